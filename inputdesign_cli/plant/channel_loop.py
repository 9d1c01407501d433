"""The loop around a plant with several channels: u = r - C y, C a matrix of transfer functions in q^-1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.signal
from numpy.typing import ArrayLike

from inputdesign_cli.errors import bad_spec
from inputdesign_cli.plant.channels import PolynomialChannels
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.loop import LoopResponse, refuse_unstable
from inputdesign_cli.plant.polynomial import (
    Array,
    ComplexArray,
    evaluate,
    join_roots,
    roots_in_z,
    unit_circle,
)
from inputdesign_cli.plant.polynomial_matrix import at, stack

_WELL_POSED = 1e-9


@dataclass(frozen=True)
class MatrixController:
    """C = Q^-1 P: `numerator` P (inputs, outputs, l), `denominator` the polynomials of a diagonal Q.

    A denominator that several entries of a row share is kept once, so that its poles are not counted twice:
    with integral action on every output each input has one integrator.
    """

    numerator: Array
    denominator: tuple[Array, ...]

    @classmethod
    def build(
        cls, numerator: Sequence[Sequence[Sequence[float]]], denominator: Sequence[Sequence[Sequence[float]]]
    ) -> MatrixController:
        """From entries, rows are inputs of the plant and columns its outputs; zero entries have no poles."""
        rows, below = [], []
        for tops, bottoms in zip(numerator, denominator, strict=True):
            pairs = list(zip(tops, bottoms, strict=True))
            distinct = list(dict.fromkeys(tuple(bottom) for top, bottom in pairs if np.any(top)))
            row = []
            for top, bottom in pairs:
                product = np.asarray(top, dtype=float)
                for factor in distinct if np.any(top) else []:
                    if factor != tuple(bottom):
                        product = np.convolve(product, factor)
                row.append(product.tolist())
            common = np.ones(1)
            for factor in distinct:
                common = np.convolve(common, factor)
            rows.append(row)
            below.append(common)
        return cls(stack(rows), tuple(below))

    @property
    def poles(self) -> ComplexArray:
        """Poles in z."""
        return join_roots(roots_in_z(q) for q in self.denominator)

    def at(self, w: ArrayLike) -> ComplexArray:
        """C (n, inputs, outputs) at normalised frequencies `w`."""
        q = unit_circle(w)
        below = np.stack([evaluate(row, q) for row in self.denominator], axis=-1)
        return at(self.numerator, q) / below[:, :, None]


@dataclass(frozen=True)
class ChannelLoop:
    """A polynomial model under u = r - C y, with e acting on u through the loop.

    With R_i = A_i prod_j F_ij, G = R^-1 N, everything solves the polynomial equation

        [R  -N] [y]   [prod_j F_ij C_i / D_i e]
        [P   Q] [u] = [Q r                    ]

    in which unstable or integrating poles of plant and controller are coefficients, so that what they
    cause in the loop stays finite. The roots of the determinant are all closed-loop poles: the loop is
    internally stable when they lie inside the unit circle (every 1/A_i is driven by its own noise e_i).
    """

    model: PolynomialChannels
    controller: MatrixController

    @cached_property
    def _left(self) -> Array:
        """(p + r, p + r, l): the matrix of polynomials on the left."""
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
        return stack(rows)

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

    @cached_property
    def singularities(self) -> ComplexArray:
        """Poles of all that the excitation and the noise cause, as points of the frequency plane."""
        m = self.model
        predictor = [*m.C, *m.D, *(f for row in m.F for f in row)]
        roots = join_roots([self.closed_poles, *(roots_in_z(p) for p in predictor)])
        return logarithmic_distance(roots)

    def check_stability(self) -> None:
        """Raise `SpecError` unless the loop is well posed and internally stable.

        Raises:
            SpecError: `unstable-loop` or `algebraic-loop`.
        """
        p, leading = self.model.outputs, self._left[..., 0]
        # det(I + C G) is the product of 1 + these eigenvalues, which do not depend on the units of u and y.
        gains = np.linalg.eigvals(-leading[:p, p:] @ np.linalg.solve(leading[p:, p:], leading[p:, :p]))
        if np.min(np.abs(1.0 + gains) / (1.0 + np.abs(gains))) < _WELL_POSED:
            raise bad_spec(
                "algebraic-loop",
                "plant and controller both act without delay and det(I + C G) vanishes at infinite frequency",
                hint="put the delay of the plant into B (a leading 0) or into the controller's numerator",
                key="experiment.controller",
            )
        refuse_unstable(
            self.closed_poles,
            hint="check the signs (feedback is negative: u = r - C y), which output each column of the "
            "controller reads, and that entries of a row with the same poles share one denominator",
        )

    def responses(self, w: ArrayLike) -> LoopResponse:
        """From r and from e at normalised frequencies `w`: y_x (n, p, r), u_x (n, r, r), y_e (n, p, p), u_e.

        y_x = G S_i, u_x = S_i = (I + C G)^-1, y_e = S_o H, u_e = -C S_o H with S_o = (I + G C)^-1.
        """
        m, q = self.model, unit_circle(w)
        p, r = m.outputs, m.inputs
        right = np.zeros((q.size, p + r, r + p), dtype=complex)
        for j, below in enumerate(self.controller.denominator):
            right[:, p + j, j] = evaluate(below, q)
        for i, (c, d) in enumerate(zip(m.per_output(m.C), m.per_output(m.D), strict=True)):
            right[:, i, r + i] = evaluate(self._others(i), q) * evaluate(c, q) / evaluate(d, q)
        solved: ComplexArray = np.linalg.solve(at(self._left, q), right).astype(complex)
        return LoopResponse(
            y_x=solved[:, :p, :r], u_x=solved[:, p:, :r], y_e=solved[:, :p, r:], u_e=solved[:, p:, r:]
        )

    def signals(self, r: Array, e: Array) -> tuple[Array, Array]:
        """y (.., n, p) and u (.., n, r) for samples r (.., n, r) and e (.., n, p), from rest."""
        m, samples = self.model, r.shape[-2]
        right = np.empty((*r.shape[:-1], m.outputs + m.inputs))
        for i, (c, d) in enumerate(zip(m.per_output(m.C), m.per_output(m.D), strict=True)):
            right[..., i] = scipy.signal.lfilter(np.convolve(self._others(i), c), d, e[..., i])
        for j, q in enumerate(self.controller.denominator):
            right[..., m.outputs + j] = scipy.signal.lfilter(q, [1.0], r[..., j])
        inverse = np.linalg.inv(self._left[..., 0])
        back = [(inverse @ self._left[..., lag]).T for lag in range(1, self._left.shape[-1])]
        found = right @ inverse.T
        for t in range(1, samples):
            for lag, block in enumerate(back[:t], start=1):
                found[..., t, :] -= found[..., t - lag, :] @ block
        return found[..., : m.outputs], found[..., m.outputs :]

    def sensitivity(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """S = (I + G C)^-1 (n, p, p) and C S (n, r, p) at normalised frequencies `w`."""
        left, p = at(self._left, unit_circle(w)), self.model.outputs
        right = np.zeros((left.shape[0], left.shape[1], p), dtype=complex)
        right[:, :p] = left[:, :p, :p]
        solved: ComplexArray = np.linalg.solve(left, right).astype(complex)
        return solved[:, :p], -solved[:, p:]

    def excitation_gradient(self, w: ArrayLike) -> ComplexArray:
        """(n, k, p, r): what r contributes to the gradient of the prediction."""
        t = self.responses(w)
        return self.model.prediction_gradient(w, t.y_x, t.u_x, np.zeros_like(t.y_x))

    def noise_gradient(self, w: ArrayLike) -> ComplexArray:
        """(n, k, p, p): what e contributes, through the noise model and around the loop."""
        t = self.responses(w)
        e = np.broadcast_to(np.eye(self.model.outputs, dtype=complex), t.y_e.shape)
        return self.model.prediction_gradient(w, t.y_e, t.u_e, e)
