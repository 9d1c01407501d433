"""The program of the literature: one LMI per grid frequency, positivity by a Gram matrix or the KYP lemma.

[bombois-least-costly], (13) and (19) with footnote 2; the lemma: [rantzer-1996]. It guarantees nothing
between the grid frequencies; its multipliers still prove a lower bound for the problem at every frequency,
of which the grid is a relaxation. Whitened coordinates are kept: in raw parameters no solver survives a
resonant plant.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from inputdesign_cli.accuracy import ModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.design.convex.certificate import Certificate, certify
from inputdesign_cli.design.convex.master import Implied, Proof
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.spectrum import svec


@dataclass(frozen=True)
class GridResult:
    """Holds the optimum on the grid: spectrum `x` (m + 1,), its cost, and the bound from its multipliers."""

    x: Array
    cost: float
    certificate: Certificate


def solve_on_grid(
    problem: Problem,
    requirements: Sequence[ModelError],
    frequencies: Array,
    start: Array,
    *,
    positivity: Literal["gram", "kyp"] = "gram",
) -> GridResult:
    """Minimise the cost of a FIR spectrum of one input subject to the requirements at `frequencies` alone.

    Args:
        requirements: the problem's own, to first order.
        start: a spectrum of the right size (the white baseline), which scales the program.

    Raises:
        InaccurateError: `solver-failed` when cvxpy reports neither an optimum nor nearly one; `out-of-time`.
    """
    import cvxpy as cp

    basis = problem.basis
    unit_cost, power = problem.price.at(start), start[0]
    inverse = np.linalg.inv(np.linalg.cholesky(problem.information(start)))
    c = cp.Variable(basis.size)
    constraints = _positive(c, basis.degree, positivity)
    maps = inverse @ problem.information_map @ inverse.T
    offset = inverse @ problem.baseline_information @ inverse.T
    information = offset + sum(power * c[i] * _symmetric(maps[i]) for i in range(basis.size))
    cuts = [r.cut(float(w)).transformed(inverse) for r in requirements for w in frequencies]
    lmis = [information - _symmetric(cut.matrix) >> 0 for cut in cuts]
    program = cp.Problem(cp.Minimize((power / unit_cost) * problem.price.vector @ c), constraints + lmis)
    try:
        with warnings.catch_warnings():
            # An inaccurate solution shows in the gap between its cost and the bound that it proves.
            warnings.filterwarnings("ignore", message="Solution may be inaccurate")
            program.solve(solver=cp.CLARABEL, time_limit=seconds_left())
    except cp.SolverError as error:
        raise _failed(str(error)) from error
    seconds_left()
    if program.status not in ("optimal", "optimal_inaccurate") or c.value is None:
        raise _failed(f"its status is {program.status}")
    x = power * c.value
    proofs = []
    for cut, lmi in zip(cuts, lmis, strict=True):
        Y, r = cut.proof([svec(_symmetric(lmi.dual_value))])
        proofs.append(Implied(unit_cost * inverse.T @ Y @ inverse, unit_cost * r))
    return GridResult(x, problem.cost_at(x), certify(problem, Proof(tuple(proofs), np.zeros(0))))


def _positive(c, order: int, positivity: str) -> list:
    """Return the constraints for c_0 + 2 sum c_r cos(r w) >= 0 at all w."""
    import cvxpy as cp

    if order == 0:
        return [c >= 0]
    if positivity == "gram":
        gram = cp.Variable((order + 1, order + 1), PSD=True)
        return [cp.trace(gram) == c[0]] + [
            sum(gram[i, i + lag] for i in range(order + 1 - lag)) == c[lag] for lag in range(1, order + 1)
        ]
    # Phi / 2 is the real part of C (zI - A)^-1 B + c_0 / 2 with A the shift and B the first unit column.
    shift = np.eye(order, k=-1)
    first = np.eye(order, 1)
    Q = cp.Variable((order, order), symmetric=True)
    row = cp.reshape(c[1:], (1, order), order="C")
    corner = cp.reshape(c[0], (1, 1), order="C") - first.T @ Q @ first
    block = cp.bmat(
        [[Q - shift.T @ Q @ shift, row.T - shift.T @ Q @ first], [row - first.T @ Q @ shift, corner]]
    )
    return [0.5 * (block + block.T) >> 0]


def _symmetric(matrix: Array) -> Array:
    return 0.5 * (matrix + matrix.T)


def _failed(why: str) -> InaccurateError:
    return InaccurateError.because(
        "solver-failed",
        f"the solver found no answer to the grid program: {why}",
        hint="use solver: {method: exchange}, fewer grid frequencies, or a lower order",
        key="solver.method",
    )
