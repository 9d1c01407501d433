"""Find other minima that explain the data nearly as well as the best one.

A dead time that was excited at a few frequencies is known only up to whole periods. Near-equal minima then
stand far apart, and the covariance describes one of them alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.gauss_newton import Minimum
from inputdesign_cli.identification.record_problem import Point
from inputdesign_cli.identification.records import Records

NEARLY = 2.0 * float(np.log(1000.0))
"""What another minimum may have more in -2 log likelihood: a thousandth of the likelihood of the best."""
# Another minimum: so far apart in squared standard deviations, and by what the slope of one does not explain.
_APART, _UNEXPLAINED = 25.0, 4.0


@dataclass(frozen=True)
class Rival:
    """Parameters theta (k,) at another minimum, `excess` more in -2 log likelihood than the estimate."""

    theta: Array
    excess: float


def rivals(records: Records, point: Point, found: Minimum) -> tuple[Rival, ...]:
    """Where other starts ended, the likeliest first: far from the best `point`, and nearly as likely."""
    if point.cost <= 0.0:
        return ()
    estimate, best = Rival(point.theta, 0.0), list[Rival]()
    for run in np.argsort(found.cost):
        cost = float(found.cost[run])
        if not np.isfinite(cost):
            break
        excess = excess_of(records, point, cost)
        if excess > NEARLY:
            break
        theta = np.asarray(found.theta[run], dtype=float)
        if not any(
            is_near(records, point, point.theta + theta - other.theta, excess - other.excess)
            for other in (estimate, *best)
        ):
            best.append(Rival(theta, max(excess, 0.0)))
    return tuple(best)


def spread_out(records: Records, points: Sequence[Point], most: int) -> list[int]:
    """Return the numbers of the likeliest points, of near ones only the best."""
    chosen: list[int] = []
    for number in np.argsort([point.cost for point in points], kind="stable"):
        point = points[number]
        if len(chosen) == most or not np.isfinite(point.cost):
            break
        near = (distance(records, points[other], point.theta - points[other].theta) for other in chosen)
        if point.cost <= 0.0 or all(square > _APART for square in near):
            chosen.append(int(number))
    return chosen


def distance(records: Records, point: Point, step: Array) -> float:
    """Return the square of a `step` (k,) in standard deviations of the parameters at a point."""
    unit = 1.0 if records.weights is not None else point.near.freedom / point.cost
    return unit * float(step @ point.hessian @ step)


def is_near(records: Records, point: Point, theta: Array, excess: float) -> bool:
    """Whether parameters (k,) are of the same minimum, or within five deviations of the one at a point."""
    return distance(records, point, theta - point.theta) <= max(_APART, _UNEXPLAINED * excess)


def excess_of(records: Records, point: Point, cost: float) -> float:
    """Return by how much -2 log likelihood at parameters of a `cost` exceeds its value at a point."""
    if records.weights is not None:
        return cost - point.cost
    return point.near.freedom * float(np.log(cost / point.cost))
