"""Transfer matrices in s, with dead times.

[mohan-spectral], (1)-(2): G_ij = e^(-tau_ij s) sum_k b_ij^(k) s^k / sum_k a_ij^(k) s^k; the denominators are
monic, and dG/dtau = -s G.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.polynomial import polynomial as ascending
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray, Rows
from inputdesign_cli.plant.frequencies import frequency_plane
from inputdesign_cli.plant.held import HeldEntry, Intersample, polynomial_roots
from inputdesign_cli.plant.model import DELAY, Fraction, Parameter, WhiteNoise, entry_label, tables_at


@dataclass(frozen=True)
class ContinuousModel(WhiteNoise):
    """A stable transfer matrix in s with white noise of a full covariance (p, p) on its sampled outputs.

    `numerator` and `denominator` hold ascending coefficients, s^0 first; denominators are monic. With
    `common` all entries share one denominator and its parameters. `delay` holds a list of one dead time for
    each entry, an empty list if it has none; it is empty if no entry has one. `entries` are the present
    entries; if None, the ones whose numerator is not zero.

    Parameters are named after their power of s: `b0[2,1]` in the numerator, `a1[2,1]` in the denominator of
    entry (2, 1), `delay[2,1]` its dead time; common ones, and of one input and output, go without brackets.
    """

    numerator: Rows
    denominator: Rows
    covariance: Array
    common: bool = False
    delay: Rows = ()
    common_delay: bool = False
    entries: tuple[tuple[int, int], ...] | None = None

    continuous = True

    @classmethod
    def monic(
        cls,
        numerator: Rows,
        denominator: Rows,
        covariance: Array,
        *,
        common: bool = False,
        delay: Rows = (),
        common_delay: bool = False,
        degrees: Sequence[Sequence[int]] | None = None,
    ) -> ContinuousModel:
        """Build from any coefficients: each entry divided by the leading coefficient of its denominator.

        The `degrees` (p, r) of numerators are -1 for absent entries; without them trailing zeros are dropped.
        """
        tops = [[np.asarray(t, dtype=float) for t in row] for row in numerator]
        sizes = (
            [[np.trim_zeros(t, "b").size - 1 for t in row] for row in tops] if degrees is None else degrees
        )
        low, high = [], []
        for top, size, bottom in zip(tops, sizes, denominator, strict=True):
            bottoms = [np.trim_zeros(np.asarray(b, dtype=float), "b") for b in bottom]
            high.append(tuple(b / b[-1] for b in bottoms))
            low.append(tuple(t[: max(n, 0) + 1] / b[-1] for t, n, b in zip(top, size, bottoms, strict=True)))
        entries = tuple((i, j) for i, row in enumerate(sizes) for j, size in enumerate(row) if size >= 0)
        return cls(tuple(low), tuple(high), covariance, common, delay, common_delay, entries)

    @property
    def outputs(self) -> int:
        """Return the number of outputs p."""
        return len(self.numerator)

    @property
    def inputs(self) -> int:
        """Return the number of inputs r."""
        return len(self.numerator[0])

    @cached_property
    def active(self) -> tuple[tuple[int, int], ...]:
        """Return the entries that are not absent."""
        if self.entries is not None:
            return self.entries
        places = ((i, j) for i in range(self.outputs) for j in range(self.inputs))
        return tuple((i, j) for i, j in places if np.any(self.numerator[i][j]))

    @cached_property
    def at_once(self) -> NDArray[np.bool_]:
        """Return the entries of G that may act without delay, (p, r), see `Model`."""
        found = np.zeros((self.outputs, self.inputs), dtype=bool)
        for i, j in self.active:
            equal = self.numerator[i][j].size == self.denominator[i][j].size
            found[i, j] = equal and self.dead_time(i, j) == 0.0
        return found

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return numerator coefficients entry by entry, then denominator coefficients, then dead times."""
        single = self.outputs == self.inputs == 1
        found = [
            Parameter("b", power, ((i, j),), entry_label(i, j, single=single), float(value))
            for i, j in self.active
            for power, value in enumerate(self.numerator[i][j])
        ]
        groups = [self.active] if self.common else [(place,) for place in self.active]
        for places in groups:
            i, j = places[0]
            label = "" if self.common else entry_label(i, j, single=single)
            found += [
                Parameter("a", power, places, label, float(value))
                for power, value in enumerate(self.denominator[i][j][:-1])
            ]
        late = [place for place in self.active if self._delays(place).size]
        together = self.common_delay and late
        for places in [tuple(late)] if together else [(place,) for place in late]:
            label = "" if self.common_delay else entry_label(*places[0], single=single)
            found.append(Parameter(DELAY, 0, places, label, self.dead_time(*places[0])))
        return tuple(found)

    def dead_time(self, output: int, input: int) -> float:
        """Return the dead time of an entry."""
        return float(np.sum(self._delays((output, input))))

    def _delays(self, place: tuple[int, int]) -> Array:
        """Return a list of the dead time of an entry, empty where it has none."""
        return self.delay[place[0]][place[1]] if self.delay else np.zeros(0)

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> ContinuousModel:
        """Return the structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""
        tables = tables_at(
            self.parameters, theta, {"b": self.numerator, "a": self.denominator, DELAY: self.delay}
        )
        return replace(
            self,
            numerator=tables["b"],
            denominator=tables["a"],
            delay=tables[DELAY],
            covariance=self.covariance if covariance is None else covariance,
            entries=self.active,
        )

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """Return the response (.., n, p) to the band-limited interpolation of u (.., n, r), and e itself."""
        return self.driven(u, Intersample(step, hold=False)), e

    def driven(self, u: Array, intersample: Intersample) -> Array:
        """Return the outputs (.., n, p) that samples u (.., n, r) cause, from rest."""
        y = np.zeros((*u.shape[:-1], self.outputs))
        for i, j in self.active:
            y[..., i] += intersample.caused(self.held(i, j, intersample.sample_time), u[..., j])
        return y

    def held(self, output: int, input: int, sample_time: float) -> HeldEntry:
        """Return one entry as samples drive it."""
        rows = (self.numerator, self.denominator)
        above, below = (part[output][input] for part in rows)
        late = self._delays((output, input))
        delay = float(late[0]) if late.size else None
        return _held(tuple(above.tolist()), tuple(below.tolist()), sample_time, delay)

    @cached_property
    def poles(self) -> ComplexArray:
        """Return the poles in s of all entries."""
        parts = [polynomial_roots(self.denominator[i][j]) for i, j in self.active]
        return np.concatenate(parts)

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return the poles of G and of all gradients, as points of the frequency plane."""
        return frequency_plane(self.poles)

    @property
    def radius(self) -> float:
        """See `Model`."""
        return float(np.exp(np.max(self.poles.real, initial=-np.inf)))

    @property
    def plant_points(self) -> ComplexArray:
        """Return the poles of G alone, as points of the frequency plane."""
        return frequency_plane(self.poles)

    def entry_singularities(self, output: int, input: int) -> ComplexArray:
        """Return the poles and zeros of one entry of G, as points of the frequency plane."""
        return frequency_plane(
            np.concatenate([polynomial_roots(p[output][input]) for p in (self.numerator, self.denominator)])
        )

    @property
    def memory(self) -> float:
        """Return the longest dead time."""
        return max((self.dead_time(i, j) for i, j in self.active), default=0.0)

    def bends(self, output: int, input: int) -> NDArray[np.bool_]:
        """Return a mask (k,) of the dead time."""
        place = (output, input)
        return np.array([p.letter == DELAY and place in p.places for p in self.parameters], dtype=bool)

    def entry_fraction(self, output: int, input: int, w: ArrayLike) -> Fraction:
        """Return one entry of G as a fraction, with gradients (n, k); the numerator has the dead time."""
        s = 1j * np.atleast_1d(np.asarray(w))
        above = np.zeros((s.size, len(self.parameters)), dtype=complex)
        below = np.zeros_like(above)
        late = self._late(s, output, input)
        for index, parameter in enumerate(self.parameters):
            if (output, input) in parameter.places and parameter.letter != DELAY:
                gradient = above if parameter.letter == "b" else below
                gradient[:, index] = s**parameter.power
        numerator = late * ascending.polyval(s, self.numerator[output][input])
        return Fraction(numerator, self._below(s, output, input), late[:, None] * above, below)

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """Return the frequency response G as (n, p, r)."""
        s = 1j * np.atleast_1d(np.asarray(w))
        G = np.zeros((s.size, self.outputs, self.inputs), dtype=complex)
        for i, j in self.active:
            above = self._late(s, i, j) * ascending.polyval(s, self.numerator[i][j])
            G[:, i, j] = above / self._below(s, i, j)
        return G

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the gradient dG/dtheta as (n, k, p, r)."""
        s = 1j * np.atleast_1d(np.asarray(w))
        gradient = np.zeros((s.size, len(self.parameters), self.outputs, self.inputs), dtype=complex)
        for index, parameter in enumerate(self.parameters):
            for i, j in parameter.places:
                below = self._below(s, i, j)
                factor = self._late(s, i, j) / below
                if parameter.letter == "a":
                    factor = -ascending.polyval(s, self.numerator[i][j]) * factor / below
                if parameter.letter == DELAY:
                    factor = -s * ascending.polyval(s, self.numerator[i][j]) * factor
                gradient[:, index, i, j] = factor * s**parameter.power
        return gradient

    def _late(self, s: ComplexArray, i: int, j: int) -> ComplexArray:
        """Return the factor by which the dead time of an entry multiplies it."""
        return np.asarray(np.exp(-s * self.dead_time(i, j)), dtype=complex)

    def _below(self, s: ComplexArray, i: int, j: int) -> ComplexArray:
        return np.asarray(ascending.polyval(s, self.denominator[i][j]), dtype=complex)


@lru_cache(maxsize=64)
def _held(
    above: tuple[float, ...], below: tuple[float, ...], sample_time: float, delay: float | None
) -> HeldEntry:
    """Return one entry as samples drive it; the segments of a record share its matrix exponential."""
    return HeldEntry.of(np.array(above), np.array(below), sample_time, delay)
