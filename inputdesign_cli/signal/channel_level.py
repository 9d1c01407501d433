"""The level of a record of several inputs: what the accuracy needs, within what the limits allow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.information import ChannelExperiment, PowerKind
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.channel_information import (
    channel_inputs,
    channel_outputs,
    channel_record_information,
)
from inputdesign_cli.signal.settle import least_level

_INSIDE = 1.0 - 1e-12
_MET = 1.0 + 1e-9


@dataclass(frozen=True)
class ChannelBounds:
    """What a record (n, r) may not exceed, by channel: `amplitude` and `rate` (r,), `output` (p,).

    `powers` are the largest mean squares: kind, channel (None is the sum over the channels), bound.
    """

    amplitude: Array | None = None
    rate: Array | None = None
    output: Array | None = None
    powers: tuple[tuple[PowerKind, int | None, float], ...] = ()

    @property
    def hard(self) -> bool:
        """Whether single samples are limited."""
        return any(bound is not None for bound in (self.amplitude, self.rate, self.output))

    def most(self, experiment: ChannelExperiment, record: Array, step: float) -> tuple[float, float]:
        """The largest factors on the record that the limits on its samples, and on its powers, allow."""
        y = channel_outputs(experiment, record, step)
        moves = np.abs(np.diff(record, axis=0, prepend=0.0)).max(axis=0)
        seen = [
            (self.amplitude, np.abs(record).max(axis=0)),
            (self.rate, moves),
            (self.output, np.abs(y).max(axis=0)),
        ]
        samples = min(
            (
                float(np.min(_INSIDE * bound / np.maximum(peak, 1e-300)))
                for bound, peak in seen
                if bound is not None
            ),
            default=np.inf,
        )
        u = channel_inputs(experiment, record, step)
        signals = {"input": u, "output": y, "excitation": record}
        means = {kind: np.mean(signal**2, axis=0) for kind, signal in signals.items()}
        spent = [
            (bound, means[kind].sum() if channel is None else means[kind][channel])
            for kind, channel, bound in self.powers
        ]
        powers = min((float(np.sqrt(bound / power)) for bound, power in spent if power > 0), default=np.inf)
        return samples, powers


@dataclass(frozen=True)
class Levelled:
    """A record (n, r) at its level, its score, and the factor by which limits on samples hold it down."""

    samples: Array
    score: float
    short_of: float


def levelled(
    experiment: ChannelExperiment,
    record: Array,
    step: float,
    score: Callable[[Array], float],
    bounds: ChannelBounds,
    *,
    meets: bool,
) -> Levelled:
    """The record at the least level at which its `score` is one (`meets`), or as it is, within the limits.

    Raises:
        LinAlgError: the record does not excite every parameter.
    """
    full = channel_record_information(experiment, record, step)
    known = channel_record_information(experiment, np.zeros_like(record), step)

    def at(level: float) -> float:
        return score(known + level**2 * (full - known))

    needed = least_level(at, 1.0) if meets else 1.0
    by_samples, by_powers = bounds.most(experiment, record, step)
    level = min(needed, by_samples, by_powers)
    return Levelled(level * record, at(level), max(1.0, needed / by_samples))
