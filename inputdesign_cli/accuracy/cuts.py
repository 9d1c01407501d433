"""Requirements as a solver handles them: cones, and the linear inequalities that they prove.

Every cone here holds for M whenever it holds for a smaller M, and has the form h * constant + linear
map of (M, auxiliary unknowns), with h = 1 for a plain requirement. A design that scales M by an
unknown h scales the constants with it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np
import scipy.sparse as sp

from inputdesign_cli.arrays import Array
from inputdesign_cli.spectrum import smat, svec, svec_layout, svec_length

CutKind = Literal["nonnegative", "psd", "exponential"]


@dataclass(frozen=True)
class CutBlock:
    """The constraint h * constant + information svec(M) + auxiliary z in a cone, see `design.conic.Block`."""

    kind: CutKind
    order: int
    constant: Array
    information: sp.csc_matrix
    auxiliary: sp.csc_matrix


@dataclass(frozen=True)
class Inequality:
    """The constraint h * `constant` + `scale` * M + nu * `form` >= 0 (psd), M filling the leading (k, k).

    The matrices are (d, d) with d >= k; nu >= 0 is an unknown of its own, where there is a `form`.
    """

    constant: Array
    scale: float = 1.0
    form: Array | None = None


@dataclass(frozen=True)
class ConcaveFunction:
    """The constraint g(M) >= h, g concave for M > 0 (k, k) and of degree one: g(t M) = t g(M).

    `at` maps (M, M^-1) to g(M) and its gradient G (k, k). The second derivative along D is `curvature`
    (tr(G D)^2 / g - tr(M^-1 D G D)).
    """

    curvature: float
    at: Callable[[Array, Array], tuple[float, Array]]


class Cut(Protocol):
    """A convex set of information matrices (k, k) that contains every admissible one.

    `frequency`, in the unit of the experiment, is where the requirement needs it; None if it has none.
    """

    @property
    def frequency(self) -> float | None:
        """Return the frequency, in the unit of the experiment, at which the cut is needed, if it has one."""

    def transformed(self, congruence: Array) -> Cut:
        """Return the same set for K M K^T, K = `congruence` (k, k) nonsingular."""

    def blocks(self, size: int) -> list[CutBlock]:
        """Return the cones of the cut, all with the same number of auxiliary unknowns; `size` is k."""

    @property
    def inequality(self) -> Inequality | None:
        """Return the set as one matrix inequality, unless it is a concave function."""

    @property
    def concave(self) -> ConcaveFunction | None:
        """Return the set by a concave function, unless it is a matrix inequality."""

    def proof(self, multipliers: Sequence[Array]) -> tuple[Array, float]:
        """Return (Y, r) with Y >= 0 (k, k) and tr(Y M) >= h r for every M of the set.

        Args:
            multipliers: one array a block, suggestions of a solver; the inequality holds for any.
        """

    def implied(self, weight: Array) -> tuple[Array, float]:
        """Return (Y, r) from one matrix: a multiplier of `inequality`, or of `concave` times its gradient."""


def positive_part(matrix: Array) -> Array:
    """Return the nearest positive semidefinite matrix."""
    eigenvalues, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    kept = eigenvalues > 0
    return (vectors[:, kept] * eigenvalues[kept]) @ vectors[:, kept].T


@dataclass(frozen=True)
class MatrixCut:
    """The cut M >= `matrix` (k, k)."""

    matrix: Array
    frequency: float | None = None

    concave = None

    def transformed(self, congruence: Array) -> MatrixCut:
        """Return the same set for K M K^T, see `Cut`."""
        return replace(self, matrix=congruence @ self.matrix @ congruence.T)

    def blocks(self, size: int) -> list[CutBlock]:
        """Return M - `matrix` positive semidefinite as a cone."""
        rows = svec_length(size)
        return [
            CutBlock(
                "psd", size, -svec(self.matrix), sp.eye_array(rows, format="csc"), sp.csc_matrix((rows, 0))
            )
        ]

    @property
    def inequality(self) -> Inequality:
        """Return M - `matrix` >= 0 as an inequality."""
        return Inequality(-self.matrix)

    def proof(self, multipliers: Sequence[Array]) -> tuple[Array, float]:
        """See `implied`."""
        return self.implied(smat(multipliers[0]))

    def implied(self, weight: Array) -> tuple[Array, float]:
        """Return the implied inequality tr(Y M) >= tr(Y matrix)."""
        Y = positive_part(weight)
        return Y, float(np.sum(Y * self.matrix))


@dataclass(frozen=True)
class VarianceCut:
    """The cut tr(V^T M^-1 V) <= 1, V = `directions` (k, q): a sum of variances.

    By a Schur complement ([boyd-vandenberghe-2004], A.5.5) it is [[M, V], [V^T, Z]] >= 0 with tr Z <= 1. The
    inequality is the one of Cauchy and Schwarz, tr(Y M) tr(V^T M^-1 V) >= |Y^{1/2} V|_*^2 with the nuclear
    norm.
    """

    directions: Array
    frequency: float | None = None

    inequality = None

    def transformed(self, congruence: Array) -> VarianceCut:
        """Return the same set for K M K^T, see `Cut`."""
        return replace(self, directions=congruence @ self.directions)

    def blocks(self, size: int) -> list[CutBlock]:
        """Return the Schur complement, and the trace of Z, which is the unknown."""
        q = self.directions.shape[1]
        order, aux = size + q, svec_length(q)
        corner = np.zeros((order, order))
        corner[:size, size:] = self.directions
        corner[size:, :size] = self.directions.T
        rows, columns, _ = svec_layout(order)
        in_corner = np.flatnonzero((rows >= size) & (columns >= size))
        unknown = sp.csc_matrix((np.ones(aux), (in_corner, np.arange(aux))), (rows.size, aux))
        information = sp.eye_array(rows.size, svec_length(size), format="csc")
        trace = sp.csc_matrix(-svec(np.eye(q))[None, :])
        return [
            CutBlock("psd", order, svec(corner), information, unknown),
            CutBlock("nonnegative", 1, np.ones(1), sp.csc_matrix((1, svec_length(size))), trace),
        ]

    @property
    def concave(self) -> ConcaveFunction:
        """Return the concave function 1 / tr(V^T M^-1 V)."""

        def at(information: Array, inverse: Array) -> tuple[float, Array]:
            half = inverse @ self.directions
            value = 1.0 / float(np.sum(half * self.directions))
            return value, value**2 * (half @ half.T)

        return ConcaveFunction(2.0, at)

    def proof(self, multipliers: Sequence[Array]) -> tuple[Array, float]:
        """See `implied`."""
        size = self.directions.shape[0]
        return self.implied(smat(multipliers[0])[:size, :size])

    def implied(self, weight: Array) -> tuple[Array, float]:
        """Return the implied inequality tr(Y M) >= |Y^{1/2} V|_*^2."""
        Y = positive_part(weight)
        return Y, float(np.linalg.svd(_root(Y) @ self.directions, compute_uv=False).sum() ** 2)


@dataclass(frozen=True)
class DeterminantCut:
    """The cut (det M)^{1/k} >= `level`.

    M >= T diag(T)^-1 T^T with T lower triangular, so that log det M >= sum of log diag(T). Exponential cones
    bound each term from below. The inequality is the one of the arithmetic and geometric means, tr(Y M) >= k
    (det Y)^{1/k} (det M)^{1/k}.
    """

    level: float = 1.0
    frequency: float | None = None

    inequality = None

    def transformed(self, congruence: Array) -> DeterminantCut:
        """Return the same set for K M K^T, see `Cut`."""
        _, logarithm = np.linalg.slogdet(congruence)
        return replace(self, level=self.level * float(np.exp(2.0 * logarithm / len(congruence))))

    def blocks(self, size: int) -> list[CutBlock]:
        """Return the factorisation, the logarithms of diag(T), and their sum."""
        triangle, entries = svec_length(size), []
        rows, columns, scale = svec_layout(2 * size)
        # Entry (j, i) of T stands at (i, size + j) of the block [[M, T], [T^T, diag T]], j >= i.
        number = {(int(i), int(j)): n for n, (i, j) in enumerate(zip(*np.triu_indices(size), strict=True))}
        for at, (r, c, weight) in enumerate(zip(rows.tolist(), columns.tolist(), scale, strict=True)):
            if r < size <= c and r <= c - size:
                entries.append((at, number[(r, c - size)], weight))
            elif r == c >= size:
                entries.append((at, number[(r - size, r - size)], 1.0))
        at_rows, of, weights = (np.array(part) for part in zip(*entries, strict=True))
        aux = triangle + size  # T, then the logarithms
        unknown = sp.csc_matrix((weights, (at_rows, of)), (rows.size, aux))
        diagonal = [number[(i, i)] for i in range(size)]
        each = np.arange(size)
        logarithms = sp.csc_matrix(
            (np.ones(2 * size), (np.r_[3 * each, 3 * each + 2], np.r_[triangle + each, diagonal])),
            (3 * size, aux),
        )
        total = sp.csc_matrix((np.ones(size), (np.zeros(size, dtype=int), triangle + each)), (1, aux))
        none = sp.csc_matrix((3 * size, triangle))
        return [
            CutBlock(
                "psd", 2 * size, np.zeros(rows.size), sp.eye_array(rows.size, triangle, format="csc"), unknown
            ),
            CutBlock("exponential", size, np.tile([0.0, 1.0, 0.0], size), none, logarithms),
            CutBlock(
                "nonnegative", 1, np.array([-size * np.log(self.level)]), sp.csc_matrix((1, triangle)), total
            ),
        ]

    @property
    def concave(self) -> ConcaveFunction:
        """Return (det M)^{1/k} / level."""

        def at(information: Array, inverse: Array) -> tuple[float, Array]:
            size = len(information)
            value = float(np.exp(np.linalg.slogdet(information)[1] / size)) / self.level
            return value, value / size * inverse

        return ConcaveFunction(1.0, at)

    def proof(self, multipliers: Sequence[Array]) -> tuple[Array, float]:
        """See `implied`."""
        block = smat(multipliers[0])
        size = len(block) // 2
        return self.implied(block[:size, :size])

    def implied(self, weight: Array) -> tuple[Array, float]:
        """Return the implied inequality tr(Y M) >= k (det Y)^{1/k} level."""
        Y, size = positive_part(weight), len(weight)
        sign, logarithm = np.linalg.slogdet(Y)
        mean = float(np.exp(logarithm / size)) if sign > 0 else 0.0
        return Y, size * mean * self.level


@dataclass(frozen=True)
class TraceCut:
    """The cut tr(W M) >= 1, W = `weight` (k, k) positive semidefinite."""

    weight: Array
    frequency: float | None = None

    inequality = None

    def transformed(self, congruence: Array) -> TraceCut:
        """Return the same set for K M K^T, see `Cut`."""
        inverse = np.linalg.inv(congruence)
        return replace(self, weight=inverse.T @ self.weight @ inverse)

    def blocks(self, size: int) -> list[CutBlock]:
        """Return the linear inequality itself."""
        row = sp.csc_matrix(svec(self.weight)[None, :])
        return [CutBlock("nonnegative", 1, -np.ones(1), row, sp.csc_matrix((1, 0)))]

    def proof(self, multipliers: Sequence[Array]) -> tuple[Array, float]:
        """Return the inequality tr(W M) >= 1, times its multiplier."""
        y = max(float(multipliers[0][0]), 0.0)
        return y * self.weight, y

    @property
    def concave(self) -> ConcaveFunction:
        """Return the concave function tr(W M), which is linear."""
        return ConcaveFunction(
            0.0, lambda information, inverse: (float(np.sum(self.weight * information)), self.weight)
        )

    def implied(self, weight: Array) -> tuple[Array, float]:
        """Return the multiple of W that is nearest to the suggestion."""
        return self.proof([np.array([np.sum(weight * self.weight) / np.sum(self.weight**2)])])


def _root(matrix: Array) -> Array:
    eigenvalues, vectors = np.linalg.eigh(matrix)
    return np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * vectors.T


@dataclass(frozen=True)
class EllipsoidCut:
    """The cut x^T Q x <= 0 for all x = (d, 1) with d^T M d <= alpha^2, Q = `form` (k + 1, k + 1).

    By the S-procedure this holds exactly when [[M / alpha^2, 0], [0, -1]] >= nu Q for some nu >= 0
    ([polik-terlaky-2007]; the ellipsoid has an interior point, so nothing is lost). With a multiplier
    Z >= 0 of tr(Z Q) >= 0, tr(Z_11 M) / alpha^2 >= Z_22.
    """

    form: Array
    alpha: float
    frequency: float | None = None

    concave = None

    def transformed(self, congruence: Array) -> EllipsoidCut:
        """Return the same set for K M K^T, see `Cut`."""
        corner = np.eye(len(self.form))
        corner[:-1, :-1] = congruence
        return replace(self, form=corner @ self.form @ corner.T)

    def blocks(self, size: int) -> list[CutBlock]:
        """Return the matrix inequality of the S-procedure, and nu, which is the unknown."""
        order, entries = size + 1, svec_length(size)
        corner = np.zeros((order, order))
        corner[-1, -1] = -1.0
        information = sp.eye_array(svec_length(order), entries, format="csc") / self.alpha**2
        unknown = sp.csc_matrix(-svec(self.form)[:, None])
        return [
            CutBlock("psd", order, svec(corner), information, unknown),
            CutBlock("nonnegative", 1, np.zeros(1), sp.csc_matrix((1, entries)), sp.csc_matrix(np.eye(1))),
        ]

    @property
    def inequality(self) -> Inequality:
        """Return the matrix inequality of the S-procedure."""
        corner = np.zeros_like(self.form)
        corner[-1, -1] = -1.0
        return Inequality(corner, 1.0 / self.alpha**2, -self.form)

    def proof(self, multipliers: Sequence[Array]) -> tuple[Array, float]:
        """See `implied`."""
        return self.implied(smat(multipliers[0]))

    def implied(self, weight: Array) -> tuple[Array, float]:
        """Return the implied tr(Z_11 M) / alpha^2 >= Z_22 for any Z >= 0 (k + 1, k + 1) with tr(Z Q) >= 0.

        Weigh the matrix inequality with Z: tr(Z_11 M) / alpha^2 - Z_22 >= nu tr(Z Q) >= 0 for any nu. The
        solver's Z is made positive semidefinite first, and rounding may make tr(Z Q) slightly negative. Two
        changes of Z correct that and keep it positive semidefinite: to shrink its last row and column, or to
        add to Z_11 the direction in which Q_11 is largest. The first proves more, where it is possible.
        """
        Z = positive_part(weight)
        missing = -float(np.sum(Z * self.form))
        if missing > 0.0:
            shorter = _shortened(Z, self.form)
            if shorter is not None:
                return shorter[:-1, :-1] / self.alpha**2, float(shorter[-1, -1])
            values, vectors = np.linalg.eigh(self.form[:-1, :-1])
            if values[-1] <= 0.0:
                return np.zeros_like(self.form[:-1, :-1]), 0.0
            Z[:-1, :-1] += missing / values[-1] * np.outer(vectors[:, -1], vectors[:, -1])
        return Z[:-1, :-1] / self.alpha**2, float(Z[-1, -1])


def _shortened(Z: Array, form: Array) -> Array | None:
    """Return Z with its last row and column times the largest c < 1 for which tr(Z Q) >= 0; or None.

    Q is `form`.
    """
    square = Z[-1, -1] * form[-1, -1]
    linear = 2.0 * float(Z[:-1, -1] @ form[:-1, -1])
    constant = float(np.sum(Z[:-1, :-1] * form[:-1, :-1]))
    roots = np.roots([square, linear, constant])
    inside = roots.real[(np.abs(roots.imag) == 0.0) & (roots.real > 0.5) & (roots.real < 1.0)]
    if inside.size == 0:
        return None
    corner = np.ones(len(Z))
    corner[-1] = inside.max() * (1.0 - 1e-15)
    return Z * np.outer(corner, corner)
