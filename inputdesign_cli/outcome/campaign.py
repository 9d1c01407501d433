"""The entry of a campaign in a result: its records, its rounds and its plans."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from inputdesign_cli.outcome.design import Objective, Spectrum

State = Literal["running", "stopped", "missed", "undecided"]
PlanKind = Literal["pilot", "nominal", "robust", "white", "stopgap", "parting"]


@dataclass(frozen=True)
class PartRecord:
    """Holds a record of a part, compared with its plan.

    Attributes:
        file: its name in the directory; `given`: the name of the user's file.
        samples: number of samples applied; `plan`: the file of the plan.
        energy: cost of these samples.
        likeness: correlation with the plan; `scale`: factor on the plan at which it was applied.
    """

    file: str
    given: str
    samples: int
    plan: str
    withdrawn: bool
    energy: float
    likeness: float | None = None
    scale: float | None = None


@dataclass(frozen=True)
class PlanClaim:
    """Holds the proof of the design behind a plan."""

    status: str
    objective: Objective
    spectrum: Spectrum


@dataclass(frozen=True)
class PlannedPart:
    """Describes a part to be applied.

    Attributes:
        samples: length of the part; `planned_samples`: length of the whole plan.
        power: mean square of the plan; `part_power`: mean square of the part.
        cost: cost of a sample of the design; `part_cost`: cost of a sample of the part.
        capped: whether the plan misses the accuracy that is asked.
        offset: levels about which the excitation varies.
        why: the reason why there is no design.
    """

    file: str
    samples: int
    planned_samples: int
    power: float
    part_power: float
    cost: float
    part_cost: float
    kind: PlanKind
    capped: bool
    seed: int
    offset: tuple[float, ...]
    design: PlanClaim | None = None
    why: str | None = None


@dataclass(frozen=True)
class Round:
    """Holds a decision after some records, with the estimate that it rests on."""

    samples: int
    energy: float
    records: tuple[int, ...]
    state: State
    estimate: Mapping[str, float] | None = None
    standard_deviation: Mapping[str, float] | None = None
    worst_ratio: float | None = None
    share: float | None = None
    plan: PlannedPart | None = None


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """Holds the records and decisions of an experiment in parts.

    Attributes:
        version: number of the format of the directory.
        folder: path from the directory to the folder that file names in the spec are relative to.
        last: the last estimate that a plan was based on, by the names of the parameters.
        first_cost: cost of a sample of the first design.
        digests: SHA-256 of the files that decisions depend on, and of the decisions.
        regardless: whether to go on although tests refute the structure.
    """

    version: int
    time_unit: str
    folder: str
    state: State
    samples: int
    max_samples: int
    records: tuple[PartRecord, ...]
    rounds: tuple[Round, ...]
    last: Mapping[str, float] | None = None
    first_cost: float | None = None
    digests: Mapping[str, str]
    regardless: bool | None = None

    @property
    def done(self) -> int:
        """Return the number of samples that have been applied, in records that count or not."""
        return sum(record.samples for record in self.records)

    @property
    def plan(self) -> PlannedPart | None:
        """Return the part that is due; None if the campaign has ended."""
        return self.rounds[-1].plan if self.rounds else None

    @property
    def plans(self) -> tuple[PlannedPart, ...]:
        """Return every plan, in order."""
        return tuple(one.plan for one in self.rounds if one.plan is not None)
