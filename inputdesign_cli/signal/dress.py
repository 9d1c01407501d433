"""A shape at a level, made fit to be applied: limited, converted, held."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.signal.achieved import input_and_output
from inputdesign_cli.signal.recipe import LEVELLED, Recipe
from inputdesign_cli.signal.within import Watched, largest_move, peak_ratio, restrained, slow_moves

_INSIDE = 1.0 - 1e-12
_TRIES = 8


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


@dataclass(frozen=True)
class Dresser:
    """Turns values at some level into the record (n,) that is applied."""

    experiment: Experiment
    recipe: Recipe
    bounds: Bounds

    @property
    def plain(self) -> bool:
        """Whether the record is just a multiple of its values."""
        return not self.bounds.hard and self.recipe.quantiser is None

    @property
    def amplitude(self) -> float | None:
        """The bound on the record itself: the limit on u in open loop, and the range of the converter."""
        stated = self.bounds.amplitude if self.experiment.loop.controller is None else None
        rooms = [stated, None if self.recipe.quantiser is None else self.recipe.quantiser.room()]
        known = [room for room in rooms if room is not None]
        return min(known) if known else None

    @property
    def rate(self) -> float | None:
        """The bound on the moves of the record itself."""
        return self.bounds.rate if self.experiment.loop.controller is None else None

    def dress(self, values: Array, level: float) -> Array:
        """(n,): `level` times the `values` (n // hold,) as far as the limits allow, which hold exactly."""
        if self.plain:
            return np.repeat(level * values, self.recipe.hold)
        if self.recipe.method in LEVELLED:
            return self._levelled(values, level)
        goal = level * values
        shrink = 1.0
        for _ in range(_TRIES):
            limited = self._limited(goal)
            if self.watched:
                limited = restrained(limited, self._tighter(shrink))
            record = self._converted(limited)
            # Rounding may lift what the record causes over its bound by a little.
            excess = peak_ratio(record, self.watched)
            if excess <= 1.0:
                break
            shrink /= excess * 1.001
        return np.repeat(record, self.recipe.hold)

    def gains(self, frequencies: Array) -> tuple[ComplexArray, ...]:
        """(L,) each: the filters from the record to what is limited, over its bound, in steady state."""
        responses = self.experiment.loop.responses(frequencies)
        moves = 1.0 - np.exp(-1j * frequencies)
        found = [
            (self.bounds.amplitude, responses.u_x),
            (self.bounds.rate, moves * responses.u_x),
            (self.bounds.output, responses.y_x),
        ]
        return tuple(gain / bound for bound, gain in found if bound is not None)

    @cached_property
    def watched(self) -> tuple[Watched, ...]:
        """What the values cause and must be kept small by more than clipping them."""
        bounds, loop = self.bounds, self.experiment.loop
        closed = loop.controller is not None
        found = []
        if bounds.output is not None:
            found.append(self._watch(lambda r: input_and_output(self.experiment, r)[1], bounds.output))
        if bounds.amplitude is not None and (closed or found):
            found.append(self._watch(lambda r: input_and_output(self.experiment, r)[0], bounds.amplitude))
        if bounds.rate is not None and (closed or found):
            found.append(
                self._watch(
                    lambda r: np.diff(input_and_output(self.experiment, r)[0], prepend=0.0), bounds.rate
                )
            )
        return tuple(found)

    def _watch(self, apply: Callable[[Array], Array], bound: float) -> Watched:
        """The map from the values, each held; a filter run backwards in time is its own transpose."""
        hold = self.recipe.hold

        def forwards(values: Array) -> Array:
            return apply(np.repeat(values, hold))

        def backwards(weights: Array) -> Array:
            reversed_time = apply(weights[::-1])[::-1]
            return reversed_time.reshape(-1, hold).sum(axis=1)

        return Watched(forwards, backwards, bound)

    def _tighter(self, shrink: float) -> tuple[Watched, ...]:
        return tuple(Watched(w.apply, w.adjoint, shrink * w.bound) for w in self.watched)

    def _limited(self, values: Array) -> Array:
        if self.amplitude is not None:
            values = np.clip(values, -self._most, self._most)
        if self.rate is not None:
            values = slow_moves(values, self._fastest)
        return values

    @cached_property
    def _most(self) -> float:
        """The amplitude, of whole steps of the converter."""
        assert self.amplitude is not None
        step = self._step
        return self.amplitude if step is None else step * np.floor(self.amplitude / step * (1 + 1e-12))

    @cached_property
    def _fastest(self) -> float:
        assert self.rate is not None
        step = self._step
        return self.rate * _INSIDE if step is None else step * np.floor(self.rate / step * (1 + 1e-12))

    @property
    def _step(self) -> float | None:
        return None if self.recipe.quantiser is None else self.recipe.quantiser.step

    def _converted(self, values: Array) -> Array:
        quantiser = self.recipe.quantiser
        return values if quantiser is None else quantiser.step * quantiser.codes(values)

    def _levelled(self, values: Array, level: float) -> Array:
        """Few levels stay so: the limits bound the level."""
        size = float(np.abs(values).max())
        most = [level * size]
        if self.amplitude is not None:
            most.append(self._most)
        if self.rate is not None:
            most.append(self._fastest * size / largest_move(values))
        if self.watched:
            most.append(_INSIDE * size / peak_ratio(values, self.watched))
        height = min(most)
        quantiser = self.recipe.quantiser
        if quantiser is not None:
            steps = np.floor(height / quantiser.step + (0.5 if height == most[0] else 1e-12))
            height = quantiser.step * min(steps, np.floor(quantiser.room() / quantiser.step + 0.5))
        return np.repeat(values * (height / size), self.recipe.hold)
