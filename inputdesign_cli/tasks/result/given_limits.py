"""Limits beside an excitation that is given: the answer says which of them it breaks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.information import PowerKind
from inputdesign_cli.runs.results import Json

_ROUNDING = 1e-9


@dataclass(frozen=True)
class StatedLimits:
    """What the experiment may not exceed: powers, single samples (a number or one a channel), its length."""

    powers: tuple[PowerLimit, ...]
    input: ArrayLike | None
    output: ArrayLike | None
    rate: ArrayLike | None
    samples: int | None


def broken_limits(
    limits: StatedLimits, samples: int, power: Mapping[PowerKind, list[float]], signal: Mapping[str, Json]
) -> list[str]:
    """A note for each limit that the excitation does not keep.

    Args:
        samples: the length of the experiment.
        power: of the excitation, by channel.
        signal: what `result.json` says of its record; empty without one.
    """
    return [*_powers(limits, power), *_single_samples(limits, signal), *_length(limits, samples)]


def _powers(limits: StatedLimits, power: Mapping[PowerKind, list[float]]) -> Iterator[str]:
    for limit in limits.powers:
        value, of = sum(power[limit.kind]), str(limit.kind)
        if limit.channel is not None:
            value, of = power[limit.kind][limit.channel], f"{limit.kind} {limit.channel + 1}"
        beyond = value / limit.bound if limit.upper else limit.bound / max(value, 1e-300)
        if beyond > 1.0 + _ROUNDING:
            side = "above" if limit.upper else "below"
            yield f"{limit.key} is not kept: the power of {of} is {value:.6g}, {side} {limit.bound:.6g}"


def _single_samples(limits: StatedLimits, signal: Mapping[str, Json]) -> Iterator[str]:
    stated = (
        ("limits.amplitude.input", limits.input, "input_peak"),
        ("limits.amplitude.output", limits.output, "output_peak"),
        ("limits.rate", limits.rate, "input_move"),
    )
    for key, bound, name in stated:
        if bound is None or name not in signal:
            continue
        reached = np.atleast_1d(signal[name])
        pairs = zip(reached, np.broadcast_to(bound, reached.shape), strict=True)
        for channel, (value, most) in enumerate(pairs):
            if value > most * (1.0 + _ROUNDING):
                where = f" of channel {channel + 1}" if reached.size > 1 else ""
                yield f"{key} is not kept: the record reaches {value:.6g}{where}, above {most:.6g}"


def _length(limits: StatedLimits, samples: int) -> Iterator[str]:
    if limits.samples is not None and samples > limits.samples:
        most = limits.samples
        yield f"limits.samples is not kept: the experiment has {samples} samples, more than {most}"
