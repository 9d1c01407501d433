"""Is there a design within the limits at all: a strictly feasible one, or a proof that there is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.accuracy import Requirement
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.candidate import least_scale, missing_floor, scaled_up
from inputdesign_cli.design.convex.demands import Scenario
from inputdesign_cli.design.convex.exchange import ExchangeResult, exchange
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.spectrum import Basis

_TOLERANCE = 1e-6
_ROOM = 0.8
_NEARLY = 1e-5
_PLENTY = 1e4


class UnreachableError(Exception):
    """The requirements cannot be met within the limits.

    `nearest` solves `problem` (goal "factor"), the best accuracy within the limits: the least s > 1 for which
    s times its information meets them, so that every error must be loosened by sqrt(s), with its certificate.
    `within` keeps to all limits with room to spare, where some are lower ones. With `limits_alone` it is the
    lower limits that contradict the upper ones, whatever the accuracy.
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
    """A spectrum that meets all requirements (side included) and limits with room to spare.

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
        # Undecided: the limits alone leave some combination of the inputs free. With a cap on all it is not.
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
