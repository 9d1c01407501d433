"""What all kinds of questions deliver alike: results with a record, its files, its findings, and a study."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
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
from inputdesign_cli.outcome import Outcome, Signal, Simulation
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import Searched
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.questions.common.bound import Pairs
from inputdesign_cli.questions.common.foresight import Foresight
from inputdesign_cli.questions.common.record import RecordRequest, worst_ratio
from inputdesign_cli.questions.common.signal_outcome import other_files, signal_curves
from inputdesign_cli.signal.selection import Record

# Errors that grow by less than this, relative, where the start is unknown are not mentioned.
_MATTERS = 0.2
# A gap up to this many tolerances is almost optimal.
ALMOST = 100.0
_ROUNDING = 1e-6


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


def results_of(
    header: Header, outcome: Outcome, tables: Mapping[str, Table], curves: Mapping[str, Curves]
) -> Results:
    """Return the results of a question with this header."""
    return Results(outcome, header.resolved_spec, header.units.time_unit, tables, curves)


def adding(
    results: Results,
    outcome: Outcome,
    findings: Iterable[Finding] = (),
    tables: Mapping[str, Table] | None = None,
    curves: Mapping[str, Curves] | None = None,
) -> Results:
    """Return the results with an outcome of more sections, findings, and tables and curves by stem."""
    return replace(
        results,
        outcome=outcome.saying(findings),
        tables={**results.tables, **(tables or {})},
        curves={**results.curves, **(curves or {})},
    )


def with_record(
    results: Results,
    request: RecordRequest,
    units: Units,
    experiment: Experiment,
    record: Record,
    signal: Signal,
) -> Results:
    """Return the results with a record, its curves and its files."""
    tables, drawn = signal_curves(request, units, experiment, record)
    results = replace(results, files=other_files(request, units, record))
    return adding(results, replace(results.outcome, signal=signal), (), tables, {"signal": drawn})


def foreseeing(
    results: Results, foresight: Foresight | None, record: Array, requirements: Sequence[Requirement]
) -> Results:
    """Return the results with the other minima that data of this record (n, r) would leave."""
    if foresight is None:
        return results
    found = foresight.foreseen(record, requirements)
    return adding(results, replace(results.outcome, foreseen=found.entry), found.findings)


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
        step: time between samples in the unit of the experiment's frequencies.
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


def timing(started: float, solved: float) -> dict[str, float]:
    """Return the seconds that the design and, until now, its signal took; times by `perf_counter`."""
    return {"design": solved - started, "signal": time.perf_counter() - solved}


def with_study(
    results: Results,
    study: Simulation,
    begun: float,
    findings: Iterable[Finding] = (),
    tables: Mapping[str, Table] | None = None,
    curves: Mapping[str, Curves] | None = None,
) -> Results:
    """Return the results with a Monte Carlo study that began then, by `perf_counter`."""
    seconds = {**(results.outcome.timing_s or {}), "simulation": time.perf_counter() - begun}
    outcome = replace(results.outcome, simulation=study, timing_s=seconds)
    return adding(results, outcome, findings, tables, curves)


def proof_status(gap: float, tolerance: float) -> str:
    """Whether the relative gap that is proved is as small as asked."""
    if gap <= tolerance * (1.0 + _ROUNDING):
        return "optimal"
    return "almost_optimal" if gap <= ALMOST * tolerance else "gap_open"
