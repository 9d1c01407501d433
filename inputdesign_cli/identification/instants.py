"""Find minima on the other side of sampling instants, which dead times pass.

There the likelihood has a kink. It may have a minimum between any two instants, as likely as the best and
within a few standard deviations of it. No single minimum shows how far the parameters are known.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.gauss_newton import Minimum, best_run, minimise
from inputdesign_cli.identification.record_problem import Point, RecordProblem, evaluate
from inputdesign_cli.identification.records import Records
from inputdesign_cli.identification.rivals import NEARLY, distance, excess_of, is_near

# Instants that are farther, in standard deviations, part the estimate from nothing that is likely.
_REACH = 3.0
# Begun within a deviation, a search settles in a few steps, or is stopped by the kink that it has passed.
_STEPS, _ROUNDS = 15, 4
# Squared standard deviations between minima that are not one.
_SAME = 0.1
_RIDGE = 1e-9


def beyond_instants(records: Records, found: Minimum) -> Minimum:
    """Return `found` with minima beyond the sampling instants next to dead times, until none is better."""
    for _ in range(_ROUNDS):
        best = best_run(found)
        point = evaluate(records, found.theta[best])
        if not (np.isfinite(point.cost) and point.cost > 0.0):
            break
        points = _beyond(records, point)
        if not len(points):
            break
        others = minimise(RecordProblem((records,) * len(points)), points, most=_STEPS)
        better = ~others.converged & (others.cost < point.cost)
        if np.any(better):
            begun = others.theta[better]
            others = _both(others, minimise(RecordProblem((records,) * len(begun)), begun))
        found = _both(found, _of(others, others.converged))
        if best_run(found) == best:
            break
    return found


def _of(one: Minimum, runs: NDArray[np.bool_]) -> Minimum:
    """Return some of the runs."""
    return Minimum(one.theta[runs], one.cost[runs], one.hessian[runs], one.converged[runs], one.steps[runs])


def _both(one: Minimum, other: Minimum) -> Minimum:
    """Return the runs of `one`, then the runs of `other`."""
    return Minimum(
        np.concatenate([one.theta, other.theta]),
        np.concatenate([one.cost, other.cost]),
        np.concatenate([one.hessian, other.hessian]),
        np.concatenate([one.converged, other.converged]),
        np.concatenate([one.steps, other.steps]),
    )


def minima_beside(records: Records, point: Point, found: Minimum) -> tuple[tuple[Point, float], ...]:
    """Return minima near the best `point` and about as likely, each with its excess in -2 log likelihood.

    Only models with dead times have them: kinks separate them from the best one. A minimum far from it is a
    rival.
    """
    if not records.dead_times.size or point.cost <= 0.0:
        return ()
    kept: list[tuple[Point, float]] = []
    for run in np.argsort(found.cost):
        cost, theta = float(found.cost[run]), found.theta[run]
        if not np.isfinite(cost) or excess_of(records, point, cost) > NEARLY:
            break
        excess = excess_of(records, point, cost)
        known = (point, *(other for other, _ in kept))
        apart = min(distance(records, point, theta - other.theta) for other in known)
        if found.converged[run] and apart > _SAME and is_near(records, point, theta, excess):
            kept.append((evaluate(records, theta), max(excess, 0.0)))
    return tuple(kept)


def _beyond(records: Records, point: Point) -> Array:
    """(n, k): where to begin beyond instants within reach, the other parameters following the dead time."""
    unit = 1.0 if records.weights is not None else point.near.freedom / point.cost
    scale = np.sqrt(np.maximum(np.diag(point.hessian), 1e-300))
    covariance = np.linalg.pinv(point.hessian / np.outer(scale, scale), rcond=_RIDGE, hermitian=True)
    covariance /= unit * np.outer(scale, scale)
    found = []
    for to_instant, to_midst in records.crossings(point.theta):
        index = int(np.argmax(np.abs(to_midst)))
        deviation = float(np.sqrt(max(covariance[index, index], 0.0)))
        if deviation > 0.0 and abs(to_instant[index]) < _REACH * deviation:
            beyond = np.clip((to_midst - to_instant)[index], -deviation, deviation)
            step = covariance[index] / covariance[index, index] * (to_instant[index] + beyond)
            found.append(records.stabilised(point.theta + step))
    return np.array(found).reshape(-1, point.theta.size)
