"""The finite program of one round: a face of the cone of spectra, finitely many cuts and rows.

Unknowns: y (the spectrum on the face), svec(M'), s where the goal has one, and the auxiliary unknowns of
the cuts. Everything is scaled by the best design so far: there M' is the identity and the objective is
one, so that whatever is active has multipliers and slacks of order one. Eliminating M' would halve the
time and cost two digits of the multipliers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from inputdesign_cli.accuracy import Cut, positive_part
from inputdesign_cli.design.conic import Block, solve_conic
from inputdesign_cli.design.convex.candidate import Candidate
from inputdesign_cli.design.convex.limits import DensityPlace
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spectrum import Face, Functional, smat, svec, svec_length

# The conic program is solved this much tighter than the gap that is asked for.
_SOLVER_MARGIN = 1e-2
_SOLVER_FLOOR = 1e-10
_SINGULAR = 1e-14
# Without a requirement that keeps M definite, weak directions are not blown up beyond this.
_INDEFINITE = 1e-3


@dataclass(frozen=True)
class Row:
    """One linear limit of the finite program: `functional` at most (`upper`) or at least `bound`.

    `limit` is the index of the power limit; `density` says where a density limit is looked at.
    """

    functional: Functional
    bound: float
    upper: bool
    limit: int | None = None
    density: DensityPlace | None = None


@dataclass(frozen=True)
class Proof:
    """What the multipliers of one round suggest, in the problem's own units.

    `cuts` holds (Y, r) of each cut, tr(Y M') >= r (times s for cuts of side requirements), whatever the
    solver did; `rows` (number of rows,) are nonnegative weights of the limits.
    """

    cuts: tuple[tuple[Array, float], ...]
    rows: Array


@dataclass(frozen=True)
class MasterSolution:
    """The optimum of the finite program: y on the face, the spectrum z = columns y, s, and its proof.

    Without `converged` it is the last iterate of a solver that gave up: often good enough to scale the
    next attempt by, and the proof holds as always.
    """

    y: Array
    z: Array
    s: float
    proof: Proof
    converged: bool


def solve_master(
    problem: Problem,
    face: Face,
    cuts: Sequence[tuple[Cut, bool]],
    rows: Sequence[Row],
    best: Candidate,
    *,
    tolerance: float,
    keep: bool = False,
) -> MasterSolution | None:
    """Solve one finite program; None when the solver has no point to show.

    Args:
        cuts: each with whether it belongs to a side requirement, whose constants s multiplies.
        best: the best design so far, which sets the scales.
        keep: let any multiple of the best spectrum be added to the face, so that the program stays
            feasible where scaling up is no remedy.
    """
    k = problem.experiment.size
    ray = best.z[:, None] / problem.price.at(best.z) if keep else np.zeros((best.z.size, 0))
    columns = np.concatenate([face.columns, ray], axis=1)
    inside, number, entries = face.columns.shape[1], columns.shape[1], svec_length(k)
    congruence = _congruence(best.information, definite=problem.needs_definite)
    objective, worth = best.objective, problem.price.at(best.z)
    scaled = 1 if problem.scaled else 0
    transformed = [cut.transformed(congruence) for cut, _ in cuts]
    parts = [cut.blocks(k) for cut in transformed]
    widths = [blocks[0].auxiliary.shape[1] for blocks in parts]
    starts = np.concatenate([[0], np.cumsum(widths)]).astype(int) + number + entries + scaled
    total = number + entries + scaled + sum(widths)

    def turned(information: Array) -> Array:
        return svec(congruence @ information @ congruence.T)

    gains = turned(problem.information_map).T @ columns
    link = [-worth * gains, np.eye(entries)]
    if scaled:
        link.append(-best.s * turned(problem.scaled_information)[:, None])
    blocks = [
        Block("zero", _widened(sp.csc_matrix(np.hstack(link)), 0, total), -turned(problem.fixed_information)),
        Block(face.kind, sp.eye_array(inside, total, format="csc"), np.zeros(inside), face.order),
    ]
    if keep:
        blocks.append(Block("nonnegative", sp.eye_array(1, total, k=inside, format="csc"), np.zeros(1)))
    at_s = number + entries
    if scaled:
        blocks.append(Block("nonnegative", sp.eye_array(1, total, k=at_s, format="csc"), np.zeros(1)))
    if rows:
        blocks.append(_row_block(problem, columns, rows, best.s, worth, at_s, total))
    first = len(blocks)
    for (_, side), conic, start in zip(cuts, parts, starts, strict=False):
        for block in conic:
            pieces = [sp.csc_matrix((block.constant.size, number)), block.information]
            if scaled:
                column = best.s * block.constant[:, None] if side else np.zeros((block.constant.size, 1))
                pieces.append(sp.csc_matrix(column))
            head = sp.hstack(pieces, format="csc")
            matrix = _widened(head, 0, total) + _widened(block.auxiliary, int(start), total)
            offset = np.zeros(block.constant.size) if side else block.constant
            blocks.append(Block(block.kind, sp.csc_matrix(matrix), offset, block.order))
    q = np.zeros(total)
    if scaled:
        q[at_s] = 1.0
    else:
        q[:number] = problem.price.vector @ columns
    solution = solve_conic(q, blocks, tolerance=max(_SOLVER_MARGIN * tolerance, _SOLVER_FLOOR))
    if solution.status in ("infeasible", "unbounded") or not np.all(np.isfinite(solution.x)):
        return None
    y = worth * _in_cone(face, solution.x[:inside])
    kept = worth * np.maximum(solution.x[inside:number], 0.0)
    remaining = list(solution.multipliers[first:])
    proofs = []
    for cut, conic in zip(transformed, parts, strict=True):
        mine, remaining = remaining[: len(conic)], remaining[len(conic) :]
        Y, r = cut.proof(mine)
        proofs.append((objective * congruence.T @ Y @ congruence, objective * r))
    weights = np.zeros(0)
    if rows:
        scales = np.array([_level(problem, row, best.s) for row in rows])
        weights = objective * np.maximum(solution.multipliers[first - 1], 0.0) / scales
    return MasterSolution(
        y=y,
        z=face.columns @ y + ray @ kept,
        s=best.s * float(solution.x[at_s]) if scaled else 1.0,
        proof=Proof(tuple(proofs), weights),
        converged=solution.status != "failed",
    )


def _in_cone(face: Face, y: Array) -> Array:
    """The nearest y in the cone of the face: a solver leaves it by its tolerance."""
    if face.kind == "nonnegative":
        return np.maximum(y, 0.0)
    return svec(positive_part(smat(y)))


def _congruence(information: Array, *, definite: bool) -> Array:
    """K with K M K^T = I, or nearly so where M is close to singular."""
    eigenvalues, vectors = np.linalg.eigh(information)
    floor = (_SINGULAR if definite else _INDEFINITE) * eigenvalues[-1]
    return (vectors / np.sqrt(np.maximum(eigenvalues, floor))).T


def _level(problem: Problem, row: Row, s: float) -> float:
    return row.bound * problem.bound_factor(row.upper, s) or 1.0


def _row_block(
    problem: Problem, columns: Array, rows: Sequence[Row], s: float, worth: float, at_s: int, total: int
) -> Block:
    """Each limit over its level at the best design: 1 (or s over its best value) minus the used share."""
    matrix, offset = np.zeros((len(rows), total)), np.zeros(len(rows))
    number = columns.shape[1]
    for index, row in enumerate(rows):
        sign = 1.0 if row.upper else -1.0
        level = _level(problem, row, s)
        matrix[index, :number] = -sign * worth / level * (row.functional.vector @ columns)
        share = sign * row.bound * problem.bound_factor(row.upper, s) / level
        if problem.scaled and (row.upper or not problem.floors_fixed):
            matrix[index, at_s] = share
        else:
            offset[index] = share
    return Block("nonnegative", sp.csc_matrix(matrix), offset)


def _widened(matrix: sp.csc_matrix, start: int, total: int) -> sp.csc_matrix:
    rows, width = matrix.shape
    left, right = sp.csc_matrix((rows, start)), sp.csc_matrix((rows, total - start - width))
    return sp.hstack([left, matrix, right], format="csc")
