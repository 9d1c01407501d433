"""FIR spectra of several inputs: Phi(w) = sum over |t| <= m of c_t e^{-jwt}, c_t = E u(s + t) u(s)^T."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information import NODES_AT_ONCE, Quadrature, integrate
from inputdesign_cli.spectrum.basis import Density, Factor
from inputdesign_cli.spectrum.directions import integrand
from inputdesign_cli.spectrum.gram import GramBasis
from inputdesign_cli.spectrum.svec import svec_layout, svec_length


@dataclass(frozen=True)
class MatrixFirBasis(GramBasis):
    """The unknowns are the upper triangle of c_0 by columns, then c_1 .. c_m (r, r) row by row.

    `inputs` r, `order` m. A spectrum of this family is nonnegative exactly when it is V Q V^* with
    V(w) = [I, e^{-jw} I, .., e^{-jwm} I] and a real Q >= 0 ([dritschel-rovnyak-2010]); c_t is the sum of the
    blocks (s + t, s) of Q.
    """

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return svec_length(self.inputs) + self.order * self.inputs**2

    def spread(self, powers: Array) -> Array:
        """(size,): white excitation with these powers (r,) of the channels, uncorrelated."""
        rows, columns, _ = svec_layout(self.inputs)
        flat = np.zeros(self.size)
        flat[: rows.size] = np.where(rows == columns, powers[rows], 0.0)
        return flat

    def of_order(self, order: int) -> MatrixFirBasis:
        """Return the basis with a lower order."""
        return MatrixFirBasis(self.inputs, order)

    def autocovariances(self, x: Array) -> NDArray[np.float64]:
        """(m + 1, r, r): c_0 .. c_m."""
        r = self.inputs
        rows, columns, _ = svec_layout(r)
        first = np.zeros((1, r, r))
        first[0, rows, columns] = first[0, columns, rows] = x[: rows.size]
        return np.concatenate([first, x[rows.size :].reshape(-1, r, r)])

    def density(self, x: Array, w: ArrayLike) -> ComplexArray:
        """(n, r, r): Phi, Hermitian, at normalised frequencies `w`."""
        c = self.autocovariances(x)
        turn = np.exp(-1j * np.outer(np.asarray(w, dtype=float), np.arange(1, self.order + 1)))
        later = np.tensordot(turn, c[1:], axes=1)
        return c[0] + later + later.conj().swapaxes(1, 2)

    def integrals(
        self, density: Density, singularities: ComplexArray, factor: Factor | None = None
    ) -> NDArray[np.float64]:
        """(size, ...): (1 / 2 pi) integral of tr(density(w) Phi(w)) for each unknown."""
        lags = np.arange(self.order + 1)
        source, summed = integrand(density, factor, self.inputs)

        def sums(rule: Quadrature, values: NDArray) -> NDArray[np.float64]:
            turn = np.exp(-1j * np.outer(rule.nodes, lags))
            found = summed(turn, values, rule.weights).real
            return self._functional(np.moveaxis(found, (-2, -1), (1, 2)))

        return integrate(source, sums, singularities, highest_lag=self.order, at_once=NODES_AT_ONCE)

    def directed(self, frequency: float, direction: ComplexArray) -> Array:
        """(size,): v^* Phi v at one frequency, v the `direction` (r,), as a functional."""
        turn = np.exp(-1j * frequency * np.arange(self.order + 1))
        return self._functional((turn[:, None, None] * np.outer(direction, direction.conj())).real)

    def _functional(self, sums: NDArray[np.float64]) -> NDArray[np.float64]:
        """(size, ...) from the real parts (m + 1, r, r, ...) of the integrals of D(w) e^{-jwt}.

        tr(D c_t e^{-jwt}) and its mirror image add up to twice the real part; D_ij meets c_ji.
        """
        rows, columns, _ = svec_layout(self.inputs)
        mean = 0.5 * (sums[0] + sums[0].swapaxes(0, 1))
        twice = np.where(rows == columns, 1.0, 2.0).reshape(-1, *[1] * (mean.ndim - 2))
        head = mean[rows, columns] * twice
        tail = 2.0 * sums[1:].swapaxes(1, 2)
        return np.concatenate([head, tail.reshape(-1, *tail.shape[3:])])

    def gram(self, vector: Array) -> NDArray[np.float64]:
        """Block Toeplitz: a functional is nonnegative on the cone exactly when this matrix is."""
        r, m = self.inputs, self.order
        g = 0.5 * self.autocovariances(vector)
        g[0] += np.diag(np.diag(g[0]))
        blocks = np.zeros((m + 1, r, m + 1, r))
        for lag in range(m + 1):
            for start in range(m + 1 - lag):
                blocks[start + lag, :, start] = g[lag]
                blocks[start, :, start + lag] = g[lag].T
        return blocks.reshape(r * (m + 1), r * (m + 1))

    def products(self, generators: NDArray) -> Array:
        """(size, q (q + 1) / 2): x of (v_a v_b^* + v_b v_a^*) / 2 for each pair of generators (n, q).

        A generator v holds the taps v(0) .. v(m), (r,) each, of a filter, and c_t of a pair is the sum over s
        of v_a(s + t) v_b(s)^T made symmetric in a and b: a correlation along the lags, done by FFT.
        """
        r, number = self.inputs, generators.shape[1]
        length = 2 * (self.order + 1)
        taps = np.zeros((self.order + 1, r, number))
        taps.reshape(-1, number)[: len(generators)] = generators
        spectra = np.fft.rfft(taps, length, axis=0)
        a, b, scale = svec_layout(number)
        rows, columns, _ = svec_layout(r)
        out = np.zeros((self.size, a.size))
        later = out[rows.size :].reshape(self.order, r, r, a.size)
        for i in range(r):
            for j in range(r):
                pair = spectra[:, i][:, a] * spectra[:, j][:, b].conj()
                pair = pair + spectra[:, i][:, b] * spectra[:, j][:, a].conj()
                c = 0.5 * np.fft.irfft(pair, length, axis=0)[: self.order + 1] * scale
                out[np.flatnonzero((rows == i) & (columns == j))] = c[:1]
                later[:, i, j] = c[1:]
        return out

    def described(self, x: Array, unit: float) -> Mapping[str, object]:
        """The autocovariances c_0 .. c_m, (r, r) each."""
        return {"type": "fir", "order": self.order, "coefficients": self.autocovariances(x)}
