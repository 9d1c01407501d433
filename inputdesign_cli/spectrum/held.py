"""Spectra of signals whose values are held for several samples, which gives every sinusoid images."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.spectrum.basis import Density, Face, Factor, Functional, Pricing
from inputdesign_cli.spectrum.lines import LinesBasis


@dataclass(frozen=True)
class HeldLines(LinesBasis):
    """Lines of values that are held for `hold` samples; frequencies are in rad per value.

    A line at v causes lines at (v + 2 pi l) / hold, l = 0 .. hold - 1, whose powers add up to its own.
    """

    hold: int = 1

    @classmethod
    def of(cls, hold: int, inputs: int) -> HeldLines:
        """Return lines at free frequencies of held values."""
        free = LinesBasis.anywhere(0.0, np.pi, inputs)
        return cls(free.frequencies, free.directions, free.allowed, free.units, True, hold)

    def images(self, v: Array) -> tuple[Array, Array]:
        """Return where lines at `v` (n,) appear, within (-pi, pi], and their shares, (hold, n)."""
        w = (v + 2.0 * np.pi * np.arange(self.hold)[:, None]) / self.hold
        w = np.where(w > np.pi, w - 2.0 * np.pi, w)
        pulse = np.exp(-1j * w[..., None] * np.arange(self.hold)).mean(axis=-1)
        return w, np.abs(pulse) ** 2

    def folded(self, density: Density) -> Density:
        """Return a density over the frequencies of samples as one over the frequencies of held values."""

        def over_values(v: Array) -> NDArray:
            parts = []
            for w, share in zip(*self.images(np.asarray(v)), strict=True):
                at = density(np.abs(w))
                shape = (-1, *(1,) * (at.ndim - 1))
                parts.append(share.reshape(shape) * np.where(w.reshape(shape) < 0.0, at.conj(), at))
            return np.sum(parts, axis=0)

        return over_values

    def integrals(
        self, density: Density, singularities: ComplexArray, factor: Factor | None = None
    ) -> NDArray[np.float64]:
        """Return the functional of each line of unit power, summed over its images, (L, ...)."""
        return super().integrals(self.folded(density), singularities)

    def price(self, price: Functional, value: Functional, grid: Array) -> Pricing:
        """Return `LinesBasis.price`, with densities folded to the frequencies of held values."""
        folded = [replace(one, density=self.folded(one.density)) for one in (price, value)]
        turned = np.mod(grid * self.hold, 2.0 * np.pi)
        over = np.unique(
            np.concatenate([[0.0, np.pi], np.where(turned > np.pi, 2.0 * np.pi - turned, turned)])
        )
        return super().price(folded[0], folded[1], over)

    def enlarge(self, face: Face, y: Array, directions: Array, price: Functional) -> tuple[LinesBasis, Face]:
        """Return `LinesBasis.enlarge` with the price folded to the frequencies of held values."""
        return super().enlarge(face, y, directions, replace(price, density=self.folded(price.density)))
