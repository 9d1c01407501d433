"""The autocovariances that signals within an amplitude can have: a polytope, known by its best cycles."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import scipy
from numpy.polynomial.chebyshev import chebval
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.amplitude.windows import Windows, weighted

# Most cycles of one search. A facet is found when no cycle exceeds it by the second number; a cycle that
# exceeds it by the third is taken without a search for the best one.
_MOST_CYCLES, _CLOSE, _DEEP = 400, 1e-5, 1e-3
_BOX, _SAME = 1e3, 1e-12  # largest entries of a form; largest difference between equal lags
_FIRST = 60


@dataclass(frozen=True)
class Facet:
    """A form (m, r, r), at most one for all signals within the amplitude, and its value at some lags."""

    form: Array
    share: float


@dataclass
class LagPolytope:
    """The autocovariances of all signals of some windows: the hull of the best cycles, and of zero.

    It remembers the `cycles` (period, r) and the `forms` of the facets that searches have found. Values are
    held for `hold` samples each.
    """

    windows: Windows
    hold: int = 1
    cycles: list[Array] = field(default_factory=list)
    forms: list[NDArray[np.float64]] = field(default_factory=list)
    _columns: list[Array] = field(default_factory=list, init=False, repr=False)
    _values: Array | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        """Begin with a few cycles, which bound the forms of a search."""
        letters, rng = self.windows.letters, np.random.default_rng(0)
        first = [letters[[i, j]] for i in range(len(letters)) for j in range(i, len(letters))]
        tried = letters[rng.integers(len(letters), size=(_FIRST, 2 * self.windows.length))]
        self.cycles = self.cycles or [*first, *tried]
        self._columns = [self.windows.lags(cycle).ravel() for cycle in self.cycles]

    def longer(self, length: int) -> LagPolytope:
        """Return the polytope of longer windows, which knows the same cycles and facets."""
        more = length - self.windows.length
        forms = [np.pad(form, ((0, more), (0, 0), (0, 0))) for form in self.forms]
        return LagPolytope(Windows(self.windows.letters, length), self.hold, self.cycles, forms)

    def gauge(self, lags: Array) -> tuple[float, Facet]:
        """Return the least multiple of the polytope that contains lags (m, r, r), and a facet that shows it.

        The multiple rests on the known cycles, so that it is an upper bound; the facet proves a lower one.
        """
        inputs, unit = self.windows.letters.shape[1], float(np.abs(self.windows.letters).max()) ** 2
        twice = weighted(np.ones_like(lags)).ravel()
        goal = lags.ravel() * twice / unit
        size = float(np.abs(goal).max()) or 1.0  # the solver takes large numbers for infinite
        # Forms that are convex in every value are largest at the ends of its range.
        lower = np.full(lags.shape, -_BOX)
        lower[0, range(inputs), range(inputs)] = 0.0
        bounds = np.column_stack([lower.ravel(), np.full(goal.size, _BOX)])
        best, multiple = Facet(np.zeros(lags.shape), 0.0), np.inf
        for _ in range(_MOST_CYCLES):
            columns, ones = np.array(self._columns) * twice / unit, np.ones(len(self._columns))
            found = scipy.optimize.linprog(-goal / size, A_ub=columns, b_ub=ones, bounds=bounds)
            multiple, form = -found.fun * size, found.x.reshape(lags.shape) / unit
            form[0] = 0.5 * (form[0] + form[0].T)
            most, cycle, self._values = self.windows.largest_mean(form, self._values, 1.0 + _DEEP)
            if multiple / most > best.share:
                best = Facet(form / most, multiple / most)
            column = self.windows.lags(cycle).ravel()
            known = np.abs(np.array(self._columns) - column).max(axis=1).min() < _SAME * unit
            if most <= 1.0 + _CLOSE or known:
                break
            self.cycles.append(cycle)
            self._columns.append(column)
        return multiple, best

    def density_of(self, form: Array, w: Array) -> NDArray:
        """Return the density (n, r, r) whose mean over a spectrum is the form (m, r, r) of its lags."""
        if form.shape[1] == 1:  # a sum of cosines, by the recurrence of Clenshaw
            return chebval(np.cos(self.hold * w), weighted(form)[:, 0, 0])[:, None, None]
        turns = np.exp(-1j * self.hold * np.multiply.outer(w, np.arange(len(form))))
        half = np.tensordot(turns[:, 1:], form[1:], axes=1)
        return form[0] + half + half.conj().swapaxes(1, 2)

    def lag_densities(self, w: Array) -> NDArray:
        """Return the densities of each entry of the lags, (n, m, r, r, r, r); for one input (n, m)."""
        length, inputs = self.windows.length, self.windows.letters.shape[1]
        turns = np.exp(1j * self.hold * np.multiply.outer(w, np.arange(length)))
        if inputs == 1:
            return turns.real
        unit = np.eye(inputs**2).reshape(inputs, inputs, inputs, inputs)
        half = 0.5 * turns[..., None, None, None, None] * unit.swapaxes(2, 3)
        return half + half.conj().swapaxes(-1, -2)
