"""The exchange method: a finite conic program, enlarged by violated constraints until the gap is closed.

Both the cone of spectra and most requirements hold infinitely many conditions, and each scenario has its own:
a semi-infinite program ([hettich-kortanek-1993]). Each round solves a finite selection, a relaxation, and
adds the worst violations of every part. The upper bound is the iterate, repaired until everything holds
(`repair`). The lower bound comes from its multipliers, made exactly dual feasible (`certificate`). Their
distance is the proved gap.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError, Round, report_progress
from inputdesign_cli.design.convex.certificate import Certificate
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.design.convex.repair import Place
from inputdesign_cli.design.convex.state import State, first_state
from inputdesign_cli.spectrum import Basis

MAX_ROUNDS = 60
_STAGE_TOLERANCE = 1e-2
# A program solved to the tolerance may end with a larger gap. It is then solved to this share of it.
_FINER = 0.1
_STAGE_ROUNDS = 10
# Rounds without a gain of a tenth after which only rounding is left. A growing basis may take several rounds
# to find the sinusoids that pay.
_PATIENCE, _PATIENCE_GROWING = 6, 16

Enough = Callable[[float, float], bool]


class UnfinishedError(OutOfTimeError):
    """Raised when the time limit has passed; `found` is the best design so far, with its proved bound."""

    found: ExchangeResult

    @classmethod
    def of(cls, ended: OutOfTimeError, found: ExchangeResult) -> UnfinishedError:
        """Return an error with the same diagnostics that holds the result found so far."""
        error = cls(ended.diagnostics)
        error.found = found
        return error


@dataclass(frozen=True)
class ExchangeResult:
    """Holds a spectrum `x` of `basis` that meets everything, its information, and the proved bound.

    `objective` is what was minimised: the cost, or s (see `Problem`); `certificate.bound` is its proved
    lower bound. `informations` (S, k, k) are the M_s(x); for the goal "samples" they belong to s samples.
    """

    basis: Basis
    x: Array
    s: float
    objective: float
    informations: NDArray[np.float64]
    certificate: Certificate
    active: tuple[Place, ...]  # (requirement, frequency) with a positive multiplier, the largest first
    rounds: int
    cuts: int

    @property
    def information(self) -> Array:
        """Return the information (k, k) of the nominal plant."""
        return self.informations[0]

    @property
    def active_frequencies(self) -> Array:
        """Return the frequencies, in the unit of the experiment, of the requirements that bind."""
        return np.array([w for _, w in self.active if w is not None])

    def active_at(self, index: int) -> Array:
        """Return the frequencies at which one requirement binds, by its index in `Demands.asked`."""
        return np.array([w for i, w in self.active if i == index and w is not None])

    @property
    def gap(self) -> float:
        """Return |objective - bound| / objective; a bound beyond the objective counts as an error."""
        difference = abs(self.objective - self.certificate.bound)
        return difference / self.objective if self.objective > 0 else 0.0


def exchange(
    problem: Problem,
    start: Array,
    *,
    tolerance: float,
    interior: Array | None = None,
    enough: Enough | None = None,
    known: Sequence[Place] = (),
) -> ExchangeResult:
    """Solve a design problem to a proved relative gap.

    Args:
        start: (size,) a spectrum to begin with, scaled up until it meets everything (white does);
            the answer is never worse.
        interior: (size,) a spectrum that meets limits and (side) requirements strictly. Needed where
            scaling cannot repair an iterate: limits or lower limits that do not scale, side requirements.
        tolerance: the relative gap at which to stop. The result may miss it after `MAX_ROUNDS` or
            when the solver makes no more progress: its `gap` says so.
        enough: maps (objective, bound) to whether to stop already.
        known: places that are likely to bind, for example from a similar design: cuts to begin with.

    Raises:
        UnfinishedError: with what was reached.
    """
    done = enough or (lambda objective, bound: False)
    coarser = [] if interior is not None else problem.basis.coarser()
    # x of a coarser basis is the head of x of the next, so that they share their integrals.
    stages = [replace(problem, basis=coarse, finer=problem) for coarse in coarser] + [problem]
    state = first_state(stages[0], start, interior, known)
    rounds = 0
    for stage in stages:
        if stage is not stages[0]:
            state = state.moved_to(stage) if state.solved else first_state(stage, start, interior, known)
        goal = tolerance if stage is problem else max(_STAGE_TOLERANCE, tolerance)
        gaps: list[float] = []
        asked = tolerance
        for _ in range(MAX_ROUNDS if stage is problem else _STAGE_ROUNDS):
            rounds += 1
            try:
                solved = state.improve(asked)
            except OutOfTimeError as ended:
                raise UnfinishedError.of(ended, _result(state.on(problem).least_multiple(), rounds)) from None
            gaps.append(state.gap)
            report_progress(Round(rounds, state.best.objective, state.certificate.bound, len(state.cuts)))
            grows = state.problem.basis.size > stage.basis.size
            patience = _PATIENCE_GROWING if grows else _PATIENCE
            stalled = len(gaps) > patience and gaps[-1] > 0.9 * gaps[-1 - patience]
            if not solved and state.gap > goal and asked == tolerance:
                asked *= _FINER
                continue
            if stalled and state.gap > goal and not state.dense:
                # The dense method is more accurate for multipliers of very different sizes.
                state.dense = True
                gaps.clear()
                continue
            if not solved or state.gap <= goal or stalled:
                break
            if done(state.best.objective, state.certificate.bound):
                break
    return _result(state, rounds)


def _result(state: State, rounds: int) -> ExchangeResult:
    best, problem = state.best, state.problem
    whole = problem.goal == "samples" or not problem.scaled
    return ExchangeResult(
        basis=problem.basis,
        x=best.z / best.s,
        s=best.s,
        objective=best.objective,
        informations=best.informations if whole else best.informations / best.s,
        certificate=state.certificate,
        active=state.active,
        rounds=rounds,
        cuts=len(state.cuts),
    )
