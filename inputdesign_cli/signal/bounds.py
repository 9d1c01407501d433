"""Limits on single samples and on powers for a loop with one input, and what enforces them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.signal.achieved import input_and_output
from inputdesign_cli.signal.constraints import SignalConstraint
from inputdesign_cli.signal.input_limits import InputLimits
from inputdesign_cli.signal.limiter import Limiter
from inputdesign_cli.signal.settings import SignalSettings


@dataclass(frozen=True)
class Bounds:
    """What the record may not exceed; None where there is no limit.

    `amplitude` and `rate` bound |u| and its moves, `output` bounds |y|, where u and y are what the record
    causes from rest (in open loop u is the record). `powers` are the largest mean squares.
    """

    amplitude: float | None = None
    rate: float | None = None
    output: float | None = None
    powers: tuple[tuple[PowerKind, float], ...] = ()

    @property
    def hard(self) -> bool:
        """Whether single samples are limited."""
        return any(bound is not None for bound in (self.amplitude, self.rate, self.output))


def limiter_of(experiment: Experiment, recipe: SignalSettings, bounds: Bounds) -> Limiter:
    """What enforces the bounds: limits on u are those of the record itself in open loop only."""
    open_loop = experiment.loop.controller is None
    amplitude, rate = (bounds.amplitude, bounds.rate) if open_loop else (None, None)
    return Limiter(
        recipe, (InputLimits(amplitude, rate, recipe.quantiser),), _watched(experiment, recipe.hold, bounds)
    )


def limited_gains(experiment: Experiment, bounds: Bounds, frequencies: Array) -> tuple[ComplexArray, ...]:
    """(L,) each: the filters from the record to what is limited, over its bound, in steady state."""
    responses = experiment.loop.responses(frequencies)
    moves = 1.0 - np.exp(-1j * frequencies)
    found = [
        (bounds.amplitude, responses.u_x),
        (bounds.rate, moves * responses.u_x),
        (bounds.output, responses.y_x),
    ]
    return tuple(gain / bound for bound, gain in found if bound is not None)


def _watched(experiment: Experiment, hold: int, bounds: Bounds) -> tuple[SignalConstraint, ...]:
    closed = experiment.loop.controller is not None
    found = []
    if bounds.output is not None:
        found.append(_watch(lambda r: input_and_output(experiment, r)[1], bounds.output, hold))
    if bounds.amplitude is not None and (closed or found):
        found.append(_watch(lambda r: input_and_output(experiment, r)[0], bounds.amplitude, hold))
    if bounds.rate is not None and (closed or found):
        found.append(
            _watch(lambda r: np.diff(input_and_output(experiment, r)[0], prepend=0.0), bounds.rate, hold)
        )
    return tuple(found)


def _watch(apply: Callable[[Array], Array], bound: float, hold: int) -> SignalConstraint:
    """The map from the values, each held; a filter run backwards in time is its own transpose."""

    def forwards(values: Array) -> Array:
        return apply(np.repeat(values, hold))

    def backwards(weights: Array) -> Array:
        reversed_time = apply(weights[::-1])[::-1]
        return reversed_time.reshape(-1, hold).sum(axis=1)

    return SignalConstraint(forwards, backwards, bound)
