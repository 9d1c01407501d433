"""Small convex programs over Toeplitz shapes: one step of sequential convex programming, and extensions.

The unknown rho_1 .. rho_{n-1} ranges over all shapes (P >= 0) or over the shapes of a periodic signal
(nonnegative powers on the lines of a grid).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
import scipy.sparse as sp
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.conic import Block, solve_conic
from inputdesign_cli.design.regression.toeplitz import Autocorrelations, ToeplitzProblem, Weight
from inputdesign_cli.spectrum import svec

_TOLERANCE = 1e-10


@dataclass(frozen=True)
class Region:
    """The shapes rho = origin + span @ x, with `blocks` that keep x where rho is a shape."""

    origin: Array
    span: NDArray[np.float64]
    blocks: tuple[Block, ...]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.span.shape[1]


def all_shapes(problem: ToeplitzProblem) -> Region:
    """Every rho with P >= 0, one cone for the symmetric and one for the skew vectors."""
    n = problem.n
    blocks = []
    for basis in problem.halves:
        parts = svec(basis.T @ problem.lags @ basis)
        blocks.append(Block("psd", sp.csc_matrix(parts[1:].T), parts[0], basis.shape[1]))
    span = np.vstack([np.zeros((1, n - 1)), np.eye(n - 1)])
    return Region(np.eye(n)[0], span, tuple(blocks))


def line_shapes(problem: ToeplitzProblem, frequencies: Array) -> Region:
    """The rho of nonnegative powers at `frequencies` (L,) (rad/sample) that add up to one."""
    span = np.cos(np.arange(problem.n)[:, None] * frequencies[None, :])
    count = frequencies.size
    positive = Block("nonnegative", sp.identity(count, format="csc"), np.zeros(count))
    total = Block("zero", sp.csc_matrix(np.ones((1, count))), np.array([-1.0]))
    return Region(np.zeros(problem.n), span, (positive, total))


def step(
    problem: ToeplitzProblem, region: Region, weight: Weight, at: Autocorrelations, radius: float
) -> tuple[Array, float] | None:
    """The best shape within `radius` of `at` for linearised bias and exact variance, and its model value.

    minimise |b + J (rho - rho_at)|^2 + kappa q subject to [[P11, L1], [L1^T, q]] >= 0.
    """
    J = problem.bias_jacobian(at.rho)
    extra = [_near(region, at.rho, radius), _variance_block(problem, region)]
    origin = at.bias + J @ (region.origin - at.rho)[1:]
    return _solve(problem, region, weight, extra, J @ region.span[1:], origin)


def extend(problem: ToeplitzProblem, weight: Weight, head: Array) -> Array | None:
    """The best rho that begins with `head` (m,): the bias is then linear and the variance fixed.

    This is the first half of the alternation of [eckhard-mse] (R11 fixed).
    """
    m = problem.m
    u = problem.weights(scipy.linalg.toeplitz(head))
    if u is None:
        return None
    slope = (problem.lags[:, m:, :m] @ u).T  # (n - m, n): b = slope @ rho - L2
    region = _beginning_with(problem, head)
    still = _nonnegative(region.size, region.size + 2)
    origin = slope @ region.origin - problem.second
    found = _solve(problem, region, weight, [still], slope @ region.span, origin)
    return None if found is None else found[0]


def rescale(problem: ToeplitzProblem, weight: Weight, at: Autocorrelations) -> Array | None:
    """The best rho with the same Z = R11^-1 R12 as `at`: the second half of the alternation.

    Z fixed makes R11 Z = R12 linear, n - m equations for each of the m rows. Where they leave no
    freedom but the scale, which no shape has, `at` itself is returned.
    """
    m = problem.m
    P = scipy.linalg.toeplitz(at.rho)
    Z = np.linalg.pinv(P[:m, :m], rcond=1e-12, hermitian=True) @ P[:m, m:]
    equations = (problem.lags[:, :m, :m] @ Z - problem.lags[:, :m, m:]).reshape(problem.n, -1).T
    freedom = scipy.linalg.null_space(equations[:, 1:], rcond=1e-10)
    if freedom.shape[1] == 0:
        return at.rho
    every = all_shapes(problem)
    blocks = tuple(
        Block(b.kind, b.matrix @ freedom, b.offset + b.matrix @ at.rho[1:], b.order) for b in every.blocks
    )
    region = Region(at.rho, every.span @ freedom, blocks)
    found = _solve(
        problem,
        region,
        weight,
        [_variance_block(problem, region)],
        np.zeros((problem.n - m, region.size)),
        at.bias,
    )
    return None if found is None else found[0]


def _beginning_with(problem: ToeplitzProblem, head: Array) -> Region:
    """The shapes whose first autocorrelations are `head` (m,)."""
    every, held = all_shapes(problem), head.size - 1
    blocks = tuple(
        Block(b.kind, b.matrix[:, held:], b.offset + b.matrix[:, :held] @ head[1:], b.order)
        for b in every.blocks
    )
    return Region(every.origin + every.span[:, :held] @ head[1:], every.span[:, held:], blocks)


def _solve(
    problem: ToeplitzProblem,
    region: Region,
    weight: Weight,
    extra: list[Block],
    bias_span: NDArray[np.float64],
    bias_origin: Array,
) -> tuple[Array, float] | None:
    """minimise t + kappa q over (x, q, t), t >= |bias|^2; `extra` bounds q from below.

    rho and the value of the model; None when the solver found nothing.
    """
    size = region.size
    q = np.zeros(size + 2)
    scale = max(1.0, weight.kappa)
    q[size:] = weight.kappa / scale, 1.0 / scale
    blocks = [_widen(block, size + 2) for block in (*region.blocks, *extra)]
    if weight.biased and bias_origin.size:
        blocks.append(_bias_block(bias_span, bias_origin, size))
    else:
        blocks.append(_nonnegative(size + 1, size + 2))
    answer = solve_conic(q, blocks, tolerance=_TOLERANCE)
    if answer.status not in ("solved", "almost_solved"):
        return None
    return region.origin + region.span @ answer.x[:size], float(scale * (q @ answer.x))


def _nonnegative(index: int, size: int) -> Block:
    return Block("nonnegative", sp.csc_matrix(([1.0], ([0], [index])), shape=(1, size)), np.zeros(1))


def _variance_block(problem: ToeplitzProblem, region: Region) -> Block:
    """[[P11, L1], [L1^T, q]] >= 0 over (x, q)."""
    m = problem.m
    stack = np.zeros((problem.n, m + 1, m + 1))
    stack[:, :m, :m] = problem.lags[:, :m, :m]
    rows = svec(stack)
    offset = np.zeros((m + 1, m + 1))
    offset[:m, m] = offset[m, :m] = problem.first
    corner = np.zeros((m + 1, m + 1))
    corner[m, m] = 1.0
    matrix = np.column_stack([rows.T @ region.span, svec(corner)])
    return Block("psd", sp.csc_matrix(matrix), svec(offset) + rows.T @ region.origin, m + 1)


def _bias_block(span: NDArray[np.float64], origin: Array, size: int) -> Block:
    """[[I, b], [b^T, t]] >= 0 over (x, q, t)."""
    count = origin.size
    parts = np.zeros((size + 2, count + 1, count + 1))
    parts[:size, :count, count] = parts[:size, count, :count] = span.T
    parts[size + 1, count, count] = 1.0
    offset = np.eye(count + 1)
    offset[count, count] = 0.0
    offset[:count, count] = offset[count, :count] = origin
    return Block("psd", sp.csc_matrix(svec(parts).T), svec(offset), count + 1)


def _near(region: Region, centre: Array, radius: float) -> Block:
    """|rho_k - centre_k| <= radius for every k."""
    span, offset = region.span[1:], (region.origin - centre)[1:]
    return Block(
        "nonnegative", sp.csc_matrix(np.vstack([span, -span])), radius + np.concatenate([offset, -offset])
    )


def _widen(block: Block, size: int) -> Block:
    rows, columns = block.matrix.shape
    if columns == size:
        return block
    return Block(
        block.kind,
        sp.hstack([block.matrix, sp.csc_matrix((rows, size - columns))], format="csc"),
        block.offset,
        block.order,
    )
