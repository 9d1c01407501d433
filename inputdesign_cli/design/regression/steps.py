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
from inputdesign_cli.design.regression.toeplitz import Autocorrelations, ToeplitzProblem, Weight

_TOLERANCE = 1e-10


@dataclass(frozen=True)
class Region:
    """The shapes rho = origin + span x: all with P >= 0, or (`lines`) all by powers x >= 0 with sum one."""

    origin: Array
    span: NDArray[np.float64]
    lines: bool = False

    @property
    def affine(self) -> NDArray[np.float64]:
        """Return origin and span side by side, (n, 1 + size)."""
        return np.column_stack([self.origin, self.span])


def all_shapes(problem: ToeplitzProblem) -> Region:
    """Return the set of every rho with P >= 0."""
    return _beginning_with(problem, np.ones(1))


def line_shapes(problem: ToeplitzProblem, frequencies: Array) -> Region:
    """Return the rho of nonnegative powers at `frequencies` (L,) (rad/sample) that add up to one."""
    return Region(np.zeros(problem.n), np.cos(np.arange(problem.n)[:, None] * frequencies), True)


def _beginning_with(problem: ToeplitzProblem, head: Array) -> Region:
    """Return the shapes whose first autocorrelations are `head`."""
    n, held = problem.n, head.size
    return Region(np.append(head, np.zeros(n - held)), np.eye(n)[:, held:])


def step(
    problem: ToeplitzProblem, region: Region, weight: Weight, at: Autocorrelations, radius: float
) -> tuple[Array, float] | None:
    """Return the best shape within `radius` of `at` (linearised bias, exact variance) and its model value.

    minimise |b + J (rho - rho_at)|^2 + kappa q subject to [[P11, L1], [L1^T, q]] >= 0.
    """
    J = problem.bias_jacobian(at.rho)
    near = region.affine[1:].copy()
    near[:, 0] -= at.rho[1:]
    bias = J @ near
    bias[:, 0] += at.bias
    return _solve(problem, region, weight, bias, np.concatenate([near, -near]), radius)


def extend(problem: ToeplitzProblem, weight: Weight, head: Array) -> Array | None:
    """Return the best rho that begins with `head` (m,): the bias is then linear and the variance fixed.

    This is the first half of the alternation of [eckhard-mse] (R11 fixed).
    """
    m = problem.m
    u = problem.weights(scipy.linalg.toeplitz(head))
    if u is None:
        return None
    region = _beginning_with(problem, head)
    bias = (problem.lags[:, m:, :m] @ u).T @ region.affine
    bias[:, 0] -= problem.second
    found = _solve(problem, region, weight, bias, varies=False)
    return None if found is None else found[0]


def rescale(problem: ToeplitzProblem, weight: Weight, at: Autocorrelations) -> Array | None:
    """Return the best rho with the same Z = R11^-1 R12 as `at`: the second half of the alternation.

    Z fixed makes R11 Z = R12 linear, n - m equations for each of the m rows. Where only the scale is then
    free, which no shape has, `at` itself is returned.
    """
    m = problem.m
    P = scipy.linalg.toeplitz(at.rho)
    Z = np.linalg.pinv(P[:m, :m], rcond=1e-12, hermitian=True) @ P[:m, m:]
    equations = (problem.lags[:, :m, :m] @ Z - problem.lags[:, :m, m:]).reshape(problem.n, -1).T
    freedom = scipy.linalg.null_space(equations[:, 1:], rcond=1e-10)
    if freedom.shape[1] == 0:
        return at.rho
    region = Region(at.rho, np.eye(problem.n)[:, 1:] @ freedom)
    bias = np.column_stack([at.bias, np.zeros((problem.n - m, freedom.shape[1]))])
    found = _solve(problem, region, weight, bias)
    return None if found is None else found[0]


def _solve(
    problem: ToeplitzProblem,
    region: Region,
    weight: Weight,
    bias: NDArray[np.float64],
    near: NDArray[np.float64] | None = None,
    radius: float = 0.0,
    *,
    varies: bool = True,
) -> tuple[Array, float] | None:
    """Minimise t + kappa q over (x, q, t), t >= |bias|^2, q at least the variance where that varies.

    Args:
        bias: (n - m, 1 + size), its value at x = 0 and its derivatives; `near` is limited to `radius`.

    Returns:
        rho and the value of the model; None when the solver found nothing.
    """
    affine, m, size = region.affine, problem.m, region.span.shape[1]
    known = slice(0, size + 1)  # the constant and x; then q and t

    def rows(number: int) -> NDArray[np.float64]:
        return np.zeros((size + 3, number))

    def matrices(order: int) -> NDArray[np.float64]:
        return np.zeros((size + 3, order, order))

    blocks: list[Block] = []
    if region.lines:
        positive, total = rows(size), rows(1)
        positive[1 : size + 1] = np.eye(size)
        total[: size + 1, 0] = np.append(-1.0, np.ones(size))
        blocks += [Block.of("nonnegative", positive), Block.of("zero", total)]
    for basis in () if region.lines else problem.halves:
        shapes = matrices(basis.shape[1])
        shapes[known] = np.einsum("kx,kab->xab", affine, basis.T @ problem.lags @ basis)
        blocks.append(Block.of("psd", shapes))
    if near is not None:
        inside = rows(len(near))
        inside[known] = -near.T
        inside[0] += radius
        blocks.append(Block.of("nonnegative", inside))
    variance = matrices(m + 1 if varies else 1)
    if varies:
        variance[known, :m, :m] = np.einsum("kx,kab->xab", affine, problem.lags[:, :m, :m])
        variance[0, :m, m] = variance[0, m, :m] = problem.first
    variance[size + 1, -1, -1] = 1.0
    count = len(bias) if weight.biased else 0
    error = matrices(count + 1)
    error[0, :count, :count] = np.eye(count)
    error[known, :count, count] = error[known, count, :count] = bias.T[:, :count]
    error[size + 2, count, count] = 1.0
    scale = max(1.0, weight.kappa)
    q = np.append(np.zeros(size), [weight.kappa / scale, 1.0 / scale])
    blocks += [Block.of("psd", variance), Block.of("psd", error)]
    answer = solve_conic(q, blocks, tolerance=_TOLERANCE)
    if answer.status not in ("solved", "almost_solved"):
        return None
    return affine @ np.append(1.0, answer.x[:size]), float(scale * (q @ answer.x))
