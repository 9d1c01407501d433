"""Convex designs: least cost, best accuracy, shortest experiment, with proof, signal and curves."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from inputdesign_cli.accuracy import OnModelError, worst_ratio
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings import designed_records as of_records, unfinished
from inputdesign_cli.findings.designs import loop_not_held
from inputdesign_cli.findings.simulated_runs import confidence_missed
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.outcome import Outcome, White
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.design import white_labels
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.questions.common.bound_curves import (
    Informed,
    equal_white,
    optimality_curves,
    spectrum_curves,
    with_periodogram,
)
from inputdesign_cli.questions.common.confidence import covered
from inputdesign_cli.questions.common.delivery import Delivered, adding, results_of
from inputdesign_cli.questions.common.record import (
    Made,
    design_cost,
    least_period,
    peak_at,
    redrawn,
    spectrum_of,
)
from inputdesign_cli.questions.common.searched_record import distance_to_best
from inputdesign_cli.questions.common.signal_outcome import signal_of
from inputdesign_cli.questions.common.task import SpectrumTask
from inputdesign_cli.questions.least_cost.audit import audit
from inputdesign_cli.questions.least_cost.outcome import Designed, design_outcome
from inputdesign_cli.questions.least_cost.record_search import fitting_record
from inputdesign_cli.questions.least_cost.robust_outcome import robust_result
from inputdesign_cli.questions.least_cost.sought import Sought
from inputdesign_cli.signal.selection import Record

_GAINED = 1.001  # a bound over records up to this multiple of the bound over spectra gains nothing
_NEAR = 0.05  # a record within this share of the best possible one needs no note


@dataclass(frozen=True, kw_only=True)
class ConvexTask(SpectrumTask):
    """Holds a convex design: the requirements, the use of its record, and the report."""

    asked: Sought

    def designed(self) -> Designed:
        """Return the design, see `Sought.designed`."""
        return self.asked.designed(self.record)

    def delivered(self) -> Delivered:
        """Return the design, its proof, its signal and its curves, with what a trial takes from it."""
        started = time.perf_counter()
        done = self.designed()
        outcome = self._outcome(done)
        self.asked.check_length(done, of_record=self.record.bounds.hard)
        solved = time.perf_counter()
        self._audit(done, outcome)
        checked = time.perf_counter()
        made = self._made(done)
        record, known = made.record, _known(done, made.record, self.record.step)
        results, informed = self._illustrated(done, outcome, record, known)
        if done.plants is not None:
            peak = None if record is None else peak_at(made.request, done.design, record)
            robust = robust_result(done, done.plants, peak)
            outcome = replace(results.outcome, robust=robust.entry)
            results = adding(results, outcome, robust.findings, robust.tables, robust.curves)
        if done.excites:
            results = self._with_record(done, results, made, known)
        seconds = {
            "design": solved - started,
            "check": checked - solved,
            "signal": time.perf_counter() - checked,
        }
        of_design = made.design.result
        return self.to_be_tried(
            results,
            seconds,
            record,
            partial(redrawn, made.request, of_design.basis, of_design.x),
            done.confidence.alpha,
            informed,
            done.experiment,
            done.problem.requirements,
            flat=done.problem.demands.definite,
        )

    def _outcome(self, done: Designed) -> Outcome:
        """Return the outcome of the design, with findings on parts that its proof lacks."""
        outcome, columns, reach = design_outcome(done), self.asked.columns, self.asked.reach
        if columns is not None and outcome.spectrum is not None:
            details = {**outcome.spectrum.details, "factor_columns": columns.columns}
            outcome = replace(outcome, spectrum=replace(outcome.spectrum, details=details))
        if not done.excites:
            return outcome
        found: list[Finding] = []
        if done.answer.solver.ended_by is not None and outcome.objective is not None:
            found += unfinished.ended_early(done.answer.status, outcome.objective)
        elif not (done.design.any_spectrum or reach.note):
            found.append(unfinished.other_spectra_left_out())
        if reach.note:
            found.append(unfinished.uncounted_excitation(reach.note, bounded=reach.bounded))
        if self.asked.grid is not None and outcome.model_error is not None:
            worst = outcome.model_error.worst_ratio or 0.0
            found.append(unfinished.on_grid(self.asked.grid.lines, worst))
        return outcome.saying(found)

    def _audit(self, done: Designed, outcome: Outcome) -> None:
        """Check the results that are about to be written by other means, see `audit`."""
        reach = self.asked.reach
        loose = 0.0 if reach.attained else self.asked.tolerance
        try:
            audit(done, outcome, on_grid=self.asked.grid is not None, loose=loose)
        except InaccurateError as error:
            if not reach.note:
                raise
            # An optimum that is only approached drives numbers to the limits of precision.
            explained = [replace(one, hint=f"{reach.note}; or {one.hint}") for one in error.diagnostics]
            raise InaccurateError(explained) from error

    def _made(self, done: Designed) -> Made:
        """Return the record of the design, or none with the finding that there was no time."""
        exact, request = self.asked.exact, self.record
        try:
            made = fitting_record(request, done.question, done.design, done.experiment.samples)
            if exact is not None:
                made = exact.recorded(done, made, request, partial(_known, done, step=request.step))
            return made
        except OutOfTimeError:
            missing = unfinished.no_record_in_time(request.settings.candidates)
            return Made(None, request, done.design, findings=(missing,))

    def _illustrated(
        self, done: Designed, outcome: Outcome, record: Record | None, known: Array | None
    ) -> tuple[Results, Informed]:
        """Return the outcome with tables and curves; of a design without excitation the spectrum alone.

        The accuracy curves are r_u of every entry if no model error is bounded.
        """
        units, design, problem = self.header.units, done.design, done.problem
        level = design.white_power if units.inputs == 1 else None
        spectrum = spectrum_curves(
            units, problem.basis, design.result.x, problem.experiment.band, white=level
        )
        if record is not None:
            spectrum = with_periodogram(units, *spectrum, record.samples)
        tables: dict[str, Table] = {"spectrum": spectrum[0]}
        curves: dict[str, Curves] = {"spectrum": spectrum[1]}
        errors, stated = self.errors(done.experiment, done.asked)
        white = (None if outcome.baseline is None else outcome.baseline.white) or White()
        kind = None if outcome.objective is None else outcome.objective.kind
        informed = Informed(
            units,
            errors,
            done.information,
            stated,
            [design.result.active_at(i) for i, r in enumerate(done.asked) if isinstance(r, OnModelError)],
            design.white.informations[0] / (design.white.s if problem.goal == "factor" else 1.0),
            equal_white(design, done.experiment.samples, white.ratio or 0.0) if done.excites else None,
            known if stated else _known(done, record, self.record.step, own_length=False),
            white_labels(kind, white, done.experiment.samples),
            of_several=done.plants is not None,
        )
        if done.excites:
            more = informed.curves(done.experiment, self.ellipses, flat=problem.demands.definite)
            tables, curves = tables | more[0], curves | more[1]
            optimality = optimality_curves(units, design)
            if optimality is not None:
                bound = None if outcome.objective is None else outcome.objective.any_record_bound
                tables["optimality"] = optimality[0]
                curves["optimality"] = replace(optimality[1], record_bound=bound)
        return results_of(self.header, outcome, tables, curves), informed

    def _with_record(self, done: Designed, results: Results, made: Made, known: Array | None) -> Results:
        """Return the results with the record, and what a user should know before applying it."""
        request, record, problem = made.request, made.record, done.problem
        error = results.outcome.model_error
        coverage = None if error is None else error.confidence
        if record is None:
            length, inputs = request.length(done.experiment.samples), problem.experiment.inputs
            sought = problem.goal == "samples" and request.samples is None
            missing = of_records.too_long(length, request.longest, sought=sought)
            if done.excites:
                missing += of_records.too_short(request.settings.period(length), least_period(inputs))
            missed = [] if coverage is None else confidence_missed(coverage, None)
            found = [*missed, *made.findings, *missing]
            return adding(results, results.outcome, found)
        design, exact = made.design, self.asked.exact
        signal = signal_of(
            made.request,
            design.problem.experiment.with_samples(done.experiment.samples),
            record,
            design.problem.requirements,
            designed=done.information if design is done.design else design.result.information,
            spectrum=spectrum_of(made.request, design.result.basis, design.result.x),
        )
        if exact is not None and known is not None:
            signal = replace(signal, confidence=covered(exact.of_record(done, record, known)))
        if made.input_power is not None:
            signal = replace(signal, spectrum_of={"input_power": made.input_power})
        asked, fewest = request.samples or done.experiment.samples, least_period(problem.experiment.inputs)
        findings = [
            *([] if coverage is None else confidence_missed(coverage, signal.confidence)),
            *made.findings,
            *of_records.accuracy_missed(record),
            *of_records.length_of_record(
                record, asked, request.settings.block, fewest, signal.of_limits or {}
            ),
            *loop_not_held((one.loop for one in results.outcome.requirements or ()), request.settings.hold),
        ]
        if known is not None:
            cost = (1.0 + record.extra_power) * design_cost(done.design, done.cost)
            distance = distance_to_best(done.design, record, known, cost)
            signal = replace(signal, distance_to_best=distance)
            bound, free = done.design.any_record, done.design.any_spectrum
            if bound is not None and free is not None and bound.bound <= _GAINED * free.certificate.bound:
                seen = bound.length * request.settings.hold
                findings += of_records.short_windows(seen, problem.experiment.slowest, distance)
            spectral = problem.goal == "factor" and problem.demands.criterion is None
            near = distance is not None and distance <= _NEAR
            if spectral and not near:  # a record that is near the best there is needs no other
                designed = float(np.sqrt(done.design.result.objective))
                findings += of_records.less_accurate(record.worst_ratio, designed)
            names = list(dict.fromkeys(requirement.name for requirement in problem.side))
            findings += of_records.requirement_missed(names, worst_ratio(problem.side)(known))
        return self.applied(results, done.experiment, record, signal, problem.requirements, findings)


def _known(done: Designed, record: Record | None, step: float, *, own_length: bool = True) -> Array | None:
    """Return the information (k, k) of the record, over its own or the designed length; None without one."""
    if record is None or not np.isfinite(record.worst_ratio):
        return None
    plant = FiniteRecord(done.experiment, len(record.samples), step)
    inform: Callable[[Array], Array] = plant.information if own_length else plant.information_of_experiment
    return inform(record.samples)
