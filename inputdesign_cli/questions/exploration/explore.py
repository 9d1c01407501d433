"""Find a model in a log, with the evidence for and against it and the next spec; or judge a given model."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np

from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.explore.drift import levelled
from inputdesign_cli.explore.fits import fits
from inputdesign_cli.explore.joint import Found, explore_records
from inputdesign_cli.explore.relation import answers_output, check_enough, check_unpredictable
from inputdesign_cli.explore.search import Family
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.explored_logs import DRIVE, doubtful_inputs, doubtful_model, undriven
from inputdesign_cli.findings.explored_structures import explored_structures
from inputdesign_cli.findings.faults import SPIKES, biasing, left_out, shifted_levels
from inputdesign_cli.findings.frequency_responses import contradicted, response_note, silent_lines_answer
from inputdesign_cli.findings.judged_models import other_plants
from inputdesign_cli.findings.prepared_records import columns_against_spec
from inputdesign_cli.findings.refuted_structure import refutations
from inputdesign_cli.findings.unrelated_inputs import late_inputs, perhaps_swapped
from inputdesign_cli.identification import silent_in
from inputdesign_cli.identification.checks import check_varying
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.outcome.curves import FitCurves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.identify import Identified, blaming_columns, identification_results
from inputdesign_cli.questions.assessment.outcome import fit_of, fit_to_log, response_without_model
from inputdesign_cli.questions.common.delivery import adding
from inputdesign_cli.questions.exploration.build import Asked, build_explored, spec_text
from inputdesign_cli.questions.exploration.outcome import exploration_of, structure_curves, validation_of
from inputdesign_cli.records import Preparation, Record, read_data, read_logs

# If shifts still appear after they were left out this many times, no model that was tried fits the plant.
_MOST_SHIFTS = 2


@dataclass(frozen=True)
class Exploration:
    """Holds the results, reasons against trust in any model (empty if one has it), and failed tests.

    `levels` is the option with which `assess` removes the levels of this log in the same way.
    """

    results: Results
    reasons: tuple[str, ...] = ()
    against: tuple[str, ...] = ()
    levels: str = "--remove-means"


def explore(
    paths: Sequence[Path], preparation: Preparation, only: Family | None = None, asked: Asked | None = None
) -> Exploration:
    """Find a model of the plant that a log is of; raise `DataError` if it cannot be read or determines none.

    Args:
        only: the structure to take; None: the simplest that explains the log as well as any.
        asked: the sections on the design of the spec to write; None: the most informative experiment.
    """
    started = time.perf_counter()
    whole_log = log = read_logs(paths, preparation)
    if asked is not None:
        asked.check_unit(log.time_unit)
    looped = bool(loops := answers_output(log.parts))
    with blaming_columns(paths[0], log):
        try:
            log, found = explored_beside_shifts(log, loop=looped, only=only)
        except SpecError as error:
            if idle := undriven(log.parts):
                raise bad_spec("no-structure", idle[0].message, hint=DRIVE, key="u") from error
            raise
    measured, log = log, replace(log, y=np.concatenate([y for _, y in levelled(log.parts, found.slopes)]))
    task, data = build_explored(spec_text(log, found, paths)), _data(log, found)
    units, of_log = task.header.units, replace(log, r=log.r if looped else None)
    tables, curves, lines = response_without_model(
        units, found.model, of_log, inputs=found.moving, loop=looped
    )
    whole = lines is not None and len(log.lengths) == 1
    silent = silent_in(log.u[:, found.moving], log.y) if whole else {}
    integrates = only == "integrator" or (asked is not None and asked.integrates)
    doubts = _doubts(found, measured, data, units, loop=looped, integrates=integrates)
    doubts += () if lines is None else contradicted(lines)
    reasons = tuple(one.message for one in doubts)
    noted = replace(data, findings=(*log.findings, *explored_structures(log, found, loops)))
    identified = Identified(found.estimate, found.model, noted, preparation, loop_noted=looped)
    results = identification_results(task, identified.asked_by(task, "the estimate"), started)
    names = " and ".join(path.name for path in paths)
    once = [one for one in results.outcome.findings or () if one.message not in reasons]
    outcome = replace(
        results.outcome.with_findings(once),
        title=f"The plant, from {names}",
        exploration=exploration_of(log, found, loops, reasons, lines, silent),
        validation=validation_of(found.validation),
    )
    findings = [*map(_untrusted, doubts)]
    findings += () if lines is None else response_note(lines)
    findings += silent_lines_answer(silent)
    if asked is not None:
        stated = {one: (own.get("name", ""), own.get("unit", "")) for one, own in asked.channels.items()}
        findings += columns_against_spec(
            [*log.names.values()], stated, units.inputs, units.outputs, log.names
        )
    text = spec_text(log, found, paths, reasons, loop=looped and not asked, asked=asked)
    fit = fit_to_log(cast(FitCurves, results.curves["fit"]), whole_log, data)
    curves = {**structure_curves(found), **curves, "fit": fit}
    results = adding(replace(results, resolved_spec=text), outcome, findings, tables, curves)
    against = [*shifted_levels(found.estimate, data, log.time_unit)]
    against += refutations(found.model, found.estimate)
    levels = "--detrend linear" if np.any(found.slopes) else "--remove-means"
    return Exploration(results, reasons, tuple(one.message for one in against), levels)


def _doubts(
    found: Found, log: Record, data: Record, units: Units, *, loop: bool, integrates: bool
) -> list[Finding]:
    """Return what speaks against a model that was found in a log.

    Args:
        log: the whole log, without its drift.
        data: the samples that the model was estimated from.
        loop, integrates: whether inputs answer the outputs, and the user says that the plant integrates.
    """
    if idle := undriven(log.parts):  # then other tests say nothing about the plant
        return idle
    if swapped := perhaps_swapped(log.parts):
        return swapped
    faulty = biasing(units, found.estimate, data, found.validation.simulation)
    if spiked := [one for one in faulty if one.code == SPIKES.code]:
        return spiked
    return [
        *doubtful_model(found, log.parts, log.step, log.time_unit, integrates=integrates),
        *doubtful_inputs(found, log.parts, loop=loop),
        *late_inputs(units, found.estimate),
        *faulty,
    ]


def explored_beside_shifts(log: Record, *, loop: bool, only: Family | None = None) -> tuple[Record, Found]:
    """Return the model that a log supports, and the log without the samples in which outputs shift.

    Each part then has a level of its own. Nothing is left out where the rest determines no model, or cannot
    judge it.
    """

    def found_in(part: Record, only: Family | None = only) -> Found:
        return explore_records(part.parts, feedback=loop, step=part.step, ramp=part.lined, only=only)

    check_unpredictable(log.parts)
    whole = rest = log
    first = found = found_in(log)
    for _ in range(_MOST_SHIFTS):
        shifts = found.estimate.tests.shifted
        if not shifts:
            return rest, found
        shifting = np.unique(np.concatenate([found.samples[one.begins : one.ends] for one in shifts]))
        less = rest.without(shifting)
        try:
            another = found_in(less)
        except SpecError:
            return rest, found
        if another.split == "none" != found.split:
            return rest, found
        step = left_out(rest, shifts, found.samples, rest.time_unit)
        rest, found = replace(less, findings=(*rest.findings, step)), another
    return (whole, first) if found.estimate.tests.shifted else (rest, found)


def _untrusted(doubt: Finding) -> Finding:
    """Return a reason against trust in a model as a finding that says so."""
    return replace(doubt, message=f"no trust: {doubt.message}")


def _data(log: Record, found: Found) -> Record:
    """Return the samples that the model was estimated from."""
    u, y = (np.concatenate(signals) for signals in zip(*found.used, strict=True))
    own = log.at(found.samples, tuple(len(part) for _, part in found.used))
    return replace(own, u=u, y=y, r=None, findings=(), means=None, repeated=(), lined=False)


def judge(model: Model, header: Header, paths: Sequence[Path], preparation: Preparation) -> Exploration:
    """Return the fit and the tests of a given model on other data.

    Raises:
        DataError: the data cannot be used, or an output never changes.
    """
    started = time.perf_counter()
    data = read_data(paths, header.units, preparation)
    with blaming_columns(paths[0], data):
        check_varying((), data.u[:, :0], data.y)
        check_enough(data.y)
    found = fits(model, data.parts)
    simulated = [
        (fit if np.all(np.isfinite(curve)) else None, curve)
        for fit, curve in zip(found.simulation, found.simulated.T, strict=True)
    ]
    columns, curves = fit_of(header.units, data, found.errors, simulated, data.time)
    doubts = other_plants(found, data)
    reasons = tuple(one.message for one in doubts)
    outcome = Outcome(
        title=header.title or f"How the model does on {' and '.join(path.name for path in paths)}",
        status="validated",
        samples=len(data.y),
        validation=validation_of(found, reasons),
        timing_s={"validation": time.perf_counter() - started},
    ).saying([*data.findings, *map(_untrusted, doubts)])
    tables, unit = {"fit": Table(columns)}, header.units.time_unit
    return Exploration(Results(outcome, header.resolved_spec, unit, tables, {"fit": curves}), reasons)
