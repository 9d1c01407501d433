"""What the design asks of a family of spectra, and linear functionals on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.plant import local_maxima
from inputdesign_cli.plant.polynomial import Array, ComplexArray

Density = Callable[[Array], NDArray[np.float64]]


@dataclass(frozen=True)
class Functional:
    """A linear functional of the spectrum, (1 / 2 pi) integral of density(w) Phi(w) dw.

    `vector` (n,) are its values on the n basis functions; `density` maps frequencies to (number,).
    A `concentrated` functional also picks up Phi at single frequencies, which its density leaves out.
    """

    vector: Array
    density: Density
    concentrated: bool = False

    def __add__(self, other: Functional) -> Functional:
        return Functional(
            self.vector + other.vector,
            lambda w: self.density(w) + other.density(w),
            self.concentrated or other.concentrated,
        )

    def __mul__(self, factor: float) -> Functional:
        return Functional(factor * self.vector, lambda w: factor * self.density(w), self.concentrated)

    __rmul__ = __mul__

    def at(self, x: Array) -> float:
        """Its value on the spectrum with coefficients `x` (n,)."""
        return float(self.vector @ x)


@dataclass(frozen=True)
class Face:
    """A part of the cone of spectra, small enough for a solver: x = columns y with y in a simple cone.

    `columns` is (size, number); `kind` says that y is a nonnegative vector or svec of a positive
    semidefinite matrix of order `order`. `generators` is the basis' own record of what spans it.
    """

    columns: Array
    kind: Literal["nonnegative", "psd"]
    order: int
    generators: Array


@dataclass(frozen=True)
class Pricing:
    """What a dual point is worth: `scale` is the largest s with price - s value >= 0 on the whole cone.

    `directions` are the members of the cone (in the basis' own record) at which that is tightest:
    the ones to add to a face when the dual point came from a face alone.
    """

    scale: float
    directions: Array


class Basis(Protocol):
    """A linear family of spectra, x (size,) -> Phi, with the cone of those that are nonnegative.

    The cone is never handed to a solver whole. A design starts on `first_face` and enlarges it where
    `price` shows that a spectrum outside of it would pay.
    """

    @property
    def size(self) -> int:
        """Number of unknowns."""
        ...

    def integrals(self, density: Density, singularities: ComplexArray) -> NDArray[np.float64]:
        """(size, ...): (1 / 2 pi) integral of the even function density(w) times each basis function."""
        ...

    def coarser(self) -> Sequence[Basis]:
        """Smaller families to design first, from coarse to fine; x of each is the head of x of the next."""
        ...

    def first_face(self, price: Functional) -> Face:
        """A face rich enough to identify every parameter, scaled so that each column has a like price."""
        ...

    def price(self, price: Functional, value: Functional, grid: Array) -> Pricing:
        """How far the dual point may be scaled, and where it is tightest."""
        ...

    def enlarge(self, face: Face, y: Array, directions: Array, price: Functional) -> tuple[Basis, Face]:
        """A face that holds the current solution `y` and the `directions` (the basis may grow with it)."""
        ...


def pointwise_scale(price: Functional, value: Functional, grid: Array) -> tuple[float, Array, Array]:
    """The largest s for which price(w) >= s value(w) at every frequency.

    Valid for every spectrum whatever, since every spectrum is a mixture of sinusoids. What a price picks
    up at single frequencies only adds to it and is left out; a value that does proves nothing (s = 0).

    Returns:
        s, and the local maxima of value / price over [grid[0], grid[-1]]: frequencies and ratios.
    """

    def ratio(w: ArrayLike) -> Array:
        at = np.asarray(w, dtype=float)
        cost = price.density(at)
        with np.errstate(divide="ignore", invalid="ignore"):
            quotient = value.density(at) / cost
        # Where the price vanishes (S at DC under integral action) the ratio is defined by its limit.
        return np.where(cost > 0, quotient, -np.inf)

    peaks, heights = local_maxima(ratio, grid, ratio(grid))
    top = heights.max(initial=0.0)
    if value.concentrated:
        return 0.0, peaks, heights
    return (np.inf if top <= 0 else 1.0 / top), peaks, heights
