"""A given excitation does not keep a limit of the spec."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.finding import Finding, FindingKind, Severity
from inputdesign_cli.outcome import Powers, Signal

_ROUNDING = 1e-9

LIMIT_NOT_KEPT = FindingKind(
    "limit-not-kept",
    Severity.DOUBT,
    "the given excitation breaks a limit",
    "An excitation that is given is analysed as it stands. Its powers, its samples and its length are "
    "compared with `limits`. Each limit that it exceeds is named.",
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
) -> list[Finding]:
    """Return a finding for each limit that the excitation does not keep.

    Args:
        limits: the limits in the spec.
        samples: the length of the experiment.
        power: of the excitation, by channel.
        signal: the statements about its record; None without one.
    """
    single = [] if signal is None else _single_samples(limits, signal)
    return [*_powers(limits, power), *single, *_length(limits, samples)]


def _powers(limits: StatedLimits, power: Powers) -> Iterator[Finding]:
    channels = {"input": power.input, "output": power.output, "excitation": power.excitation}
    for limit in limits.powers:
        found = channels[limit.kind] or ()
        value, of = sum(found), str(limit.kind)
        if limit.channel is not None:
            value, of = found[limit.channel], f"{limit.kind} {limit.channel + 1}"
        beyond = value / limit.bound if limit.upper else limit.bound / max(value, 1e-300)
        if beyond > 1.0 + _ROUNDING:
            side = "above" if limit.upper else "below"
            yield LIMIT_NOT_KEPT.found(
                f"{limit.key} is not kept: the power of {of} is {value:.6g}, {side} {limit.bound:.6g}",
                where=limit.key,
                value=value,
                limit=limit.bound,
            )


def _single_samples(limits: StatedLimits, signal: Signal) -> Iterator[Finding]:
    stated = (
        ("limits.amplitude.input", limits.input, signal.input_peak),
        ("limits.amplitude.output", limits.output, signal.output_peak),
        ("limits.rate", limits.rate, signal.input_move),
    )
    for key, bound, found in stated:
        if bound is None or found is None:
            continue
        pairs = zip(found, np.broadcast_to(bound, len(found)).tolist(), strict=True)
        for channel, (value, most) in enumerate(pairs, start=1):
            if value > most * (1.0 + _ROUNDING):
                of = f" of channel {channel}" if len(found) > 1 else ""
                yield LIMIT_NOT_KEPT.found(
                    f"{key} is not kept: the record reaches {value:.6g}{of}, above {most:.6g}",
                    where=key,
                    value=value,
                    limit=most,
                    channel=channel,
                )


def _length(limits: StatedLimits, samples: int) -> Iterator[Finding]:
    most = limits.samples
    if most is not None and samples > most:
        yield LIMIT_NOT_KEPT.found(
            f"limits.samples is not kept: the experiment has {samples} samples, more than {most}",
            where="limits.samples",
            value=samples,
            limit=most,
        )
