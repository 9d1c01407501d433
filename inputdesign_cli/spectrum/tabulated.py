"""A spectrum that is given as a table: nothing to design, but everything to integrate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.information import Quadrature, integrate
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.spectrum.basis import Density


@dataclass(frozen=True)
class TabulatedSpectrum:
    """Phi(w), linear between the points of a table and zero outside it."""

    frequency: Array  # (n,) ascending, rad/sample
    phi: Array  # (n,) nonnegative

    @property
    def size(self) -> int:
        """One: a table is a single spectrum."""
        return 1

    def density(self, w: ArrayLike) -> Array:
        """Phi (n,) at frequencies `w` (n,)."""
        return np.interp(np.asarray(w, dtype=float), self.frequency, self.phi, left=0.0, right=0.0)

    def integrals(self, density: Density, singularities: ComplexArray) -> NDArray[np.float64]:
        """(1, ...): (1 / 2 pi) integral of the even function density(w) times Phi."""

        def moments(rule: Quadrature) -> NDArray[np.float64]:
            return np.tensordot(self.density(rule.nodes) * rule.weights, density(rule.nodes), axes=(0, 0))[
                None
            ]

        lo, hi = float(self.frequency[0]), float(self.frequency[-1])
        return integrate(moments, singularities, lo=lo, hi=hi, knots=self.frequency)
