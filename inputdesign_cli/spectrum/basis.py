"""The protocol of families of spectra, and linear functionals on them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray

# A map from frequencies (n,) to values (n, ..) for one input, Hermitian matrices (n, .., r, r) for several.
Density = Callable[[Array], NDArray]
# A map to F (n, k, p, r), if the density is Re F_l^* F_m, symmetric in l and m: its integrals take less time.
Factor = Callable[[Array], NDArray]


@dataclass(frozen=True)
class Functional:
    """A linear functional of the spectrum, (1 / 2 pi) integral of density(w) Phi(w) dw.

    `vector` (n,) holds its values on the n basis functions; `density` maps frequencies (m,) to (m,), or to
    (m, r, r) for several inputs. A `concentrated` functional also has a part at single frequencies, which is
    not in the density.
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
        """Return its value on the spectrum with coefficients `x` (n,)."""
        return float(self.vector @ x)


def constant(level: NDArray) -> Density:
    """Return the density that has this level at every frequency."""
    return lambda w: np.broadcast_to(level, (np.size(w), *np.shape(level)))


def kept_on_grid(density: Callable[[Array], NDArray]) -> Callable[[Array], NDArray]:
    """Return the function with a cache of its values at the latest array of the largest size."""
    last: list[tuple[Array, NDArray]] = []

    def known(w: Array) -> NDArray:
        if last and last[0][0] is w:
            return last[0][1]
        found = density(w)
        if not last or w.size >= last[0][0].size:
            last[:] = [(w, found)]
        return found

    return known


def weighted_mean(functionals: Sequence[Functional], weights: Array) -> Functional:
    """Return sum_i w_i f_i over nonzero weights, `weights` (n,) with the sum one."""
    parts = [(f, float(w)) for f, w in zip(functionals, weights, strict=True) if w != 0.0]
    density = kept_on_grid(lambda w: np.asarray(sum(weight * f.density(w) for f, weight in parts)))
    vector = np.asarray(sum(weight * f.vector for f, weight in parts))
    return Functional(vector, density, any(f.concentrated for f, _ in parts))


@dataclass(frozen=True)
class Face:
    """A part of the cone of spectra, small enough for a solver: x = columns y with y in a simple cone.

    `columns` is (size, number); `kind` says that y is a nonnegative vector or svec of a positive
    semidefinite matrix of order `order`. `generators` are the spectra that span it, in a form of the basis.
    """

    columns: Array
    kind: Literal["nonnegative", "psd"]
    order: int
    generators: NDArray


@dataclass(frozen=True)
class Pricing:
    """The price of a dual point: `scale` is the largest s with price - s value >= 0 on the whole cone.

    `directions` are the members of the cone (in a form of the basis) where the inequality is tightest. They
    are added to a face when the dual point came from a face alone.
    """

    scale: float
    directions: Array


class Basis(Protocol):
    """A linear family of spectra, x (size,) -> Phi, with the cone of its nonnegative members.

    The cone is never handed to a solver whole. A design starts on `first_face` and enlarges it where
    `price` shows that a spectrum outside of it would pay.

    A family has a density over frequency, or it consists of sinusoids; the other of `density` and `lines` is
    then empty. Densities of one input are (n,), of r inputs Hermitian (n, r, r).
    """

    @property
    def size(self) -> int:
        """Return the number of unknowns."""

    @property
    def inputs(self) -> int:
        """Return the number of inputs r."""

    @property
    def has_density(self) -> bool:
        """Return whether the family has a density over frequency (else it consists of sinusoids)."""

    @property
    def free(self) -> bool:
        """Return whether the family can grow to every spectrum."""

    @property
    def degree(self) -> int:
        """Return how fast a density may oscillate over the band, as the degree of a polynomial."""

    @property
    def knots(self) -> Array:
        """Return frequencies at which the density may have a kink."""

    def density(self, x: Array, w: ArrayLike) -> NDArray:
        """Return Phi at frequencies `w` (n,)."""

    def lines(self, x: Array) -> tuple[Array, ComplexArray]:
        """Return frequencies (L,), ascending, and power matrices (L, r, r) of sinusoids with power."""

    def spread(self, powers: Array) -> Array:
        """Return flat uncorrelated excitation (size,) with these powers (r,) of the channels."""

    @property
    def even(self) -> Array:
        """Return `spread` of total power one, (size,), even over the channels."""

    def in_units(self, units: Array) -> Basis:
        """Return the family for channels of these units (r,), if they change where a design begins."""

    def moving_average(self, x: Array) -> Array | None:
        """Return c_0 .. c_m of one input, where a moving average has this spectrum; else None."""

    def directed(self, frequency: float, direction: ComplexArray) -> Array:
        """Return v^* Phi v at one frequency, v the `direction` (r,), as a functional, (size,)."""

    def integrals(
        self, density: Density, singularities: ComplexArray, factor: Factor | None = None
    ) -> NDArray[np.float64]:
        """Return (1 / 2 pi) integral of tr(density(w) Phi(w)) for each basis function, (size, ...).

        If the density has a `factor`, families of several inputs need not form the density.
        """

    def beyond(self, number: int) -> Basis:
        """Return the basis functions after the first ones, for families that grow."""

    def coarser(self) -> Sequence[Basis]:
        """Return smaller families to design first, coarse to fine; x of each is the head of x of the next."""

    def first_face(self, price: Functional) -> Face:
        """Return a face rich enough to identify every parameter, with columns of like price."""

    def price(self, price: Functional, value: Functional, grid: Array) -> Pricing:
        """Return the largest scale of the dual point, and where it is tightest."""

    def enlarge(self, face: Face, y: Array, directions: Array, price: Functional) -> tuple[Basis, Face]:
        """Return a face that holds the solution `y` and the `directions` (the basis may grow with it)."""

    def described(self, x: Array, unit: float) -> Mapping[str, object]:
        """Return the type of the family and the data that restate the spectrum, as plain data and arrays.

        Args:
            unit: frequencies are divided by it to be in the user's unit.
        """


class DensityFamily:
    """Holds the common part of families with a density over frequency."""

    has_density = True
    free = False

    @property
    def knots(self) -> Array:
        """Return no knots, since the density has no kinks."""
        return np.zeros(0)

    if TYPE_CHECKING:

        @property
        def inputs(self) -> int:
            """Return the number of inputs r."""

        def spread(self, powers: Array) -> Array:
            """See `Basis`."""

    @property
    def even(self) -> Array:
        """Return total power one, even over the channels, (size,)."""
        return self.spread(np.full(self.inputs, 1.0 / self.inputs))

    def lines(self, x: Array) -> tuple[Array, ComplexArray]:
        """Return no lines: there are no sinusoids."""
        return np.zeros(0), np.zeros((0, self.inputs, self.inputs), dtype=complex)

    def moving_average(self, x: Array) -> Array | None:
        """Return None: there is no finite moving average."""
        return None

    def beyond(self, number: int) -> Self:
        """Raise `ValueError`: a family with a density does not grow."""
        raise ValueError("a family with a density does not grow")

    def in_units(self, units: Array) -> Self:
        """Return the family itself: units do not matter."""
        return self
