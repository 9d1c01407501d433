"""Calls the conic solver; only two reference methods call one elsewhere, through cvxpy.

minimise q^T x subject to offset_i + matrix_i x in cone_i for every block i.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import clarabel
import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.spectrum import svec

ConeKind = Literal["zero", "nonnegative", "psd", "exponential"]


@dataclass(frozen=True)
class Block:
    """The constraint that offset + matrix x lies in the cone.

    For "psd" the rows are svec of a matrix of this `order`; for "exponential" they are `order` triples
    (t, y, x) with y exp(t / y) <= x, y > 0.
    """

    kind: ConeKind
    matrix: sp.csc_matrix
    offset: Array
    order: int = 0

    @classmethod
    def of(cls, kind: ConeKind, parts: NDArray[np.float64]) -> Block:
        """Build the constraint that parts[0] + sum_i x_i parts[i + 1] lies in the cone.

        `parts` is (1 + n, d, d) for "psd", else (1 + n, rows).
        """
        rows = svec(parts) if kind == "psd" else parts
        return cls(kind, sp.csc_matrix(rows[1:].T), rows[0], parts.shape[1] if kind == "psd" else 0)


@dataclass(frozen=True)
class ConicSolution:
    """Holds the answer of the solver: a claim, to be judged by residuals that we compute ourselves.

    `multipliers` holds one array a block, with q = sum_i matrix_i^T multipliers_i at the optimum.
    """

    x: Array
    multipliers: tuple[Array, ...]
    status: Literal["solved", "almost_solved", "infeasible", "unbounded", "failed"]
    iterations: int


_MOST_ROWS = 20_000  # rows of semidefinite blocks: their factors are dense, 8 bytes for each pair of rows
_STATUS: dict[str, Literal["solved", "almost_solved", "infeasible", "unbounded", "failed"]] = {
    "Solved": "solved",
    "AlmostSolved": "almost_solved",
    "PrimalInfeasible": "infeasible",
    "AlmostPrimalInfeasible": "infeasible",
    "DualInfeasible": "unbounded",
    "AlmostDualInfeasible": "unbounded",
}


def solve_conic(
    q: Array, blocks: Sequence[Block], *, tolerance: float = 1e-9, max_iterations: int = 200
) -> ConicSolution:
    """Solve by the interior-point method of [goulart-chen-2024].

    Args:
        q: (n,) linear cost.
        tolerance: bound on the relative gap and the residuals, to be tighter than the design needs; the
            certificate decides on the design.

    Raises:
        InaccurateError: `out-of-time`.
        SpecError: `too-large` when the factors of the program would not fit into memory.
    """
    _check_fits(blocks)
    cones = []
    for block in blocks:
        if block.kind == "zero":
            cones.append(clarabel.ZeroConeT(block.offset.size))
        elif block.kind == "nonnegative":
            cones.append(clarabel.NonnegativeConeT(block.offset.size))
        elif block.kind == "exponential":
            cones += [clarabel.ExponentialConeT()] * block.order
        else:
            cones.append(clarabel.PSDTriangleConeT(block.order))
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_threads = 1  # these programs are small: threads cost more than they gain
    settings.max_iter = max_iterations
    settings.time_limit = seconds_left()
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
    n = q.size
    solver = clarabel.DefaultSolver(
        sp.csc_matrix((n, n)),
        q,
        sp.csc_matrix(-sp.vstack([b.matrix for b in blocks], format="csc")),
        np.concatenate([b.offset for b in blocks]),
        cones,
        settings,
    )
    answer = solver.solve()
    seconds_left()
    ends = np.cumsum([b.offset.size for b in blocks])[:-1]
    return ConicSolution(
        x=np.asarray(answer.x),
        multipliers=tuple(np.split(np.asarray(answer.z), ends)),
        status=_STATUS.get(str(answer.status), "failed"),
        iterations=int(answer.iterations),
    )


def _check_fits(blocks: Sequence[Block]) -> None:
    rows = sum(block.offset.size for block in blocks if block.kind == "psd")
    if rows > _MOST_ROWS:
        raise bad_spec(
            "too-large",
            f"matrix inequalities of {rows} entries do not fit into memory; at most {_MOST_ROWS} do",
            hint="lower the order of the spectrum, or the number of parameters",
            key="spectrum",
        )
