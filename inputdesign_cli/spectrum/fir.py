"""FIR spectra of one input: Phi(w) = c_0 + 2 sum_{t=1..m} c_t cos(t w), c_t the autocovariances.

[bombois-least-costly], (14); m = 0 is white noise. The fast path of `matrix_fir` for one input.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information import Quadrature, integrate
from inputdesign_cli.spectrum.basis import Density, DensityFamily, Face, Factor, Functional, Pricing
from inputdesign_cli.spectrum.directions import directed_scale
from inputdesign_cli.spectrum.svec import smat, svec_layout

_FIRST_ORDER = 11  # spectra up to this order are designed whole, in one face
_DIRECTIONS = 8
_MOST_KEPT = 14
_KEPT = 1e-14  # share of the largest eigenvalue below which a generator is dropped
_SINGULAR_PRICE = 1e-10


@dataclass(frozen=True)
class FirBasis(DensityFamily):
    """The unknowns are c_0 .. c_m (m = `order`); the cone is that of nonnegative cosine polynomials.

    Each of those is a sum of |v_i(e^{jw})|^2, v_i polynomials of degree m ([fejer-riesz-1916]). With the
    v_i in the span of the columns of V (m + 1, q) it is v(w)^* Q v(w), Q >= 0 of order q: this is a
    face, and its generators are V. The full Gram matrix has order m + 1, but the optimal one is of
    low rank, so a few generators, found by pricing, reach the optimum.
    """

    order: int

    inputs = 1

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.order + 1

    @property
    def degree(self) -> int:
        """Return the degree of the trigonometric polynomial."""
        return self.order

    def spread(self, powers: Array) -> Array:
        """(m + 1,): the flat spectrum of this power (1,)."""
        flat = np.zeros(self.size)
        flat[0] = powers[0]
        return flat

    def moving_average(self, x: Array) -> Array | None:
        """The autocovariances themselves."""
        return x

    def functions(self, w: ArrayLike) -> Array:
        """(n, m + 1): the basis functions 1, 2 cos w, .., 2 cos m w."""
        table = 2.0 * np.cos(np.outer(np.asarray(w, dtype=float), np.arange(self.size)))
        table[:, 0] = 1.0
        return table

    def density(self, x: Array, w: ArrayLike) -> Array:
        """(n,): Phi at normalised frequencies `w`."""
        return self.functions(w) @ x

    def directed(self, frequency: float, direction: ComplexArray) -> Array:
        """(m + 1,): Phi at one frequency as a functional; one input has one direction."""
        return self.functions(np.array([frequency]))[0]

    def integrals(
        self, density: Density, singularities: ComplexArray, factor: Factor | None = None
    ) -> NDArray[np.float64]:
        """(m + 1, ...): (1 / 2 pi) integral of density(w) times each basis function."""

        def sums(rule: Quadrature, values: NDArray) -> NDArray[np.float64]:
            weighted = self.functions(rule.nodes) * rule.weights[:, None]
            return np.tensordot(weighted, values, axes=(0, 0))

        return integrate(density, sums, singularities, highest_lag=self.order)

    def coarser(self) -> list[FirBasis]:
        """Lower orders, each about half the next, whose optimum is a good start for this one."""
        orders = [self.order]
        while orders[0] > 2 * _FIRST_ORDER:
            orders.insert(0, orders[0] // 2)
        return [FirBasis(order) for order in orders[:-1]]

    def first_face(self, price: Functional) -> Face:
        """All spectra of order up to 11."""
        return self._face(np.eye(self.size)[:, : min(self.order, _FIRST_ORDER) + 1], price)

    def price(self, price: Functional, value: Functional, grid: Array) -> Pricing:
        """The largest s with price - s value >= 0 on every spectrum of this basis.

        A linear functional of c_0 .. c_m is nonnegative on all nonnegative cosine polynomials exactly
        when its Toeplitz matrix is positive semidefinite ([caratheodory-1911]): a generalised
        eigenvalue, whose leading eigenvectors are the spectra |v|^2 that pay best. Where the price
        itself nearly vanishes, rounding spoils that eigenvalue, and the pointwise ratio, which is
        valid too, stands in.
        """
        metric, worth = _toeplitz(price.vector), _toeplitz(value.vector)
        first = max(self.size - _DIRECTIONS, 0)
        spread = np.linalg.eigvalsh(metric)
        if spread[0] <= _SINGULAR_PRICE * spread[-1]:
            _, vectors = scipy.linalg.eigh(worth - metric, subset_by_index=[first, self.order])
            return Pricing(directed_scale(price, value, grid)[0], vectors)
        ratios, vectors = scipy.linalg.eigh(worth, metric, subset_by_index=[first, self.order])
        return Pricing(1.0 / ratios[-1] if ratios[-1] > 0 else np.inf, vectors)

    def enlarge(self, face: Face, y: Array, directions: Array, price: Functional) -> tuple[FirBasis, Face]:
        """Keep the generators that the solution uses, add the `directions` (m + 1, number)."""
        known = len(face.generators)
        if face.order == self.size == known:
            return self, face
        eigenvalues, vectors = np.linalg.eigh(smat(y))
        kept = eigenvalues > _KEPT * eigenvalues[-1]
        kept[:-_MOST_KEPT] = False
        used = face.generators @ vectors[:, kept]
        used = np.pad(used, ((0, self.size - known), (0, 0)))
        spanning = scipy.linalg.qr(np.concatenate([used, directions], axis=1), mode="economic")[0]
        return self, self._face(spanning, price)

    def _face(self, spanning: Array, price: Functional) -> Face:
        """Columns: the autocovariances of each pair of generators, in the order of svec.

        Generators are made orthonormal in the metric of the price, so that the cost is tr Q: where
        the price varies by orders of magnitude over frequency, the dual residual of the solver then
        counts in units of the price at each frequency, and the certificate loses nothing.
        """
        metric = spanning.T @ _toeplitz(price.vector) @ spanning
        values, vectors = np.linalg.eigh(metric)
        generators = spanning @ (vectors / np.sqrt(np.maximum(values, _SINGULAR_PRICE * values[-1])))
        transform = np.fft.rfft(generators, 2 * self.size, axis=0)
        rows, columns, scale = svec_layout(generators.shape[1])
        cross = np.fft.irfft(transform[:, rows] * transform[:, columns].conj(), 2 * self.size, axis=0)
        lags = np.arange(self.size)
        return Face(
            columns=0.5 * (cross[lags] + cross[-lags]) * scale,
            kind="psd",
            order=generators.shape[1],
            generators=generators,
        )

    def described(self, x: Array, unit: float) -> Mapping[str, object]:
        """The autocovariances c_0 .. c_m."""
        return {"type": "fir", "order": self.order, "coefficients": x}


def _toeplitz(g: Array) -> Array:
    # g_r multiplies c_r = c_{-r} twice, hence the halves.
    column = 0.5 * g
    column[0] *= 2.0
    return scipy.linalg.toeplitz(column)
