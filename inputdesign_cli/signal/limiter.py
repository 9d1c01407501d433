"""Values at a level, made fit to be applied: limited, converted, held."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.constraints import SignalConstraint, peak_ratio, restrained
from inputdesign_cli.signal.input_limits import InputLimits
from inputdesign_cli.signal.settings import LEVELLED, SignalSettings

_INSIDE = 1.0 - 1e-12
_TRIES = 8
_SILENT = 1e-300  # what signals that are zero use of their bounds, so that any factor will do


@dataclass(frozen=True)
class Limiter:
    """Turns values (m, r) at some level into the record that is applied.

    Args:
        inputs: the limits of each input.
        constraints: what the values cause and must be kept small by more than clipping them.
    """

    settings: SignalSettings
    inputs: tuple[InputLimits, ...]
    constraints: tuple[SignalConstraint, ...] = ()

    @property
    def plain(self) -> bool:
        """Whether the record is just a multiple of its values."""
        return not self.constraints and all(limits.unlimited for limits in self.inputs)

    def record(self, values: Array, level: float) -> Array:
        """(n, r): `level` times the `values` as far as the limits allow, which hold exactly."""
        goal = level * values
        if self.plain:
            return self._held(goal)
        if self.settings.method in LEVELLED:
            return self._held(self._levelled(goal))
        fit = InputLimits.slewed if self.settings.method == "slewed" else InputLimits.limited
        shrink, record = 1.0, goal
        for _ in range(_TRIES):
            limited = self._each(goal, fit)
            if self.constraints:
                limited = restrained(limited, tuple(c.tightened(shrink) for c in self.constraints))
            record = self._each(limited, InputLimits.converted)
            # Rounding may lift what the record causes over its bound by a little.
            excess = peak_ratio(record, self.constraints)
            if excess <= 1.0:
                break
            shrink /= excess * 1.001
        return self._held(record)

    def _held(self, values: Array) -> Array:
        return np.repeat(values, self.settings.hold, axis=0)

    def _each(self, values: Array, fit: Callable[[InputLimits, Array], Array]) -> Array:
        """One input after the other."""
        columns = zip(self.inputs, values.T, strict=True)
        return np.stack([fit(limits, column) for limits, column in columns], axis=1)

    def _levelled(self, goal: Array) -> Array:
        """Few levels stay so: the limits bound their height, that of all inputs by one factor."""
        factor = min(limits.factor(column) for limits, column in zip(self.inputs, goal.T, strict=True))
        if self.constraints:
            factor = min(factor, _INSIDE / max(peak_ratio(goal, self.constraints), _SILENT))
        rounded = factor >= 1.0

        def fit(limits: InputLimits, column: Array) -> Array:
            size = float(np.abs(column).max())
            if size == 0.0:
                return column
            return column * (limits.height(min(factor, 1.0) * size, rounded=rounded) / size)

        return self._each(goal, fit)
