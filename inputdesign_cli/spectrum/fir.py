"""FIR spectra: Phi(w) = sum over |t| <= m of c_t e^{-jwt}, c_t = E u(s + t) u(s)^T.

For one input [bombois-least-costly], (14); order zero is white noise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information import integrand, integrate
from inputdesign_cli.spectrum.basis import Density, Factor
from inputdesign_cli.spectrum.gram import FaceSizes, GramBasis
from inputdesign_cli.spectrum.svec import svec_layout, svec_length

_OF_ONE_INPUT = FaceSizes(whole=12, first=12, kept=14)


@dataclass(frozen=True)
class FirBasis(GramBasis):
    """The unknowns are the upper triangle of c_0 by columns, then c_1 .. c_m (r, r) row by row.

    `inputs` is r, `order` m. A spectrum of this family is nonnegative exactly when it is V Q V^* with a real
    Q >= 0 ([fejer-riesz-1916]; for several inputs [dritschel-rovnyak-2010]). Here V(w) = [I, e^{-jw} I, ..,
    e^{-jwm} I]; c_t is the sum of the blocks (s + t, s) of Q.
    """

    @cached_property
    def size(self) -> int:
        """Return the number of unknowns."""
        return svec_length(self.inputs) + self.order * self.inputs**2

    @property
    def sizes(self) -> FaceSizes:
        """See `GramBasis`; for one input few generators reach the optimum."""
        return _OF_ONE_INPUT if self.inputs == 1 else super().sizes

    def spread(self, powers: Array) -> Array:
        """Return white excitation with these powers (r,) of the channels, uncorrelated, (size,)."""
        rows, columns, _ = svec_layout(self.inputs)
        flat = np.zeros(self.size)
        flat[: rows.size] = np.where(rows == columns, powers[rows], 0.0)
        return flat

    def moving_average(self, x: Array) -> Array | None:
        """Return the autocovariances of one input, None for several."""
        return x if self.inputs == 1 else None

    def of_order(self, order: int) -> FirBasis:
        """Return the basis with a lower order."""
        return FirBasis(self.inputs, order)

    def autocovariances(self, x: Array) -> NDArray[np.float64]:
        """Return the autocovariances c_0 .. c_m, (m + 1, r, r)."""
        r = self.inputs
        rows, columns, _ = svec_layout(r)
        first = np.zeros((1, r, r))
        first[0, rows, columns] = first[0, columns, rows] = x[: rows.size]
        return np.concatenate([first, x[rows.size :].reshape(-1, r, r)])

    def density(self, x: Array, w: ArrayLike) -> NDArray:
        """Return Phi at normalised frequencies `w`: (n,) for one input, else Hermitian (n, r, r)."""
        c, turn = self.autocovariances(x), self._turn(np.asarray(w, dtype=float))
        if self.inputs == 1:
            return 2.0 * turn @ c[:, 0, 0] - c[0, 0, 0]
        later = np.tensordot(turn[:, 1:], c[1:], axes=1)
        return np.asarray(c[0] + later + later.conj().swapaxes(1, 2), dtype=complex)

    def _turn(self, w: Array) -> NDArray:
        """Return e^{-jwt}, or its real part for one input, whose densities are even, (n, m + 1)."""
        angles = np.outer(w, np.arange(self.order + 1))
        return np.cos(angles) if self.inputs == 1 else np.exp(-1j * angles)

    def integrals(
        self, density: Density, singularities: ComplexArray, factor: Factor | None = None
    ) -> NDArray[np.float64]:
        """Return (1 / 2 pi) integral of tr(density(w) Phi(w)) for each unknown, (size, ...)."""
        (source, sums), several = integrand(density, factor, self.inputs), self.inputs > 1
        found = integrate(
            source, self._turn, singularities, sums=sums, highest_lag=self.order, several=several
        )
        return self._functional(
            np.moveaxis(found.real, (-2, -1), (1, 2)) if several else found[:, None, None]
        )

    def directed(self, frequency: float, direction: ComplexArray) -> Array:
        """Return v^* Phi v at one frequency, v the `direction` (r,), as a functional, (size,)."""
        turn = self._turn(np.array([frequency]))[0]
        return self._functional((turn[:, None, None] * np.outer(direction, direction.conj())).real)

    def _functional(self, sums: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (size, ...) from the real parts (m + 1, r, r, ...) of the integrals of D(w) e^{-jwt}.

        tr(D c_t e^{-jwt}) and its mirror image add up to twice the real part; D_ij multiplies c_ji.
        """
        rows, columns, _ = svec_layout(self.inputs)
        mean = 0.5 * (sums[0] + sums[0].swapaxes(0, 1))
        twice = np.where(rows == columns, 1.0, 2.0).reshape(-1, *[1] * (mean.ndim - 2))
        head = mean[rows, columns] * twice
        tail = 2.0 * sums[1:].swapaxes(1, 2)
        return np.concatenate([head, tail.reshape(-1, *tail.shape[3:])])

    def gram(self, vector: Array) -> NDArray[np.float64]:
        """Return a block Toeplitz matrix, positive semidefinite exactly for nonnegative functionals."""
        g = 0.5 * self.autocovariances(vector)
        g[0] += np.diag(np.diag(g[0]))
        every = np.concatenate([g, g[:0:-1].swapaxes(1, 2)])  # by lag, negative ones from the end
        s = np.arange(self.order + 1)
        return every[s[:, None] - s].transpose(0, 2, 1, 3).reshape(self.gram_order, self.gram_order)

    def products(self, generators: NDArray) -> Array:
        """Return x of (v_a v_b^* + v_b v_a^*) / 2 for each pair of generators (n, q), (size, q (q + 1) / 2).

        A generator v holds the taps v(0) .. v(m), (r,) each, of a filter. c_t of a pair is the sum over s of
        v_a(s + t) v_b(s)^T made symmetric in a and b: a correlation along the lags, computed by FFT.
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
                turned = pair.conj() if i == j else spectra[:, i][:, b] * spectra[:, j][:, a].conj()
                c = 0.5 * np.fft.irfft(pair + turned, length, axis=0)[: self.order + 1] * scale
                out[np.flatnonzero((rows == i) & (columns == j))] = c[:1]
                later[:, i, j] = c[1:]
        return out

    def described(self, x: Array, unit: float) -> Mapping[str, object]:
        """Return the autocovariances c_0 .. c_m, (r, r) each where there are several inputs."""
        shown = x if self.inputs == 1 else self.autocovariances(x)
        return {"type": "fir", "order": self.order, "coefficients": shown}
