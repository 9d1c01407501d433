"""The exchange within limits: ignored where they cost nothing, and otherwise met from inside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError, out_of_time
from inputdesign_cli.design.convex.candidate import Place, candidate_at, excess, scaled_up
from inputdesign_cli.design.convex.exchange import ExchangeResult, UnfinishedError, exchange
from inputdesign_cli.design.convex.feasible import strictly_feasible
from inputdesign_cli.design.convex.problem import Problem

KEEPS = 1e-9


def solve_limited(
    problem: Problem, start: Array, tolerance: float, known: Sequence[Place] = ()
) -> ExchangeResult:
    """The exchange, begun with what suits the limits of the problem; arguments as there.

    Raises:
        UnreachableError: the requirements cannot be met within the limits.
        UnfinishedError: with a design that keeps the limits.
        OutOfTimeError: none that does is known yet.
    """
    floors, limited = problem.has_floors, bool(problem.limits or problem.densities)
    free: ExchangeResult | None = None
    if problem.goal == "cost" and limited and not floors:
        # Limits that the cheapest design keeps anyway cost nothing.
        unlimited = replace(problem, limits=(), densities=(), finer=problem)
        try:
            free = exchange(unlimited, start, tolerance=tolerance, known=known)
        except UnfinishedError as ended:
            raise _within_limits(ended, problem, start, ended.found) from None
        if _keeps_limits(problem, free):
            return _unweighted(problem, free)
    basis, interior = problem.basis, None
    if floors or problem.side or (problem.goal == "cost" and limited):
        try:
            basis, interior = strictly_feasible(problem, start)
        except OutOfTimeError as ended:
            raise _within_limits(ended, problem, start, free) from None
    return exchange(problem.on(basis), start, tolerance=tolerance, interior=interior, known=known)


def _within_limits(
    ended: OutOfTimeError, problem: Problem, start: Array, free: ExchangeResult | None
) -> OutOfTimeError:
    """The error with a design that keeps the limits, if one is known.

    Args:
        free: of the problem without limits. It may keep them, or else even excitation; its bound holds.
    """
    within = None if free is None else _known_within_limits(problem, start, free)
    if within is None:
        return out_of_time("no design within the limits is known yet")
    return UnfinishedError.of(ended, within)


def _known_within_limits(problem: Problem, start: Array, free: ExchangeResult) -> ExchangeResult | None:
    if _keeps_limits(problem, free):
        return _unweighted(problem, free)
    even = scaled_up(replace(problem, limits=(), densities=(), finer=problem), start, 0.0, [])
    found = replace(
        free,
        basis=problem.basis,
        x=even.z,
        objective=even.objective,
        informations=even.informations,
        active=(),
    )
    return _unweighted(problem, found) if _keeps_limits(problem, found) else None


def _keeps_limits(problem: Problem, found: ExchangeResult) -> bool:
    kept = problem.on(found.basis)
    return excess(kept, candidate_at(kept, found.x, 1.0)) <= KEEPS


def _unweighted(problem: Problem, free: ExchangeResult) -> ExchangeResult:
    """A design without limits as one of the problem with limits, which have no weight."""
    no_weight = replace(free.certificate, limits=np.zeros(len(problem.limits)))
    return replace(free, certificate=no_weight)
