"""The finite program in scaled numbers. Clarabel solves small ones, `interior` large ones.

Clarabel takes each matrix inequality with all unknowns, and factors the linear system in every iteration. The
dense method sums the inequalities first. Below a certain size Clarabel is faster, and it takes over where the
dense method fails.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from inputdesign_cli.accuracy import Cut
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.conic import Block, solve_conic
from inputdesign_cli.design.convex.cones import Atoms, Cone, Entries, Gram, Orthant
from inputdesign_cli.design.convex.cut_cones import Concave, Inequalities
from inputdesign_cli.design.convex.interior import Seen, follow_path
from inputdesign_cli.spectrum import Face, svec, svec_length

# Entries of matrix inequalities from which on the dense method is the faster one.
_LARGE = 100
# Entries up to which Clarabel takes over, if the error of the dense method is this multiple of its tolerance.
_MOST_WAITED_FOR, _STAYS = 5000, 1e3
_USEFUL = 1e-4  # the error up to which multipliers are worth another round


@dataclass(frozen=True)
class MatrixPart:
    """One information matrix: svec(M) = `offset` + `gains` v, M in the `cuts`.

    The constants of the cuts are multiplied by s, in natural units, for `sides`.
    """

    gains: Array
    offset: Array
    cuts: Sequence[Cut]
    sides: Sequence[bool]


@dataclass(frozen=True)
class FiniteProgram:
    """The program minimise cost . v over v = (y on the face, multiples of kept spectra, s), (n,).

    `matrices` are the information matrices with their cuts, one for each scenario. The constraints are
    `signs` v >= 0 (kept spectra and s are not negative) and `limit_offset` + `limits` v >= 0. In natural
    units s is `unit` v[-1]; without s, `unit` is None. `size` is k.
    """

    cost: Array
    face: Face
    matrices: Sequence[MatrixPart]
    signs: Array
    limits: Array
    limit_offset: Array
    unit: float | None
    size: int

    @property
    def work(self) -> int:
        """Return the number of entries of the matrix inequalities that make up the cuts."""
        cuts = [cut for part in self.matrices for cut in part.cuts]
        orders = np.array([self.size if cut.concave is None else 2 * self.size for cut in cuts], dtype=int)
        return int(np.sum(orders * (orders + 1) // 2))


@dataclass(frozen=True)
class FiniteSolution:
    """Holds v (n,), the weights of the limits, and the proof of each cut (see `Cut.proof`), by matrix.

    `converged` is false if the solver failed to reach a useful accuracy.
    """

    v: Array
    proofs: list[list[tuple[Array, float]]]
    limit_weights: Array
    converged: bool


def solve_program(
    program: FiniteProgram, *, tolerance: float, rough: float, dense: bool = False
) -> FiniteSolution | None:
    """Solve to about the tolerance, a large program to the `rough` one; None when there is no point to show.

    Args:
        dense: take a small program for a large one.

    Raises:
        InaccurateError: `out-of-time`.
    """
    if dense or program.work > _LARGE:
        found, error = by_interior(program, tolerance=rough)
        if error <= _STAYS * rough or (np.isfinite(error) and program.work > _MOST_WAITED_FOR):
            return found
    return by_cones(program, tolerance=tolerance)


def by_cones(program: FiniteProgram, *, tolerance: float) -> FiniteSolution | None:
    """Solve by a general conic solver, with M among the unknowns: else the multipliers lose two digits."""
    k, entries, n = program.size, svec_length(program.size), program.cost.size
    inside, scaled = program.face.columns.shape[1], int(program.unit is not None)
    number = n - scaled
    # The unknowns: (y, kept), svec(M) of each matrix, s, auxiliary ones of the cuts.
    s_at = number + entries * len(program.matrices)
    parts = [[cut.blocks(k) for cut in matrix.cuts] for matrix in program.matrices]
    total = s_at + scaled + sum(blocks[0].auxiliary.shape[1] for part in parts for blocks in part)

    def placed(matrix: Array) -> sp.csc_matrix:
        """Place columns of v among all unknowns."""
        wide = np.zeros((len(matrix), total))
        wide[:, :number] = matrix[:, :number]
        wide[:, s_at : s_at + scaled] = matrix[:, number:]
        return sp.csc_matrix(wide)

    blocks = []
    for index, matrix in enumerate(program.matrices):
        wide = np.zeros((entries, total))
        wide[:, :number], wide[:, s_at : s_at + scaled] = -matrix.gains[:, :number], -matrix.gains[:, number:]
        wide[:, number + index * entries :][:, :entries] = np.eye(entries)
        blocks.append(Block("zero", sp.csc_matrix(wide), -matrix.offset))
    face = program.face
    blocks.append(Block(face.kind, sp.eye_array(inside, total, format="csc"), np.zeros(inside), face.order))
    blocks += [Block("nonnegative", placed(row[None]), np.zeros(1)) for row in program.signs]
    if len(program.limits):
        blocks.append(Block("nonnegative", placed(program.limits), program.limit_offset))
    first, start = len(blocks), s_at + scaled
    for index, (matrix, part) in enumerate(zip(program.matrices, parts, strict=True)):
        for side, conic in zip(matrix.sides, part, strict=True):
            for block in conic:
                pieces = [(number + index * entries, block.information)]
                if program.unit is not None and side:
                    pieces.append((s_at, sp.csc_matrix(program.unit * block.constant[:, None])))
                pieces.append((start, block.auxiliary))
                offset = np.zeros(block.constant.size) if side else block.constant
                blocks.append(Block(block.kind, _among(total, pieces), offset, block.order))
            start += conic[0].auxiliary.shape[1]
    q = np.zeros(total)
    q[:number] = program.cost[:number]
    q[s_at : s_at + scaled] = program.cost[number:]
    solution = solve_conic(q, blocks, tolerance=tolerance)
    if solution.status in ("infeasible", "unbounded") or not np.all(np.isfinite(solution.x)):
        return None
    remaining = iter(solution.multipliers[first:])
    proofs = [
        [cut.proof([next(remaining) for _ in conic]) for cut, conic in zip(matrix.cuts, part, strict=True)]
        for matrix, part in zip(program.matrices, parts, strict=True)
    ]
    return FiniteSolution(
        v=np.concatenate([solution.x[:number], solution.x[s_at : s_at + scaled]]),
        proofs=proofs,
        limit_weights=solution.multipliers[first - 1] if len(program.limits) else np.zeros(0),
        converged=solution.status != "failed",
    )


def by_interior(program: FiniteProgram, *, tolerance: float) -> tuple[FiniteSolution | None, float]:
    """Solve by the dense interior-point method; return its best iterate and the error of that iterate.

    The iterate is None if the method has none.
    """
    n, inside = program.cost.size, program.face.columns.shape[1]
    parts = [_seen(program, matrix) for matrix in program.matrices]
    share = 1.0 / max(sum(cone.degree for seen, _ in parts for cone in seen.cones), 1)
    direct: list[Cone] = []
    start = np.zeros(n)
    if program.face.kind == "psd":
        direct.append(Gram(program.face.order, 1.0 / program.face.order, 1.0))
        start[:inside] = svec(np.eye(program.face.order)) / program.face.order
    else:
        direct.append(Atoms(np.full(inside, 1.0 / inside), np.ones(inside)))
        start[:inside] = 1.0 / inside
    start[inside:] = 1.0
    rows = np.concatenate([program.signs, program.limits])
    if len(rows):
        levels = np.concatenate([np.zeros(len(program.signs)), program.limit_offset])
        slack = np.maximum(levels + rows @ start, 1.0)
        direct.append(Orthant(rows, levels, slack, share * np.ones(len(rows))))
    reached = follow_path(program.cost, start, direct, [seen for seen, _ in parts], tolerance=tolerance)
    if not np.isfinite(reached.error):
        return None, np.inf
    weights = iter(reached.multipliers[len(direct) :])
    proofs = []
    for matrix, (seen, order) in zip(program.matrices, parts, strict=True):
        own = [Z for _ in seen.cones for Z in next(weights)]
        by_cut = dict(zip(order, own, strict=True))
        proofs.append([cut.implied(by_cut[i]) for i, cut in enumerate(matrix.cuts)])
    row_weights = reached.multipliers[1][0] if len(rows) else np.zeros(0)
    solution = FiniteSolution(
        v=reached.v,
        proofs=proofs,
        limit_weights=row_weights[len(program.signs) :],
        converged=reached.error <= _USEFUL,
    )
    return solution, reached.error


def _seen(program: FiniteProgram, matrix: MatrixPart) -> tuple[Seen, list[int]]:
    """Return the cones of one matrix, as functions of its entries, and the cut of each multiplier.

    The entries are the ones of M that may differ from zero, and s.
    """
    seen = np.abs(matrix.gains).max(axis=1) + np.abs(matrix.offset)
    kept = np.flatnonzero(seen > 1e-14 * seen.max())
    entries = Entries(program.size, kept, with_s=program.unit is not None)
    offset, gains = matrix.offset[kept], matrix.gains[kept]
    if program.unit is not None:
        offset = np.append(offset, 0.0)
        gains = np.vstack([gains, program.unit * np.eye(program.cost.size)[-1]])
    cones, order = _cut_cones(matrix, entries)
    return Seen(cones, offset, gains), order


def _cut_cones(part: MatrixPart, entries: Entries) -> tuple[list[Cone], list[int]]:
    """Return the cones of the cuts, gathered by kind, and the cut that each multiplier belongs to."""
    cuts = list(zip(range(len(part.cuts)), part.cuts, part.sides, strict=True))
    found: list[Cone] = []
    order: list[int] = []
    matrix = [(i, cut.inequality, side) for i, cut, side in cuts if cut.inequality is not None]
    keys = [(len(one.constant), one.scale, one.form is None) for _, one, _ in matrix]
    for key in dict.fromkeys(keys):
        mine = [item for item, own in zip(matrix, keys, strict=True) if own == key]
        share = 1.0 / (len(mine) * key[0])
        found.append(Inequalities([p for _, p, _ in mine], [s for *_, s in mine], entries, 1.0, share))
        order += [i for i, *_ in mine]
    smooth = [(i, cut.concave, side) for i, cut, side in cuts if cut.concave is not None]
    if smooth:
        found.append(
            Concave([f for _, f, _ in smooth], [s for *_, s in smooth], entries, 1.0, 1.0 / len(smooth))
        )
        order += [i for i, *_ in smooth]
    return found, order


def _among(total: int, pieces: Sequence[tuple[int, sp.csc_matrix]]) -> sp.csc_matrix:
    """Stack sparse matrices of as many rows, each at its first column (ascending), among `total` columns."""
    counts = np.zeros(total + 1, dtype=np.int32)
    for start, piece in pieces:
        counts[start + 1 : start + 1 + piece.shape[1]] = np.diff(piece.indptr)
    data, indices = (
        np.concatenate(part) for part in zip(*((p.data, p.indices) for _, p in pieces), strict=True)
    )
    return sp.csc_matrix((data, indices, np.cumsum(counts)), shape=(pieces[0][1].shape[0], total))
