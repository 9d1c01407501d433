"""The exchange method: a finite conic program, enlarged by whatever it violates, until a proof closes.

Both the cone of spectra and most requirements hold infinitely many conditions. Each round solves
with a finite selection, whose optimum is a relaxation, asks every piece for its worst violations,
and adds those. Upper bound: the iterate, repaired until everything holds. Lower bound: its
multipliers, made exactly dual feasible (`certificate`). Their distance is the proof.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from inputdesign_cli.accuracy import Cut
from inputdesign_cli.design.certificate import Certificate, certify
from inputdesign_cli.design.conic import Block, ConicSolution, solve_conic
from inputdesign_cli.design.problem import Problem
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spectrum import Face, smat, svec, svec_length

MAX_ROUNDS = 60
# The conic program is solved this much tighter than the gap that is asked for.
_SOLVER_MARGIN = 1e-2
_SOLVER_FLOOR = 1e-10
# A far-off iterate is not worth repairing: its upper bound would say nothing.
_WORTH_REPAIRING = 1.5
_MEETS = 1e-9
_FIRST_CUTS = 0.3


@dataclass(frozen=True)
class ExchangeResult:
    """A spectrum `x` that meets everything, its cost and information, and the proved lower bound."""

    x: Array
    cost: float
    information: Array
    certificate: Certificate
    active: tuple[tuple[int, float | None], ...]   # (requirement, frequency) with a positive multiplier
    rounds: int
    cuts: int

    @property
    def gap(self) -> float:
        """(cost - bound) / cost."""
        return max(self.cost - self.certificate.bound, 0.0) / self.cost if self.cost > 0 else 0.0


def exchange(problem: Problem, start: Array, *, tolerance: float) -> ExchangeResult:
    """Solve a least-cost problem to a proved relative gap.

    Args:
        start: (size,) a spectrum that meets everything (the white baseline); the answer is never worse.
        tolerance: the relative gap at which to stop. The result may miss it after `MAX_ROUNDS` or
            when the solver makes no more progress: its `gap` says so.
    """
    best = _feasible(problem, start)
    keys: list[tuple[int, float | None]] = []
    cuts: list[Cut] = []
    fresh = [(i, v.frequency) for i, v in problem.violations(best.information, above=_FIRST_CUTS)]
    face = problem.basis.first_face()
    certificate: Certificate | None = None
    active: tuple[tuple[int, float | None], ...] = ()
    rounds = 0
    for rounds in range(1, MAX_ROUNDS + 1):
        keys += fresh
        cuts += [problem.requirements[i].cut(w) for i, w in fresh]
        solution = _solve(problem, face, cuts, tolerance)
        if solution.status == "failed":
            break
        y = solution.x[: face.columns.shape[1]]
        multipliers = [smat(z) for z in solution.multipliers[2:]]
        proved = certify(problem, cuts, multipliers)
        if certificate is None or proved.bound > certificate.bound:
            certificate = proved
            active = _active(keys, multipliers)
        x = face.columns @ y
        found = problem.violations(problem.information(x), above=1.0)
        if max((v.ratio for _, v in found), default=1.0) <= _WORTH_REPAIRING:
            candidate = _scaled(problem, x, [(i, v.frequency) for i, v in found])
            best = min(best, candidate, key=lambda c: c.cost)
        if best.cost - certificate.bound <= tolerance * best.cost:
            break
        fresh = [(i, v.frequency) for i, v in found if v.ratio > 1.0 + 1e-2 * tolerance]
        _, face = problem.basis.enlarge(face, y, proved.directions)
    return ExchangeResult(best.x, best.cost, best.information, certificate, active, rounds, len(cuts))


@dataclass(frozen=True)
class _Candidate:
    x: Array
    cost: float
    information: Array


def _feasible(problem: Problem, x: Array) -> _Candidate:
    return _Candidate(x, problem.price.at(x), problem.information(x))


def _scaled(problem: Problem, x: Array, found: list[tuple[int, float | None]]) -> _Candidate:
    """`x` times the smallest factor that meets every requirement, found by the secant method.

    The search looks at the frequencies in `found` only; the full check follows, and adds to them.
    """
    factor = 1.0
    at = set(found)
    for _ in range(12):
        factor = _smallest_factor(problem, x, at, factor)
        information = problem.information(factor * x)
        missed = [(i, v) for i, v in problem.violations(information, above=1.0) if v.ratio > 1.0 + _MEETS]
        if not missed:
            break
        at |= {(i, v.frequency) for i, v in missed}
    return _feasible(problem, factor * x)


def _smallest_factor(problem: Problem, x: Array, at: set[tuple[int, float | None]], factor: float) -> float:
    excited = problem.information(x) - problem.baseline_information

    def excess(f: float) -> float:
        information = problem.baseline_information + f * excited
        ratios = [
            float(problem.requirements[i].ratios(information, np.array([w]))[0]) for i, w in at
        ]
        return max(ratios, default=0.0) ** 2 - 1.0

    value = excess(factor)
    while value > _MEETS:
        # r_u^2 falls at most like 1 / factor, so this step never overshoots.
        step = factor * (1.0 + value)
        slope = (excess(step) - value) / (step - factor)
        factor = max(step, factor - value / slope) if slope < 0 else step
        value = excess(factor)
    return factor


def _active(keys: list[tuple[int, float | None]], multipliers: list[Array]) -> tuple[tuple[int, float | None], ...]:
    weights = np.array([np.trace(m) for m in multipliers])
    return tuple(key for key, weight in zip(keys, weights, strict=True) if weight > 1e-4 * weights.sum())


def _solve(problem: Problem, face: Face, cuts: list[Cut], tolerance: float) -> ConicSolution:
    """The finite program on a face: unknowns y and svec(M), so that each cut is an identity block."""
    k = problem.experiment.size
    number, entries = face.columns.shape[1], svec_length(k)
    link = np.concatenate([-svec(problem.information_map).T @ face.columns, np.eye(entries)], axis=1)
    in_face = sp.eye_array(number, number + entries, format="csc")
    matrix = sp.eye_array(entries, number + entries, k=number, format="csc")
    blocks = [
        Block("zero", sp.csc_matrix(link), -svec(problem.baseline_information)),
        Block(face.kind, in_face, np.zeros(number), face.order),
    ]
    blocks += [Block("psd", matrix, -svec(cut.matrix), k) for cut in cuts]
    q = np.concatenate([problem.price.vector @ face.columns, np.zeros(entries)])
    return solve_conic(q, blocks, tolerance=max(_SOLVER_MARGIN * tolerance, _SOLVER_FLOOR))
