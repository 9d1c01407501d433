"""The matrix of polynomials of a plant that a control law inverts: its determinant, delays and zeros."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.polynomial import delay_of, determinant_and_adjugate, roots_in_z
from inputdesign_cli.plant.polynomial_model import PolynomialModel


class MatrixPlant(PolynomialModel):
    """A `PolynomialModel` as G = R^-1 N, R diagonal, with the parts needed to invert a square G."""

    @classmethod
    def of(cls, channels: PolynomialModel) -> MatrixPlant:
        """Build the plant from a polynomial model."""
        return cls(
            channels.B, channels.A, channels.F, channels.C, channels.D, channels.covariance, channels.first
        )

    def disturbance_at(self, w: ArrayLike) -> ComplexArray:
        """Return Phi_v (K, n, n), the spectrum of the noise at the outputs."""
        H = self.noise_at(w)
        return H @ self.covariance @ np.conj(np.swapaxes(H, 1, 2))

    @property
    def numerator(self) -> Array:
        """Return N (outputs, inputs, l): G = R^-1 N with R diagonal, R_i = A_i prod_j F_ij."""
        return self._fractions[:, 1:]

    @cached_property
    def _inverse(self) -> tuple[Array, Array]:
        return determinant_and_adjugate(self.numerator)

    @cached_property
    def regular(self) -> bool:
        """Return whether the square G has an inverse at all."""
        return bool(np.any(self._inverse[0]))

    @cached_property
    def inverse_delay(self) -> int:
        """Return the least d for which q^-d G^-1 is causal."""
        det, adj = self._inverse
        return delay_of(det) - delay_of(adj)

    @cached_property
    def delay(self) -> int:
        """Return the least delay among the entries of G."""
        return delay_of(self.numerator)

    @cached_property
    def zeros(self) -> ComplexArray:
        """Return the transmission zeros in z of the square G (with stable ones that cancel against F)."""
        return roots_in_z(self._inverse[0])

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return poles and zeros of G and H as points of the frequency plane."""
        poles = super().singularities
        if self.outputs != self.inputs or not self.regular:
            return poles
        return np.concatenate([poles, logarithmic_distance(self.zeros)])
