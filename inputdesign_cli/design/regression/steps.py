"""Small convex programs over Toeplitz shapes: one step of sequential convex programming, and extensions.

The unknown rho_1 .. rho_{n-1} ranges over all shapes (P >= 0) or over the shapes of a periodic signal
(nonnegative powers on the lines of a grid).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.conic import Block, solve_conic
from inputdesign_cli.design.regression.toeplitz import Shape, ToeplitzProblem

_TOLERANCE = 1e-10


@dataclass(frozen=True)
class Region:
    """The shapes rho = affine (1, x): all with P >= 0, or (`lines`) all by powers x >= 0 with sum one."""

    affine: NDArray[np.float64]
    lines: bool = False

    @classmethod
    def beginning_with(cls, head: Array, n: int) -> Region:
        """Return the shapes (n,) with P >= 0 whose first autocorrelations are `head`."""
        return cls(np.column_stack([np.append(head, np.zeros(n - head.size)), np.eye(n)[:, head.size :]]))

    @classmethod
    def of_lines(cls, frequencies: Array, n: int) -> Region:
        """Return the shapes (n,) of nonnegative powers at `frequencies` (L,) (rad/sample), one in sum."""
        return cls(np.column_stack([np.zeros(n), np.cos(np.arange(n)[:, None] * frequencies)]), lines=True)


def step(
    problem: ToeplitzProblem, region: Region, kappa: float, at: Shape, radius: float
) -> tuple[Array, float] | None:
    """Return the best shape within `radius` of `at` (linearised bias, exact variance) and its model value.

    minimise |b + J (rho - rho_at)|^2 + kappa q subject to [[P11, L1], [L1^T, q]] >= 0.
    """
    near = region.affine[1:].copy()
    near[:, 0] -= at.rho[1:]
    bias = problem.bias_jacobian(at.rho) @ near
    bias[:, 0] += at.bias
    return _solve(problem, region, kappa, bias, np.concatenate([near, -near]), radius)


def extend(problem: ToeplitzProblem, head: Array) -> Shape | None:
    """Return the least biased shape that begins with `head` (m,): the bias is linear, the variance fixed."""
    m = problem.m
    u = problem.weights(scipy.linalg.toeplitz(head))
    if u is None:
        return None
    region = Region.beginning_with(head, problem.n)
    bias = (problem.lags[:, m:, :m] @ u).T @ region.affine
    bias[:, 0] -= problem.neglected
    found = _solve(problem, region, 1.0, problem.neglected_norm * bias)
    return None if found is None else problem.evaluate(found[0])


def _solve(
    problem: ToeplitzProblem,
    region: Region,
    kappa: float,
    bias: NDArray[np.float64],
    near: NDArray[np.float64] | None = None,
    radius: float = 0.0,
) -> tuple[Array, float] | None:
    """Minimise t + kappa q over (x, q, t), t >= |bias|^2, q at least the variance near a shape, or else zero.

    Args:
        bias: (n - m, 1 + size), its value at x = 0 and its derivatives; `near` is limited to `radius`.

    Returns:
        rho and the value of the model; None when the solver found nothing.
    """
    affine, m, count = region.affine, problem.m, len(bias)
    size = affine.shape[1] - 1
    known = slice(0, size + 1)  # the constant and x; then q and t

    def matrices(*order: int) -> NDArray[np.float64]:
        return np.zeros((size + 3, *order))

    blocks: list[Block] = []
    if region.lines:
        positive, total = matrices(size), matrices(1)
        positive[1 : size + 1] = np.eye(size)
        total[known, 0] = np.append(-1.0, np.ones(size))
        blocks += [Block.of("nonnegative", positive), Block.of("zero", total)]
    for basis in () if region.lines else problem.halves:
        shapes = matrices(basis.shape[1], basis.shape[1])
        shapes[known] = np.einsum("kx,kab->xab", affine, basis.T @ problem.lags @ basis)
        blocks.append(Block.of("psd", shapes))
    variance = matrices(1, 1)
    if near is not None:
        inside = matrices(len(near))
        inside[known] = -near.T
        inside[0] += radius
        blocks.append(Block.of("nonnegative", inside))
        variance = matrices(m + 1, m + 1)
        variance[known, :m, :m] = np.einsum("kx,kab->xab", affine, problem.lags[:, :m, :m])
        variance[0, :m, m] = variance[0, m, :m] = problem.estimated
    variance[size + 1, -1, -1] = 1.0
    error = matrices(count + 1, count + 1)
    error[0, :count, :count] = np.eye(count)
    error[known, :count, count] = error[known, count, :count] = bias.T
    error[size + 2, count, count] = 1.0
    scale = max(1.0, kappa)
    q = np.append(np.zeros(size), [kappa / scale, 1.0 / scale])
    blocks += [Block.of("psd", variance), Block.of("psd", error)]
    answer = solve_conic(q, blocks, tolerance=_TOLERANCE)
    if answer.status not in ("solved", "almost_solved"):
        return None
    return affine @ np.append(1.0, answer.x[:size]), float(scale * (q @ answer.x))
