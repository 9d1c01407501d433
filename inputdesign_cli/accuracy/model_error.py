"""Model error r_u(w) <= r_adm(w) at every frequency of a band, of one entry of G or of its norm.

[bombois-least-costly], (6), (10) and (12): r_u = alpha sqrt(lambda_max(T P T^T)) with T the real and
imaginary parts of the gradient of the entry, equivalently M >= R_adm(w) = (alpha / r_adm)^2 T^T T. With the
gradients of all entries in T, r_u bounds the Frobenius norm of the error of G over the confidence ellipsoid,
to first order, and with it the largest singular value, which a bound on the sensitivity function needs.

Entries that are held to bounds of their own share the confidence factor alpha of all parameters of G, so
that all of them hold at once with that probability.

A designer states r_adm in one of four forms. Its `singularities` are the points of the frequency plane near
which it changes fast, its `knots` the frequencies at which it may have a kink.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.accuracy.cuts import MatrixCut
from inputdesign_cli.accuracy.requirement import (
    OverFrequency,
    Requirement,
    inverse_factor,
    largest_singular,
    turned,
)
from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.plant import Loop, Model, ScalarTransfer, local_maxima

_NOWHERE = np.zeros(0)
# A requirement is void at zeros of the weight: there r_adm is large, but not infinite.
_NO_WEIGHT = 1e-12
_TINY = np.finfo(float).tiny
# Samples after which the input of a loop has settled, unless their second half raises its deviation by more.
_SETTLED, _STILL = 10_000, 1.005


class AdmissibleError(Protocol):
    """The admissible error r_adm over frequency."""

    @property
    def singularities(self) -> ComplexArray:
        """Return poles and zeros near which r_adm varies fast, as points of the frequency plane."""

    @property
    def knots(self) -> Array:
        """Return frequencies at which r_adm may have a kink."""

    @property
    def kept(self) -> Sensitivity | None:
        """Return the closed loop whose margins the bound preserves, or None if there is no loop."""

    @property
    def floored(self) -> Floored | None:
        """Return the bound that replaces r_adm at a plant where it vanishes, or None if there is none."""

    def at(self, w: ArrayLike) -> Array:
        """Return r_adm (n,) at frequencies `w` (n,)."""


@dataclass(frozen=True)
class Relative:
    """Sets r_adm = fraction |G| of one entry (output, input), or of the Frobenius norm of all (None)."""

    model: Model
    fraction: float
    entry: tuple[int, int] | None = None
    knots = _NOWHERE
    kept = None
    floored = None

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return poles and zeros near which r_adm varies fast, as points of the frequency plane."""
        if self.entry is None:
            return self.model.singularities
        return self.model.entry_singularities(*self.entry)

    def at(self, w: ArrayLike) -> Array:
        """Return r_adm (n,) at frequencies `w` (n,)."""
        G = self.model.plant_at(w)
        if self.entry is None:
            return self.fraction * np.linalg.norm(G, axis=(1, 2))
        return self.fraction * np.abs(G[:, self.entry[0], self.entry[1]])


@dataclass(frozen=True)
class Absolute:
    """Sets r_adm = level, in the units of G."""

    level: float
    knots = _NOWHERE
    kept = None
    floored = None
    singularities = _NOWHERE.astype(complex)

    def at(self, w: ArrayLike) -> Array:
        """Return r_adm (n,) at frequencies `w` (n,)."""
        return np.full(np.shape(w), self.level)


@dataclass(frozen=True)
class Table:
    """Interpolates r_adm between given points, linearly in (log frequency, log r_adm).

    At frequency zero, and below the first point if that stands at zero, the first value holds.
    """

    frequency: Array  # (n,) ascending, in the unit of the experiment
    value: Array  # (n,) positive
    kept = None
    floored = None
    singularities = _NOWHERE.astype(complex)

    @property
    def knots(self) -> Array:
        """Return frequencies at which r_adm may have a kink."""
        return self.frequency

    def at(self, w: ArrayLike) -> Array:
        """Return r_adm (n,) at frequencies `w` (n,)."""
        tiny = 1e-12
        x = np.log(np.maximum(self.frequency, tiny))
        return np.exp(np.interp(np.log(np.maximum(np.asarray(w, dtype=float), tiny)), x, np.log(self.value)))


@dataclass(frozen=True)
class Sensitivity:
    """Sets r_adm = (1 - |W| s(S)) / s(C S), s the largest singular value, S = (I + G C)^-1 (nominal loop).

    For every plant G + D with s(D) <= r_adm then s(W S') <= 1: S' = S (I + D C S)^-1, so that
    s(S') <= s(S) / (1 - s(D) s(C S)). With one channel that is (|1 + C G| - |W|) / |C|
    ([bombois-least-costly], Illustration 2, by the reverse triangle inequality).

    `settings` holds the controller settings if the requirement is on the loop itself, else None.
    """

    loop: Loop
    weight: ScalarTransfer
    settings: Mapping[str, float] | None = None
    knots = _NOWHERE
    floored = None

    @property
    def kept(self) -> Sensitivity:
        """Return this bound itself, since it preserves the margins of a loop."""
        return self

    def nominal(self, w: ArrayLike) -> Array:
        """Return the largest singular value of S (n,) with the nominal plant."""
        return largest_gain(self.loop.sensitivity(w)[0])

    def margins(self, w: ArrayLike) -> dict[str, float]:
        """Return the margins of a loop, and the peak of |S| with the nominal plant and with every other.

        1 + L stays 1/|S| away from 0: a gain margin of |S|/(|S| - 1) and a phase margin of
        2 asin(1/(2 |S|)), in degrees, follow. `input_deviation` is the largest standard deviation of an input
        due to noise, with the nominal plant. It is left out if it has not settled, as under drifts that the
        controller does not remove.
        """
        peak = float(np.min(1.0 / np.abs(self.weight.at(w))))
        root = np.asarray(np.linalg.cholesky(self.loop.model.covariance), dtype=float)
        early, late = (float(np.max(self.loop.input_deviation(root, n))) for n in (_SETTLED // 2, _SETTLED))
        return {
            "nominal_peak": float(np.max(self.nominal(w))),
            "max_sensitivity": peak,
            "gain_margin": peak / (peak - 1.0),
            "phase_margin": float(2.0 * np.degrees(np.arcsin(0.5 / peak))),
            **({"input_deviation": late} if late <= _STILL * early else {}),
        }

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return poles and zeros near which r_adm varies fast, as points of the frequency plane."""
        return np.concatenate([self.loop.singularities, self.weight.singularities])

    def at(self, w: ArrayLike) -> Array:
        """Return r_adm (n,) at frequencies `w` (n,)."""
        S, applied = self.loop.sensitivity(w)
        left = 1.0 - np.abs(self.weight.at(w)) * largest_gain(S)
        return left / np.maximum(largest_gain(applied), _TINY)


@dataclass(frozen=True)
class Weighted:
    """Divides r_adm by |W|, so that |W| r_u stays below r_adm."""

    inner: AdmissibleError
    weight: ScalarTransfer

    @property
    def kept(self) -> Sensitivity | None:
        """Return the loop of the error without the weight, if any."""
        return self.inner.kept

    @property
    def floored(self) -> Floored | None:
        """Return the replacement of r_adm without the weight, if any."""
        return self.inner.floored

    @property
    def knots(self) -> Array:
        """Return frequencies at which r_adm may have a kink."""
        return self.inner.knots

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return poles and zeros near which r_adm varies fast, as points of the frequency plane."""
        return np.concatenate([self.inner.singularities, self.weight.singularities])

    def at(self, w: ArrayLike) -> Array:
        """Return r_adm (n,) at frequencies `w` (n,)."""
        return self.inner.at(w) / np.maximum(np.abs(self.weight.at(w)), _NO_WEIGHT)


@dataclass(frozen=True)
class Floored:
    """Bounds r_adm of a scenario from below by a `share` of r_adm at the nominal plant.

    Where a scenario's own r_adm vanishes no experiment would be long enough.
    """

    own: AdmissibleError
    nominal: AdmissibleError
    share: float
    _on_grid: list[tuple[Array, Array, Array]] = field(
        default_factory=list, init=False, repr=False, compare=False
    )

    @property
    def kept(self) -> Sensitivity | None:
        """Return the loop of the scenario, if any."""
        return self.own.kept

    @property
    def floored(self) -> Floored:
        """Return this bound itself."""
        return self

    def lost(self, grid: Array) -> bool:
        """Return whether r_adm of the scenario itself vanishes on the grid or between two points."""
        own = -self._both(grid)[0]
        return bool(
            np.max(own) >= 0.0 or np.any(local_maxima(lambda w: -self.own.at(w), grid, own)[1] >= 0.0)
        )

    def raised(self, grid: Array) -> bool:
        """Return whether r_adm of the scenario is smaller than its lower bound, somewhere on the grid."""
        own, floor = self._both(grid)
        return bool(np.any(own < floor))

    def _both(self, w: Array) -> tuple[Array, Array]:
        """Return r_adm of the scenario, and its lower bound where r_adm is smaller, (n,) each."""
        # The grid of a requirement is evaluated many times, points between its own only once.
        for grid, own, floor in self._on_grid:
            if np.array_equal(grid, w):
                return own, floor
        found = self.own.at(w), self.share * self.nominal.at(w)
        if all(w.size >= grid.size for grid, _, _ in self._on_grid):
            self._on_grid[:] = [(w.copy(), *found)]
        return found

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return poles and zeros near which r_adm varies fast, as points of the frequency plane."""
        return np.concatenate([self.own.singularities, self.nominal.singularities])

    @property
    def knots(self) -> Array:
        """Return frequencies at which r_adm may have a kink."""
        return np.union1d(self.own.knots, self.nominal.knots)

    def at(self, w: ArrayLike) -> Array:
        """Return r_adm (n,) at frequencies `w` (n,)."""
        return np.maximum(*self._both(np.asarray(w)))


def largest_gain(G: ComplexArray) -> Array:
    """Return the largest singular values (n,) of (n, p, r)."""
    if G.shape[1:] == (1, 1):
        return np.abs(G[:, 0, 0])
    return np.linalg.norm(G, 2, axis=(1, 2))


@dataclass(frozen=True, kw_only=True)
class OnModelError(OverFrequency):
    """Holds the common part of requirements on a model error: r_adm, alpha, and r_u to first order."""

    admissible: AdmissibleError
    alpha: float

    @property
    def name(self) -> str:
        """Return the name `model_error`."""
        return "model_error"

    @property
    def knots(self) -> Array:
        """Return the knots of r_adm."""
        return self.admissible.knots

    @property
    def own_singularities(self) -> ComplexArray:
        """Return the singularities of r_adm."""
        return self.admissible.singularities

    def weight_at(self, w: ArrayLike) -> Array:
        """Return alpha / r_adm: with V(w)^T = (alpha / r_adm) T the requirement reads M >= V V^T."""
        return self.alpha / self.admissible.at(w)

    def error_bound(self, information: Array, w: ArrayLike) -> Array:
        """Return r_u (n,) at frequencies `w`, inside or outside the band, to first order."""
        return self.error_bounds([information], w)[0]

    def error_bounds(self, informations: Iterable[Array], w: ArrayLike) -> list[Array]:
        """Return `error_bound` for each of several information matrices."""
        rows = self.plant_rows(w)
        return [self.alpha * largest_singular(turned(rows, inverse_factor(M).T)) for M in informations]


@dataclass(frozen=True, kw_only=True)
class ModelError(OnModelError):
    """The requirement on the model error to first order."""

    def cut(self, frequency: float | None) -> MatrixCut:
        """Return the cut M >= R_adm at this frequency."""
        rows = self.rows(np.array([frequency]))[0]
        return MatrixCut(rows.T @ rows, frequency)


def model_errors(requirements: Iterable[Requirement]) -> list[OnModelError]:
    """Return the requirements that bound a model error; bound.csv shows them."""
    return [requirement for requirement in requirements if isinstance(requirement, OnModelError)]


def check_positive(admissible: AdmissibleError, grid: Array, *, unit: float, named: str) -> None:
    """Raise `SpecError` (`admissible-not-positive`) unless r_adm > 0 between the ends of the `grid`.

    The message states the frequency divided by `unit`, in the unit `named`.
    """
    on_grid = admissible.at(grid)
    if not np.any(on_grid):
        raise bad_spec(
            "admissible-not-positive",
            "the admissible error is zero at every frequency: no model can be that good",
            hint="an entry of G that is zero at the nominal parameters has no relative error: ask for an "
            "absolute one, or for that of the norm (norm: frobenius)",
            key="accuracy.model_error",
        )
    w, negative = local_maxima(lambda w: -admissible.at(w), grid, -on_grid)
    scale = np.median(np.abs(on_grid))
    bad = negative >= -1e-9 * scale
    if np.any(bad):
        at = w[bad][int(np.argmax(negative[bad]))]
        raise bad_spec(
            "admissible-not-positive",
            f"the admissible error is not positive at {at / unit:.6g} {named}: no model can be that good",
            hint="restrict `band` to the frequencies that matter, or loosen the requirement there "
            "(a relative bound vanishes where G does; a sensitivity bound where |W S| already reaches 1)",
            key="accuracy.model_error",
        )
