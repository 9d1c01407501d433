"""A log -> a model, what speaks for and against it, and a spec for the next experiment; or a verdict."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import IdesignError, SpecError, bad_spec
from inputdesign_cli.explore import Fits, Found, answers_output, fits
from inputdesign_cli.findings.faults import biasing
from inputdesign_cli.findings.level_shifts import shifted_levels
from inputdesign_cli.findings.measured_response import contradicted, response_note
from inputdesign_cli.findings.nonlinear_response import silent_lines_answer
from inputdesign_cli.findings.refuted_structure import refutations
from inputdesign_cli.identification import cross_correlations, frequency_response, response_delays, silent_in
from inputdesign_cli.identification.checks import check_varying, signal_name
from inputdesign_cli.identification.silent_lines import SilentLines
from inputdesign_cli.outcome import MeasuredLines
from inputdesign_cli.outcome.curves import ResponseCurves
from inputdesign_cli.outcome.results import Json, Results, Table, typed
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.identify import (
    Identification,
    Identified,
    blaming_columns,
    identification_results,
    told,
)
from inputdesign_cli.questions.assessment.responses import response_of_data
from inputdesign_cli.questions.exploration.beside_shifts import explored_beside_shifts
from inputdesign_cli.questions.exploration.build import build_explored, spec_text, warned
from inputdesign_cli.questions.exploration.no_trust import DRIVE, HALF, LEAST_FIT, distrusted, undriven_inputs
from inputdesign_cli.questions.exploration.outcome import (
    exploration_entry,
    exploration_notes,
    structure_curves,
    validation_curves,
    validation_entry,
    without_drift,
)
from inputdesign_cli.questions.frequency_response.measured import silent_entry
from inputdesign_cli.records import Preparation, Record, read_data, read_logs, read_sheet, with_channels

# Past inputs explain what a judged model leaves: by chance alone, so seldom.
_SURELY = 1e-6


@dataclass(frozen=True)
class Exploration:
    """The results, why no model deserves trust (nothing where one does), and what tests say against it."""

    results: Results
    reasons: tuple[str, ...] = ()
    against: tuple[str, ...] = ()


def explore(paths: Sequence[Path], preparation: Preparation) -> Exploration:
    """Find a model of the plant that a log is of.

    Raises:
        DataError: the log cannot be read, or tells no model at all.
    """
    started = time.perf_counter()
    log = read_logs(paths, preparation)
    loops = answers_output(log.parts)
    undriven = undriven_inputs(log)
    with blaming_columns(paths[0], log):
        try:
            log, found = explored_beside_shifts(log, loop=bool(loops))
        except SpecError as error:
            if not undriven:
                raise
            raise bad_spec("no-structure", undriven[0], hint=DRIVE, key="u") from error
    measured, log = log, without_drift(log, found)
    text = spec_text(log, found, paths)
    task = build_explored(text)
    u, y = (np.concatenate(signals) for signals in zip(*found.used, strict=True))
    lengths = tuple(len(part) for _, part in found.used)
    own = log.at(found.samples, lengths)
    data = replace(own, u=u, y=y, r=None, findings=(), remarks=(), means=None, repeated=(), lined=False)
    response = _without_model(task.header.units, log, found, loop=bool(loops))
    doubts = (
        *biasing(task.header.units, found.estimate, data, found.validation.simulation),
        *(() if response is None else contradicted(response.told)),
    )
    doubtful = [one.message for one in doubts]
    reasons = distrusted(measured, found, undriven, doubtful, loop=bool(loops))
    heard = exploration_notes(log, found, loops)
    heard = [*log.remarks, *heard, *(f"no trust: {reason}" for reason in reasons)]
    noted = replace(data, findings=log.findings, remarks=tuple(heard))
    identified = _asked(
        task, Identified(found.estimate, found.model, noted, preparation, None, loop_told=bool(loops))
    )
    results = identification_results(task, identified, started)
    result = {
        **results.result,
        "title": f"What {' and '.join(path.name for path in paths)} {'tells' if len(paths) == 1 else 'tell'}",
        "exploration": exploration_entry(log, found, loops, reasons),
        "validation": validation_entry(found.validation),
    }
    complete = replace(
        results,
        outcome=typed(result),
        resolved_spec=warned(text, reasons, loop=bool(loops)),
        curves={**results.curves, **structure_curves(found)},
    )
    against = tuple(
        one.message
        for one in (
            *shifted_levels(found.estimate, data, log.time_unit),
            *refutations(found.model, found.estimate),
        )
    )
    return Exploration(complete if response is None else response.beside(complete), reasons, against)


@dataclass(frozen=True)
class _Response:
    """The frequency response of the data alone, and what silent lines tell."""

    table: Table
    curves: ResponseCurves
    told: MeasuredLines
    silent: dict[str, SilentLines]

    def beside(self, explored: Results) -> Results:
        """The results with it."""
        result = explored.result
        return replace(
            explored,
            outcome=typed(
                {
                    **result,
                    "exploration": {
                        **result["exploration"],
                        "frequency_response": self.told,
                        **({"nonlinearity": silent_entry(self.silent)} if self.silent else {}),
                    },
                    "notes": [
                        *result.get("notes", []),
                        *(one.message for one in response_note(self.told)),
                        *(one.message for one in silent_lines_answer(self.silent)),
                    ],
                }
            ),
            tables={**explored.tables, "frequency_response": self.table},
            curves={**explored.curves, "frequency_response": self.curves},
        )


def _without_model(units: Units, log: Record, found: Found, *, loop: bool) -> _Response | None:
    """The frequency response of the data alone, where it can be had.

    Args:
        loop: whether inputs answer the outputs.
    """
    moving = log.u[:, found.moving]

    def delays(samples: int) -> NDArray[np.int64]:
        return response_delays(found.model, samples, step=units.step)[:, found.moving]

    outside = log.r[:, found.moving] if loop and log.r is not None else None
    if outside is not None and np.any(np.all(outside == moving, axis=0)):
        outside = None  # what is u itself is not from outside
    response = frequency_response(moving, log.y, outside, lengths=log.lengths, delays=delays)
    if response is None and outside is not None:  # a reference that rests excites nothing
        outside = None
        response = frequency_response(moving, log.y, lengths=log.lengths, delays=delays)
    if response is None:
        return None
    silent = silent_in(moving, log.y) if len(log.lengths) == 1 else {}
    made = response_of_data(
        units, found.model, response, by_reference=outside is not None, inputs=found.moving, loop=loop
    )
    return _Response(*made, silent)


def _asked(task: Identification, identified: Identified) -> Identified:
    """With what the spec asks at the estimate, where it can be asked."""
    try:
        question = task.at(
            identified.model, len(identified.data.y), identified.estimate.factor, "the estimate"
        )
    except IdesignError as error:
        return replace(identified, unasked=told(error))
    return replace(identified, question=question)


def judge(model: Model, header: Header, paths: Sequence[Path], preparation: Preparation) -> Exploration:
    """How a given model does on other data.

    Raises:
        DataError: the data cannot be used, or an output never changes.
    """
    started = time.perf_counter()
    counts = {"u": header.units.inputs, "y": header.units.outputs}
    sheet = read_sheet(paths[0], preparation=preparation)
    own = {
        name: column
        for name, column in with_channels(sheet, preparation.columns).items()
        if name in preparation.columns or int(name[1:]) <= counts[name[0]]
    }
    preparation = replace(preparation, columns=own)
    data = read_data(paths, header.units, preparation)
    with blaming_columns(paths[0], data):
        check_varying((), data.u[:, :0], data.y)
    at = np.cumsum(data.lengths)[:-1]
    parts = list(zip(np.split(data.u, at), np.split(data.y, at), strict=True))
    found = fits(model, parts)
    table, curves = validation_curves(header.units, data, found)
    reasons = _too_little(found) or _explained_by_inputs(found, data)
    result: dict[str, Json] = {
        "format": 1,
        "title": header.title or f"How the model does on {' and '.join(path.name for path in paths)}",
        "status": "validated",
        "samples": len(data.y),
        "validation": {**validation_entry(found), "reasons": list(reasons)},
        "notes": [*data.notes, *(f"no trust: {reason}" for reason in reasons)],
        "timing_s": {"validation": time.perf_counter() - started},
    }
    outcome = replace(typed(result), findings=data.findings or None)
    return Exploration(
        Results(outcome, header.resolved_spec, header.units.time_unit, {"fit": table}, {"fit": curves}),
        reasons,
    )


def _too_little(found: Fits) -> tuple[str, ...]:
    """Why a model that is judged is none of these data."""
    single = len(found.simulation) == 1
    told = []
    for i, fit in enumerate(found.simulation):
        if fit < LEAST_FIT:
            output = "y" if single else f"y{i + 1}"
            what = (
                f"the simulation explains {fit:.1f} % of {output}, and less than {LEAST_FIT:g} % is "
                "nothing: a level alone explains as much"
                if np.isfinite(fit)
                else f"the model has no simulation of {output}: its plant is unstable"
            )
            told.append(
                f"{what}; see whether the model is of this plant, and gain, delay, units and columns agree"
            )
    return tuple(told)


def _explained_by_inputs(found: Fits, data: Record) -> tuple[str, ...]:
    """Outputs of which a model that is judged explains less than half, where past inputs explain the rest.

    A poor fit alone is no fault of the model: the noise may be strong.
    """
    poor = [i for i, fit in enumerate(found.simulation) if fit < HALF]
    told = []
    for i in poor:
        test = cross_correlations(found.errors[:, i : i + 1], data.u, lengths=data.lengths)
        if not test.probability >= _SURELY:
            output = signal_name("y", i, len(found.simulation))
            told.append(
                f"the simulation explains {found.simulation[i]:.1f} % of {output} only, and past inputs "
                f"explain what it leaves (probability {chance(test.probability)}): the model is not of the "
                "plant of these data, or this acts otherwise here"
            )
    return tuple(told)
