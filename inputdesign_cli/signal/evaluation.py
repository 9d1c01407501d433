"""Judge a record by its own information and by the cost of its powers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.information import FiniteRecord, PowerKind

# A record meets the accuracy when its ratio exceeds one by no more than rounding.
MET = 1.0 + 1e-9
# Levels are found to this relative accuracy where the record is a multiple of its values, and to
# the coarser one where limits and rounding make it depend on the level in another way.
_EXACT = 1e-10
_COARSE = 1e-3
_WIDER = 1.5
_GROWTH = 1.2
_MOST_GROWTH = 40.0
# A level that leaves more than this share of the figure gains too little; this many in a row end a search.
_WORTH = 0.998
_PATIENCE = 4
_LOWEST, _HIGHEST = 1e-9, 1e30  # levels relative to the start


def least_level(ratio: Callable[[float], float], start: float) -> float:
    """Return the level at which a `ratio` that falls continuously with the level is one, from above.

    Information is affine in the square of the level. For every bound on a variance 1 / ratio^2 is a concave
    function of that square, and near a line; its root is computed.

    Raises:
        LinAlgError: the ratio is defined at no level, or exceeds one at all levels: some parameter is not
            excited.
    """
    ratio = cache(ratio)
    level = start
    for _ in range(2):  # exact at once if all information comes from the record
        reached = ratio(level)
        if abs(reached - 1.0) <= 1e-12:
            return level
        level *= min(reached, _HIGHEST)
    low = high = level
    while ratio(high) > 1.0:
        low, high = high, high * _WIDER
        if high > _HIGHEST * start:
            raise np.linalg.LinAlgError
    while ratio(low) <= 1.0:
        if low <= _LOWEST * start:  # the information without the record is enough
            return low
        low, high = low / _WIDER, low

    def surplus(square: float) -> float:
        return ratio(float(np.sqrt(square))) ** -2.0 - 1.0

    square = scipy.optimize.brentq(surplus, low**2, high**2, xtol=_EXACT * low**2, rtol=1e-14)
    high = float(np.sqrt(square))
    while ratio(high) > 1.0:
        high *= 1.0 + _EXACT
    return high


def first_level(figure: Callable[[float], float], start: float) -> tuple[float, bool]:
    """Return the least of rising levels at which a `figure` is at most one, to a thousandth, and True.

    Where limits are active, a higher level helps at first, and finally changes nothing. When several levels
    in a row gain too little, return the level of the least figure, and False.
    """
    low, high = start / _GROWTH, start
    best, least, idle = start, np.inf, 0
    while (reached := figure(high)) > 1.0:
        idle = 0 if reached < _WORTH * least or np.isinf(least) else idle + 1
        if reached < least:
            best, least = high, reached
        low, high = high, high * _GROWTH
        if idle == _PATIENCE or high > _MOST_GROWTH * start:
            return best, False
    while high > low * (1.0 + _COARSE):
        middle = np.sqrt(low * high)
        if figure(middle) <= 1.0:
            high = middle
        else:
            low = middle
    return high, True


def last_level(accepted: Callable[[float], bool], start: float) -> float:
    """Return the greatest accepted level below `start`, to a thousandth; lower ones are accepted too."""
    low, high = start / _GROWTH, start
    while not accepted(low) and low > start / _MOST_GROWTH:
        low, high = low / _GROWTH, low
    while high > low * (1.0 + _COARSE):
        middle = np.sqrt(low * high)
        if accepted(middle):
            low = middle
        else:
            high = middle
    return low


def level_of_power(power: Callable[[float], float], wanted: float, start: float) -> float:
    """Return the level at which the record has the `wanted` power, or the highest that still adds to it."""

    def figure(level: float) -> float:
        reached = power(level)
        return wanted * (1.0 - 1e-9) / reached if reached > 0.0 else np.inf

    return first_level(figure, start)[0]


@dataclass(frozen=True)
class Target:
    """Holds the requirement on a record.

    Args:
        worst_ratio: maps an information matrix to the largest r_u / r_adm (or another figure, to be small).
        meets: whether the level of the record is the lowest at which this ratio is at most one; otherwise
            the record has the power of the design.
        cost: weights of the powers (of all channels together, or one weight a channel), to rank records
            that meet the target.
        designed: the cost of the design in the same weights; its power when not given.
        least_ratios: maps the informations of several records, (runs, k, k) or (plants, runs, k, k), to
            lower bounds (runs,) of their worst ratios, in a shorter time; NaN where none is known.
    """

    worst_ratio: Callable[[Array], float]
    meets: bool = False
    cost: Mapping[PowerKind, float | tuple[float, ...]] = field(default_factory=lambda: {"excitation": 1.0})
    designed: float | None = None
    least_ratios: Callable[[Array], Array] | None = None


@dataclass(frozen=True)
class Evaluator:
    """The plant on which records are tried, with the `limits` on their powers (see `Bounds.powers`)."""

    plant: FiniteRecord
    target: Target
    limits: tuple[tuple[PowerKind, int | None, float], ...] = ()
    _latest: list[tuple[Array, float]] = field(default_factory=list, compare=False, repr=False)

    def ratio(self, samples: Array) -> float:
        """Return the worst ratio; infinite when the record does not excite every parameter."""
        # A record is evaluated twice: when its level is found, and when it is ranked.
        if not self._latest or self._latest[0][0] is not samples:
            self._latest[:] = [(samples, self._ratio(samples))]
        return self._latest[0][1]

    def _ratio(self, samples: Array) -> float:
        try:
            return self.target.worst_ratio(self.plant.information(samples))
        except np.linalg.LinAlgError:
            return np.inf

    def figure(self, samples: Array) -> float:
        """Return at most one for a record that meets the target; infinite beyond the limits on the powers."""
        return self.ratio(samples) / MET if self.share(samples) >= 1.0 / MET else np.inf

    def share(self, samples: Array) -> float:
        """Return the largest factor on the record's powers within the limits, at every plant."""
        powers, share = dict[PowerKind, NDArray[np.float64]](), np.inf
        for kind, channel, most in self.limits:
            if kind not in powers:
                powers[kind] = self.plant.mean_squares_of_each(kind, samples)
            spent = float(max(powers[kind].sum(axis=1) if channel is None else powers[kind][:, channel]))
            share = min(share, most / spent) if spent > 0.0 else share
        return share

    def cost(self, samples: Array) -> float:
        """Return the weighted sum of the powers."""
        return float(self._costs(samples))

    def _costs(self, samples: Array) -> Array:
        """Return the weighted sums (..,) of the powers of records (.., n, r)."""
        costs = np.zeros(samples.shape[:-2])
        for kind, weight in self.target.cost.items():
            costs = costs + np.sum(np.asarray(weight) * self.plant.mean_squares(kind, samples), axis=-1)
        return costs

    def least_ratios(self, samples: Array, cost: float) -> Array:
        """Return lower bounds (runs,) on the ratios of multiples of records (runs, n, r) at this cost.

        They are NaN where none is known.
        """
        least, own = self.target.least_ratios, self._costs(samples)
        if least is None or cost <= 0.0:
            return np.full(len(samples), np.nan)
        squares = np.divide(cost, own, out=np.zeros_like(own), where=own > 0.0)
        return least(self.plant.information(np.sqrt(squares)[:, None, None] * samples))

    def needed_level(self, samples: Array) -> float | None:
        """Return the level that the accuracy needs, were there no limits; None when no level is enough."""
        known = self.plant.known
        gained = self.plant.information(samples) - known
        try:
            if not known.any():  # ratios are of standard deviations: they fall as the level grows
                return self.target.worst_ratio(gained) or None
            return least_level(lambda level: self.target.worst_ratio(known + level**2 * gained), 1.0)
        except np.linalg.LinAlgError:  # too short to excite every parameter
            return None
