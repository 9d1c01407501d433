"""Spectra that are flat on each of several bands."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.spectrum.basis import Basis, Density, DensityFamily, Face, Factor, Functional, Pricing
from inputdesign_cli.spectrum.flat import FlatBasis


@dataclass(frozen=True)
class PiecesBasis(DensityFamily):
    """The unknowns are the powers between successive `edges` (size + 1,), even over the `inputs`."""

    inputs: int
    edges: tuple[float, ...]

    degree = 0

    @property
    def size(self) -> int:
        return len(self.edges) - 1

    @property
    def knots(self) -> Array:
        return np.array(self.edges)

    @property
    def _pieces(self) -> list[FlatBasis]:
        return [FlatBasis(self.inputs, band) for band in pairwise(self.edges)]

    def spread(self, powers: Array) -> Array:
        return np.sum(powers) * np.diff(self.edges) / (self.edges[-1] - self.edges[0])

    def density(self, x: Array, w: ArrayLike) -> NDArray:
        return sum(piece.density(x[[i]], w) for i, piece in enumerate(self._pieces))

    def directed(self, frequency: float, direction: ComplexArray) -> Array:
        inside = (self.knots[:-1] <= frequency) & (frequency <= self.knots[1:])
        return inside * [piece.level for piece in self._pieces]

    def integrals(
        self, density: Density, singularities: ComplexArray, factor: Factor | None = None
    ) -> NDArray[np.float64]:
        return np.concatenate([piece.integrals(density, singularities) for piece in self._pieces])

    def coarser(self) -> list[Basis]:
        return []

    def first_face(self, price: Functional) -> Face:
        return Face(np.diag(1.0 / price.vector), "nonnegative", self.size, np.arange(self.size))

    def price(self, price: Functional, value: Functional, grid: Array) -> Pricing:
        worth = np.maximum(value.vector, 1e-300)
        return Pricing(float(np.min(price.vector / worth)), np.zeros(0))

    def enlarge(self, face: Face, y: Array, directions: Array, price: Functional) -> tuple[Basis, Face]:
        return self, face

    def described(self, x: Array, unit: float) -> Mapping[str, object]:
        return {"type": "pieces", "edges": self.knots / unit, "powers": x}
