"""Feasibility within the limits: a strictly feasible design, or a proof that there is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.accuracy import Requirement
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError, out_of_time
from inputdesign_cli.design.convex.demands import Scenario
from inputdesign_cli.design.convex.exchange import ExchangeResult, UnfinishedError, exchange
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.design.convex.repair import Place, excess, least_scale, missing_floor, scaled_up
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.spectrum import Basis

_TOLERANCE = 1e-6
_ROOM = 0.8
_NEARLY = 1e-5
_PLENTY = 1e4


class UnreachableError(Exception):
    """Raised when the requirements cannot be met within the limits.

    `nearest` solves `problem` (goal "factor"), the best accuracy within the limits: the least s > 1 for which
    s times its information meets them, so that every error must be loosened by sqrt(s), with its certificate.
    `within` keeps to all limits with room to spare, where some are lower ones. With `limits_alone` the lower
    limits contradict the upper ones at any accuracy.
    """

    def __init__(
        self, problem: Problem, nearest: ExchangeResult, within: Array | None = None, *, limits_alone: bool
    ) -> None:
        super().__init__("no design meets the requirements within the limits")
        self.within = within
        self.problem = problem
        self.nearest = nearest
        self.limits_alone = limits_alone


def strictly_feasible(problem: Problem, start: Array) -> tuple[Basis, Array]:
    """Find a spectrum that meets all requirements (side included) and limits with room to spare.

    Args:
        start: (size,) any spectrum that excites every parameter (white).

    Returns:
        The basis, which may have grown, and the spectrum on it.

    Raises:
        UnreachableError: there is none; the proof comes with it.
        InaccurateError: `gap-not-closed`: neither a design nor a proof was found.
    """
    if not any(limit.upper for limit in problem.limits):
        # Nothing caps the excitation: enough of it meets everything.
        strong = scaled_up(problem, start, 1.0, []).z
        return problem.basis, 1.2 * max(1.0, missing_floor(problem, strong)) * strong

    def asked(of: Scenario) -> tuple[Requirement, ...]:
        return (*of.requirements, *of.side) if problem.goal == "cost" else of.side

    within = None
    if problem.has_floors:
        nothing = problem.with_requirements(lambda _: ())
        limits_only = replace(nothing, goal="factor", floors_fixed=True, finer=problem)
        reached = exchange(limits_only, start, tolerance=_TOLERANCE, enough=_decided)
        if reached.objective >= 1.0:
            _check_proved(reached)
            raise UnreachableError(limits_only, reached, limits_alone=True)
        within = np.sqrt(reached.s) * reached.x
        problem, start = problem.on(reached.basis), np.pad(start, (0, within.size - start.size))
    factor = replace(problem.with_requirements(asked), goal="factor", finer=problem)
    if not factor.demands.asked:
        return problem.basis, within if within is not None else start * (0.5 / least_scale(factor, start))
    found = exchange(factor, start, tolerance=_TOLERANCE, interior=within, enough=_decided)
    if found.objective >= 1.0 > found.certificate.bound and problem.goal == "cost":
        # Undecided: the limits leave some combination of the inputs free, which a cap on all prevents.
        most = scaled_up(replace(problem, limits=(), densities=()), start, 1.0, []).z
        total = problem.power("excitation").at(most)
        capped = replace(factor, limits=(*factor.limits, PowerLimit("excitation", _PLENTY * total)))
        again = exchange(capped, start, tolerance=_TOLERANCE, interior=within, enough=_decided)
        found = again if again.objective < 1.0 else found
    if found.objective >= 1.0:
        _check_proved(found)
        raise UnreachableError(factor, found, within, limits_alone=False)
    if within is None:
        return found.basis, np.sqrt(found.s) * found.x
    share = 0.5 * (1.0 - found.s)
    within = np.pad(within, (0, found.x.size - within.size))
    return found.basis, (1.0 - share) * found.x + share * within


def _check_proved(found: ExchangeResult) -> None:
    """Raise `InaccurateError` unless it is proved, to rounding, that nothing is within the limits."""
    bound = found.certificate.bound
    if bound < 1.0 - _NEARLY:
        raise InaccurateError.because(
            "gap-not-closed",
            "whether any design keeps to the limits was not decided: the best found misses by a factor of "
            f"{np.sqrt(found.objective):.4g}, and the proof excludes only factors below {np.sqrt(bound):.4g}",
            hint="write limits and costs of the channels in units in which they are of like size, or lower "
            "the order of the spectrum",
            key="limits",
        )


def _decided(objective: float, bound: float) -> bool:
    return objective < _ROOM or (bound > 1.0 and objective - bound < _TOLERANCE * bound)


KEEPS = 1e-9  # largest relative violation of limits that are kept


def solve_limited(
    problem: Problem, start: Array, tolerance: float, known: Sequence[Place] = ()
) -> ExchangeResult:
    """Solve the limited problem by the exchange, from a start within the limits; arguments as there.

    Raises:
        UnreachableError: the requirements cannot be met within the limits.
        UnfinishedError: with a design that keeps the limits.
        OutOfTimeError: none that does is known yet.
    """
    floors = problem.has_floors
    limited = bool(problem.limits or problem.densities or problem.polytope)
    free: ExchangeResult | None = None
    if problem.goal == "cost" and limited and not floors:
        # Limits that the cheapest design keeps anyway cost nothing.
        unlimited = replace(problem, limits=(), densities=(), polytope=None, finer=problem)
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
    """Return the error with a design that keeps the limits, if one is known.

    Args:
        free: the design of the problem without limits. Its bound holds; it, or else even excitation, may
            keep the limits.
    """
    within = None if free is None else _known_within_limits(problem, start, free)
    if within is None:
        return out_of_time("no design within the limits is known yet")
    return UnfinishedError.of(ended, within)


def _known_within_limits(problem: Problem, start: Array, free: ExchangeResult) -> ExchangeResult | None:
    if _keeps_limits(problem, free):
        return _unweighted(problem, free)
    even = scaled_up(replace(problem, limits=(), densities=(), polytope=None, finer=problem), start, 0.0, [])
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
    return excess(kept, kept.candidate(found.x, 1.0)) <= KEEPS


def _unweighted(problem: Problem, free: ExchangeResult) -> ExchangeResult:
    """Return a design without limits as one of the problem with limits, which have no weight."""
    no_weight = replace(free.certificate, limits=np.zeros(len(problem.limits)))
    return replace(free, certificate=no_weight)
