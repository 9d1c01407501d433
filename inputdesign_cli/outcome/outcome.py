"""The outcome of a question: the content of `result.json`, typed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Self

from inputdesign_cli.finding import Finding
from inputdesign_cli.outcome.campaign import Campaign
from inputdesign_cli.outcome.codec import others
from inputdesign_cli.outcome.design import (
    Baseline,
    ClosedLoopError,
    Foreseen,
    Information,
    LimitUse,
    MeanSquaredError,
    ModelError,
    Moments,
    Objective,
    Powers,
    RequirementMet,
    Sensitivity,
    Signal,
    Solver,
    Spectrum,
)
from inputdesign_cli.outcome.estimate import (
    Assessment,
    Exploration,
    Identification,
    MeasuredLines,
    Validation,
)
from inputdesign_cli.outcome.robust import Robust
from inputdesign_cli.outcome.simulation import Simulation


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Holds the question and the answer, section by section; a section is None if the question lacks it.

    `notes` are the messages of the `findings`. `provenance` has what the writer of a run adds: environment,
    digests, and the names of its files.
    """

    format: int = 1
    title: str | None = None
    status: str | None = None
    objective: Objective | None = None
    cost: float | None = None
    samples: int | None = None
    power: Powers | None = None
    model_error: ModelError | None = None
    requirements: tuple[RequirementMet, ...] | None = None
    limits: tuple[LimitUse, ...] | None = None
    information: Information | None = None
    spectrum: Spectrum | None = None
    baseline: Baseline | None = None
    robust: Robust | None = None
    foreseen: Foreseen | None = None
    signal: Signal | None = None
    frequency_response: MeasuredLines | None = None
    closed_loop_error: ClosedLoopError | None = None
    mean_squared_error: MeanSquaredError | None = None
    moments: Moments | None = None
    sensitivity: Sensitivity | None = None
    identification: Identification | None = None
    assessment: Assessment | None = None
    exploration: Exploration | None = None
    validation: Validation | None = None
    simulation: Simulation | None = None
    campaign: Campaign | None = None
    solver: Solver | None = None
    findings: tuple[Finding, ...] | None = None
    notes: tuple[str, ...] | None = None
    timing_s: Mapping[str, float] | None = None
    provenance: Mapping[str, object] = others()

    def saying(self, findings: Iterable[Finding]) -> Self:
        """Return the outcome with further findings and their notes."""
        more = tuple(findings)
        if not more:
            return self
        messages = tuple(one.message for one in more)
        return replace(self, findings=(*(self.findings or ()), *more), notes=(*(self.notes or ()), *messages))
