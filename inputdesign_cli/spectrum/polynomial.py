"""Spectra that are polynomials in frequency: Phi(w) = 1/2 W(w) S W(w)^* on a band, zero outside.

[mohan-spectral], (8)-(9), with S = H H^T in place of the factor H: only S enters the information
and the powers, which are linear in it. W = [p_0 I, .., p_m I], and the band is the half band [lo, hi]
mapped to [-1, 1]: a polynomial on [-w_c, w_c] with real coefficients need not satisfy
Phi(-w) = Phi(w)^T, as the spectrum of a real signal does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.polynomial import chebyshev, legendre
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information import integrand, integrate_band
from inputdesign_cli.spectrum.basis import Density, Factor
from inputdesign_cli.spectrum.gram import GramBasis
from inputdesign_cli.spectrum.svec import hmat, hvec, hvec_layout, smat, svec, svec_layout, svec_length

BasisName = Literal["legendre", "chebyshev", "monomial"]


@dataclass(frozen=True)
class PolynomialBasis(GramBasis):
    """The unknowns are S (n, n), n = r (m + 1), as svec (real) or hvec (`hermitian`, complex).

    `inputs` is r, `order` m <= 40, `band` in the unit of frequency of the experiment. All computing is done
    in Legendre polynomials orthonormal on the band: (1/2 pi) integral of p_a p_b = 1 if a = b. So the power
    of u is tr(S) / 2. Chebyshev polynomials and monomials span the same spectra. A congruence with the
    Cholesky factor of their Gram matrix brings their S to this form. Without it monomials (condition 1e9 at m
    = 13) give wrong answers. `coefficients` converts back.
    """

    band: tuple[float, float] = (0.0, np.pi)
    hermitian: bool = False
    shown_in: BasisName = "legendre"  # the polynomials in which results state the coefficients

    @property
    def size(self) -> int:
        """Return the number of unknowns."""
        n = self.gram_order
        return n * n if self.hermitian else svec_length(n)

    def spread(self, powers: Array) -> Array:
        """Return the flat uncorrelated spectrum (size,) with these powers (r,) of the channels."""
        flat = np.zeros((self.gram_order, self.gram_order))
        flat[: self.inputs, : self.inputs] = 2.0 * np.diag(powers)
        return hvec(flat.astype(complex)) if self.hermitian else svec(flat)

    def of_order(self, order: int) -> PolynomialBasis:
        """Return the basis with a lower order."""
        return replace(self, order=order)

    def functions(self, w: ArrayLike) -> Array:
        """Return the polynomials p_0 .. p_m (n, m + 1), zero outside of the band."""
        lo, hi = self.band
        at = np.asarray(w, dtype=float)
        scale = np.sqrt((2.0 * np.arange(self.order + 1) + 1.0) * np.pi / (hi - lo))
        table = legendre.legvander(np.clip(2.0 * (at - lo) / (hi - lo) - 1.0, -1.0, 1.0), self.order) * scale
        margin = 1e-12 * hi
        return np.where(((at >= lo - margin) & (at <= hi + margin))[:, None], table, 0.0)

    def matrix(self, x: Array) -> NDArray:
        """Return S (n, n) in orthonormal Legendre polynomials."""
        return hmat(x) if self.hermitian else smat(x)

    def density(self, x: Array, w: ArrayLike) -> NDArray:
        """Return Phi at `w`: (n,) for one input, else Hermitian (n, r, r)."""
        m, r = self.order + 1, self.inputs
        p = self.functions(w)
        S = self.matrix(x).reshape(m, r, m, r)
        phi = 0.5 * np.einsum("na,aibj,nb->nij", p, S, p, optimize=True)
        return phi[:, 0, 0].real if r == 1 else phi.astype(complex)

    def integrals(
        self, density: Density, singularities: ComplexArray, factor: Factor | None = None
    ) -> NDArray[np.float64]:
        """Return (1 / 2 pi) integral over the band of tr(density(w) Phi(w)) for each unknown, (size, ...)."""
        first, second = np.triu_indices(self.order + 1)
        place = np.zeros((self.order + 1, self.order + 1), dtype=np.intp)
        place[first, second] = place[second, first] = np.arange(first.size)
        rows, columns, scale, imaginary = self._layout()
        pairs = place[rows // self.inputs, columns // self.inputs]
        i, j = rows % self.inputs, columns % self.inputs
        source, sums = integrand(density, factor, self.inputs)

        def products(w: Array) -> NDArray[np.float64]:
            p = self.functions(w)
            return p[:, first] * p[:, second]

        lag = 2 * self.order
        found = integrate_band(source, products, singularities, self.band, sums=sums, highest_lag=lag)
        # The advanced indices are apart, so that their axis comes first: (size, ...).
        entries = np.moveaxis(found, (-2, -1), (1, 2))[pairs, i, j] if self.inputs > 1 else found[pairs]
        spread = (slice(None), *[None] * (entries.ndim - 1))
        return 0.5 * scale[spread] * np.where(imaginary[spread], entries.imag, entries.real)

    def directed(self, frequency: float, direction: ComplexArray) -> Array:
        """Return v^* Phi v at one frequency, v the `direction` (r,), as a functional, (size,)."""
        z = np.kron(self.functions(np.array([frequency]))[0], direction)
        outer = np.asarray(0.5 * np.outer(z, z.conj()), dtype=complex)
        return hvec(outer) if self.hermitian else svec(outer.real)

    def gram(self, vector: Array) -> NDArray:
        """Return the matrix that stands for a functional."""
        return self.matrix(vector)

    def products(self, generators: NDArray) -> Array:
        """See `GramBasis`."""
        rows, columns, scale, imaginary = self._layout()
        left, right, pair_scale = svec_layout(generators.shape[1])
        above, below = generators[rows], generators[columns].conj()
        # The pair (a, b) of svec stands for (z_a z_b^* + z_b z_a^*) / sqrt(2), or z_a z_a^*.
        entries = 0.5 * (above[:, left] * below[:, right] + above[:, right] * below[:, left]) * pair_scale
        parts = np.where(imaginary[:, None], entries.imag, entries.real)
        return parts * scale[:, None]

    def _layout(self) -> tuple[NDArray[np.intp], NDArray[np.intp], Array, NDArray[np.bool_]]:
        if self.hermitian:
            return hvec_layout(self.gram_order)
        rows, columns, scale = svec_layout(self.gram_order)
        return rows, columns, scale, np.zeros(rows.size, dtype=bool)

    def coefficients(self, x: Array, basis: BasisName) -> NDArray:
        """Return S (n, n) in the named basis of x = 2 (w - lo) / (hi - lo) - 1, degree by degree.

        `legendre` is the orthonormal one. In monomials digits are lost as the order grows: their
        coefficients alternate and cancel (ten digits at m = 20).
        """
        S = self.matrix(x)
        if basis == "legendre":
            return S
        lo, hi = self.band
        change = np.zeros((self.order + 1, self.order + 1))
        for degree in range(self.order + 1):
            unit = np.zeros(degree + 1)
            unit[degree] = np.sqrt((2.0 * degree + 1.0) * np.pi / (hi - lo))
            powers = legendre.leg2poly(unit)
            column = powers if basis == "monomial" else chebyshev.poly2cheb(powers)
            change[: degree + 1, degree] = column
        spread = np.kron(change, np.eye(self.inputs))
        return spread @ S @ spread.T

    def described(self, x: Array, unit: float) -> Mapping[str, object]:
        """Return S in the polynomials that results are stated in, and the band."""
        return {
            "type": "polynomial",
            "basis": self.shown_in,
            "order": self.order,
            "band": [edge / unit for edge in self.band],
            "coefficients": self.coefficients(x, self.shown_in),
        }
