"""Limits beside an excitation that is given: the answer says which of them it breaks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from inputdesign_cli.information import PowerKind
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.channels import has_channels
from inputdesign_cli.tasks.build.limits import build_power_limits

_ROUNDING = 1e-9


def check_given_limits(spec: Spec) -> None:
    """Whether every limit can be compared with the excitation.

    Raises:
        SpecError: `not-supported`.
    """
    refused = ("spectrum", "energy") if has_channels(spec) else ("spectrum", "energy", "band")
    for name in refused:
        if getattr(spec.limits, name) is not None:
            raise spec.complain(
                "not-supported",
                f"this version does not compare a given excitation with limits.{name}",
                hint="remove it",
                key=f"limits.{name}",
            )


def broken_limits(
    spec: Spec, samples: int, power: Mapping[PowerKind, list[float]], signal: Mapping[str, Any]
) -> list[str]:
    """A note for each limit that the excitation does not keep.

    Args:
        power: of the excitation, by channel.
        signal: what `result.json` says of its record; empty without one.
    """
    return [*_powers(spec, power), *_single_samples(spec, signal), *_length(spec, samples)]


def _powers(spec: Spec, power: Mapping[PowerKind, list[float]]) -> Iterator[str]:
    for limit in build_power_limits(spec):
        value, of = sum(power[limit.kind]), str(limit.kind)
        if limit.channel is not None:
            value, of = power[limit.kind][limit.channel], f"{limit.kind} {limit.channel + 1}"
        beyond = value / limit.bound if limit.upper else limit.bound / max(value, 1e-300)
        if beyond > 1.0 + _ROUNDING:
            side = "above" if limit.upper else "below"
            yield f"{limit.key} is not kept: the power of {of} is {value:.6g}, {side} {limit.bound:.6g}"


def _single_samples(spec: Spec, signal: Mapping[str, Any]) -> Iterator[str]:
    amplitude = spec.limits.amplitude
    stated = (
        ("limits.amplitude.input", None if amplitude is None else amplitude.input, "input_peak"),
        ("limits.amplitude.output", None if amplitude is None else amplitude.output, "output_peak"),
        ("limits.rate", spec.limits.rate, "input_move"),
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


def _length(spec: Spec, samples: int) -> Iterator[str]:
    most = spec.limits.samples
    if most is not None and samples > most:
        yield f"limits.samples is not kept: the experiment has {samples} samples, more than {most}"
