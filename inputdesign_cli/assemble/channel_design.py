"""Spec -> design -> outcome, for several channels, in continuous time or on a band."""

from __future__ import annotations

import time
from typing import Any

from inputdesign_cli.accuracy import Criterion
from inputdesign_cli.assemble.channel_curves import (
    bound_curves_of,
    channel_optimality_curves,
    channel_signal_curves,
    density_curves,
    line_curves,
)
from inputdesign_cli.assemble.channel_record import (
    channel_signal_entry,
    lines_of_record,
    make_channel_record,
)
from inputdesign_cli.assemble.channel_task import build_channel_task
from inputdesign_cli.assemble.design import by_exchange, check_length, plain_errors
from inputdesign_cli.assemble.ellipses import experiment_ellipses
from inputdesign_cli.assemble.factor_columns import restrict_columns
from inputdesign_cli.assemble.result import design_result, experiment_of
from inputdesign_cli.design.designs import Design
from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.signal import Lines
from inputdesign_cli.spec import Spec
from inputdesign_cli.spectrum import DirectedLines, LinesBasis


def solve_channels(spec: Spec) -> Outcome:
    """The design, its proof, its signal and its curves; see `designed_channels`."""
    return designed_channels(spec)[0]


def designed_channels(spec: Spec) -> tuple[Outcome, Lines | None]:
    """The same, and the sinusoids that stand for the spectrum in a record of its length, if there is one.

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
    _illustrate(spec, design, experiment, tables, curves)
    record = make_channel_record(spec, design, experiment)
    if record is not None:
        result["signal"] = channel_signal_entry(spec, design, experiment, record)
        tables["signal"], curves["signal"] = channel_signal_curves(spec, record.samples)
    result["timing_s"] = {"design": solved - started, "signal": time.perf_counter() - solved}
    lines = None if record is None else lines_of_record(spec, design, experiment, len(record.samples))
    return Outcome(result, spec.to_yaml(), spec.time_unit, tables, curves), lines


def _illustrate(
    spec: Spec,
    design: Design,
    experiment: ChannelExperiment,
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
    bound = bound_curves_of(spec, (*problem.requirements, *problem.side), found.information, white)
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
