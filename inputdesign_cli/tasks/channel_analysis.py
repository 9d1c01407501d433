"""A given excitation of several channels or in continuous time -> what accuracy it buys."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.design.convex.designs import Question
from inputdesign_cli.information import ChannelExperiment, FiniteRecord
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Results
from inputdesign_cli.signal import Record
from inputdesign_cli.specification import Spec
from inputdesign_cli.spectrum import DirectedLines, FlatBasis, TabulatedChannels
from inputdesign_cli.tasks.analysis import check_excites, given_result
from inputdesign_cli.tasks.build.channel_given import (
    ChannelExcitation,
    channel_samples,
    read_channel_excitation,
    spectral,
)
from inputdesign_cli.tasks.build.channel_requirements import unstated_errors
from inputdesign_cli.tasks.build.channel_task import (
    channel_requirements,
    check_channels_supported,
    check_given_signal,
    with_prior,
)
from inputdesign_cli.tasks.build.channels import (
    build_cost,
    channel_experiment,
    frequency_unit,
    record_step,
)
from inputdesign_cli.tasks.build.given_limits import broken_limits, check_given_limits
from inputdesign_cli.tasks.build.header import build_units
from inputdesign_cli.tasks.build.model_error import model_error_alpha
from inputdesign_cli.tasks.build.signal_settings import build_record_request
from inputdesign_cli.tasks.build.task import Task
from inputdesign_cli.tasks.record import worst_ratio
from inputdesign_cli.tasks.result.channel_curves import (
    bound_curves_of,
    density_curves,
    entry_bound_curves,
    line_curves,
    plain_complex,
)
from inputdesign_cli.tasks.result.ellipses import check_pairs, experiment_ellipses
from inputdesign_cli.tasks.result.signal import other_files, signal_curves, signal_entry


def build_channel_analysis(spec: Spec) -> Task:
    """The question of a given excitation: its requirements, if any, are checked, not met.

    Raises:
        SpecError, DataError: see the builders of the parts.
    """
    check_channels_supported(spec)
    check_given_signal(spec)
    record_step(spec)
    # Any: requirements ask for no more than both kinds of experiments have.
    experiment: Any = with_prior(spec, channel_experiment(spec))
    model, band = experiment.model, experiment.band
    requirements = channel_requirements(spec, experiment)
    experiment.whitened(1.0)  # says which parameters cannot be told apart
    check_pairs(spec, model.names)
    question = Question(experiment, FlatBasis(model.inputs, band), "cost", requirements)
    return Task(question, experiment, build_cost(spec), model_error_alpha(spec, experiment), None)  # type: ignore[arg-type]


def analyse_channels(spec: Spec) -> Results:
    """r_u entry by entry, information, predicted standard deviations and powers of `spectrum.given`.

    Raises:
        SpecError, DataError: the spec or a file that it names cannot be used, or the excitation leaves
            parameters undetermined (`not-exciting`).
    """
    started = time.perf_counter()
    check_given_limits(spec)
    task = build_channel_analysis(spec)
    raw: Any = task.experiment
    excitation = read_channel_excitation(spec, raw)
    experiment: Any = raw.whitened(max(sum(excitation.power["excitation"]), 1e-300))
    if excitation.samples is not None:
        experiment = replace(experiment, samples=len(excitation.samples))
    information = excitation.information(experiment)
    check_excites(spec, experiment, information)
    requirements = tuple(make(experiment) for make in task.question.requirements)
    cost, white = excitation.cost(build_cost(spec)), _even(raw, 1.0)
    level = cost / white.cost(build_cost(spec))
    flat = _even(raw, level).information(experiment)
    result = given_result(spec, task, experiment, information, requirements)
    result |= {"cost": cost, "power": excitation.power, "spectrum": _entry(spec, excitation)}
    result["baseline"] = {"white": {"cost": cost, "excitation_power": level}}
    tables: dict[str, Any] = {}
    curves: dict[str, Any] = {}
    bound = bound_curves_of(spec, requirements, information, flat)
    tables["bound"], curves["bound"] = bound or entry_bound_curves(
        spec, unstated_errors(spec, experiment), information, flat, stated=False
    )
    if isinstance(excitation.basis, DirectedLines):
        tables["spectrum"], curves["spectrum"] = line_curves(spec, excitation.basis, _x(excitation))
    elif excitation.basis is not None:
        tables["spectrum"], curves["spectrum"] = density_curves(spec, excitation.basis, _x(excitation))
    ellipses = experiment_ellipses(spec, experiment, information, flat)
    if ellipses is not None:
        curves["ellipses"] = ellipses
    samples, files = channel_samples(spec, excitation), {}
    if samples is not None:
        request, units = build_record_request(spec), build_units(spec)
        reached = FiniteRecord(experiment, len(samples), record_step(spec)).information(samples)
        record = Record(
            samples, "multisine" if excitation.samples is None else "given", _ratio(requirements, reached)
        )
        result["signal"] = signal_entry(request, units, experiment, record, requirements)
        tables["signal"], curves["signal"] = signal_curves(request, units, record)
        files = other_files(request, units, record)
    notes = broken_limits(spec, experiment.samples, excitation.power, result.get("signal", {}))
    if notes:
        result["notes"] = notes
    result["timing_s"] = {"analysis": time.perf_counter() - started}
    return Results(result, spec.to_yaml(), spec.time_unit, tables, curves, files)


def _even(experiment: ChannelExperiment, power: float) -> ChannelExcitation:
    """White excitation of this total power, flat over the band and even over the channels."""
    share = np.full(experiment.inputs, power / experiment.inputs)
    return spectral("white", TabulatedChannels.white(share, experiment.band), np.ones(1), experiment)


def _x(excitation: ChannelExcitation) -> Array:
    assert excitation.x is not None
    return excitation.x


def _ratio(requirements: tuple[Any, ...], information: Array) -> float:
    """The worst ratio of a record; infinite when it is too short to excite every parameter."""
    try:
        return worst_ratio(requirements)(information)
    except np.linalg.LinAlgError:
        return np.inf


def _entry(spec: Spec, excitation: ChannelExcitation) -> dict[str, Any]:
    entry: dict[str, Any] = {"type": "given", "given": excitation.kind}
    if isinstance(excitation.basis, DirectedLines):
        frequencies, powers = excitation.basis.lines(_x(excitation))
        entry["frequencies"] = frequencies / frequency_unit(spec)
        entry["powers"] = plain_complex(powers)
    elif excitation.kind == "white":
        entry["power"] = excitation.power["input"]
    return entry
