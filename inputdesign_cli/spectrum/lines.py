"""Line spectra: sinusoids of free power, at given frequencies or wherever they pay.

Each has a direction v across the channels; the power matrix of a line, Hermitian (r, r), is the sum over its
directions of power v v^*. With free frequencies these stand for every spectrum: an information matrix that
some spectrum reaches is reached by finitely many sinusoids (Caratheodory).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.spectrum.basis import Density, Face, Factor, Functional, Pricing
from inputdesign_cli.spectrum.directions import (
    directed_scale,
    every_direction,
    first_directions,
    inverse_of,
    matrices,
)

_FIRST_LINES, _FEWEST_LINES, _FIRST_ATOMS = 24, 6, 800
# New atoms a round, for each input and in all, and how many of them get neighbours (see `_around`).
_NEW_EACH, _MOST_NEW, _MOST_ACCOMPANIED = 16, 64, 16
# A face with more atoms than the first number keeps the second number, with the most power.
_MOST_ATOMS, _KEPT_ATOMS = 320, 200
_ATOMS_AT_ONCE = 256
# Two atoms at one frequency are the same when their directions agree this closely.
_SAME = 1e-12
# Share of the cost from which an atom is in use; distance (in frequency and direction) of a neighbour.
_USED = 1e-4
_NEAR = 0.2
# Least price, relative to the largest, by which an atom is scaled: some atoms are nearly free.
_LEAST_PRICE = 1e-12


@dataclass(frozen=True)
class LinesBasis:
    """The unknowns are the powers of atoms: sinusoids at `frequencies` (L,) along `directions` (L, r).

    Directions have length one, so that the power is the total over the channels; they are compared in
    `units` (r,) of the channels. The basis grows by the atoms that would pay: anywhere on the grid when
    `free`, else at `allowed` frequencies with any direction. Prices then hold for every spectrum, or for
    every spectrum on the allowed lines.
    """

    frequencies: Array
    directions: ComplexArray
    allowed: Array
    units: Array
    free: bool = False

    has_density = False
    degree = 0
    knots = np.zeros(0)

    @classmethod
    def anywhere(cls, lo: float, hi: float, inputs: int) -> LinesBasis:
        """Return free frequencies on [lo, hi], at first some spread linearly and logarithmically."""
        low = max(lo, 1e-3 * hi)
        number = int(np.clip(_FIRST_ATOMS // (2 * inputs**2), _FEWEST_LINES, _FIRST_LINES))
        start = np.concatenate([np.linspace(low, hi, number), np.geomspace(low, hi, number)])
        return replace(cls.at(np.unique(start), inputs), free=True)

    @classmethod
    def at(cls, frequencies: Array, inputs: int) -> LinesBasis:
        """Return lines at these frequencies, at first along each channel and pair of channels."""
        even = np.zeros((frequencies.size, inputs), dtype=complex)
        return cls(frequencies, even, frequencies, np.ones(inputs)).in_units(np.ones(inputs))

    def in_units(self, units: Array) -> LinesBasis:
        """Return the first lines again, with directions that suit channels of these units (r,)."""
        start = first_directions(units)
        w = self.allowed
        return replace(
            self, frequencies=np.repeat(w, len(start)), directions=np.tile(start, (w.size, 1)), units=units
        )

    @cached_property
    def size(self) -> int:
        """Return the number of unknowns."""
        return self.frequencies.size

    @cached_property
    def inputs(self) -> int:
        """Return the number of inputs r."""
        return self.directions.shape[1]

    def density(self, x: Array, w: ArrayLike) -> NDArray:
        """Return zero: sinusoids have no density."""
        shape = () if self.inputs == 1 else (self.inputs, self.inputs)
        return np.zeros((np.size(w), *shape))

    def directed(self, frequency: float, direction: ComplexArray) -> Array:
        """Return zero, since the density is zero."""
        return np.zeros(self.size)

    @property
    def even(self) -> Array:
        """Return power one, spread evenly over the lines and channels, (L,)."""
        return self.spread(np.full(self.inputs, 1.0 / self.inputs))

    def coarser(self) -> list[LinesBasis]:
        """Return no coarser basis: lines are cheap."""
        return []

    def spread(self, powers: Array) -> Array:
        """Return these powers (r,) of the channels, uncorrelated, each spread evenly over the lines, (L,)."""
        axes = (np.abs(self.directions) > 1.0 - _SAME).astype(float)
        return axes @ (powers / np.sum(axes, axis=0))

    def integrals(
        self, density: Density, singularities: ComplexArray, factor: Factor | None = None
    ) -> NDArray[np.float64]:
        """Return v^* D(w) v, the functional of an atom of power one, (L, ...)."""
        if factor is not None and self.inputs > 1:
            return self._products(factor)
        values = density(self.frequencies)
        if self.inputs == 1:
            return values
        return np.einsum("na,n...ab,nb->n...", self.directions.conj(), values, self.directions).real

    def _products(self, factor: Factor) -> NDArray[np.float64]:
        """Return Re (F v) (F v)^*, a part of the atoms at a time, (L, k, k)."""
        found = []
        for start in range(0, self.size, _ATOMS_AT_ONCE):
            part = slice(start, start + _ATOMS_AT_ONCE)
            w, where = np.unique(self.frequencies[part], return_inverse=True)
            F = factor(w)[where.ravel()]
            along = (F @ self.directions[part][:, None, :, None])[..., 0]
            real = np.concatenate([along.real, along.imag], axis=2)
            found.append(real @ real.swapaxes(1, 2))
        return np.concatenate(found)

    def beyond(self, number: int) -> LinesBasis:
        """Return the atoms after the first ones."""
        return replace(self, frequencies=self.frequencies[number:], directions=self.directions[number:])

    def first_face(self, price: Functional) -> Face:
        """Return all atoms, in units of their price."""
        return self._face(np.arange(self.size), price.vector)

    def _face(self, atoms: NDArray[np.intp], prices: Array) -> Face:
        """Return these atoms, each in units of its price; the generators are their numbers."""
        columns = np.zeros((self.size, atoms.size))
        columns[atoms, np.arange(atoms.size)] = 1.0 / np.maximum(prices[atoms], _LEAST_PRICE * prices.max())
        return Face(columns, "nonnegative", atoms.size, atoms)

    def price(self, price: Functional, value: Functional, grid: Array) -> Pricing:
        """Return the ratio over all allowed frequencies and directions, and new atoms (frequency, direction).

        A frequency may get several of its stationary directions at once: the power matrix there may need
        them together, and one direction a round would take more rounds.
        """
        scale, where = directed_scale(price, value, grid) if self.free else (None, self.allowed)
        ratios, directions = every_direction(price.density(where), value.density(where))
        best = np.argsort(-ratios, axis=None, kind="stable")[: min(_NEW_EACH * self.inputs, _MOST_NEW)]
        number, which = np.unravel_index(best, ratios.shape)
        atoms = np.column_stack([where[number], directions[number, which]])
        return Pricing(inverse_of(ratios) if scale is None else scale, atoms)

    def enlarge(self, face: Face, y: Array, directions: Array, price: Functional) -> tuple[LinesBasis, Face]:
        """Return the atoms so far and the new ones; x of the old basis is the head of x of the new.

        A face with very many atoms loses the faintest. They come back when they pay.
        """
        number = face.generators
        power = np.zeros(self.size)
        power[number[: y.size]] = y
        rows = [*directions, *self._around(power, directions[:_MOST_ACCOMPANIED])]
        known = [self._known(float(row[0].real), row[1:]) for row in rows]
        fresh = [row for row, at in zip(rows, known, strict=True) if at is None]
        back = np.setdiff1d([at for at in known if at is not None], number).astype(np.intp)
        if not fresh and not back.size:
            return self, face
        kept = number
        if number.size > _MOST_ATOMS:
            kept = np.sort(number[np.argsort(-y)[:_KEPT_ATOMS]])
        added = np.array(fresh).reshape(-1, 1 + self.inputs)
        grown = replace(
            self,
            frequencies=np.concatenate([self.frequencies, added[:, 0].real]),
            directions=np.concatenate([self.directions, added[:, 1:]]),
        )
        at = matrices(price.density(added[:, 0].real))
        costs = np.einsum("na,nab,nb->n", added[:, 1:].conj(), at, added[:, 1:]).real
        atoms = np.concatenate([kept, back, np.arange(self.size, grown.size)])
        return grown, grown._face(atoms, np.concatenate([price.vector, costs]))

    def _around(self, y: Array, atoms: NDArray) -> list[NDArray]:
        """Return atoms halfway from the nearest atom in use to each of the new ones, and as far beyond.

        Each round moves the best frequencies and directions a little less than the round before. Atoms on
        both sides of a new one save a quarter of the rounds.
        """
        used = np.flatnonzero(y > _USED * y.sum())
        span, found = max(float(np.ptp(self.allowed)), np.finfo(float).tiny), []
        for atom in atoms if used.size else []:
            w, v = float(atom[0].real), atom[1:]
            apart = np.abs(self.frequencies[used] - w) / span
            turned = 1.0 - self._alike(self.directions[used], v)
            distance = np.where(self.free | (apart == 0.0), apart + turned, np.inf)
            nearest = used[int(np.argmin(distance))]
            if distance.min() > _NEAR:
                continue
            old = self.directions[nearest]
            phase = np.vdot(old, v)
            old = old * phase / abs(phase)
            for share in (0.5, 1.5):
                at = self.frequencies[nearest] + share * (w - self.frequencies[nearest])
                turn = old + share * (v - old)
                if self.allowed[0] <= at <= self.allowed[-1]:
                    found.append(np.concatenate([[at], turn / np.linalg.norm(turn)]))
        return found

    def _known(self, frequency: float, direction: ComplexArray) -> int | None:
        """Return the number of this atom, if it is known."""
        near = np.flatnonzero(np.abs(self.frequencies - frequency) <= 1e-10 * max(frequency, 1e-300))
        same = near[self._alike(self.directions[near], direction) > 1.0 - _SAME]
        return int(same[0]) if same.size else None

    def _alike(self, directions: ComplexArray, direction: ComplexArray) -> Array:
        """Return squared cosines between directions, in the units of the channels, (n,)."""
        one, other = directions / self.units, direction / self.units
        size = np.linalg.norm(one, axis=1) * np.linalg.norm(other)
        return np.abs(one.conj() @ other / size) ** 2

    def moving_average(self, x: Array) -> Array | None:
        """Return None: sinusoids have no density."""
        return None

    def lines(self, x: Array) -> tuple[Array, ComplexArray]:
        """Return frequencies (number,) with power, ascending, and their power matrices (number, r, r)."""
        w, inverse = np.unique(self.frequencies, return_inverse=True)
        power = np.zeros((w.size, self.inputs, self.inputs), dtype=complex)
        outer = np.einsum("na,nb->nab", self.directions, self.directions.conj())
        np.add.at(power, inverse.ravel(), np.maximum(x, 0.0)[:, None, None] * outer)
        kept = np.trace(power, axis1=1, axis2=2).real > 0
        return w[kept], power[kept]

    def described(self, x: Array, unit: float) -> Mapping[str, object]:
        """Return frequencies and powers: numbers of one input, else Hermitian matrices."""
        w, powers = self.lines(x)
        shown = powers[:, 0, 0].real if self.inputs == 1 else powers
        return {"type": "free" if self.free else "multisine", "frequencies": w / unit, "powers": shown}
