"""A spectrum given as a table, in any unit of frequency: it is integrated, but not designed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information import integrand, integrate_band
from inputdesign_cli.spectrum.basis import Density, DensityFamily, Factor


@dataclass(frozen=True)
class TabulatedSpectrum(DensityFamily):
    """The family x Phi(w), with Phi linear between the points of a table and zero outside it.

    White excitation on a band, of any powers of the channels, is a table of two points.
    """

    frequency: Array  # (n,) ascending
    phi: ComplexArray  # (n, r, r), Hermitian and positive semidefinite

    size = 1

    @classmethod
    def white(cls, powers: Array, band: tuple[float, float]) -> TabulatedSpectrum:
        """Return independent channels of these `powers` (r,), each flat over `band`."""
        level = np.diag(powers * np.pi / (band[1] - band[0])).astype(complex)
        return cls(np.array(band), np.array([level, level]))

    @property
    def knots(self) -> Array:
        """Return the frequencies of the table."""
        return self.frequency

    @property
    def inputs(self) -> int:
        """Return the number of inputs r."""
        return self.phi.shape[1]

    def raised(self, share: float) -> TabulatedSpectrum:
        """Return the table with a `share` of its interpolation error added to all rows.

        The error is found by interpolation from every second row to the others. Its absolute value (as a
        matrix) is added, so that errors at different frequencies do not cancel.
        """
        rows = np.unique([*range(0, self.frequency.size, 2), self.frequency.size - 1])
        missed = self.phi - TabulatedSpectrum(self.frequency[rows], self.phi[rows])._at(self.frequency)
        values, vectors = np.linalg.eigh(missed)
        size = np.einsum("nij,nj,nkj->nik", vectors, np.abs(values), vectors.conj())
        around = size.copy()  # the kept rows have no error, and get the errors of both neighbours
        around[rows] = sum(size[np.clip(rows + step, 0, len(size) - 1)] for step in (-1, 1))
        return TabulatedSpectrum(self.frequency, self.phi + share * around)

    def density(self, x: Array, w: ArrayLike) -> NDArray:
        """Return Phi at `w`: (n,) for one input, else (n, r, r)."""
        phi = x[0] * self._at(np.asarray(w, dtype=float))
        return phi[:, 0, 0].real if self.inputs == 1 else phi

    def _at(self, w: Array) -> ComplexArray:
        right = np.clip(np.searchsorted(self.frequency, w), 1, self.frequency.size - 1)
        left = right - 1
        part = (w - self.frequency[left]) / (self.frequency[right] - self.frequency[left])
        lo, hi = self.frequency[0], self.frequency[-1]
        slack = 1e-12 * hi
        inside = (w >= lo - slack) & (w <= hi + slack)
        part = np.clip(part, 0.0, 1.0)
        mixed = (1 - part)[:, None, None] * self.phi[left] + part[:, None, None] * self.phi[right]
        return mixed * inside[:, None, None]

    def integrals(
        self, density: Density, singularities: ComplexArray, factor: Factor | None = None
    ) -> NDArray[np.float64]:
        """Return (1 / 2 pi) integral of tr(D(w) Phi(w)) over both signs of w, (1, ...)."""
        r, band = self.inputs, (float(self.frequency[0]), float(self.frequency[-1]))
        source, sums = integrand(density, factor, r)
        found = integrate_band(
            source,
            lambda w: self._at(w).reshape(-1, r * r),
            singularities,
            band,
            sums=sums,
            knots=self.frequency,
        )
        if r == 1:
            return found.real
        return np.einsum("ba...ab->...", found.reshape(r, r, *found.shape[1:])).real[None]
