"""The loop around polynomial plants with several channels, as one polynomial equation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.loop import Loop, close_loop
from inputdesign_cli.plant.polynomial import evaluate, join_roots, roots_in_z, unit_circle
from inputdesign_cli.plant.polynomial_matrix import at, stack
from inputdesign_cli.plant.polynomial_model import PolynomialModel
from inputdesign_cli.plant.transfer import TransferMatrix

# Frequencies from which on it pays to leave out coefficients that vanish.
_MANY = 512


@dataclass(frozen=True)
class PolynomialLoop(Loop):
    """`Loop` with R_i = A_i prod_j F_ij and N = R G, so that R H = prod_j F_ij C_i / D_i.

    The roots of the determinant of the polynomial matrix on the left are all closed-loop poles (every 1/A_i
    is driven by its own noise e_i).
    """

    model: PolynomialModel

    @cached_property
    def _left(self) -> Array:
        """(p + r, p + r, l): the matrix of polynomials on the left."""
        return stack(self._rows)

    @cached_property
    def _rows(self) -> list[list[list[float]]]:
        m, C = self.model, self.controller
        p, r = m.outputs, m.inputs
        rows: list[list[list[float]]] = []
        for i, a in enumerate(m.per_output(m.A)):
            whole = np.convolve(a, self._others(i))
            left = [whole.tolist() if i == other else [0.0] for other in range(p)]
            rows.append(left + [(-np.convolve(m.B[i][j], self._others(i, j))).tolist() for j in range(r)])
        for j, q in enumerate(C.denominator):
            right = [q.tolist() if j == other else [0.0] for other in range(r)]
            rows.append([C.numerator[j, i].tolist() for i in range(p)] + right)
        return rows

    @cached_property
    def _longest(self) -> int:
        """Coefficients of the longest polynomial in the rows of the plant, as in others of its structure."""
        return max(len(entry) for row in self._rows[: self.model.outputs] for entry in row)

    def _others(self, output: int, left_out: int | None = None) -> Array:
        """The product of the F of an output, but for one input's."""
        product = np.ones(1)
        for j, f in enumerate(self.model.F[output]):
            product = np.convolve(product, f) if j != left_out else product
        return product

    @cached_property
    def closed_poles(self) -> ComplexArray:
        """Roots in z of the determinant, those at the origin included: eigenvalues of its companion form."""
        leading, later = self._left[..., 0], self._left[..., 1:]
        size, lags = leading.shape[0], later.shape[-1]
        if lags == 0:
            return np.zeros(0, dtype=complex)
        companion = np.eye(size * lags, k=-size)
        blocks = -np.linalg.solve(leading, later.reshape(size, -1)).reshape(size, size, lags)
        companion[:size] = blocks.transpose(0, 2, 1).reshape(size, -1)
        return np.asarray(np.linalg.eigvals(companion), dtype=complex)

    @property
    def predictor_poles(self) -> ComplexArray:
        """Poles in z of the filters that make the gradient of the prediction."""
        m = self.model
        return join_roots(roots_in_z(p) for p in [*m.C, *m.D, *(f for row in m.F for f in row)])

    @property
    def instantaneous(self) -> Array:
        """(p + r, p + r): what acts without delay."""
        return self._left[..., 0]

    def left_at(self, w: ArrayLike) -> ComplexArray:
        """(n, p + r, p + r): the matrix on the left of `Loop`."""
        q = unit_circle(w)
        return at(self._left, q) if q.size < _MANY else self._lefts(self._left[None], q)[0]

    @classmethod
    def lefts_at(cls, loops: Sequence[Self], w: ArrayLike) -> ComplexArray:
        """(S, n, p + r, p + r): see `Loop`; all at once where they are read off at the same frequencies."""
        if len({loop.nearest for loop in loops}) > 1:
            return super().lefts_at(loops, w)
        first, q = loops[0], unit_circle(loops[0].beside_zero(w))
        lefts = np.stack([loop._left for loop in loops])
        p = first.model.outputs
        controllers = lefts[:, p:]
        if not np.array_equal(controllers[:-1], controllers[1:]):
            return at(lefts, q)
        return first._lefts(lefts, q)

    def _lefts(self, lefts: Array, q: ComplexArray) -> ComplexArray:
        """Return the values (S, n, p + r, p + r) of the left matrices at `q`.

        The rows of the one controller are evaluated once, the rows of the plants up to their own length.

        Args:
            lefts: (S, p + r, p + r, l), of plants of one structure.
        """
        p = self.model.outputs
        value = np.empty((*lefts.shape[:3], q.size), dtype=complex)
        value[:, :p] = at(lefts[:, :p, :, : self._longest], q).transpose(0, 2, 3, 1)
        value[:, p:] = at(self._left[p:], q).transpose(1, 2, 0)
        return value.transpose(0, 3, 1, 2)

    def noise_at(self, w: ArrayLike) -> ComplexArray:
        """R H (n, p, p)."""
        return self._noises([self], w)[0]

    @classmethod
    def noises_at(cls, loops: Sequence[Self], w: ArrayLike) -> ComplexArray:
        """(S, n, p, p): see `Loop`; all at once where they are read off at the same frequencies."""
        if len({loop.nearest for loop in loops}) > 1:
            return super().noises_at(loops, w)
        return cls._noises(loops, loops[0].beside_zero(w))

    @staticmethod
    def _noises(loops: Sequence[PolynomialLoop], w: ArrayLike) -> ComplexArray:
        q, p = unit_circle(w), loops[0].model.outputs
        models = [loop.model for loop in loops]
        found = np.zeros((len(loops), q.size, p, p), dtype=complex)
        for i in range(p):
            others = evaluate(np.array([loop._others(i) for loop in loops]), q)
            above = evaluate(np.array([m.per_output(m.C)[i] for m in models]), q)
            below = evaluate(np.array([m.per_output(m.D)[i] for m in models]), q)
            found[:, :, i, i] = others * above / below
        return found

    def signals(self, r: Array, e: Array) -> tuple[Array, Array]:
        """y (.., n, p) and u (.., n, r) for samples of r and e, from rest."""
        m, samples = self.model, r.shape[-2]
        right = np.empty((*r.shape[:-1], m.outputs + m.inputs))
        for i, (c, d) in enumerate(zip(m.per_output(m.C), m.per_output(m.D), strict=True)):
            right[..., i] = filtered(np.convolve(self._others(i), c), d, e[..., i])
        for j, q in enumerate(self.controller.denominator):
            right[..., m.outputs + j] = filtered(q, [1.0], r[..., j])
        if right.shape[-1] == 2:
            return self._single(right[..., :1], right[..., 1:])
        inverse = np.linalg.inv(self._left[..., 0])
        back = [(inverse @ self._left[..., lag]).T for lag in range(1, self._left.shape[-1])]
        found = right @ inverse.T
        for t in range(1, samples):
            for lag, block in enumerate(back[:t], start=1):
                found[..., t, :] -= found[..., t - lag, :] @ block
        return found[..., : m.outputs], found[..., m.outputs :]

    def _single(self, top: Array, bottom: Array) -> tuple[Array, Array]:
        """y and u of one input and one output by Cramer's rule: filters in place of a pass over time.

        Args:
            top, bottom: the right-hand side, (.., n, 1) each.
        """
        ((R, minus_N), (P, Q)) = self._left
        determinant = np.convolve(R, Q) - np.convolve(minus_N, P)

        def solved(a: Array, x: Array, b: Array, z: Array) -> Array:
            above = filtered(a, [1.0], x, axis=-2) - filtered(b, [1.0], z, axis=-2)
            return np.asarray(filtered([1.0], determinant, above, axis=-2))

        return solved(Q, top, minus_N, bottom), solved(R, bottom, P, top)


@close_loop.register
def _(model: PolynomialModel, controller: TransferMatrix) -> PolynomialLoop:
    return PolynomialLoop(model, controller)
