"""Lower bounds on the error of every Toeplitz shape in a box: a Kronecker lift with an exact dual point.

With P the Toeplitz matrix of a shape, P11 u = L1 and u = D w for a D that makes w of order one, the products
(1, w)(1, w)^T (x) P form a positive semidefinite matrix of Toeplitz blocks Y_ij, i, j = 0 .. m.
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
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.accuracy import positive_part
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.conic import Block, solve_conic
from inputdesign_cli.design.regression.toeplitz import ToeplitzProblem
from inputdesign_cli.spectrum import smat, svec, svec_layout

SMALLEST_EIGENVALUE = 1e-6
"""A lower bound on the eigenvalues of R11 / r_0 that is assumed for m >= 3 in boxes with singular R11."""

_TOLERANCE = 1e-9
_VANISHING = 1e-28  # the squared norm, by rounding, of a part of L1 that vanishes
_ROUNDING = 1e-12

Box = NDArray[np.float64]
"""The box lower <= rho_1 .. rho_{m-1} <= upper, (2, m - 1)."""


@dataclass(frozen=True)
class BoxLimits:
    """The bound |w|^2 <= limit, with u = D w, for all shapes of a box that matter (see `box_limits`).

    The limit keeps the relaxation bounded, and bounds the loss by residuals of its dual point.

    Attributes:
        least_v: no shape of the box has a smaller v; infinite if the box has none.
        assumed: whether the limit assumes that eigenvalues of R11 / r_0 exceed `SMALLEST_EIGENVALUE`.
    """

    D: Array
    limit: float
    least_v: float
    assumed: bool


def box_limits(problem: ToeplitzProblem, box: Box, largest_v: float) -> BoxLimits:
    """Return the limits in a box on shapes with v <= `largest_v`.

    P11 maps symmetric and skew vectors into themselves, so u falls into two parts, each with its own matrix.
    C is P11 at the centre of the box, r its change over the box, and D = sqrt(s) (C + r)^(-1/2) in each part.
    Then |w|^2 = u^T (C + r) u / s <= (v + 2 r |u|^2) / s, and also <= (largest eigenvalue) |u|^2 / s. s is
    chosen to make the limit of order one.
    """
    C = scipy.linalg.toeplitz(np.append(1.0, box.mean(axis=0)))
    change = scipy.linalg.toeplitz(np.append(0.0, 0.5 * (box[1] - box[0])))
    D, limit, least_v, assumed = np.zeros_like(C), 0.0, 0.0, False
    for basis in replace(problem, neglected=np.zeros(0)).halves:
        weight = float(np.sum((basis.T @ problem.estimated) ** 2))
        radius = float(np.linalg.eigvalsh(np.abs(basis).T @ change @ np.abs(basis))[-1])
        values, vectors = np.linalg.eigh(basis.T @ C @ basis)
        frame = basis @ vectors
        lowest = float(values[0]) - radius
        # |u|^2 is at most v / (smallest eigenvalue), and (v / |L1|)^2 where the part is one-dimensional.
        floor, single = largest_v / SMALLEST_EIGENVALUE, len(values) == 1
        bounds = [largest_v**2 / max(weight, _VANISHING) if single else floor]
        bounds += [weight / lowest**2, largest_v / lowest] if lowest > 0.0 else []
        square = min(bounds) if weight > _VANISHING else 0.0
        assumed |= not single and square == floor
        least_v += weight / max(float(values[-1]) + radius, 1e-300)
        if values[0] + np.abs(frame[:, 0]) @ change @ np.abs(frame[:, 0]) < 0.0:
            least_v = np.inf  # nowhere in the box P11 is positive semidefinite
        kept = np.maximum(values, 0.0) + radius + _ROUNDING
        v = min(largest_v, weight / lowest if lowest > 0.0 else np.inf)
        most = float(kept[-1]) * square
        s = max(min(v, most), 1e-8)
        D += np.sqrt(s) * (frame / np.sqrt(kept)) @ frame.T
        limit += min(v + 2.0 * (radius + max(0.0, -float(values[0])) + _ROUNDING) * square, most) / s
    return BoxLimits(D, max(limit, 1.0), least_v, assumed)


@dataclass(frozen=True)
class NodeBound:
    """Holds a lower `bound` on |b|^2 + kappa v over a box, and the start that its relaxation suggests.

    Attributes:
        rho: (n,) autocorrelations of the relaxed optimum, a good start.
        spread: (m - 1,) how far the products in the relaxation are from true products, by coordinate.
    """

    bound: float
    rho: Array
    spread: Array


@dataclass(frozen=True)
class Lift:
    """The relaxation of a problem; one object is used for all boxes and weights.

    Whatever is affine in the unknowns is an array whose first axis holds the constant, then the derivative
    with respect to each unknown: the Y_ij (but E[rho_0] = 1, the constant), then svec of B >= E[b b^T].
    """

    problem: ToeplitzProblem

    @property
    def biases(self) -> int:
        """Return the number of entries of b, which is 0 if bias does not count."""
        return self.problem.n - self.problem.m if self.problem.neglected_norm else 0

    @cached_property
    def _unknowns(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return Y_ij by lag (t, m + 1, m + 1, n), and B (t, biases, biases)."""
        n, size = self.problem.n, self.problem.m + 1
        first, second = np.triu_indices(size)
        rows, columns, scale = svec_layout(self.biases)
        t, own = np.arange(first.size * n), first.size * n + np.arange(rows.size)
        Y = np.zeros((t.size + own.size, size, size, n))
        B = np.zeros((t.size + own.size, self.biases, self.biases))
        i, j = first[t // n], second[t // n]
        Y[t, i, j, t % n] = Y[t, j, i, t % n] = 1.0
        B[own, rows, columns] = B[own, columns, rows] = 1.0 / scale
        return Y, B

    @cached_property
    def _products(self) -> tuple[Block, ...]:
        """Return the constraint Y >= 0 on the symmetric and on the skew vectors."""
        parts = [basis.T @ self.problem.lags @ basis for basis in self.problem.halves]
        lifted = [np.einsum("tijk,kab->tiajb", self._unknowns[0], lags) for lags in parts]
        return tuple(
            Block.of("psd", each.reshape(len(each), each.shape[1] * each.shape[2], -1)) for each in lifted
        )

    def bound(self, box: Box, kappa: float, allowed: BoxLimits) -> NodeBound:
        """Return a lower bound on |b|^2 + kappa v over the box; minus infinity without multipliers."""
        (Y, B), scale = self._unknowns, max(1.0, kappa)
        blocks, undecided = self._blocks(box, allowed), (np.zeros(0), box[1] - box[0])
        # The cost is |b|^2 + kappa L1^T D w over a scale.
        variance = Y[1:, 0, 1:, 0] @ (kappa * (self.problem.estimated @ allowed.D))
        q = (variance + np.trace(B[1:], axis1=1, axis2=2)) / scale
        answer = solve_conic(q, blocks, tolerance=_TOLERANCE)
        if not all(np.all(np.isfinite(z)) for z in answer.multipliers):
            return NodeBound(-np.inf, *undecided)
        # Whatever the status of the solver, the dual point is repaired and evaluated here.
        value = scale * self._repaired(q, blocks, answer.multipliers, allowed.limit, 1.0 / scale)
        if answer.status not in ("solved", "almost_solved"):
            return NodeBound(value, *undecided)
        mean = np.tensordot(np.append(1.0, answer.x), Y, axes=1)
        rho, w = mean[0, 0], mean[0, 1:, 0]
        inner = slice(1, self.problem.m)
        return NodeBound(value, rho, np.abs(mean[0, 1:, inner] - w[:, None] * rho[inner]).sum(axis=0))

    def _blocks(self, box: Box, allowed: BoxLimits) -> list[Block]:
        """Return the constraint blocks of the semidefinite program, in the order that `_repaired` expects."""
        Y, B = self._unknowns
        size, m = len(Y), self.problem.m
        # E[(1, w)_i (P u - L)] (t, m + 1, n), P u from m columns of P; its first rows vanish.
        excited = np.einsum(
            "tijk,kra,aj->tir", Y[:, :, 1:], self.problem.lags[..., :m], allowed.D, optimize=True
        )
        errors = excited - Y[:, :, 0, 0, None] * np.append(self.problem.estimated, self.problem.neglected)
        gram = np.zeros((size, m + 1 + self.biases, m + 1 + self.biases))
        gram[:, : m + 1, : m + 1], gram[:, m + 1 :, m + 1 :] = Y[..., 0], B
        gram[:, : m + 1, m + 1 :] = errors[:, :, m : m + self.biases]
        gram[:, m + 1 :, : m + 1] = gram[:, : m + 1, m + 1 :].swapaxes(1, 2)
        room = (np.arange(size) == 0) - np.einsum("tii->t", Y[:, 1:, 1:, 0]) / allowed.limit
        blocks = [
            *self._products,
            Block.of("psd", gram),
            Block.of("nonnegative", room[:, None]),
            Block.of("zero", errors[:, :, :m].reshape(size, -1)),
        ]
        for k, (lower, upper) in enumerate(box.T, 1):
            for sign, edge in ((1.0, lower), (-1.0, upper)):
                inside = Y[..., k] - edge * Y[..., 0]
                blocks.append(Block.of("psd", 2.0 * sign / (upper - lower) * inside))
        return blocks

    def _repaired(
        self, q: Array, blocks: Sequence[Block], multipliers: Sequence[Array], limit: float, weight: float
    ) -> float:
        """Return the value of a dual point made feasible from the solver's multipliers.

        q^T x >= residual^T x - sum offset_i^T z_i with the residual q - sum matrix_i^T z_i, whenever every
        z_i lies in its cone. Each is projected. The multiplier of the Gram matrix keeps exactly the `weight`
        of B, so that B has no residual. No E[(1, w)_i (1, w)_j rho_k] exceeds the limit on |w|^2, or its
        root, or one.
        """
        z, many = list(multipliers), len(self._products)
        z[many] = self._with_weight(z[many], weight)
        for i, block in enumerate(blocks):
            if block.kind == "nonnegative":
                z[i] = np.maximum(z[i], 0.0)
            elif block.kind == "psd" and i != many:
                z[i] = svec(positive_part(smat(z[i])))
        residual = q - sum(block.matrix.T @ own for block, own in zip(blocks, z, strict=True))
        size = np.append(1.0, np.full(self.problem.m, np.sqrt(limit)))
        most = np.max(np.outer(size, size)[..., None] * self._unknowns[0][1:], axis=(1, 2, 3))
        lost = float(np.abs(residual) @ most)
        return -lost - float(sum(block.offset @ own for block, own in zip(blocks, z, strict=True)))

    def _with_weight(self, z: Array, weight: float) -> Array:
        """Return the multiplier [[T, G], [G^T, weight I]] >= 0 of the Gram matrix nearest to z."""
        matrix, head = smat(z), self.problem.m + 1
        G = matrix[:head, head:]
        least = G @ G.T / weight
        matrix[:head, :head] = least + positive_part(matrix[:head, :head] - least)
        matrix[head:, head:] = weight * np.eye(self.biases)
        return svec(matrix)
