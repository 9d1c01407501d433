"""What designs and given excitations deliver alike: a record with its curves, its files and its findings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from inputdesign_cli.accuracy import ModelError, Requirement
from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.designed_records import (
    accuracy_missed,
    length_of_record,
    start_matters,
    too_long,
)
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.monte_carlo.excitations import Excitation
from inputdesign_cli.outcome import Outcome, Signal
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import Searched
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.questions.common.bound import Pairs
from inputdesign_cli.questions.common.foresight import Foresight
from inputdesign_cli.questions.common.record import RecordRequest, worst_ratio
from inputdesign_cli.questions.common.signal_outcome import other_files, signal_curves
from inputdesign_cli.signal import Record

# Errors that grow by less than this, relative, where the start is unknown are not mentioned.
_MATTERS = 0.2


@dataclass(frozen=True)
class Shown:
    """How an experiment is reported.

    Attributes:
        unstated: errors of the entries of G that have r_u if no requirement bounds it.
        ellipses: pairs of parameters; None for a choice of them.
    """

    header: Header
    unstated: Sequence[ModelError]
    ellipses: Pairs | None


@dataclass(frozen=True)
class Delivered:
    """What a design or an analysis delivers to be tried.

    Attributes:
        results: what has been computed so far.
        record: (n, r), about its operating point; None if no excitation is needed.
        renewed: realises the spectrum anew in each run; None for a record that was given.
        alpha: of r_u, see the contract.
        of_length: curves `bound` and `ellipses` for another number of samples than the results count.
        rivals: searches a number of records from several starts, if that finds other minima.
    """

    results: Results
    record: Array | None
    renewed: Excitation | None
    alpha: float
    of_length: Callable[[int], Mapping[str, Curves]] = lambda _: {}
    rivals: Callable[[int], Searched | None] | None = None


@dataclass(frozen=True)
class Report:
    """An outcome with its tables and curves by file stem, and other files by name."""

    outcome: Outcome
    tables: dict[str, Table]
    curves: dict[str, Curves]
    files: Mapping[str, bytes]

    def with_record(
        self, request: RecordRequest, shown: Shown, experiment: Experiment, record: Record, signal: Signal
    ) -> Report:
        """Add a record, its curves and its files."""
        units = shown.header.units
        tables, drawn = signal_curves(request, units, experiment, record)
        return Report(
            replace(self.outcome, signal=signal),
            self.tables | tables,
            self.curves | {"signal": drawn},
            other_files(request, units, record),
        )

    def foreseeing(
        self, foresight: Foresight | None, record: Array, requirements: Sequence[Requirement]
    ) -> Report:
        """Add the other minima that data of this record (n, r) would leave."""
        if foresight is None:
            return self
        found = foresight.foreseen(record, requirements, self.outcome)
        return replace(self, outcome=replace(self.outcome, foreseen=found.entry).saying(found.findings))

    def results(self, header: Header, timing: Mapping[str, float]) -> Results:
        """Return the results of a run that took this time."""
        outcome = replace(self.outcome, timing_s=timing)
        time_unit = header.units.time_unit
        return Results(outcome, header.resolved_spec, time_unit, self.tables, self.curves, self.files)


def searching(
    foresight: Foresight | None, record: Array, requirements: Sequence[Requirement]
) -> Callable[[int], Searched | None] | None:
    """Return what searches records like this (n, r) from several starts; None without other minima."""
    return None if foresight is None else partial(foresight.tried, record, requirements)


def record_findings(
    request: RecordRequest,
    experiment: int,
    record: Record | None,
    shares: Mapping[str, float] | None = None,
    *,
    of_powers: bool = False,
) -> list[Finding]:
    """Return what a user should know before applying a record.

    Args:
        experiment: samples of the experiment.
        record: None if none was made.
        shares: of each limit on single samples that it takes.
        of_powers: whether powers are limited.
    """
    if record is None:
        return too_long(request.length(experiment), request.longest)
    taken, bounds = shares or {}, request.bounds
    held = of_powers or bool(taken) or bounds.hard or request.settings.level is not None
    asked = request.samples or experiment
    return accuracy_missed(record, held=held) + length_of_record(record, asked, request.settings.block, taken)


def begun_anywhere(
    signal: Signal, experiment: Experiment, record: Array, step: float, requirements: Sequence[Requirement]
) -> tuple[Signal, list[Finding]]:
    """Return what is said of a record (n, r), with how much larger its errors are if its start is unknown.

    A design is of spectra, which have no start; the record may live on its start from rest.

    Args:
        signal: what is said of it so far.
        step: time between samples in the unit of the experiment's frequencies.
        requirements: what the errors are measured by.
    """
    growth = _growth(experiment, record, step, requirements)
    if growth <= 1.0 + _MATTERS:
        return signal, []
    details = {**signal.details, "begun_anywhere": growth if np.isfinite(growth) else None}
    return replace(signal, details=details), [start_matters(growth)]


def _growth(experiment: Experiment, record: Array, step: float, requirements: Sequence[Requirement]) -> float:
    """Return how many times as large errors are; infinite if one has no bound."""
    from inputdesign_cli.identification import information_begun_anywhere

    plant = FiniteRecord(experiment, len(record), step)
    u, y = plant.signals("input", record), plant.signals("output", record)
    anywhere = experiment.whiten_matrix(information_begun_anywhere(experiment.model, u, y, step))
    error = worst_ratio(requirements)
    try:
        at_rest = error(plant.information(record))
        free = error(plant.known + anywhere)
    except np.linalg.LinAlgError:
        return np.inf
    return free / at_rest if at_rest > 0.0 else 1.0
