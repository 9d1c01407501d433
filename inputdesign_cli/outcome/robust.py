"""What is said of a design that serves several plants."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

Parameters = Mapping[str, float]


@dataclass(frozen=True)
class ActivePlant:
    """A plant that binds: its number (0 is that of the spec), and its share of the admissible error."""

    scenario: int
    share: float
    frequency: float | None = None
    parameters: Parameters | None = None


@dataclass(frozen=True)
class DearestPlant:
    """The plant at which the experiment costs most."""

    scenario: int
    cost: float


@dataclass(frozen=True)
class LostPlant:
    """A plant at which no model keeps what is asked; `peak` is the peak of its sensitivity function."""

    scenario: int
    parameters: Parameters
    peak: float | None = None


@dataclass(frozen=True)
class FloorUse:
    """Numbers of the plants that are held to a share of the r_adm of the plant of the spec only."""

    share: float
    raised: tuple[int, ...] = ()
    lost: tuple[int, ...] = ()
    worst: tuple[LostPlant, ...] | None = None


@dataclass(frozen=True)
class SearchedPlant:
    """The worst plant that an ascent over the region found; nothing is proved of others."""

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
    """Shares of plants that may be missed, with the stated confidence, before and after the design."""

    confidence: float
    after: float
    before: float | None = None


@dataclass(frozen=True)
class BeyondLimits:
    """How many of the fresh plants take single samples beyond a limit, and the largest share of it."""

    draws: int
    largest: float


@dataclass(frozen=True)
class FreshPlants:
    """How many of other plants from the same distribution miss what is asked."""

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
    """The share of the admissible error that estimates of the binding plants reach with this confidence."""

    draws: int
    confidence: float
    largest: float


@dataclass(frozen=True)
class Robust:
    """The accuracy that a design keeps at every plant, or that a given excitation gives there.

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
