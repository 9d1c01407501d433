"""Line spectra: sinusoids of free power, at given frequencies or wherever they pay.

With free frequencies this is every spectrum whatever: an information matrix that some spectrum
reaches is reached by finitely many sinusoids (Caratheodory).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.spectrum.basis import Density, Face, Functional, Pricing, pointwise_scale

_FIRST_LINES = 24
_MOST_NEW = 12


@dataclass(frozen=True)
class LinesBasis:
    """The unknowns are the powers (mean squares) of sinusoids at `frequencies` (L,) in rad/sample.

    With `free` the basis grows by the frequencies at which a sinusoid would pay, so that prices
    hold for every spectrum on `band`; without, the frequencies are all there is.
    """

    frequencies: Array
    free: bool = False
    band: tuple[float, float] = (0.0, np.pi)

    @classmethod
    def anywhere(cls, grid: Array) -> LinesBasis:
        """Free frequencies on [grid[0], grid[-1]], to begin with some spread linearly and logarithmically."""
        lo, hi = max(grid[0], 1e-3 * grid[-1]), grid[-1]
        start = np.concatenate([np.linspace(lo, hi, _FIRST_LINES), np.geomspace(lo, hi, _FIRST_LINES)])
        return cls(np.unique(start), free=True, band=(float(grid[0]), float(grid[-1])))

    @property
    def size(self) -> int:
        return self.frequencies.size

    @property
    def flat(self) -> Array:
        """(L,): power one spread evenly over the lines."""
        return np.full(self.size, 1.0 / self.size)

    def integrals(self, density: Density, singularities: ComplexArray) -> NDArray[np.float64]:
        """(L, ...): the density at each line, which is what a sinusoid of power one picks up."""
        return density(self.frequencies)

    def coarser(self) -> list[LinesBasis]:
        """None: lines are cheap."""
        return []

    def first_face(self, price: Functional) -> Face:
        """All lines, in units of their price."""
        return Face(np.diag(1.0 / price.vector), "nonnegative", self.size, self.frequencies)

    def price(self, price: Functional, value: Functional, grid: Array) -> Pricing:
        """The ratio at the lines, or over all frequencies with its peaks as new lines."""
        if not self.free:
            top = float(np.max(value.vector / price.vector))
            return Pricing(1.0 / top if top > 0 else np.inf, np.zeros(0))
        inside = np.union1d(grid[(grid >= self.band[0]) & (grid <= self.band[1])], self.band)
        scale, peaks, heights = pointwise_scale(price, value, inside)
        return Pricing(scale, peaks[np.argsort(-heights)][:_MOST_NEW])

    def enlarge(self, face: Face, y: Array, directions: Array, price: Functional) -> tuple[LinesBasis, Face]:
        """The lines so far and those at `directions`; x of the old basis is the head of x of the new."""
        new = np.array([w for w in directions if np.min(np.abs(w - self.frequencies)) > 1e-10])
        if new.size == 0:
            return self, face
        grown = replace(self, frequencies=np.concatenate([self.frequencies, new]))
        costs = np.concatenate([price.vector, price.density(new)])
        return grown, grown.first_face(Functional(costs, price.density))
