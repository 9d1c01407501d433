"""The outcome of a question: the content of `result.json`, typed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Self

from inputdesign_cli.finding import Finding
from inputdesign_cli.outcome import design, estimate
from inputdesign_cli.outcome.campaign import Campaign
from inputdesign_cli.outcome.codec import others
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
    objective: design.Objective | None = None
    cost: float | None = None
    samples: int | None = None
    power: design.Powers | None = None
    model_error: design.ModelError | None = None
    requirements: tuple[design.RequirementMet, ...] | None = None
    limits: tuple[design.LimitUse, ...] | None = None
    information: design.Information | None = None
    spectrum: design.Spectrum | None = None
    baseline: design.Baseline | None = None
    robust: Robust | None = None
    foreseen: design.Foreseen | None = None
    signal: design.Signal | None = None
    frequency_response: estimate.MeasuredLines | None = None
    closed_loop_error: design.ClosedLoopError | None = None
    mean_squared_error: design.MeanSquaredError | None = None
    moments: design.Moments | None = None
    sensitivity: design.Sensitivity | None = None
    identification: estimate.Identification | None = None
    assessment: estimate.Assessment | None = None
    exploration: estimate.Exploration | None = None
    validation: estimate.Validation | None = None
    simulation: Simulation | None = None
    campaign: Campaign | None = None
    solver: design.Solver | None = None
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
