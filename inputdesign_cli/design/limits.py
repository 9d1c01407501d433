"""What an experiment may not exceed, or fall below: linear conditions on the spectrum."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.information import PowerKind
from inputdesign_cli.plant.polynomial import Array


@dataclass(frozen=True)
class PowerLimit:
    """A power of input, output or excitation is at most (`upper`) or at least `bound`.

    `channel` counts from 0; None is the sum over the channels. `key` is its name in the spec.
    """

    kind: PowerKind
    bound: float
    upper: bool = True
    channel: int | None = None

    @property
    def key(self) -> str:
        return f"limits.{self.kind}_power"


@dataclass(frozen=True)
class DensityLimit:
    """Phi(w) is at most (`upper`) or at least `level`(w) at every frequency.

    `level` maps frequencies (n,) in rad/sample to (n,); `grid` is where to look for violations.
    """

    level: Callable[[Array], Array]
    grid: Array
    upper: bool = True

    key = "limits.spectrum"


def implied_power(density: DensityLimit) -> PowerLimit:
    """The power of the excitation that an upper density limit allows at most; it keeps programs bounded."""
    grid = density.grid
    middle = 0.5 * (grid[1:] + grid[:-1])
    highest = np.maximum(np.maximum(density.level(grid[1:]), density.level(grid[:-1])), density.level(middle))
    return PowerLimit("excitation", float(np.sum(np.diff(grid) * highest) / np.pi))


@dataclass(frozen=True)
class DensityBreach:
    """How a density limit is used at a frequency: `ratio` is Phi over the level, or for a lower limit two
    minus that, so that it exceeds one where the limit is missed and is affine in Phi."""

    limit: int
    frequency: float
    ratio: float


_TINY = np.finfo(float).tiny


def breach_ratio(limit: DensityLimit, phi: Array, w: Array) -> Array:
    """The ratio (n,) that must not exceed one."""
    level = limit.level(w)
    if limit.upper:
        return phi / np.maximum(level, _TINY)
    return np.where(level > 0, 2.0 - phi / np.maximum(level, _TINY), 0.0)
