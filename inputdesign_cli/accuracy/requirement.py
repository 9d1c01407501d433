"""Requirements as a design uses them: whether they are met, where they are missed, and their cones.

A requirement is one condition, or one at every frequency of a band. A grid resolves every resonance there,
and peaks are refined between its points.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.accuracy.cuts import Cut
from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import Model, graded_grid, local_maxima
from inputdesign_cli.plant.frequencies import SLACK

Entry = tuple[int, int]

# A peak nearer to frequency zero than this share of the band is at zero, if the ratio there is as large.
# With slow plants and integrating controllers rounding leaves about nine digits of the ratio there.
_BESIDE_ZERO, _FLAT, _ROUNDING = 1e-6, 1e-8, 1e-12
# Largest damping of a pole on the circle; shares of the band where rounding hides the ratio, and of its ends.
_ON_THE_CIRCLE, _HIDDEN, _EDGE = 1e-7, 1e-5, 1e-9
_GROWS = 5.0  # |G| grows by more than this, at a tenth of the distance from a pole
_STEP = 1e-5  # step of a difference quotient, relative to M
_KEPT = 8  # sets of frequencies whose rows are cached
# In the coordinates of a design, smaller eigenvalues of the information, relative to the largest, are errors
# of rounding. Compared with sixty digits, ratios are wrong by a thousandth there, and by any factor below.
_SINGULAR = 1e-12


@dataclass(frozen=True)
class Violation:
    """Holds a local maximum of the ratio of a requirement (above 1: missed), and its frequency, if any."""

    ratio: float
    frequency: float | None = None


class Requirement(ABC):
    """A convex condition on the information matrix M (k, k) in the coordinates of the experiment.

    Its `ratio` is measured as an error is, in standard deviations: with ratio r, the matrix r^2 M just
    meets the requirement (and no smaller multiple does). A new requirement is a subclass that defines
    `name`, `violations`, `ratios` and `cut`; the other methods have defaults.
    """

    @property
    @abstractmethod
    def name(self) -> str:
        """Return the name of the requirement in the spec, for reports."""

    @property
    def entry(self) -> Entry | None:
        """Return the entry (output, input) of G, counted from zero; None for G as a whole."""
        return None

    @property
    def of_the_norm(self) -> bool:
        """Return whether it concerns the Frobenius norm of all entries of G."""
        return False

    @property
    def definite(self) -> bool:
        """Return whether the requirement excludes a singular M."""
        return True

    @abstractmethod
    def violations(self, information: Array, *, above: float = -np.inf) -> list[Violation]:
        """Return every local maximum over frequency of the ratio (at most one if met), if above `above`."""

    @abstractmethod
    def ratios(self, information: Array, frequencies: Array) -> Array:
        """Return the ratio at given frequencies, (n,)."""

    def slope(self, information: Array, frequencies: Array, shares: Array) -> Array:
        """Return minus the gradient in M of the sum of `shares` (n,) times squared ratios, (k, k).

        It is taken by differences unless a subclass knows it.
        """
        size, slope = len(information), np.zeros_like(information)
        for i, j in zip(*np.triu_indices(size), strict=True):
            step = _STEP * np.sqrt(information[i, i] * information[j, j])
            turn = np.zeros_like(information)
            turn[i, j] = turn[j, i] = step
            down, up = (self.ratios(information + sign * turn, frequencies) ** 2 for sign in (-1.0, 1.0))
            slope[i, j] = slope[j, i] = shares @ (down - up) / (2.0 * step * (1.0 if i == j else 2.0))
        return slope

    @abstractmethod
    def cut(self, frequency: float | None) -> Cut:
        """Return the cone that enforces the requirement at this frequency."""

    def most(self, information: Array) -> float:
        """Return an upper bound on the largest ratio, without a slow search for it."""
        return worst(self.violations(information)).ratio

    def least(self, information: Array) -> float:
        """Return a lower bound on the largest ratio, without a slow search for it."""
        return worst(self.violations(information)).ratio

    def worst(self, information: Array) -> Violation:
        """Return the largest of the violations, for reports."""
        return worst(self.violations(information))


class OneCondition(Requirement):
    """A requirement that does not depend on frequency and has a single ratio."""

    @abstractmethod
    def ratio(self, information: Array) -> float:
        """Return the ratio, see `Requirement`."""

    def violations(self, information: Array, *, above: float = -np.inf) -> list[Violation]:
        """Return the single ratio as a violation, if it exceeds `above`."""
        ratio = self.ratio(information)
        return [Violation(ratio)] if ratio > above else []

    def ratios(self, information: Array, frequencies: Array) -> Array:
        """Return the single ratio, repeated for every frequency."""
        return np.full(np.shape(frequencies), self.ratio(information))


class _LastResults:
    """Holds the last results of a requirement, since later calls often need them again."""

    def __init__(self) -> None:
        self.looked: tuple[Array, Array, Array] | None = None  # M, K^T and the ratio on the grid
        self._rows: dict[bytes, NDArray[np.float64]] = {}

    def rows_at(self, w: Array, rows: Callable[[Array], NDArray[np.float64]]) -> NDArray[np.float64]:
        """Return `rows` (w), cached since a search for a peak often begins at the same points."""
        key = w.tobytes()
        if key not in self._rows:
            if len(self._rows) >= _KEPT:
                self._rows.clear()
            self._rows[key] = rows(w)
        return self._rows[key]


@dataclass(frozen=True, kw_only=True)
class OverFrequency(Requirement):
    """A requirement whose ratio at w depends on M through T(w) M^-1 T(w)^T, T = `rows` (q, k).

    It concerns one `entry` of G, or all of them together; `band` is in the unit of the experiment. Subclasses
    give `weight_at` or `rows`, often `measure`, and the points of the frequency plane near which they change
    fast (`own_singularities`) or have a kink (`knots`).
    """

    experiment: Experiment
    band: tuple[float, float]
    entry: Entry | None = None

    @property
    def of_the_norm(self) -> bool:
        """Return whether no entry is named although there are several."""
        return self.entry is None and self.experiment.model.outputs * self.experiment.model.inputs > 1

    @property
    @abstractmethod
    def own_singularities(self) -> ComplexArray:
        """Return the singularities other than from the plant and its loop."""

    @property
    def knots(self) -> Array:
        """Return frequencies at which the ratio may have a kink."""
        return np.zeros(0)

    def weight_at(self, w: ArrayLike) -> Array:
        """Return the weight (n,) of an error of the entry; one by default."""
        return np.ones(np.shape(w))

    def rows(self, w: ArrayLike) -> NDArray[np.float64]:
        """Return T(w), (n, q, k); by default the `plant_rows` times their weight."""
        weight, gradient = self.weight_at(w), self.experiment.model.plant_gradient(w)
        return self._rows_of(gradient) * weight[:, None, None]

    def measure(self, half: NDArray[np.float64], w: Array) -> Array:
        """Return the ratio (n,) from half = T K^T (n, q, k), K^T K = M^-1; r_u / r_adm by default."""
        return largest_singular(half)

    def ratio_rows(self, half: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return rows (n, m, k) made of the rows of half; their squares add up to the squared ratio."""
        if half.shape[1] != 2:
            return np.linalg.eigh(half @ half.swapaxes(1, 2))[1][:, None, :, -1] @ half
        real, imaginary = half[:, :1], half[:, 1:]
        a, b, d = (
            np.sum(x * y, axis=2) for x, y in ((real, real), (real, imaginary), (imaginary, imaginary))
        )
        angle = 0.5 * np.arctan2(2.0 * b, a - d)[:, None]
        return np.cos(angle) * real + np.sin(angle) * imaginary

    def plant_rows(self, w: ArrayLike) -> NDArray[np.float64]:
        """Return real and imaginary parts of the gradient of the entry (n, 2, k), or of all (n, 2 p r, k).

        In memory the frequencies stand side by side, as in `turned`.
        """
        return self._rows_of(self.experiment.model.plant_gradient(w))

    def _rows_of(self, gradient: ComplexArray) -> NDArray[np.float64]:
        if self.entry is not None:
            gradient = gradient[:, :, self.entry[0], self.entry[1]]
        n, k = gradient.shape[:2]
        flat = gradient.reshape(n, k, -1).transpose(1, 2, 0)
        columns = np.concatenate([flat.real, flat.imag], axis=1)
        return (self._whitener @ columns.reshape(k, -1)).reshape(columns.shape).T

    @cached_property
    def _whitener(self) -> Array:
        """Return the matrix (k, k) that brings gradients of raw parameters to these coordinates."""
        return self.experiment.from_raw

    def concerned(self, G: ComplexArray) -> ComplexArray:
        """Return the entry (n, 1) of G (n, p, r), or all of them (n, p r)."""
        if self.entry is None:
            return G.reshape(len(G), G.shape[1] * G.shape[2])
        return G[:, self.entry[0], self.entry[1], None]

    def nominal_size(self, w: ArrayLike) -> Array:
        """Return |G| (n,) of the entry, or the Frobenius norm."""
        return np.linalg.norm(self.concerned(self.experiment.model.plant_at(w)), axis=1)

    @cached_property
    def grid_singularities(self) -> ComplexArray:
        """Return points of the frequency plane near which G, the requirement or the loop change fast."""
        model = self.experiment.model
        plant = model.singularities if self.entry is None else model.entry_singularities(*self.entry)
        return np.concatenate([plant, self.experiment.singularities, self.own_singularities])

    @cached_property
    def grid(self) -> Array:
        """Return frequencies of the band that resolve every resonance of G, the requirement and the loop."""
        grid = graded_grid(self.grid_singularities, *self.band, knots=self.knots)
        # At a pole that a weight cancels the ratio is 0/0, and next to it only rounding.
        if self.poles_on_the_circle.size == 0:
            return grid
        clear = np.all(np.abs(grid[:, None] - self.poles_on_the_circle) > _HIDDEN * self.band[1], axis=1)
        return grid[clear]

    @cached_property
    def poles_on_the_circle(self) -> Array:
        """Return the frequencies of the band where G has a pole numerically on the unit circle."""
        lo, hi = self.band
        near = self.grid_singularities
        places = np.unique(near.real[near.imag <= _ON_THE_CIRCLE])
        inside = places[(places >= lo - _EDGE * hi) & (places <= hi * (1.0 + _EDGE))]
        if inside.size == 0:
            return inside
        side = np.where(inside + 1e-5 * hi <= hi, 1e-6 * hi, -1e-6 * hi)
        far, close = (self.nominal_size(inside + step * side) for step in (10.0, 1.0))
        return inside[~np.isfinite(close) | (close > _GROWS * far)]

    @cached_property
    def _grid_rows(self) -> NDArray[np.float64]:
        return self.rows(self.grid)

    @cached_property
    def _last(self) -> _LastResults:
        return _LastResults()

    def ratios(self, information: Array, frequencies: Array) -> Array:
        """Return the ratio (n,) at given frequencies."""
        rows = self._last.rows_at(frequencies, self.rows)
        return self.measure(turned(rows, inverse_factor(information).T), frequencies)

    def slope(self, information: Array, frequencies: Array, shares: Array) -> Array:
        """Return minus the gradient of a sum of squared ratios, by its `ratio_rows`, (k, k)."""
        factor = inverse_factor(information)
        half = turned(self._last.rows_at(frequencies, self.rows), factor.T)
        parts = self.ratio_rows(half) @ factor
        return np.asarray(np.einsum("n,nmi,nmj->ij", shares, parts, parts, optimize=True))

    def violations(self, information: Array, *, above: float = -np.inf) -> list[Violation]:
        """Return local maxima of the ratio over the band, polished between the grid points."""
        turn, on_grid = self._on_grid(information)
        return self._polished(turn, on_grid, above)

    def _on_grid(self, information: Array) -> tuple[Array, Array]:
        """Return K^T with K^T K = M^-1, and the ratio on the grid.

        Raises:
            InaccurateError: `ratio-not-finite`.
        """
        turn, on_grid = self._looked(information)
        if not np.all(np.isfinite(on_grid)):
            raise InaccurateError.because(
                "ratio-not-finite",
                f"{self.name} has no finite value at {self.grid[~np.isfinite(on_grid)][0]:.6g} (in the "
                "unit of the experiment)",
                hint="restrict the band of the requirement, and rescale signals of extreme units",
                key="accuracy",
            )
        return turn, on_grid

    def _polished(self, turn: Array, on_grid: Array, above: float) -> list[Violation]:
        w, ratio = local_maxima(
            lambda w: self.measure(turned(self._last.rows_at(w, self.rows), turn), w),
            self.grid,
            on_grid,
            above=above,
        )
        return [Violation(float(r), float(at)) for at, r in zip(w, ratio, strict=True)]

    def most(self, information: Array) -> float:
        """Bound the ratio from the grid: a peak between its points exceeds them by at most `SLACK`."""
        top = self.least(information)
        return top / (1.0 - SLACK) if np.isfinite(top) else np.inf

    def least(self, information: Array) -> float:
        """Return the largest ratio at the points of the grid; NaN where one is not finite."""
        return float(self._looked(information)[1].max())

    def _looked(self, information: Array) -> tuple[Array, Array]:
        """Return K^T with K^T K = M^-1, and the ratio on the grid, finite or not."""
        seen = self._last.looked
        if seen is None or not np.array_equal(seen[0], information):
            turn = inverse_factor(information).T
            seen = information.copy(), turn, self.measure(turned(self._grid_rows, turn), self.grid)
            self._last.looked = seen
        return seen[1:]

    def worst(self, information: Array) -> Violation:
        """Return the largest violation. A peak next to frequency zero counts as at zero."""
        turn, on_grid = self._on_grid(information)
        # A peak that ends below the highest point of the grid is not the largest.
        found = worst(self._polished(turn, on_grid, float(on_grid.max()) * (1.0 - _ROUNDING)))
        lo, hi = self.band
        if found.frequency is None or lo > 0.0 or found.frequency > _BESIDE_ZERO * hi:
            return found
        at_zero = float(self.ratios(information, np.zeros(1))[0])
        return Violation(found.ratio, 0.0) if at_zero >= found.ratio * (1.0 - _FLAT) else found


def inverse_factor(information: Array) -> Array:
    """Return K (.., k, k) with K^T K = M^-1.

    Raises:
        LinAlgError: M is singular, that is, some parameter is not excited.
    """
    if information.ndim > 2:
        return np.linalg.inv(np.linalg.cholesky(information))
    factor, flaw = scipy.linalg.lapack.dpotrf(information, lower=1)
    if flaw:
        raise np.linalg.LinAlgError("the information matrix is not positive definite")
    inverse, _ = scipy.linalg.lapack.dtrtri(factor, lower=1)
    return np.asarray(inverse)


def worst(violations: list[Violation]) -> Violation:
    """Return the largest violation; ratio 0 when there are none."""
    return max(violations, key=lambda v: v.ratio, default=Violation(0.0))


def worst_ratio(requirements: Sequence[Requirement]) -> Callable[[Array], float]:
    """Return the largest ratio of requirements as a function of the information of a record; 0 for none.

    It raises `LinAlgError` if rounding would decide: the record hardly determines all parameters.
    """
    return _largest(requirements, lambda requirement, information: requirement.worst(information).ratio)


def least_ratios(requirements: Sequence[Requirement]) -> Callable[[Array], Array]:
    """Return lower bounds on `worst_ratio` (n,) for informations (n, k, k), without a slow search.

    They are NaN where rounding would decide.
    """
    least = _largest(requirements, lambda requirement, information: requirement.least(information))

    def ratios(informations: Array) -> Array:
        found = np.full(len(informations), np.nan)
        for number, information in enumerate(informations):
            with suppress(np.linalg.LinAlgError):
                found[number] = least(information)
        return found

    return ratios


def _largest(
    requirements: Sequence[Requirement], of: Callable[[Requirement, Array], float]
) -> Callable[[Array], float]:
    def ratio(information: Array) -> float:
        eigenvalues = np.linalg.eigvalsh(information)
        if requirements and eigenvalues[0] <= _SINGULAR * eigenvalues[-1]:
            raise np.linalg.LinAlgError
        return max([of(requirement, information) for requirement in requirements], default=0.0)

    return ratio


def turned(rows: NDArray[np.float64], turn: Array) -> NDArray[np.float64]:
    """Return rows @ turn (n, q, k) as one product, since stacks of small matrices are multiplied one by one.

    In memory the frequencies stand side by side: few sums over many of them are then sums of long vectors.
    """
    n, q, k = rows.shape
    return np.asarray((turn.T @ rows.T.reshape(k, q * n)).reshape(-1, q, n).T)


def largest_singular(half: NDArray[np.float64]) -> Array:
    """Return the largest singular values (n,) of (n, q, k): closed form for two rows, else Gram matrix."""
    if half.shape[1] != 2:
        return np.sqrt(np.maximum(np.linalg.eigvalsh(half @ half.swapaxes(1, 2))[:, -1], 0.0))
    real, imaginary = half[:, 0], half[:, 1]
    a, d = np.einsum("ni,ni->n", real, real), np.einsum("ni,ni->n", imaginary, imaginary)
    b = np.einsum("ni,ni->n", real, imaginary)
    return np.sqrt(0.5 * (a + d) + np.hypot(0.5 * (a - d), b))


def active_entries(model: Model, highest: float) -> list[Entry]:
    """Return the entries of G that are not zero, or change with a parameter, probed below `highest`."""
    w = np.array([0.12, 0.39]) * highest
    there = np.any(model.plant_at(w), axis=0) | np.any(model.plant_gradient(w), axis=(0, 1))
    return [(i, j) for i in range(model.outputs) for j in range(model.inputs) if there[i, j]]
