"""White excitation: flat over a band, even over the channels, of one unknown power."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information import Experiment, integrand, integrate_band
from inputdesign_cli.spectrum.basis import Density, DensityFamily, Face, Factor, Functional, Pricing


@dataclass(frozen=True)
class FlatBasis(DensityFamily):
    """The family of flat spectra: the unknown is the total power; Phi = level I on `band`, zero outside."""

    inputs: int
    band: tuple[float, float]

    size = 1
    degree = 0

    def spread(self, powers: Array) -> Array:
        """Return the sum of the powers (1,), since this family has one power for all channels."""
        return np.array([np.sum(powers)])

    def moving_average(self, x: Array) -> Array | None:
        """Return white noise of one input over the whole circle; otherwise None."""
        return x if self.inputs == 1 and self.band == (0.0, np.pi) else None

    @cached_property
    def level(self) -> float:
        """Return each diagonal entry of Phi at power one."""
        return np.pi / ((self.band[1] - self.band[0]) * self.inputs)

    def density(self, x: Array, w: ArrayLike) -> NDArray:
        """Return Phi at `w`: (n,) for one input, else (n, r, r)."""
        at = np.asarray(w, dtype=float)
        inside = (at >= self.band[0] * (1 - 1e-12)) & (at <= self.band[1] * (1 + 1e-12))
        level = x[0] * self.level * inside
        return level if self.inputs == 1 else level[:, None, None] * np.eye(self.inputs, dtype=complex)

    def directed(self, frequency: float, direction: ComplexArray) -> Array:
        """Return v^* Phi v inside the band, (1,); it does not depend on the direction v of length one."""
        return np.array([self.level])

    def integrals(
        self, density: Density, singularities: ComplexArray, factor: Factor | None = None
    ) -> NDArray[np.float64]:
        """Return level times (1 / 2 pi) integral of the trace of the density, (1, ...)."""
        source, sums = integrand(density, factor, self.inputs)
        found = integrate_band(source, None, singularities, self.band, sums=sums)
        return self.level * (found if self.inputs == 1 else np.trace(found, axis1=-2, axis2=-1).real)

    def coarser(self) -> list[FlatBasis]:
        """Return an empty list, since no basis is coarser."""
        return []

    def first_face(self, price: Functional) -> Face:
        """Return the whole half line, in units of its price."""
        return Face(1.0 / price.vector[:, None], "nonnegative", 1, np.zeros(1))

    def price(self, price: Functional, value: Functional, grid: Array) -> Pricing:
        """Return the ratio of two numbers."""
        worth = float(value.vector[0])
        return Pricing(float(price.vector[0]) / worth if worth > 0 else np.inf, np.zeros(0))

    def enlarge(self, face: Face, y: Array, directions: Array, price: Functional) -> tuple[FlatBasis, Face]:
        """Return the face as it is, since there is nothing to add."""
        return self, face

    def described(self, x: Array, unit: float) -> Mapping[str, object]:
        """Return the power; of one input also as the autocovariance c_0."""
        entry = {"type": "white", "power": float(x[0])}
        return entry | ({"order": 0, "coefficients": x} if self.inputs == 1 else {})


def flat_basis(experiment: Experiment) -> FlatBasis:
    """Return white excitation for an experiment, by which its coordinates are whitened."""
    return FlatBasis(experiment.inputs, experiment.band)
