"""Minima that explain the data nearly as well as the best one.

A dead time that was excited at a few frequencies is known only up to whole periods. Near-equal minima then
stand far apart, and the covariance describes one of them alone. Where a dead time passes a sampling instant,
the likelihood has a kink. It may have a minimum between any two instants, as likely as the best and within a
few standard deviations of it. No single minimum shows how far the parameters are known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.gauss_newton import Minimum, best_run, minimise
from inputdesign_cli.identification.problem import Point, RecordProblem, evaluate
from inputdesign_cli.identification.records import Records

NEARLY = 2.0 * float(np.log(1000.0))
"""What another minimum may have more in -2 log likelihood: a thousandth of the likelihood of the best."""
# Another minimum: so far apart in squared standard deviations, and by what the slope of one does not explain.
_APART, _UNEXPLAINED = 25.0, 4.0
# Instants that are farther, in standard deviations, part the estimate from nothing that is likely.
_REACH = 3.0
# Begun within a deviation, a search settles in a few steps, or is stopped by the kink that it has passed.
_STEPS, _ROUNDS = 15, 4
# Squared standard deviations between minima that are not one.
_SAME = 0.1
_RIDGE = 1e-9


@dataclass(frozen=True)
class Rival:
    """Parameters theta (k,) at another minimum, `excess` more in -2 log likelihood than the estimate."""

    theta: Array
    excess: float


def rivals(point: Point, found: Minimum) -> tuple[Rival, ...]:
    """Where other starts ended, the likeliest first: far from the best `point`, and nearly as likely."""
    if point.cost <= 0.0:
        return ()
    estimate, best = Rival(point.theta, 0.0), list[Rival]()
    for run in np.argsort(found.cost):
        cost = float(found.cost[run])
        if not np.isfinite(cost):
            break
        excess = excess_of(point, cost)
        if excess > NEARLY:
            break
        theta = np.asarray(found.theta[run], dtype=float)
        if not any(
            is_near(point, point.theta + theta - other.theta, excess - other.excess)
            for other in (estimate, *best)
        ):
            best.append(Rival(theta, max(excess, 0.0)))
    return tuple(best)


def spread_out(points: Sequence[Point], most: int) -> list[int]:
    """Return the numbers of the likeliest points, of near ones only the best."""
    chosen: list[int] = []
    for number in np.argsort([point.cost for point in points], kind="stable"):
        point = points[number]
        if len(chosen) == most or not np.isfinite(point.cost):
            break
        near = (distance(points[other], point.theta - points[other].theta) for other in chosen)
        if point.cost <= 0.0 or all(square > _APART for square in near):
            chosen.append(int(number))
    return chosen


def distance(point: Point, step: Array) -> float:
    """Return the square of a `step` (k,) in standard deviations of the parameters at a point."""
    return point.near.freedom / point.cost * float(step @ point.hessian @ step)


def is_near(point: Point, theta: Array, excess: float) -> bool:
    """Whether parameters (k,) are of the same minimum, or within five deviations of the one at a point."""
    return distance(point, theta - point.theta) <= max(_APART, _UNEXPLAINED * excess)


def excess_of(point: Point, cost: float) -> float:
    """Return by how much -2 log likelihood at parameters of a `cost` exceeds its value at a point."""
    return point.near.freedom * float(np.log(cost / point.cost))


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
            others = others.and_of(minimise(RecordProblem((records,) * len(begun)), begun))
        found = found.and_of(others, others.converged)
        if best_run(found) == best:
            break
    return found


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
        if not np.isfinite(cost) or excess_of(point, cost) > NEARLY:
            break
        excess = excess_of(point, cost)
        known = (point, *(other for other, _ in kept))
        apart = min(distance(point, theta - other.theta) for other in known)
        if found.converged[run] and apart > _SAME and is_near(point, theta, excess):
            kept.append((evaluate(records, theta), max(excess, 0.0)))
    return tuple(kept)


def _beyond(records: Records, point: Point) -> Array:
    """(n, k): where to begin beyond instants within reach, the other parameters following the dead time."""
    unit = point.near.freedom / point.cost
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
