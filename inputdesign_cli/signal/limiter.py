"""A shape at a level, made fit to be applied: limited, converted, held."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.constraints import SignalConstraint, peak_ratio, restrained
from inputdesign_cli.signal.input_limits import InputLimits
from inputdesign_cli.signal.settings import LEVELLED, SignalSettings

_INSIDE = 1.0 - 1e-12
_TRIES = 8


@dataclass(frozen=True)
class Limiter:
    """Turns values (m,) or (m, r) at some level into the record that is applied.

    Args:
        rooms: of the inputs, one each.
        watched: what the values cause and must be kept small by more than clipping them.
    """

    recipe: SignalSettings
    rooms: tuple[InputLimits, ...]
    watched: tuple[SignalConstraint, ...] = ()

    @property
    def plain(self) -> bool:
        """Whether the record is just a multiple of its values."""
        return not self.watched and all(room.unlimited for room in self.rooms)

    def dress(self, values: Array, level: float) -> Array:
        """(n,) or (n, r): `level` times the `values` as far as the limits allow, which hold exactly."""
        if self.plain:
            return self._held(level * values)
        if self.recipe.method in LEVELLED:
            return self._held(self._levelled(level * values))
        goal = level * values
        shrink, record = 1.0, goal
        for _ in range(_TRIES):
            limited = self._each(goal, InputLimits.limited)
            if self.watched:
                limited = restrained(limited, self._tighter(shrink))
            record = self._each(limited, InputLimits.converted)
            # Rounding may lift what the record causes over its bound by a little.
            excess = peak_ratio(record, self.watched)
            if excess <= 1.0:
                break
            shrink /= excess * 1.001
        return self._held(record)

    def _held(self, values: Array) -> Array:
        return np.repeat(values, self.recipe.hold, axis=0)

    def _each(self, values: Array, fit: Callable[[InputLimits, Array], Array]) -> Array:
        """One input after the other."""
        if values.ndim == 1:
            return fit(self.rooms[0], values)
        columns = zip(self.rooms, values.T, strict=True)
        return np.stack([fit(room, column) for room, column in columns], axis=1)

    def _tighter(self, shrink: float) -> tuple[SignalConstraint, ...]:
        return tuple(SignalConstraint(w.apply, w.adjoint, shrink * w.bound) for w in self.watched)

    def _levelled(self, goal: Array) -> Array:
        """Few levels stay so: the limits bound their height, that of all inputs by one factor."""
        factor = min(
            room.factor(column) for room, column in zip(self.rooms, np.atleast_2d(goal.T), strict=True)
        )
        if self.watched:
            factor = min(factor, _INSIDE / peak_ratio(goal, self.watched))
        rounded = factor >= 1.0

        def fit(room: InputLimits, column: Array) -> Array:
            size = float(np.abs(column).max())
            if size == 0.0:
                return column
            return column * (room.height(min(factor, 1.0) * size, rounded=rounded) / size)

        return self._each(goal, fit)
