"""Lower bounds on the error of every Toeplitz shape in a box: a Kronecker lift with an exact dual point.

With P the Toeplitz matrix of a shape, P11 u = L1 and u = c + D w for some c and D that make w of order one,
the products (1, w)(1, w)^T (x) P form a positive semidefinite matrix of Toeplitz blocks Y_ij, i, j = 0 .. m.
Its mean over any distribution of shapes satisfies

    E[P11 u] = L1,   E[w_i P11 u] = L1 E[w_i],

and v = L1^T u, the bias b = P21 u - L2 and its products with w are linear in it. Two more conditions make it
tight: E[(1, w, b)(1, w, b)^T] >= 0, whose last block bounds E|b|^2 (with E[b] alone in its place the gap
would shrink only linearly with the box), and in a box for rho_1 .. rho_{m-1}
E[(rho_k - lower_k)(1, w)(1, w)^T] >= 0, and the like from above. As the box shrinks to a point the lift
becomes exact; for m = 1 it is exact at once. Lifts of this kind are due to [lasserre-2001].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from inputdesign_cli.accuracy import positive_part
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.conic import Block, solve_conic
from inputdesign_cli.design.regression.toeplitz import ToeplitzProblem
from inputdesign_cli.spectrum import smat, svec, svec_length
from inputdesign_cli.spectrum.svec import svec_layout

_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Box:
    """lower <= rho_1 .. rho_{m-1} <= upper, both (m - 1,)."""

    lower: Array
    upper: Array

    @property
    def centre(self) -> Array:
        """(m - 1,)."""
        return 0.5 * (self.lower + self.upper)

    def halves(self, coordinate: int, at: float) -> tuple[Box, Box]:
        """The box cut in two across a coordinate."""
        upper, lower = self.upper.copy(), self.lower.copy()
        upper[coordinate] = lower[coordinate] = at
        return Box(self.lower, upper), Box(lower, self.upper)


@dataclass(frozen=True)
class Scaling:
    """u = centre + D w with |w|^2 <= limit for all shapes of a box that matter (see `limits.scaling`).

    The limit keeps the relaxation bounded and pays for the last digits of its dual point.
    """

    centre: Array
    D: Array
    limit: float


@dataclass(frozen=True)
class NodeBound:
    """`bound` on |b|^2 + kappa v over the shapes of a box, and what its relaxation suggests.

    Attributes:
        rho: (n,) autocorrelations of the relaxed optimum, a good start.
        spread: (m - 1,) how far the products in the relaxation are from true products, by coordinate.
    """

    bound: float
    rho: Array
    spread: Array


@dataclass(frozen=True)
class Lift:
    """The relaxation of a problem; one object serves all boxes and weights."""

    problem: ToeplitzProblem

    @cached_property
    def pairs(self) -> list[tuple[int, int]]:
        """Blocks (i, j), i <= j; (0, 0) first."""
        m = self.problem.m
        return [(i, j) for i in range(m + 1) for j in range(i, m + 1)]

    def index(self, i: int, j: int, lag: int) -> int:
        """Position of E[(1, w)_i (1, w)_j rho_lag] among the unknowns; -1 for the constant E[rho_0] = 1."""
        return self._places[i, j] * self.problem.n + abs(lag) - 1

    @cached_property
    def _places(self) -> dict[tuple[int, int], int]:
        return {pair: k for k, (i, j) in enumerate(self.pairs) for pair in ((i, j), (j, i))}

    @property
    def products_size(self) -> int:
        """Number of unknown products."""
        return len(self.pairs) * self.problem.n - 1

    @property
    def biases(self) -> int:
        """Return the number of entries of b, which is 0 if bias does not count."""
        return self.problem.n - self.problem.m if self.problem.biased else 0

    @property
    def size(self) -> int:
        """Number of unknowns: the products, then svec of B >= E[b b^T]."""
        return self.products_size + svec_length(self.biases)

    @cached_property
    def products(self) -> tuple[Block, ...]:
        """Y >= 0 on the symmetric and on the skew vectors."""
        blocks = []
        m = self.problem.m
        for basis in self.problem.halves:
            lags = basis.T @ self.problem.lags @ basis
            order = (m + 1) * basis.shape[1]
            columns = []
            for i, j in self.pairs:
                place = np.zeros((m + 1, m + 1))
                place[i, j] = place[j, i] = 1.0
                columns += [svec(np.kron(place, lag)) for lag in lags]
            matrix = np.zeros((columns[0].size, self.size))
            matrix[:, : self.products_size] = np.column_stack(columns[1:])
            blocks.append(Block("psd", sp.csc_matrix(matrix), columns[0], order))
        return tuple(blocks)

    def _equations(self, affine: Array) -> Block:
        """P11 u = L1, as it stands and times each w_i; `affine` (m, m + 1) is [c, D]."""
        m, first = self.problem.m, self.problem.first
        matrix = np.zeros(((m + 1) * m, self.size))
        offset = np.zeros((m + 1) * m)
        offset[:m] = -first
        for i in range(m + 1):
            for line in range(m):
                row = i * m + line
                for a in range(m):
                    for j in range(m + 1):
                        index = self.index(i, j, line - a)
                        if index < 0:
                            offset[row] += affine[a, j]
                        else:
                            matrix[row, index] += affine[a, j]
                if i:
                    matrix[row, self.index(0, i, 0)] -= first[line]
        return Block("zero", sp.csc_matrix(matrix), offset)

    def _gram(self, affine: Array) -> Block:
        """E[(1, w, b)(1, w, b)^T] >= 0 with B in the place of E[b b^T]."""
        m, count = self.problem.m, self.biases
        order = m + 1 + count
        parts = np.zeros((self.size, order, order))
        constant = np.zeros((order, order))
        constant[0, 0] = 1.0
        for i, j in self.pairs:
            if (i, j) != (0, 0):
                index = self.index(i, j, 0)
                parts[index, i, j] = parts[index, j, i] = 1.0
        for i in range(m + 1):
            for row in range(count):
                place = m + 1 + row
                for a in range(m):
                    for j in range(m + 1):
                        parts[self.index(i, j, m + row - a), i, place] += affine[a, j]
                if i:
                    parts[self.index(0, i, 0), i, place] -= self.problem.second[row]
        parts[:, m + 1 :, : m + 1] = parts[:, : m + 1, m + 1 :].transpose(0, 2, 1)
        constant[0, m + 1 :] = constant[m + 1 :, 0] = -self.problem.second[:count]
        rows, columns, scale = svec_layout(count) if count else (np.zeros(0, dtype=int),) * 3
        own = np.arange(self.products_size, self.size)
        parts[own, m + 1 + rows, m + 1 + columns] = 1.0 / scale
        parts[own, m + 1 + columns, m + 1 + rows] = 1.0 / scale
        return Block("psd", sp.csc_matrix(svec(parts).T), svec(constant), order)

    @cached_property
    def moments(self) -> list[tuple[NDArray[np.float64], Array]]:
        """(svec rows, offset) of E[rho_k (1, w)(1, w)^T] for k = 0 .. m - 1."""
        m = self.problem.m
        found = []
        for lag in range(m):
            parts = np.zeros((self.size, m + 1, m + 1))
            for i, j in self.pairs:
                index = self.index(i, j, lag)
                if index >= 0:
                    parts[index, i, j] = parts[index, j, i] = 1.0
            offset = np.zeros((m + 1, m + 1))
            if lag == 0:
                offset[0, 0] = 1.0
            found.append((svec(parts).T, svec(offset)))
        return found

    def bound(self, box: Box, kappa: float, scaling: Scaling) -> NodeBound | None:
        """A lower bound on |b|^2 + kappa v over the box; None when the solver gave nothing to build on."""
        first = self.problem.first
        blocks = self.blocks(box, scaling)
        q, scale = self.cost(kappa, scaling)
        answer = solve_conic(q, blocks, tolerance=_TOLERANCE)
        if not all(np.all(np.isfinite(z)) for z in answer.multipliers):
            return None
        # Whatever the solver says of its answer: the dual point is repaired, and its value is ours.
        value = scale * self._repaired(q, blocks, answer.multipliers, scaling.limit, 1.0 / scale)
        value += kappa * float(first @ scaling.centre)
        if answer.status not in ("solved", "almost_solved"):
            return NodeBound(value, np.zeros(0), box.upper - box.lower)
        rho = np.concatenate([[1.0], answer.x[: self.problem.n - 1]])
        return NodeBound(value, rho, self._spread(answer.x))

    def cost(self, kappa: float, scaling: Scaling) -> tuple[Array, float]:
        """|b|^2 + kappa L1^T D w, divided by the second value returned."""
        q = np.zeros(self.size)
        scale = max(1.0, kappa)
        for i, weight in enumerate(self.problem.first @ scaling.D):
            q[self.index(0, i + 1, 0)] = kappa * weight / scale
        q[self.products_size :] = svec(np.eye(self.biases)) / scale
        return q, scale

    def blocks(self, box: Box, scaling: Scaling) -> list[Block]:
        """The products come first, then the Gram matrix and the limit: `_repaired` goes by their places."""
        order = self.problem.m + 1
        affine = np.column_stack([scaling.centre, scaling.D])
        row = np.zeros((1, self.size))
        for i in range(1, order):
            row[0, self.index(i, i, 0)] = -1.0 / scaling.limit
        bounded = Block("nonnegative", sp.csc_matrix(row), np.ones(1))
        blocks = [*self.products, self._gram(affine), bounded, self._equations(affine)]
        one, one_offset = self.moments[0]
        for k, (lower, upper) in enumerate(zip(box.lower, box.upper, strict=True), 1):
            matrix, offset = self.moments[k]
            for sign, edge in ((1.0, lower), (-1.0, upper)):
                unit = 2.0 * sign / (upper - lower)
                rows = sp.csc_matrix(unit * (matrix - edge * one))
                blocks.append(Block("psd", rows, unit * (offset - edge * one_offset), order))
        return blocks

    def _repaired(
        self, q: Array, blocks: Sequence[Block], multipliers: Sequence[Array], limit: float, weight: float
    ) -> float:
        """The value of a dual point made feasible from the solver's multipliers.

        q^T x >= - sum offset_i^T z_i whenever q = sum matrix_i^T z_i and every z_i lies in its cone. The
        cones come first: each z_i is projected, that of the Gram matrix with exactly the `weight` of
        B. What then misses in the equation is paid by the multiplier of Y, whose Toeplitz blocks are
        orthogonal to one another; where that pushes it out of its cone a multiple of the identity
        lifts it back, which the limit on |w|^2 pays for.
        """
        z = list(multipliers)
        many = len(self.products)
        z[many] = self._with_weight(z[many], weight)
        z[many + 1] = np.maximum(z[many + 1], 0.0)
        for i in range(many + 3, len(blocks)):
            z[i] = svec(positive_part(smat(z[i])))
        missing = q.copy()
        for block, multiplier in zip(blocks, z, strict=True):
            missing -= block.matrix.T @ multiplier
        missing[self.products_size :] = 0.0
        share = missing / self._norms
        for i in range(many):
            z[i] = z[i] + self.products[i].matrix @ share
        lowest = min(float(np.linalg.eigvalsh(smat(z[i]))[0]) for i in range(many))
        if lowest < 0.0:
            for i in range(many):
                z[i] = z[i] - lowest * svec(np.eye(blocks[i].order))
            z[many + 1] = z[many + 1] - lowest * self.problem.n * limit
        return -float(sum(b.offset @ zi for b, zi in zip(blocks, z, strict=True)))

    @cached_property
    def _norms(self) -> Array:
        """Squared norm of the place that each unknown takes in Y."""
        total = np.zeros(self.size)
        for block in self.products:
            total += np.asarray(block.matrix.multiply(block.matrix).sum(axis=0)).ravel()
        total[self.products_size :] = 1.0
        return total

    def _with_weight(self, z: Array, weight: float) -> Array:
        """A multiplier [[T, G], [G^T, weight I]] >= 0 of the Gram matrix, as near as can be to z."""
        matrix, head = smat(z), self.problem.m + 1
        G = matrix[:head, head:]
        least = G @ G.T / weight
        matrix[:head, :head] = least + positive_part(matrix[:head, :head] - least)
        matrix[head:, head:] = weight * np.eye(self.biases)
        return svec(matrix)

    def _spread(self, x: Array) -> Array:
        m = self.problem.m
        spread = np.zeros(m - 1)
        for k in range(1, m):
            rho = x[self.index(0, 0, k)]
            for j in range(1, m + 1):
                product = x[self.index(0, j, k)]
                spread[k - 1] += abs(product - rho * x[self.index(0, j, 0)])
        return spread
