"""Find a model in a log, list the evidence for and against it, and write a spec for the next experiment."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.explore import Family, Found, answers_output, explore_records, levelled
from inputdesign_cli.findings.explored_inputs import DRIVE, doubtful_inputs, undriven
from inputdesign_cli.findings.explored_models import doubtful_model
from inputdesign_cli.findings.faults import biasing, left_out, shifted_levels
from inputdesign_cli.findings.frequency_responses import contradicted, response_note
from inputdesign_cli.findings.periods import silent_lines_answer
from inputdesign_cli.findings.refuted_structure import refutations
from inputdesign_cli.findings.unrelated_inputs import late_inputs
from inputdesign_cli.identification import silent_in
from inputdesign_cli.identification.nonlinearity import SilentLines
from inputdesign_cli.outcome import MeasuredLines, Outcome
from inputdesign_cli.outcome.curves import ResponseCurves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.questions.assessment.identify import Identified, blaming_columns, identification_results
from inputdesign_cli.questions.assessment.outcome import response_without_model
from inputdesign_cli.questions.exploration.build import build_explored, spec_text
from inputdesign_cli.questions.exploration.outcome import (
    exploration_notes,
    exploration_of,
    structure_curves,
    validation_of,
)
from inputdesign_cli.questions.frequency_response.measure import silent_entry
from inputdesign_cli.records import Preparation, Record, read_logs

# Where more shifts appear, once these are left out so often, the plant is none of the models tried.
_MOST_SHIFTS = 2


@dataclass(frozen=True)
class Exploration:
    """Holds the results, reasons against trust in any model (empty if one has it), and failed tests."""

    results: Results
    reasons: tuple[str, ...] = ()
    against: tuple[str, ...] = ()


def explore(paths: Sequence[Path], preparation: Preparation, only: Family | None = None) -> Exploration:
    """Find a model of the plant that a log is of.

    Args:
        only: the structure to take; None: the simplest that explains the log as well as any.

    Raises:
        DataError: the log cannot be read, or determines no model at all.
    """
    started = time.perf_counter()
    log = read_logs(paths, preparation)
    loops = answers_output(log.parts)
    with blaming_columns(paths[0], log):
        try:
            log, found = explored_beside_shifts(log, loop=bool(loops), only=only)
        except SpecError as error:
            idle = undriven(log.parts)
            raise (
                bad_spec("no-structure", idle[0].message, hint=DRIVE, key="u") if idle else error
            ) from error
    measured, log = log, replace(log, y=np.concatenate([y for _, y in levelled(log.parts, found.slopes)]))
    looped = bool(loops)
    task, data = build_explored(spec_text(log, found, paths)), _data(log, found)
    units, of_log = task.header.units, replace(log, r=log.r if looped else None)
    response = response_without_model(units, found.model, of_log, inputs=found.moving, loop=looped)
    doubts = [
        *doubtful_model(found, measured.parts, log.step, log.time_unit, integrates=only == "integrator"),
        *doubtful_inputs(found, measured.parts, loop=looped),
        *late_inputs(measured.parts),
        *biasing(units, found.estimate, data, found.validation.simulation),
        *(() if response is None else contradicted(response[2])),
    ]
    reasons = tuple(one.message for one in doubts)
    remarks = (*log.remarks, *exploration_notes(log, found, loops))
    noted = replace(data, findings=log.findings, remarks=remarks)
    identified = Identified(found.estimate, found.model, noted, preparation, loop_told=looped)
    results = identification_results(task, identified.asked_by(task, "the estimate"), started)
    names = " and ".join(path.name for path in paths)
    outcome = replace(
        results.outcome,
        title=f"What {names} {'tells' if len(paths) == 1 else 'tell'}",
        exploration=exploration_of(log, found, loops, reasons),
        validation=validation_of(found.validation),
    ).saying(replace(one, message=f"no trust: {one.message}") for one in doubts)
    results = replace(
        results,
        outcome=outcome,
        resolved_spec=spec_text(log, found, paths, reasons, loop=looped),
        curves={**results.curves, **structure_curves(found)},
    )
    if response is not None:
        silent = silent_in(log.u[:, found.moving], log.y) if len(log.lengths) == 1 else {}
        results = _beside(results, *response, silent)
    speaking = (
        *shifted_levels(found.estimate, data, log.time_unit),
        *refutations(found.model, found.estimate),
    )
    return Exploration(results, reasons, tuple(one.message for one in speaking))


def explored_beside_shifts(log: Record, *, loop: bool, only: Family | None = None) -> tuple[Record, Found]:
    """Return the model that a log supports, and the log without the samples in which outputs shift.

    Each part then has a level of its own. Nothing is left out where the rest determines no model, or cannot
    judge it.
    """

    def found_in(part: Record) -> Found:
        return explore_records(part.parts, feedback=loop, step=part.step, ramp=part.lined, only=only)

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
        short = len(rest.y) - len(less.y) - len(shifting)
        step = left_out(rest, shifts, found.samples, rest.time_unit, short=short)
        rest, found = replace(less, remarks=(*rest.remarks, step)), another
    return (whole, first) if found.estimate.tests.shifted else (rest, found)


def _data(log: Record, found: Found) -> Record:
    """Return the samples that the model was estimated from."""
    u, y = (np.concatenate(signals) for signals in zip(*found.used, strict=True))
    own = log.at(found.samples, tuple(len(part) for _, part in found.used))
    return replace(own, u=u, y=y, r=None, findings=(), remarks=(), means=None, repeated=(), lined=False)


def _beside(
    explored: Results,
    table: Table,
    curves: ResponseCurves,
    lines: MeasuredLines,
    silent: dict[str, SilentLines],
) -> Results:
    """Return the results with the frequency response of the data alone, and the findings on it."""
    outcome: Outcome = explored.outcome.saying((*response_note(lines), *silent_lines_answer(silent)))
    assert outcome.exploration is not None  # results of an exploration
    section = replace(
        outcome.exploration, frequency_response=lines, nonlinearity=silent_entry(silent) or None
    )
    return replace(
        explored,
        outcome=replace(outcome, exploration=section),
        tables={**explored.tables, "frequency_response": table},
        curves={**explored.curves, "frequency_response": curves},
    )
