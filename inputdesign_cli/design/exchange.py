"""The exchange method: a finite conic program, enlarged by whatever it violates, until a proof closes.

Both the cone of spectra and most requirements hold infinitely many conditions. Each round solves
with a finite selection, whose optimum is a relaxation, asks every piece for its worst violations,
and adds those. Upper bound: the iterate, repaired until everything holds. Lower bound: its
multipliers, made exactly dual feasible (`certificate`). Their distance is the proof.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from inputdesign_cli.accuracy import Cut, Violation
from inputdesign_cli.design.certificate import Certificate, certify
from inputdesign_cli.design.conic import Block, ConicSolution, solve_conic
from inputdesign_cli.design.problem import Problem
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spectrum import Basis, Face, smat, svec, svec_length

MAX_ROUNDS = 60
# The conic program is solved this much tighter than the gap that is asked for.
_SOLVER_MARGIN = 1e-2
_SOLVER_FLOOR = 1e-10
# A far-off iterate is not worth repairing: its upper bound would say nothing.
_WORTH_REPAIRING = 1.5
_MEETS = 1e-12
_FIRST_CUTS = 0.3
_MORE_CUTS = 6
_HALVINGS = 6
_BINDS = 1e-5
_STAGE_TOLERANCE = 1e-2
_STAGE_ROUNDS = 10
# Rounds without a tenth of progress after which rounding has the last word.
_PATIENCE = 6


@dataclass(frozen=True)
class ExchangeResult:
    """A spectrum `x` of `basis` that meets everything, its cost and information, and the proved bound."""

    basis: Basis
    x: Array
    cost: float
    information: Array
    certificate: Certificate
    active: tuple[tuple[int, float | None], ...]  # (requirement, frequency) with a positive multiplier
    rounds: int
    cuts: int

    @property
    def active_frequencies(self) -> Array:
        """Frequencies (rad/sample) of the requirements that bind."""
        return np.array([w for _, w in self.active if w is not None])

    @property
    def gap(self) -> float:
        """(cost - bound) / cost."""
        return max(self.cost - self.certificate.bound, 0.0) / self.cost if self.cost > 0 else 0.0


def exchange(problem: Problem, start: Array, *, tolerance: float) -> ExchangeResult:
    """Solve a least-cost problem to a proved relative gap.

    Args:
        start: (size,) a spectrum to begin with, scaled up until it meets everything (the white
            baseline does); the answer is never worse.
        tolerance: the relative gap at which to stop. The result may miss it after `MAX_ROUNDS` or
            when the solver makes no more progress: its `gap` says so.
    """
    stages = [problem.coarsened(coarse) for coarse in problem.basis.coarser()] + [problem]
    state = _first_state(stages[0], start)
    rounds = 0
    for stage in stages:
        if stage is not stages[0]:
            state = state.moved_to(stage) if state.solved else _first_state(stage, start)
        goal = tolerance if stage is problem else max(_STAGE_TOLERANCE, tolerance)
        gaps: list[float] = []
        for _ in range(MAX_ROUNDS if stage is problem else _STAGE_ROUNDS):
            rounds += 1
            solved = state.improve(tolerance)
            gaps.append(state.gap)
            stalled = len(gaps) > _PATIENCE and gaps[-1] > 0.9 * gaps[-1 - _PATIENCE]
            if not solved or state.gap <= goal or stalled:
                break
    best = state.best
    return ExchangeResult(
        basis=state.problem.basis,
        x=best.x,
        cost=best.cost,
        information=best.information,
        certificate=state.certificate,
        active=state.active,
        rounds=rounds,
        cuts=len(state.cuts),
    )


@dataclass(frozen=True)
class _Candidate:
    x: Array
    cost: float
    information: Array


@dataclass
class _State:
    """What the method knows: the face and cuts of the finite program, the best spectrum and proof."""

    problem: Problem
    face: Face
    best: _Candidate
    keys: list[tuple[int, float | None]]
    cuts: list[Cut]
    certificate: Certificate
    active: tuple[tuple[int, float | None], ...] = ()
    multipliers: list[Array] = field(default_factory=list)
    solved: tuple[Face, Array] | None = None  # the face and y of the latest finite program

    @property
    def gap(self) -> float:
        return (self.best.cost - self.certificate.bound) / self.best.cost

    def improve(self, tolerance: float) -> bool:
        """One round: solve, prove, repair, enlarge. False when the solver fails."""
        problem = self.problem
        y, multipliers, solution = _solve(problem, self.face, self.cuts, self.best, tolerance)
        if solution.status == "failed":
            return False
        self.solved, self.multipliers = (self.face, y), multipliers
        proved = certify(problem, self.cuts, multipliers)
        if proved.bound > self.certificate.bound:
            self.certificate = proved
            self.active = _active(self.keys, multipliers)
        x = self._definite(self.face.columns @ y)
        self._prune(multipliers)
        found = problem.violations(problem.information(x), above=1.0)
        if max((v.ratio for _, v in found), default=1.0) <= _WORTH_REPAIRING:
            candidate = _scaled(problem, x, [(i, v.frequency) for i, v in found])
            self.best = min(self.best, candidate, key=lambda c: c.cost)
        self._add(_most_violated(found, self.keys, 2 * problem.experiment.size + _MORE_CUTS))
        basis, self.face = problem.basis.enlarge(self.face, y, proved.directions, problem.price)
        if basis is not problem.basis:
            self.problem = replace(problem, basis=basis)
            self.best = replace(self.best, x=np.pad(self.best.x, (0, basis.size - self.best.x.size)))
        return True

    def _prune(self, multipliers: list[Array]) -> None:
        """Drop the cuts that do not bind; each costs the solver a k x k cone, and can come back."""
        weights = np.array([np.trace(m) for m in multipliers])
        kept = np.flatnonzero(weights > _BINDS * weights.sum())
        self.keys = [self.keys[i] for i in kept]
        self.cuts = [self.cuts[i] for i in kept]
        self.multipliers = [multipliers[i] for i in kept]

    def _definite(self, x: Array) -> Array:
        """`x`, or a point halfway to the best spectrum when x leaves some parameter without information."""
        for _ in range(_HALVINGS):
            try:
                np.linalg.cholesky(self.problem.information(x))
            except np.linalg.LinAlgError:
                x = 0.5 * (x + self.best.x)
            else:
                return x
        return self.best.x

    def moved_to(self, problem: Problem) -> _State:
        """The same knowledge for a richer family of spectra: its first face comes from the prices so far."""
        assert self.solved is not None
        x = np.pad(self.best.x, (0, problem.basis.size - self.best.x.size))
        proved = certify(problem, self.cuts[: len(self.multipliers)], self.multipliers)
        _, face = problem.basis.enlarge(*self.solved, proved.directions, problem.price)
        return replace(self, problem=problem, face=face, best=_feasible(problem, x), certificate=proved)

    def _add(self, keys: list[tuple[int, float | None]]) -> None:
        self.keys += keys
        self.cuts += [self.problem.requirements[i].cut(w) for i, w in keys]


def _first_state(problem: Problem, start: Array) -> _State:
    best = _scaled(problem, start[: problem.basis.size], [])
    state = _State(
        problem=problem,
        face=problem.basis.first_face(problem.price),
        best=best,
        keys=[],
        cuts=[],
        certificate=Certificate(0.0, np.zeros_like(best.information), np.zeros((problem.basis.size, 0))),
    )
    nearly = problem.violations(best.information, above=_FIRST_CUTS)
    state._add(_most_violated(nearly, [], 2 * problem.experiment.size + _MORE_CUTS))
    return state


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
    places: dict[int, list[float | None]] = {}
    for index, frequency in at:
        places.setdefault(index, []).append(frequency)

    def excess(f: float) -> float:
        information = problem.baseline_information + f * excited
        ratios = [problem.requirements[i].ratios(information, np.array(w)).max() for i, w in places.items()]
        return float(max(ratios, default=0.0)) ** 2 - 1.0

    value = excess(factor)
    while value > _MEETS:
        # r_u^2 falls at most like 1 / factor, so this step never overshoots.
        step = factor * (1.0 + value)
        slope = (excess(step) - value) / (step - factor)
        factor = max(step, factor - value / slope) if slope < 0 else step
        value = excess(factor)
    return factor


def _most_violated(
    found: list[tuple[int, Violation]], known: list[tuple[int, float | None]], most: int
) -> list[tuple[int, float | None]]:
    """Where to cut next: the worst places that have no cut yet (a flat ratio has hundreds of maxima)."""
    ranked = sorted(found, key=lambda item: -item[1].ratio)
    return [(i, v.frequency) for i, v in ranked if (i, v.frequency) not in known][:most]


def _active(
    keys: list[tuple[int, float | None]], multipliers: list[Array]
) -> tuple[tuple[int, float | None], ...]:
    weights = np.array([np.trace(m) for m in multipliers])
    return tuple(key for key, weight in zip(keys, weights, strict=True) if weight > 1e-4 * weights.sum())


def _solve(
    problem: Problem, face: Face, cuts: list[Cut], best: _Candidate, tolerance: float
) -> tuple[Array, list[Array], ConicSolution]:
    """The finite program on a face: unknowns y and svec(M), so that each cut is an identity block.

    Scaled by the best spectrum so far: its cost is one and its information matrix is the identity, so
    that whatever is active has multipliers and slacks of order one. Eliminating M would halve the
    time and cost two digits of the multipliers.

    Returns:
        y, the multipliers (k, k) of the cuts, and the raw solution, the first two in the problem's scales.
    """
    k = problem.experiment.size
    number, entries = face.columns.shape[1], svec_length(k)
    cost = best.cost
    inverse = scipy.linalg.solve_triangular(np.linalg.cholesky(best.information), np.eye(k), lower=True)
    gains = svec(inverse @ problem.information_map @ inverse.T).T @ face.columns
    link = sp.csc_matrix(np.concatenate([-cost * gains, np.eye(entries)], axis=1))
    in_face = sp.eye_array(number, number + entries, format="csc")
    matrix = sp.eye_array(entries, number + entries, k=number, format="csc")
    blocks = [
        Block("zero", link, -svec(inverse @ problem.baseline_information @ inverse.T)),
        Block(face.kind, in_face, np.zeros(number), face.order),
    ]
    blocks += [Block("psd", matrix, -svec(inverse @ cut.matrix @ inverse.T), k) for cut in cuts]
    q = np.concatenate([problem.price.vector @ face.columns, np.zeros(entries)])
    solution = solve_conic(q, blocks, tolerance=max(_SOLVER_MARGIN * tolerance, _SOLVER_FLOOR))
    multipliers = [cost * inverse.T @ smat(z) @ inverse for z in solution.multipliers[2:]]
    return cost * solution.x[:number], multipliers, solution
