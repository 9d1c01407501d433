"""Limits on single samples and on powers for several inputs, and what enforces them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.information import ChannelExperiment, PowerKind
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.signal.channel_information import RecordFilter
from inputdesign_cli.signal.constraints import SignalConstraint
from inputdesign_cli.signal.input_limits import InputLimits
from inputdesign_cli.signal.limiter import Limiter
from inputdesign_cli.signal.settings import Quantiser, SignalSettings


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


def channel_limiter(
    plant: RecordFilter, recipe: SignalSettings, bounds: ChannelBounds, quantisers: Sequence[Quantiser | None]
) -> Limiter:
    """What enforces the bounds on records of the length of the `plant`'s, with a converter an input.

    Limits on u are those of the record itself in open loop only.
    """
    open_loop = plant.experiment.loop is None
    amplitude, rate = (bounds.amplitude, bounds.rate) if open_loop else (None, None)
    rooms = tuple(
        InputLimits(
            None if amplitude is None else float(amplitude[a]),
            None if rate is None else float(rate[a]),
            quantiser,
        )
        for a, quantiser in enumerate(quantisers)
    )
    return Limiter(recipe, rooms, _watched(plant, recipe.hold, bounds))


def limited_responses(
    experiment: ChannelExperiment, bounds: ChannelBounds, frequencies: Array, step: float
) -> list[tuple[ComplexArray, float]]:
    """From sinusoids of the record to each signal that is limited, (L, r) in steady state, and its bound.

    `frequencies` (L,) are in rad per sample. In open loop u is the record itself and left out.
    """
    found: list[tuple[ComplexArray, float]] = []
    if bounds.output is not None:
        response = experiment.response("output", frequencies / step)
        found += [(response[:, i], float(bound)) for i, bound in enumerate(bounds.output)]
    if experiment.loop is not None and (bounds.amplitude is not None or bounds.rate is not None):
        u = experiment.response("input", frequencies / step)
        moves = u * (1.0 - np.exp(-1j * frequencies))[:, None, None]
        for response, limits in ((u, bounds.amplitude), (moves, bounds.rate)):
            if limits is not None:
                found += [(response[:, a], float(bound)) for a, bound in enumerate(limits)]
    return found


def _watched(plant: RecordFilter, hold: int, bounds: ChannelBounds) -> tuple[SignalConstraint, ...]:
    """What the record is no room for: outputs, in closed loop u, and what the search might spoil."""
    if bounds.output is None and plant.experiment.loop is None:
        return ()
    found = [] if bounds.output is None else [_signals(plant, "output", hold, bounds.output)]
    if bounds.amplitude is not None:
        found.append(_signals(plant, "input", hold, bounds.amplitude))
    if bounds.rate is not None:
        found.append(_moves(_signals(plant, "input", hold, bounds.rate)))
    return tuple(found)


def _signals(plant: RecordFilter, of: PowerKind, hold: int, bound: Array) -> SignalConstraint:
    def adjoint(weights: Array) -> Array:
        each = plant.adjoint(of, weights)
        return each.reshape(-1, hold, each.shape[1]).sum(axis=1)

    return SignalConstraint(lambda values: plant.signals(of, np.repeat(values, hold, axis=0)), adjoint, bound)


def _moves(signals: SignalConstraint) -> SignalConstraint:
    """From one sample of each signal to the next, the first from rest."""
    return SignalConstraint(
        lambda values: np.diff(signals.apply(values), axis=0, prepend=0.0),
        lambda weights: signals.adjoint(weights - np.append(weights[1:], 0.0 * weights[:1], axis=0)),
        signals.bound,
    )
