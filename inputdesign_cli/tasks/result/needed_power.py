"""How far one limit would have to be raised, the others kept, for the accuracy to be met."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.design.convex.exchange import exchange
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.plant.polynomial import Array

_TOLERANCE = 1e-6
_STEPS = 30
_LONGEST_STEP, _MOST = 1e3, 1e9
_NO_SHARE = 1e-5


def needed_power(unreachable: UnreachableError, limit: PowerLimit) -> float | None:
    """The least bound of this limit with which the others allow the accuracy; None when none does.

    The multiplier of a limit tells how fast the square of the best ratio falls as the limit rises: Newton's
    method, in logarithms, between values that are proved too small and values that are known to do.
    """
    found, places = unreachable.nearest, limit.everywhere(unreachable.problem.limits)
    low, high, at = limit.bound, np.inf, limit.bound
    for _ in range(_STEPS):
        share = float(found.certificate.limits[places].sum()) * at
        if found.certificate.bound > 1.0 + _TOLERANCE:
            low = at
            if share < _NO_SHARE or low > _MOST * limit.bound:
                return None
            step = min(np.log(found.certificate.bound) / share, np.log(_LONGEST_STEP))
            at = low * float(np.exp(step))
        elif found.objective < 1.0 - _TOLERANCE:
            high = at
        else:
            return at
        if high - low <= _TOLERANCE * low:
            return low
        if at >= high:
            at = float(np.sqrt(low * high))
        problem = _raised(unreachable.problem.on(found.basis), places, at)
        found = exchange(
            problem,
            found.x,
            tolerance=0.3 * _TOLERANCE,
            interior=_padded(unreachable.within, problem.basis.size),
            enough=lambda objective, _: objective < 1.0 - 1e-3,
        )
    return low if np.isfinite(high) else None


def _raised(problem: Problem, places: list[int], bound: float) -> Problem:
    limits = list(problem.limits)
    for index in places:
        limits[index] = replace(limits[index], bound=bound)
    return replace(problem, limits=tuple(limits), finer=None)


def _padded(x: Array | None, size: int) -> Array | None:
    return None if x is None else np.pad(x, (0, size - x.size))
