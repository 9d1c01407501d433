"""Entries for a design that serves several plants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

Parameters = Mapping[str, float]


@dataclass(frozen=True)
class ActivePlant:
    """Holds a plant that binds: its number (0: that of the spec), and its share of the admissible error."""

    scenario: int
    share: float
    frequency: float | None = None
    parameters: Parameters | None = None


@dataclass(frozen=True)
class DearestPlant:
    """Holds the plant at which the experiment costs most."""

    scenario: int
    cost: float


@dataclass(frozen=True)
class LostPlant:
    """Holds a plant at which no model keeps the requirement; `peak` is that of its sensitivity function."""

    scenario: int
    parameters: Parameters
    peak: float | None = None


@dataclass(frozen=True)
class FloorUse:
    """Holds plants that must keep only a `share` of r_adm of the spec's plant, by their numbers.

    At `raised` plants r_adm of their own is smaller than that somewhere; at `lost` ones it vanishes.
    """

    share: float
    raised: tuple[int, ...] = ()
    lost: tuple[int, ...] = ()
    worst: tuple[LostPlant, ...] | None = None


@dataclass(frozen=True)
class SearchedPlant:
    """Holds the worst plant that an ascent over the region found; nothing is proved of others.

    `tried` plants were examined, and `added` ones joined the design. `lost`: no model keeps the requirement
    there.
    """

    proved: bool
    region: str
    share: float
    parameters: Parameters
    added: int
    tried: int
    frequency: float | None = None
    lost: bool | None = None
    peak: float | None = None


@dataclass(frozen=True)
class Risk:
    """Bounds the share of plants at which the design may miss the accuracy, with the stated confidence."""

    confidence: float
    after: float
    before: float | None = None


@dataclass(frozen=True)
class BeyondLimits:
    """Holds the number of fresh plants with single samples beyond a limit, and the largest share of it."""

    draws: int
    largest: float


@dataclass(frozen=True)
class FreshPlants:
    """Holds the number of other plants from the same distribution that miss the accuracy.

    `limits` hold the true share of such plants with the stated confidence. `less` counts plants that reach
    less than the accuracy, `dearer` plants at which the experiment costs more than was promised.
    """

    draws: int
    rejected: int
    missed: int
    share: float
    limits: tuple[float, float]
    largest: float
    raised: int | None = None
    lost: int | None = None
    beyond_limits: BeyondLimits | None = None
    less: int | None = None
    dearer: int | None = None


@dataclass(frozen=True)
class DrawnEstimates:
    """Holds the share of the admissible error at estimates of the binding plants, with this confidence."""

    draws: int
    confidence: float
    largest: float


@dataclass(frozen=True)
class Robust:
    """Holds the accuracy that a design keeps at every plant, or that a given excitation gives there.

    `support` counts the plants that bind a design, `missed` the plants that a given excitation misses.
    """

    source: str
    scenarios: int
    rejected: int
    discarded: int
    r_adm: str
    cost: str
    worst_share: float
    worst_scenario: int
    active: tuple[ActivePlant, ...]
    support: int | None = None
    missed: int | None = None
    dearest: DearestPlant | None = None
    floor: FloorUse | None = None
    searched: SearchedPlant | None = None
    risk: Risk | None = None
    fresh: FreshPlants | None = None
    estimates: DrawnEstimates | None = None
