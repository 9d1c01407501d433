"""From starting points to the likeliest parameters, and whether the records begin at rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.special

from inputdesign_cli.identification.gauss_newton import best_run, minimise
from inputdesign_cli.identification.record_problem import Point, RecordProblem, evaluate
from inputdesign_cli.identification.records import Records
from inputdesign_cli.plant.polynomial import Array

# A record that begins at rest is taken for one that does not with this probability.
_MISTAKEN = 0.01
# Above this probability nothing is searched for.
_UNLIKELY = 0.2


@dataclass(frozen=True)
class Search:
    """Where the search from the best of `starts` points ended.

    Attributes:
        first: (parts, p), the first residuals if each record began at rest about zero.
    """

    records: Records
    point: Point
    converged: bool
    steps: int
    starts: int
    first: Array


def search(records: Records, points: Array, *, starts: int, before: Array | int = 0) -> Search:
    """The likeliest of what Gauss and Newton find from `points` (n, k).

    Args:
        starts: how many points were looked at.
        before: (n,) steps that have been made from each.
    """
    found = minimise(RecordProblem((records,) * len(points)), points)
    best = best_run(found)
    steps = int(found.steps[best] + np.broadcast_to(before, len(points))[best])
    point = evaluate(records, found.theta[best])
    first = point.errors[np.cumsum((0, *records.lengths[:-1]))]
    return Search(records, point, bool(found.converged[best]), steps, starts, first)


def from_rest_or_free(
    records: Records,
    deviations: Records,
    rest: bool | None,
    searched: Callable[[Records, Array | None], Search],
) -> Search:
    """The search from rest, unless unknown starts explain what it leaves better than chance.

    The likelihood ratio of the two is N p log(cost / cost), chi-squared with as many degrees of freedom as
    there are unknowns.

    Args:
        records: from rest.
        deviations: the same from their means, which an unknown level makes up for.
        rest: whether the records begin at rest about zero; None: as the data say.
        searched: what searches from its own starts and, if given, from the parameters (k,).
    """
    free = replace(deviations, free=True)

    def begun_free(known: Array | None) -> Search:
        found = searched(free, known)
        errors = records.at(found.point.theta).errors
        return replace(found, first=errors[np.cumsum((0, *records.lengths[:-1]))])

    if rest is False:
        return begun_free(None)
    at_rest = searched(records, None)
    if rest or at_rest.point.cost <= 0.0:
        return at_rest
    near = evaluate(free, at_rest.point.theta)
    unknowns = near.near.directions.shape[1]
    if records.y.size <= records.size + 2 * unknowns:
        return at_rest

    def probability(cost: float) -> float:
        ratio = records.y.size * np.log(at_rest.point.cost / max(cost, 1e-300))
        return float(scipy.special.chdtrc(unknowns, ratio))

    # What one step promises is about what the search would find.
    step = np.linalg.lstsq(near.hessian, near.slope, rcond=1e-12)[0]
    if probability(near.cost - float(near.slope @ step)) > _UNLIKELY:
        return at_rest
    begun = begun_free(at_rest.point.theta)
    return begun if probability(begun.point.cost) < _MISTAKEN else at_rest
