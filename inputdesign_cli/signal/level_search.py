"""The lowest level at which a record does what is asked."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import scipy

# Levels are found to this relative accuracy where the record is a multiple of its values, and to
# the coarser one where limits and rounding make it depend on the level in another way.
_EXACT = 1e-10
_COARSE = 1e-3
_WIDER = 1.5
_GROWTH = 1.2
_MOST_GROWTH = 40.0
# A level that keeps more than this share of the figure gains too little; the second number may do so.
_WORTH = 0.998
_PATIENCE = 4
_NOTHING, _PLENTY = 1e-9, 1e30


def least_level(ratio: Callable[[float], float], start: float) -> float:
    """The level at which a `ratio` that falls continuously with the level is one, from above.

    Information is affine in the square of the level, so 1 / ratio^2 is a concave function of that square
    for every bound on a variance, and near a line: its root is looked for.

    Raises:
        LinAlgError: the ratio is not defined at any level, or at most one at none: some parameter is not
            excited.
    """
    ratio = cache(ratio)
    level = start
    for _ in range(2):  # exact at once when all that is known comes from the record
        reached = ratio(level)
        if abs(reached - 1.0) <= 1e-12:
            return level
        level *= min(reached, _PLENTY)
    low = high = level
    while ratio(high) > 1.0:
        low, high = high, high * _WIDER
        if high > _PLENTY * start:
            raise np.linalg.LinAlgError
    while ratio(low) <= 1.0:
        if low <= _NOTHING * start:  # what is known without the record is enough
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
    """The least of rising levels at which a `figure` is at most one, to a thousandth, and True.

    Where limits bite, raising the level first helps, and at last changes nothing any more: when several
    levels in a row gain nothing worth having, the level of the least figure, and False.
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
    """The greatest level below `start` that is accepted, to a thousandth, where lower ones are as well."""
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
    """The level at which the record has the `wanted` power, or the highest that still adds to it."""

    def figure(level: float) -> float:
        reached = power(level)
        return wanted * (1.0 - 1e-9) / reached if reached > 0.0 else np.inf

    return first_level(figure, start)[0]
