"""The finite program of one round: a face of the cone of spectra, finitely many cuts and rows.

Unknowns: y (the spectrum on the face), svec(M') of the scenarios that have cuts, s where the goal has one,
the largest cost where there are several, and the auxiliary unknowns of the cuts. Everything is scaled by
the best design so far: there each M' is the identity and the objective is one, so that whatever is active has
multipliers and slacks of order one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Cut, positive_part
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.finite import FiniteProgram, MatrixPart, solve_program
from inputdesign_cli.design.convex.limits import DensityPlace
from inputdesign_cli.design.convex.problem import Candidate, Problem
from inputdesign_cli.spectrum import Face, Functional, smat, svec, svec_length

# The conic program is solved this much tighter than the gap that is asked for.
_SOLVER_MARGIN = 1e-2
_SOLVER_FLOOR = 1e-10
_SINGULAR = 1e-14
_AT_ONCE = 256  # basis functions transformed together
# Shares of a cost below this fraction of the largest are rounding errors.
_NO_SHARE = 1e-9
# If no requirement keeps M definite, smaller eigenvalues, relative to the largest, are scaled like this one.
_INDEFINITE = 1e-3


@dataclass(frozen=True)
class Row:
    """A linear limit of the finite program: `functional` is at most (`upper`) or at least `bound`.

    `limit` is the index of a power limit, `density` the place of a density limit, `form` (m, r, r) a form of
    the lags of the excitation; the two that do not apply are None.
    """

    functional: Functional
    bound: float
    upper: bool
    limit: int | None = None
    density: DensityPlace | None = None
    form: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class PlacedCut:
    """A cut on the M' of a scenario; s multiplies its constants if the requirement is a `side` one."""

    cut: Cut
    scenario: int = 0
    side: bool = False


@dataclass(frozen=True)
class Implied:
    """The inequality tr(Y M') >= level of a scenario, or level times s for `side`; Y = `weight` (k, k)."""

    weight: Array
    level: float
    scenario: int = 0
    side: bool = False


@dataclass(frozen=True)
class Proof:
    """Holds the multipliers of one round, in the problem's own units.

    `cuts` holds the inequality that each cut implies, valid for any multipliers. `rows` (number of rows,) are
    nonnegative weights of the limits. `costs` are weights, with the sum one, of the costs whose maximum is
    minimised.
    """

    cuts: tuple[Implied, ...]
    rows: Array
    costs: Array = field(default_factory=lambda: np.ones(1))


@dataclass(frozen=True)
class MasterSolution:
    """Holds the optimum of the finite program: y on the face, the spectrum z = columns y, s, and its proof.

    If the solver has not `converged`, this is its last iterate. The proof holds for it as well, and it often
    sets the scale of the next attempt.
    """

    y: Array
    z: Array
    s: float
    proof: Proof
    converged: bool


def solve_master(
    problem: Problem,
    face: Face,
    cuts: Sequence[PlacedCut],
    rows: Sequence[Row],
    best: Candidate,
    *,
    tolerance: float,
    rough: float = 0.0,
    keep: bool = False,
    dense: bool = False,
) -> MasterSolution | None:
    """Solve one finite program; return None when the solver has no point to show.

    Args:
        best: the best design so far, which sets the scales.
        rough: a tolerance that is enough where it saves many steps, as in a large program.
        keep: let any multiple of the best spectrum be added to the face, so that the program stays
            feasible where scaling up is no remedy.
        dense: see `solve_program`.
    """
    worth = float(problem.price.vector @ best.z)
    ray = best.z[:, None] / worth if keep else np.zeros((best.z.size, 0))
    several = not problem.scaled and len(problem.costs) > 1
    largest = np.zeros((best.z.size, int(several)))  # an unknown that excites nothing
    columns = np.concatenate([face.columns, ray, largest], axis=1)
    inside = face.columns.shape[1]
    objective = best.objective
    # Without cuts the nominal plant takes part alone: a program without M would be solved by no excitation.
    involved = sorted({placed.scenario for placed in cuts}) or [0]
    definite = problem.demands.definite
    turns = {plant: _congruence(best.informations[plant], definite=definite) for plant in involved}
    program = _program(problem, face, columns, cuts, rows, best, worth, turns)
    exact = max(_SOLVER_MARGIN * tolerance, _SOLVER_FLOOR)
    solution = solve_program(program, tolerance=exact, rough=max(_SOLVER_MARGIN * rough, exact), dense=dense)
    if solution is None:
        return None
    y = worth * _in_cone(face, solution.v[:inside])
    kept = worth * np.maximum(solution.v[inside : inside + ray.shape[1]], 0.0)
    of_plant = {plant: iter(found) for plant, found in zip(involved, solution.proofs, strict=True)}
    proofs = []
    for placed in cuts:
        turn, (Y, r) = turns[placed.scenario], next(of_plant[placed.scenario])
        proofs.append(Implied(objective * turn.T @ Y @ turn, objective * r, placed.scenario, placed.side))
    scales = np.array([_level(problem, row, best.s) for row in rows])
    weights = objective * np.maximum(solution.limit_weights[: len(rows)], 0.0) / scales
    return MasterSolution(
        y=y,
        z=face.columns @ y + ray @ kept,
        s=best.s * float(solution.v[-1]) if problem.scaled else 1.0,
        proof=Proof(tuple(proofs), weights, _shares(solution.limit_weights[len(rows) :])),
        converged=solution.converged,
    )


def _program(
    problem: Problem,
    face: Face,
    columns: Array,
    cuts: Sequence[PlacedCut],
    rows: Sequence[Row],
    best: Candidate,
    worth: float,
    turns: Mapping[int, Array],
) -> FiniteProgram:
    """Return the finite program in scaled numbers; the last column is the largest of several costs."""
    inside, number = face.columns.shape[1], columns.shape[1]
    matrices = []
    for plant, turn in turns.items():
        mine = [placed for placed in cuts if placed.scenario == plant]
        gains, offset = _turned(problem, plant, turn, columns, worth, best.s)
        transformed = [placed.cut.transformed(turn) for placed in mine]
        matrices.append(MatrixPart(gains, offset, transformed, [placed.side for placed in mine]))
    unknowns = np.eye(number + int(problem.scaled))
    cost = unknowns[number] if problem.scaled else problem.price.vector @ columns
    limits, limit_offset = _limits(problem, columns, rows, best.s, worth)
    if not problem.scaled and len(problem.costs) > 1:
        cost = unknowns[-1]
        below = cost - worth / best.objective * np.array([one.vector for one in problem.costs]) @ columns
        limits = np.concatenate([limits, below])
        limit_offset = np.concatenate([limit_offset, np.zeros(len(below))])
    return FiniteProgram(
        cost=cost,
        face=face,
        matrices=matrices,
        signs=unknowns[inside:],
        limits=limits,
        limit_offset=limit_offset,
        unit=best.s if problem.scaled else None,
        size=problem.experiment.size,
    )


def _shares(weights: Array) -> Array:
    """Return the shares of several costs, with the sum one; a single cost has it all."""
    if not weights.size:
        return np.ones(1)
    weights = np.where(weights > _NO_SHARE * weights.max(), np.maximum(weights, 0.0), 0.0)
    return weights / weights.sum() if weights.any() else np.full(weights.size, 1.0 / weights.size)


def _turned(
    problem: Problem, scenario: int, turn: Array, columns: Array, worth: float, s: float
) -> tuple[Array, Array]:
    """Return svec of K M' K^T, K = `turn`, as gains (entries, unknowns) and offset of (y / worth, s)."""
    maps = problem.information_maps[:, scenario]
    # Most functions of a basis that has grown are not in the face.
    used = np.flatnonzero(columns.any(axis=1))
    gains = np.zeros((svec_length(len(turn)), columns.shape[1]))
    for start in range(0, used.size, _AT_ONCE):
        part = used[start : start + _AT_ONCE]
        gains += worth * (svec(turn @ maps[part] @ turn.T).T @ columns[part])
    if problem.scaled:
        scaled = svec(turn @ problem.scaled_information[scenario] @ turn.T)
        gains = np.column_stack([gains, s * scaled])
    return gains, svec(turn @ problem.fixed_information[scenario] @ turn.T)


def _in_cone(face: Face, y: Array) -> Array:
    """Return the nearest y in the cone of the face, which a solver may leave by its tolerance."""
    if face.kind == "nonnegative":
        return np.maximum(y, 0.0)
    return svec(positive_part(smat(y)))


def _congruence(information: Array, *, definite: bool) -> Array:
    """Return K with K M K^T = I, or nearly so where M is close to singular.

    It is a Cholesky factor, which does not mix parameters that M keeps apart.
    """
    if definite:
        with suppress(np.linalg.LinAlgError):
            factor = np.linalg.cholesky(information)
            if np.diag(factor).min() ** 2 > _SINGULAR * np.diag(factor).max() ** 2:
                return np.linalg.inv(factor)
    eigenvalues, vectors = np.linalg.eigh(information)
    floor = (_SINGULAR if definite else _INDEFINITE) * eigenvalues[-1]
    return (vectors / np.sqrt(np.maximum(eigenvalues, floor))).T


def _level(problem: Problem, row: Row, s: float) -> float:
    return row.bound * problem.bound_factor(row.upper, s) or 1.0


def _limits(
    problem: Problem, columns: Array, rows: Sequence[Row], s: float, worth: float
) -> tuple[Array, Array]:
    """Return each limit over its level at the best design: 1 (or s over its best value) minus its share."""
    number = columns.shape[1]
    matrix = np.zeros((len(rows), number + int(problem.scaled)))
    offset = np.zeros(len(rows))
    for index, row in enumerate(rows):
        sign = 1.0 if row.upper else -1.0
        level = _level(problem, row, s)
        matrix[index, :number] = -sign * worth / level * (row.functional.vector @ columns)
        share = sign * row.bound * problem.bound_factor(row.upper, s) / level
        if problem.scaled and (row.upper or not problem.floors_fixed):
            matrix[index, number] = share
        else:
            offset[index] = share
    return matrix, offset
