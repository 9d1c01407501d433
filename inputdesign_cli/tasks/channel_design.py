"""Spec -> design -> outcome, for several channels, in continuous time or on a band."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import Criterion
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.information import ChannelExperiment, FiniteRecord
from inputdesign_cli.runs.results import Results
from inputdesign_cli.signal import Record, SignalGenerator
from inputdesign_cli.specification import Spec
from inputdesign_cli.spectrum import DirectedLines, LinesBasis
from inputdesign_cli.tasks.build.channel_task import build_channel_task
from inputdesign_cli.tasks.build.channels import record_step
from inputdesign_cli.tasks.build.header import build_units
from inputdesign_cli.tasks.build.signal_settings import build_record_request
from inputdesign_cli.tasks.design import by_exchange, check_length, plain_errors
from inputdesign_cli.tasks.factor_columns import restrict_columns
from inputdesign_cli.tasks.record import designed_spectrum, make_record, record_notes, redrawn
from inputdesign_cli.tasks.result.channel_curves import (
    bound_curves_of,
    channel_optimality_curves,
    density_curves,
    line_curves,
    with_channel_periodograms,
)
from inputdesign_cli.tasks.result.ellipses import experiment_ellipses
from inputdesign_cli.tasks.result.result import design_result, experiment_of
from inputdesign_cli.tasks.result.signal import other_files, signal_curves, signal_entry


def solve_channels(spec: Spec) -> Results:
    """The design, its proof, its signal and its curves; see `designed_channels`."""
    return designed_channels(spec)[0]


def designed_channels(spec: Spec) -> tuple[Results, SignalGenerator | None]:
    """The same, and what draws other records of the spectrum, if there is one; see `redrawn`.

    Raises:
        SpecError, DataError: the spec cannot be used.
        InfeasibleError: nothing within the limits meets the requirements.
        InaccurateError: the proof did not close.
    """
    started = time.perf_counter()
    task = build_channel_task(spec)
    with plain_errors():
        design, how = by_exchange(spec, task)
        climbed = restrict_columns(spec, design)
    if climbed is not None:
        design = climbed.design
        how |= climbed.how
    result = design_result(spec, task, design, how)
    if climbed is not None:
        result["spectrum"] |= climbed.entry
    check_length(spec, result)
    solved = time.perf_counter()
    experiment = experiment_of(task, design)
    assert isinstance(experiment, ChannelExperiment)
    tables: dict[str, Any] = {}
    curves: dict[str, Any] = {}
    request, units = build_record_request(spec), build_units(spec)
    record = make_record(request, design, experiment)
    _illustrate(spec, design, experiment, record, tables, curves)
    files: dict[str, bytes] = {}
    if record is not None:
        result["signal"] = signal_entry(
            request,
            units,
            experiment,
            record,
            design.problem.requirements,
            designed=design.result.information,
            spectrum=designed_spectrum(request, design, experiment.inputs),
        )
        tables["signal"], curves["signal"] = signal_curves(request, units, record)
        tables["spectrum"], curves["spectrum"] = with_channel_periodograms(
            tables["spectrum"], curves["spectrum"], spec, record.samples
        )
        files = other_files(request, units, record)
        notes = record_notes(request, experiment.samples, record)
        if notes:
            result["notes"] = [*result.get("notes", []), *notes]
    result["timing_s"] = {"design": solved - started, "signal": time.perf_counter() - solved}
    other = None if record is None else redrawn(request, design, record)
    return Results(result, spec.to_yaml(), spec.time_unit, tables, curves, files), other


def _illustrate(
    spec: Spec,
    design: Design,
    experiment: ChannelExperiment,
    record: Record | None,
    tables: dict[str, Any],
    curves: dict[str, Any],
) -> None:
    found, problem = design.result, design.problem
    if isinstance(found.basis, LinesBasis | DirectedLines):
        tables["spectrum"], curves["spectrum"] = line_curves(spec, found.basis, found.x)
    else:
        tables["spectrum"], curves["spectrum"] = density_curves(spec, found.basis, found.x)
    if not found.x.any():
        return
    white = design.white.information / (design.white.s if problem.goal == "factor" else 1.0)
    known = None
    if record is not None and np.isfinite(record.worst_ratio):
        plant = FiniteRecord(experiment, len(record.samples), record_step(spec))
        known = plant.information(record.samples)
    bound = bound_curves_of(
        spec, (*problem.requirements, *problem.side), found.information, white, record=known
    )
    if bound is not None:
        tables["bound"], curves["bound"] = bound
    optimality = channel_optimality_curves(spec, design)
    if optimality is not None:
        curves["optimality"] = optimality
    first = problem.requirements[0] if problem.requirements else None
    singular_allowed = isinstance(first, Criterion) and first.letter == "T"
    ellipses = experiment_ellipses(spec, experiment, found.information, None if singular_allowed else white)
    if ellipses is not None:
        curves["ellipses"] = ellipses
