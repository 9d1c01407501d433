"""Controllers of several channels: matrices of transfer functions in q^-1."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.plant.polynomial import (
    Array,
    ComplexArray,
    evaluate,
    join_roots,
    roots_in_z,
    unit_circle,
)
from inputdesign_cli.plant.polynomial_matrix import at, stack
from inputdesign_cli.plant.state_space import StateSpace


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
        P, below = self.fraction_at(w)
        return P / below[:, :, None]

    def fraction_at(self, w: ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """P (n, inputs, outputs) and the diagonal of Q (n, inputs) at normalised frequencies `w`."""
        q = unit_circle(w)
        return at(self.numerator, q), np.stack([evaluate(row, q) for row in self.denominator], axis=-1)

    @property
    def realisation(self) -> StateSpace:
        """From outputs to inputs of the plant, row by row in the observer's canonical form."""
        inputs, outputs, length = self.numerator.shape
        direct = np.zeros((inputs, outputs))
        blocks = []
        for j, denominator in enumerate(self.denominator):
            n = max(length, denominator.size) - 1
            q, P = np.zeros(n + 1), np.zeros((n + 1, outputs))
            q[: denominator.size], P[:length] = denominator, self.numerator[j].T
            q, P = q / denominator[0], P / denominator[0]
            direct[j] = P[0]
            A, C = np.eye(n, k=1), np.zeros((inputs, n))
            if n:
                A[:, 0], C[j, 0] = -q[1:], 1.0
            blocks.append((A, P[1:] - np.outer(q[1:], P[0]), C))
        return StateSpace.of(blocks, direct)
