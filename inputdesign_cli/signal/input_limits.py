"""What limits the values of one input: their amplitude, their moves, the values of a converter."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.constraints import largest_move, ramped, slow_moves
from inputdesign_cli.signal.settings import Quantiser

_INSIDE = 1.0 - 1e-12
_ROUNDING = 1.0 + 1e-12


@dataclass(frozen=True)
class InputLimits:
    """Bounds on the values of one input and on their moves, None if there is none, and its converter."""

    amplitude: float | None = None
    rate: float | None = None
    quantiser: Quantiser | None = None

    @property
    def unlimited(self) -> bool:
        """Whether any values do."""
        return self.amplitude is None and self.rate is None and self.quantiser is None

    @property
    def reach(self) -> float | None:
        """The largest modulus, by the bound and by the range of the converter."""
        converter = None if self.quantiser is None else self.quantiser.reach()
        known = [reach for reach in (self.amplitude, converter) if reach is not None]
        return min(known, default=None)

    def limited(self, values: Array) -> Array:
        """(m,): the values clipped, then brought to slow moves."""
        if self.reach is not None:
            values = np.clip(values, -self._most, self._most)
        return values if self.rate is None else slow_moves(values, self._fastest)

    def slewed(self, values: Array) -> Array:
        """(m,): the values clipped, then followed as fast as the moves allow."""
        if self.reach is not None:
            values = np.clip(values, -self._most, self._most)
        return values if self.rate is None else ramped(values, self._fastest)

    def converted(self, values: Array) -> Array:
        """(m,): the nearest values of the converter."""
        return values if self.quantiser is None else self.quantiser.step * self.quantiser.steps(values)

    def factor(self, values: Array) -> float:
        """The largest factor on the values (m,) that the bounds leave; infinite without any."""
        size, factors = float(np.abs(values).max()), [np.inf]
        if size > 0.0 and self.reach is not None:
            factors.append(self._most / size)
        if size > 0.0 and self.rate is not None:
            factors.append(self._fastest / largest_move(values))
        return min(factors)

    def height(self, wanted: float, *, rounded: bool) -> float:
        """The peak of a signal of few levels: that of whole steps, `rounded` to nearest or else down."""
        if self.quantiser is None:
            return wanted
        steps = np.floor(wanted / self.quantiser.step + (0.5 if rounded else 1e-12))
        return float(
            self.quantiser.step * min(steps, np.floor(self.quantiser.reach() / self.quantiser.step + 0.5))
        )

    @cached_property
    def _most(self) -> float:
        """The reach, of whole steps of the converter."""
        assert self.reach is not None
        return self._whole(self.reach, self.reach)

    @cached_property
    def _fastest(self) -> float:
        assert self.rate is not None
        return self._whole(self.rate, self.rate * _INSIDE)

    def _whole(self, bound: float, plain: float) -> float:
        if self.quantiser is None:
            return plain
        step = self.quantiser.step
        return float(step * np.floor(bound / step * _ROUNDING))
