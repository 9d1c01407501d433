"""The goals, the price and the limits of an experiment: linear conditions on the spectrum."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information import PowerKind


@dataclass(frozen=True)
class PowerLimit:
    """A limit: a power of input, output, excitation or moves is at most (`upper`) or at least `bound`.

    `channel` counts from 0; None is the sum over the channels. `scenario` is the number of the plant at which
    the power is taken. `implied` says whether a limit on single samples implies it: |u| <= a bounds the power
    of u by a^2, moves of at most r have at most r^2.
    """

    kind: PowerKind
    bound: float
    upper: bool = True
    channel: int | None = None
    implied: bool = False
    scenario: int = 0

    def everywhere(self, limits: Sequence[PowerLimit]) -> list[int]:
        """Return the indices of the limits that differ from this one at most in their scenario."""
        return [index for index, other in enumerate(limits) if replace(other, scenario=self.scenario) == self]

    @property
    def key(self) -> str:
        """Return the name of the limit in the spec."""
        if self.kind == "moves":
            return "limits.rate"
        return f"limits.amplitude.{self.kind}" if self.implied else f"limits.{self.kind}_power"

    @property
    def of_samples(self) -> str:
        """Return the name of the limit on single samples that implies this power limit."""
        return "moves" if self.kind == "moves" else "a peak"


@dataclass(frozen=True)
class DensityLimit:
    """A limit by which Phi(w) is at most (`upper`) or at least `level`(w) on [grid[0], grid[-1]].

    For several inputs the limit is on v^* Phi(w) v for every direction v of length one: an eigenvalue
    condition, Phi(w) <= level(w) I or Phi(w) >= level(w) I. `level` maps frequencies (n,) of the experiment
    to (n,); `grid` holds the frequencies at which violations are sought.
    """

    level: Callable[[Array], Array]
    grid: Array
    upper: bool = True

    key = "limits.spectrum"


def implied_power(density: DensityLimit, inputs: int = 1) -> PowerLimit:
    """Return the largest excitation power that an upper density limit allows; it keeps programs bounded."""
    grid = density.grid
    middle = 0.5 * (grid[1:] + grid[:-1])
    highest = np.maximum(np.maximum(density.level(grid[1:]), density.level(grid[:-1])), density.level(middle))
    return PowerLimit("excitation", inputs * float(np.sum(np.diff(grid) * highest) / np.pi))


@dataclass(frozen=True)
class DensityPlace:
    """A place where a density limit (by its index) is checked: a frequency and a unit direction (r,)."""

    limit: int
    frequency: float
    direction: ComplexArray


@dataclass(frozen=True)
class DensityBreach:
    """The use of a density limit at a place.

    `ratio` is v^* Phi v over the level, or two minus it for a lower limit. It exceeds one where the limit is
    missed, and is affine in Phi.
    """

    place: DensityPlace
    ratio: float


_TINY = np.finfo(float).tiny


def breach_ratio(limit: DensityLimit, phi: NDArray, w: Array) -> Array:
    """Return the ratio (n,) that must not exceed one, of the worst direction where Phi is (n, r, r)."""
    if phi.ndim > 1:
        phi = np.linalg.eigvalsh(phi)[:, -1 if limit.upper else 0]
    return _ratio(limit, phi, limit.level(w))


def breaches_at(
    limit: DensityLimit, index: int, phi: NDArray, w: Array, *, above: float
) -> list[DensityBreach]:
    """Return the breaches above `above` at frequencies `w` (n,), one for each principal direction of Phi."""
    if phi.ndim == 1:
        values, vectors = phi[:, None], np.ones((w.size, 1, 1), dtype=complex)
    else:
        values, vectors = np.linalg.eigh(phi)
    ratios = _ratio(limit, values, limit.level(w)[:, None])
    return [
        DensityBreach(DensityPlace(index, float(w[n]), vectors[n, :, i]), float(ratios[n, i]))
        for n, i in np.argwhere(ratios > above)
    ]


def _ratio(limit: DensityLimit, phi: Array, level: Array) -> Array:
    if limit.upper:
        return phi / np.maximum(level, _TINY)
    return np.where(level > 0, 2.0 - phi / np.maximum(level, _TINY), 0.0)


Goal = Literal["cost", "factor", "samples"]
Weight = float | tuple[float, ...]
# The plants whose powers are paid for: the nominal one, all of them evenly, or the dearest.
Paid = Literal["nominal", "mean", "worst"]


def paid_for(paid: Paid, costs: Sequence[float]) -> float:
    """Return the cost of a design from its costs at each of the plants considered."""
    return max(costs) if paid == "worst" else sum(costs) / len(costs)


def weights_of(cost: Mapping[PowerKind, Weight]) -> list[tuple[PowerKind, int | None, float]]:
    """Return the positive weights of a cost: kind, channel (None is the sum over the channels), weight."""
    listed: list[tuple[PowerKind, int | None, float]] = []
    for kind, weight in cost.items():
        if isinstance(weight, tuple):
            listed += [(kind, channel, w) for channel, w in enumerate(weight) if w > 0]
        elif weight > 0:
            listed.append((kind, None, weight))
    return listed


def weighted_sum(weights: Mapping[PowerKind, Weight], power: Mapping[PowerKind, Sequence[float]]) -> float:
    """Return the cost of powers, by kind and channel, at these weights."""
    return sum(
        weight * (sum(power[kind]) if channel is None else power[kind][channel])
        for kind, channel, weight in weights_of(weights)
    )
