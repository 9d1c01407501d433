"""How far limits would have to be raised, the others kept, for the accuracy to be met."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.exchange import exchange
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.problem import Problem

_TOLERANCE = 1e-6
_STEPS = 30
_LONGEST_STEP, _MOST = 1e3, 1e9
_NO_SHARE = 1e-5


def needed_factor(unreachable: UnreachableError, limits: Sequence[PowerLimit]) -> float | None:
    """How many times as large these limits together allow the accuracy, at least; None where they never do.

    The multipliers of the limits tell how fast the square of the best ratio falls as they rise: Newton's
    method, in logarithms, between values that are proved too small and values that are known to do. What
    noise or a prior tell does not grow with the powers: the square of the ratio is not the factor.
    """
    stated = unreachable.problem.limits
    bounds = {place: limit.bound for limit in limits for place in limit.everywhere(stated)}
    places, found = list(bounds), unreachable.nearest
    low, high, at = 1.0, np.inf, 1.0
    for _ in range(_STEPS):
        share = float(found.certificate.limits[places] @ np.array(list(bounds.values()))) * at
        if found.certificate.bound > 1.0 + _TOLERANCE:
            low = at
            if share < _NO_SHARE or low > _MOST:
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
        problem = _raised(unreachable.problem.on(found.basis), bounds, at)
        found = exchange(
            problem,
            found.x,
            tolerance=0.3 * _TOLERANCE,
            interior=_padded(unreachable.within, problem.basis.size),
            enough=lambda objective, _: objective < 1.0 - 1e-3,
        )
    return low if np.isfinite(high) else None


def _raised(problem: Problem, bounds: Mapping[int, float], factor: float) -> Problem:
    limits = list(problem.limits)
    for index, bound in bounds.items():
        limits[index] = replace(limits[index], bound=factor * bound)
    return replace(problem, limits=tuple(limits), finer=None)


def _padded(x: Array | None, size: int) -> Array | None:
    return None if x is None else np.pad(x, (0, size - x.size))
