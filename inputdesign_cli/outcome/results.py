"""Results of a design, an analysis or a study for the record and the report: plain data, nothing to compute.

`Outcome` is the content of `result.json`; the rest is the content of CSV files and plots. Frequencies
are in rad per time unit, spectra in the convention of the contract (power = integral over the normalised
circle / 2 pi).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from html import escape
from typing import Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.finding import Finding
from inputdesign_cli.outcome import design, estimate
from inputdesign_cli.outcome.campaign import Campaign
from inputdesign_cli.outcome.codec import others, plain
from inputdesign_cli.outcome.curves import Curves, SpectrumCurves
from inputdesign_cli.outcome.robust import Robust
from inputdesign_cli.outcome.simulation import Simulation

Array = NDArray[np.float64]
# Plain data as in JSON. The path of an entry of a result determines its content, not the type.
Json = Any
Result = Mapping[str, Json]


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
        return self.with_findings([*(self.findings or ()), *findings])

    def with_findings(self, findings: Sequence[Finding]) -> Self:
        """Return the outcome with these findings in place of its own; the notes are their messages."""
        notes = tuple(one.message for one in findings)
        return replace(self, findings=tuple(findings) or None, notes=notes or None)


@dataclass(frozen=True)
class Table:
    """Holds columns of one CSV file: header name (with its unit, `frequency_rad_per_s`) -> values (n,)."""

    columns: Mapping[str, Array]


@dataclass(frozen=True)
class Results:
    """Holds one run: the outcome with its tables and curves, which go by file stem ("bound")."""

    outcome: Outcome
    resolved_spec: str  # YAML text of the spec with all overrides applied
    time_unit: str = "s"
    tables: Mapping[str, Table] = field(default_factory=dict)
    curves: Mapping[str, Curves] = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)  # file name ("model.yaml") -> content

    @cached_property
    def result(self) -> Result:
        """Return the outcome as plain data: result.json without the provenance that a run directory adds."""
        found: Result = plain(self.outcome)
        return found

    def saying(self, findings: Iterable[Finding]) -> Self:
        """Return the results with further findings and their notes."""
        return replace(self, outcome=self.outcome.saying(findings))

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Return the findings about the data, the model or the design, with codes and severities."""
        return self.outcome.findings or ()

    @property
    def cost(self) -> float | None:
        """Return the cost of the experiment, or None if nothing is applied."""
        return self.outcome.cost

    @property
    def objective(self) -> design.Objective | None:
        """Return the value of the design with its proved bounds, or None if nothing was designed."""
        return self.outcome.objective

    @property
    def model_error(self) -> design.ModelError | None:
        """Return the largest r_u/r_adm and its frequency, or None if no model error is asked about."""
        return self.outcome.model_error

    @property
    def parameters(self) -> tuple[str, ...]:
        """Return the names of the k parameters that are estimated."""
        return self._informed.parameters

    @property
    def information(self) -> Array:
        """Return the information matrix (k, k) of the experiment."""
        return self._informed.matrix

    @property
    def covariance(self) -> Array:
        """Return the covariance (k, k) of the estimates: the inverse of the information matrix."""
        found = self._informed.covariance
        if found is None:
            raise AttributeError("this experiment leaves a parameter undetermined: there is no covariance")
        return found

    @property
    def _informed(self) -> design.Information:
        if self.outcome.information is None:
            raise AttributeError("this run has no information matrix")
        return self.outcome.information

    @property
    def signal(self) -> Array:
        """Return the record to be applied as (n, r), as signal.csv has it; `AttributeError` without one."""
        _, *channels = self._table("signal").columns.values()
        return np.stack(channels, axis=1)

    @property
    def bound(self) -> Mapping[str, Array]:
        """Return the columns of bound.csv: frequency_rad_per_s, r_u, r_adm, ..; else `AttributeError`."""
        return self._table("bound").columns

    def _table(self, stem: str) -> Table:
        if stem not in self.tables:
            raise AttributeError(f"this run has no {stem}.csv")
        return self.tables[stem]

    @property
    def spectrum(self) -> SpectrumCurves:
        """Return the spectrum: `frequency` and `phi` as in spectrum.csv; `spectrum(w)` at other frequencies.

        Raises:
            AttributeError: the run has no spectrum.
        """
        if "spectrum" not in self.curves:
            raise AttributeError("this run has no spectrum")
        return cast(SpectrumCurves, self.curves["spectrum"])

    def _repr_html_(self) -> str:
        """Return the head of the result for a notebook."""
        found = self.outcome
        rows = [("status", found.status or ""), ("samples", str(found.samples or ""))]
        if found.objective is not None:
            of = found.objective
            rows += [(of.kind, f"{of.value:.6g}")]
            bounds = (of.lower_bound, of.upper_bound)
            rows += [("proved bound", f"{bound:.6g}") for bound in bounds if bound is not None]
        deviations = None if found.information is None else found.information.standard_deviation
        rows += [(f"standard deviation of {name}", f"{sd:.6g}") for name, sd in (deviations or {}).items()]
        cells = "".join(
            f"<tr><th>{escape(name)}</th><td>{escape(str(value))}</td></tr>" for name, value in rows
        )
        return f"<b>{escape(found.title or '')}</b><table>{cells}</table>"
