"""A given excitation does not keep a limit of the spec."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.finding import Finding, doubt
from inputdesign_cli.outcome import Powers, Signal

_ROUNDING = 1e-9

LIMIT_NOT_KEPT = doubt(
    "limit-not-kept",
    "The given excitation breaks a limit. An excitation that is given is analysed as it stands. Its powers, "
    "its samples and its length are compared with `limits`. Each limit that it exceeds is named.",
    "Scale or shorten the excitation, or widen the limit.",
)


@dataclass(frozen=True)
class StatedLimits:
    """What an experiment may not exceed: powers, single samples (a number or one a channel), its length."""

    powers: tuple[PowerLimit, ...]
    input: ArrayLike | None
    output: ArrayLike | None
    rate: ArrayLike | None
    samples: int | None


def limits_not_kept(
    limits: StatedLimits, samples: int, power: Powers, signal: Signal | None
) -> Iterator[Finding]:
    """Yield a finding for each limit that the excitation does not keep.

    Args:
        limits: the limits in the spec.
        samples: the length of the experiment.
        power: of the excitation, by channel.
        signal: the statements about its record; None without one.
    """
    channels = {"input": power.input, "output": power.output, "excitation": power.excitation}
    for limit in limits.powers:
        found, key, most = channels[limit.kind] or (), limit.key, limit.bound
        value, of = sum(found), str(limit.kind)
        if limit.channel is not None:
            value, of = found[limit.channel], f"{limit.kind} {limit.channel + 1}"
        beyond = value / most if limit.upper else most / max(value, 1e-300)
        side = "above" if limit.upper else "below"
        message = f"{key} is not kept: the power of {of} is {value:.6g}, {side} {most:.6g}"
        if beyond > 1.0 + _ROUNDING:
            yield LIMIT_NOT_KEPT.found(message, where=key, value=value, limit=most)
    for key, bound, peaks in (
        ("limits.amplitude.input", limits.input, signal and signal.input_peak),
        ("limits.amplitude.output", limits.output, signal and signal.output_peak),
        ("limits.rate", limits.rate, signal and signal.input_move),
    ):
        if bound is None or peaks is None:
            continue
        pairs = zip(peaks, np.broadcast_to(bound, len(peaks)).tolist(), strict=True)
        for channel, (value, most) in enumerate(pairs, start=1):
            of = f" of channel {channel}" if len(peaks) > 1 else ""
            message = f"{key} is not kept: the record reaches {value:.6g}{of}, above {most:.6g}"
            if value > most * (1.0 + _ROUNDING):
                yield LIMIT_NOT_KEPT.found(message, where=key, value=value, limit=most, channel=channel)
    key, longest = "limits.samples", limits.samples
    if longest is not None and samples > longest:
        message = f"{key} is not kept: the experiment has {samples} samples, more than {longest}"
        yield LIMIT_NOT_KEPT.found(message, where=key, value=samples, limit=longest)
