"""What is said of a campaign: its records and rounds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from inputdesign_cli.outcome.codec import others


@dataclass(frozen=True)
class PartRecord:
    """A record that was brought: of which plan, and whether it counts."""

    file: str
    given: str
    samples: int
    plan: str
    withdrawn: bool
    energy: float | None = None
    likeness: float | None = None
    scale: float | None = None
    details: Mapping[str, object] = others()


@dataclass(frozen=True)
class PlannedPart:
    """The next part: samples to apply of those that are planned, its power and cost, and why it is so."""

    file: str
    samples: int
    planned_samples: int
    power: float
    part_power: float
    cost: float
    part_cost: float
    kind: str
    capped: bool
    seed: int
    offset: tuple[float, ...]
    design: Mapping[str, object] | None = None
    why: str | None = None
    details: Mapping[str, object] = others()


@dataclass(frozen=True)
class Round:
    """What was decided after some records, and at which estimate."""

    samples: int
    energy: float
    records: tuple[int, ...]
    state: str
    estimate: Mapping[str, float] | None = None
    standard_deviation: Mapping[str, float] | None = None
    worst_ratio: float | None = None
    share: float | None = None
    plan: PlannedPart | None = None
    details: Mapping[str, object] = others()


@dataclass(frozen=True)
class Campaign:
    """The records and decisions of an experiment in parts."""

    state: str
    records: tuple[PartRecord, ...]
    rounds: tuple[Round, ...]
    samples: int | None = None
    max_samples: int | None = None
    details: Mapping[str, object] = others()
