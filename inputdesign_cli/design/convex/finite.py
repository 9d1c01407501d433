"""The finite program in scaled numbers, and who solves it: Clarabel while it is small, else `interior`.

Clarabel takes each matrix inequality with all unknowns, and factors what comes of it anew in every iteration;
the dense method sums the inequalities first. Below a certain size the first is faster, and it is what the
second falls back on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from inputdesign_cli.accuracy import Cut
from inputdesign_cli.design.conic import Block, solve_conic
from inputdesign_cli.design.convex.cones import Atoms, Cone, Gram, Orthant
from inputdesign_cli.design.convex.cut_cones import Concave, Inequalities
from inputdesign_cli.design.convex.entries import Entries
from inputdesign_cli.design.convex.interior import follow_path
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spectrum import Face, svec, svec_length

# Entries of matrix inequalities from which on the dense method is the faster one.
_LARGE = 100
# Up to how many it is worth waiting for Clarabel where the dense method stays this far from its tolerance.
_MOST_WAITED_FOR, _STAYS = 5000, 1e3
_USEFUL = 1e-4  # a multiplier this near the optimum is worth another round


@dataclass(frozen=True)
class FiniteProgram:
    """minimise cost . v over v = (y on the face, multiples of kept spectra, s), (n,).

    svec(M) = `offset` + `gains` v; `signs` v >= 0 for the kept spectra and s; `limit_offset` + `limits` v
    >= 0; and M in the `cuts`, with constants times s in natural units (`unit` v[-1]) for `sides`.
    Without s, `unit` is None. `size` is k.
    """

    cost: Array
    face: Face
    gains: Array
    offset: Array
    signs: Array
    limits: Array
    limit_offset: Array
    cuts: Sequence[Cut]
    sides: Sequence[bool]
    unit: float | None
    size: int

    @property
    def work(self) -> int:
        """Entries of the matrix inequalities that cuts are made of."""
        orders = [self.size if cut.concave is None else 2 * self.size for cut in self.cuts]
        return sum(svec_length(order) for order in orders)


@dataclass(frozen=True)
class FiniteSolution:
    """v (n,), what the multiplier of each cut proves (see `Cut.proof`), and the weights of the limits."""

    v: Array
    proofs: list[tuple[Array, float]]
    limit_weights: Array
    converged: bool


def solve_program(program: FiniteProgram, *, tolerance: float) -> FiniteSolution | None:
    """Solve to about the tolerance; None when there is no point to show.

    Raises:
        InaccurateError: `out-of-time`.
    """
    if program.work > _LARGE:
        found, error = by_interior(program, tolerance=tolerance)
        if error <= _STAYS * tolerance or (np.isfinite(error) and program.work > _MOST_WAITED_FOR):
            return found
    return by_cones(program, tolerance=tolerance)


def by_cones(program: FiniteProgram, *, tolerance: float) -> FiniteSolution | None:
    """By a general conic solver, with M among the unknowns: without it two digits of the multipliers go."""
    k, entries, n = program.size, svec_length(program.size), program.cost.size
    inside, scaled = program.face.columns.shape[1], int(program.unit is not None)
    number = n - scaled
    parts = [cut.blocks(k) for cut in program.cuts]
    widths = [blocks[0].auxiliary.shape[1] for blocks in parts]
    starts = np.concatenate([[0], np.cumsum(widths)]).astype(int) + n + entries
    total = n + entries + sum(widths)

    def placed(matrix: Array) -> sp.csc_matrix:
        """Columns of v among all unknowns: (y, kept), svec(M), s, auxiliary ones."""
        wide = np.zeros((len(matrix), total))
        wide[:, :number] = matrix[:, :number]
        wide[:, number + entries : n + entries] = matrix[:, number:]
        return sp.csc_matrix(wide)

    link = placed(-program.gains) + _widened(sp.eye_array(entries, format="csc"), number, total)
    blocks = [
        Block("zero", sp.csc_matrix(link), -program.offset),
        Block(
            program.face.kind, sp.eye_array(inside, total, format="csc"), np.zeros(inside), program.face.order
        ),
    ]
    blocks += [Block("nonnegative", placed(row[None]), np.zeros(1)) for row in program.signs]
    if len(program.limits):
        blocks.append(Block("nonnegative", placed(program.limits), program.limit_offset))
    first = len(blocks)
    for side, conic, start in zip(program.sides, parts, starts, strict=False):
        for block in conic:
            pieces = [sp.csc_matrix((block.constant.size, number)), block.information]
            if program.unit is not None:
                column = (
                    program.unit * block.constant[:, None] if side else np.zeros((block.constant.size, 1))
                )
                pieces.append(sp.csc_matrix(column))
            head = sp.hstack(pieces, format="csc")
            matrix = _widened(head, 0, total) + _widened(block.auxiliary, int(start), total)
            offset = np.zeros(block.constant.size) if side else block.constant
            blocks.append(Block(block.kind, sp.csc_matrix(matrix), offset, block.order))
    q = np.zeros(total)
    q[:number] = program.cost[:number]
    q[number + entries : n + entries] = program.cost[number:]
    solution = solve_conic(q, blocks, tolerance=tolerance)
    if solution.status in ("infeasible", "unbounded") or not np.all(np.isfinite(solution.x)):
        return None
    remaining = list(solution.multipliers[first:])
    proofs = []
    for cut, conic in zip(program.cuts, parts, strict=True):
        mine, remaining = remaining[: len(conic)], remaining[len(conic) :]
        proofs.append(cut.proof(mine))
    return FiniteSolution(
        v=np.concatenate([solution.x[:number], solution.x[number + entries : n + entries]]),
        proofs=proofs,
        limit_weights=solution.multipliers[first - 1] if len(program.limits) else np.zeros(0),
        converged=solution.status != "failed",
    )


def by_interior(program: FiniteProgram, *, tolerance: float) -> tuple[FiniteSolution | None, float]:
    """By the dense interior-point method: its best iterate, None where it had none, and the error of that."""
    n, inside = program.cost.size, program.face.columns.shape[1]
    entries = _entries(program)
    offset, gains = program.offset[entries.kept], program.gains[entries.kept]
    if program.unit is not None:
        offset = np.append(offset, 0.0)
        gains = np.vstack([gains, program.unit * np.eye(n)[-1]])
    through, order = _cut_cones(program, entries)
    share = 1.0 / max(sum(cone.degree for cone in through), 1)
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
    reached = follow_path(program.cost, start, direct, through, (offset, gains), tolerance=tolerance)
    if not np.isfinite(reached.error):
        return None, np.inf
    cut_weights = [Z for block in reached.multipliers[len(direct) :] for Z in block]
    proofs: list[tuple[Array, float] | None] = [None] * len(program.cuts)
    for index, weight in zip(order, cut_weights, strict=True):
        proofs[index] = program.cuts[index].implied(weight)
    row_weights = reached.multipliers[1][0] if len(rows) else np.zeros(0)
    solution = FiniteSolution(
        v=reached.v,
        proofs=[proof for proof in proofs if proof is not None],
        limit_weights=row_weights[len(program.signs) :],
        converged=reached.error <= _USEFUL,
    )
    return solution, reached.error


def _entries(program: FiniteProgram) -> Entries:
    """Those of M that anything may change or ask for."""
    seen = np.abs(program.gains).max(axis=1) + np.abs(program.offset)
    kept = np.flatnonzero(seen > 1e-14 * seen.max())
    return Entries(program.size, kept, with_s=program.unit is not None)


def _cut_cones(program: FiniteProgram, entries: Entries) -> tuple[list[Cone], list[int]]:
    """The cuts gathered by their kind, and which cut each multiplier then belongs to."""
    cuts = list(zip(range(len(program.cuts)), program.cuts, program.sides, strict=True))
    found: list[Cone] = []
    order: list[int] = []
    matrix = [(i, cut.inequality, side) for i, cut, side in cuts if cut.inequality is not None]
    keys = [(len(part.constant), part.scale, part.form is None) for _, part, _ in matrix]
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


def _widened(matrix: sp.csc_matrix, start: int, total: int) -> sp.csc_matrix:
    rows, width = matrix.shape
    left, right = sp.csc_matrix((rows, start)), sp.csc_matrix((rows, total - start - width))
    return sp.hstack([left, matrix, right], format="csc")
