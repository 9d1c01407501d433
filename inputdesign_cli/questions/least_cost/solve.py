"""Convex designs: least cost, best accuracy, shortest experiment, with proof, signal and curves."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from inputdesign_cli.accuracy import ModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.executor import Executor
from inputdesign_cli.compute.time_limit import OutOfTimeError, out_of_time, seconds_left, what_ended
from inputdesign_cli.design.convex.cost import Weight
from inputdesign_cli.design.convex.designs import Design, UnfinishedDesignError, solve_design
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.errors import Diagnostic, InaccurateError, InfeasibleError
from inputdesign_cli.information import Experiment, FiniteRecord, PowerKind
from inputdesign_cli.outcome.results import Json, Results, typed
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.questions.common.confidence import Confidence, covered, missed
from inputdesign_cli.questions.common.ellipses import Pairs
from inputdesign_cli.questions.common.foresight import Foreseen, Foresight
from inputdesign_cli.questions.common.reach import Reach
from inputdesign_cli.questions.common.record import Made, RecordRequest, designed_spectrum, peak_at, redrawn
from inputdesign_cli.questions.common.record_notes import record_notes, shortfall
from inputdesign_cli.questions.common.robust import Plants, delivered_samples, without_dearest
from inputdesign_cli.questions.common.signal_outcome import other_files, signal_curves, signal_entry
from inputdesign_cli.questions.common.simulation import Delivered, Simulation, simulate
from inputdesign_cli.questions.common.status import proof_status
from inputdesign_cli.questions.common.unknown_start import begun_anywhere
from inputdesign_cli.questions.common.within_limits import Bought, StatedBound
from inputdesign_cli.questions.least_cost.audit import audit
from inputdesign_cli.questions.least_cost.exact_confidence import ExactConfidence
from inputdesign_cli.questions.least_cost.factor_columns import FewColumns, restrict_columns
from inputdesign_cli.questions.least_cost.grid_method import GridMethod
from inputdesign_cli.questions.least_cost.illustrations import illustrations, illustrations_of_length
from inputdesign_cli.questions.least_cost.infeasible import explain
from inputdesign_cli.questions.least_cost.outcome import Designed, design_result
from inputdesign_cli.questions.least_cost.record_search import fitting_record, samples_of_record
from inputdesign_cli.questions.least_cost.robust_outcome import robust_result
from inputdesign_cli.questions.least_cost.unfinished import (
    no_other_spectra,
    no_record_in_time,
    unfinished_notes,
)
from inputdesign_cli.questions.least_cost.worst_case import with_worst_plants
from inputdesign_cli.signal import Record


@dataclass(frozen=True)
class ConvexTask:
    """A convex design.

    `experiment` is of the length that the spec states (in `question` it has one sample where the length is
    sought). `alpha` sizes the confidence region of r_u, `most_samples` is the longest experiment allowed.
    `unstated` are errors of the entries of G that have r_u where no requirement bounds it. `stated` are the
    numbers of the spec that bound errors.
    """

    header: Header
    question: Question
    experiment: Experiment
    cost: dict[PowerKind, Weight]
    alpha: float
    exact: ExactConfidence | None
    tolerance: float
    any_spectrum_tolerance: float | None
    most_samples: int | None
    plants: Plants | None
    ellipses: Pairs | None
    grid: GridMethod | None
    columns: FewColumns | None
    record: RecordRequest
    unstated: Sequence[ModelError]
    stated: Sequence[StatedBound]
    simulation: Simulation
    reach: Reach
    foresight: Foresight | None = None

    def solve(self) -> Results:
        """The design, its proof, its signal and its curves.

        Raises:
            InfeasibleError: nothing within the limits meets the requirements.
            InaccurateError: the proof did not close, or nothing that meets everything was found in time.
        """
        return self._delivered().results

    def simulate(self, executor: Executor | None = None) -> Results:
        """The same, with the design tried many times on the true system; see `common.simulation`.

        Raises:
            SpecError: `nothing-to-simulate`; `not-supported` for an input to compare with.
            InfeasibleError, InaccurateError: see `solve`.
        """
        delivered = self._delivered()
        if delivered.record is None:
            seconds_left()  # or else its time is the reason
        return simulate(self.simulation, delivered, executor)

    def _delivered(self) -> Delivered:
        started = time.perf_counter()
        done, how = self.designed()
        result = design_result(done, how, self.tolerance)
        if self.columns is not None:
            result["spectrum"] |= {"factor_columns": self.columns.columns}
        self._check_length(result)
        solved = time.perf_counter()
        loose = 0.0 if self.reach.attained else self.tolerance
        try:
            audit(done, result, on_grid=self.grid is not None, loose=loose)
        except InaccurateError as error:
            if not self.reach.note:
                raise
            # What is only approached drives numbers to where digits end.
            told = [replace(one, hint=f"{self.reach.note}; or {one.hint}") for one in error.diagnostics]
            raise InaccurateError(told) from error
        checked = time.perf_counter()
        if "ended_by" in how:
            notes = unfinished_notes(result)
        else:
            notes = [] if done.design.any_spectrum or self.reach.note else [no_other_spectra()]
        notes += [self.reach.note] if self.reach.note else []
        notes += [self.grid.note(result)] if self.grid is not None else []
        try:
            made = fitting_record(self.record, done.question, done.design, done.experiment.samples)
            if self.exact is not None:
                made = self.exact.recorded(done, made, self.record, partial(self._known, done))
        except OutOfTimeError:
            made = Made(
                None, self.record, done.design, notes=(no_record_in_time(self.record.settings.candidates),)
            )
        record = made.record
        known = self._known(done, record)
        tables, curves = illustrations(
            self.header.units,
            done,
            result,
            record=record,
            known=known,
            as_long=partial(self._known, done, record, own_length=False),
            unstated=self.unstated,
            ellipses=self.ellipses,
        )
        if done.plants is not None:
            peak = None if record is None else peak_at(made.request, done.design, record)
            robust = robust_result(done, done.plants, peak)
            result["robust"] = robust.entry
            tables, curves = tables | robust.tables, curves | robust.curves
            result |= {"notes": [*result.get("notes", []), *robust.notes]} if robust.notes else {}
        files: dict[str, bytes] = {}
        foreseen = Foreseen()
        if record is not None:
            result["signal"] = self._signal_entry(done, made, record, known)
            drawn = signal_curves(made.request, self.header.units, done.experiment, record)
            tables, curves = tables | drawn[0], curves | {"signal": drawn[1]}
            files = other_files(made.request, self.header.units, record)
        if done.design.result.x.any():
            taken = result.get("signal", {}).get("of_limits", {})
            limited = any(limit.upper for limit in done.design.problem.limits)
            notes += [*missed(result), *made.notes]
            notes += record_notes(made.request, done.experiment.samples, record, taken, of_powers=limited)
            if record is not None and known is not None:
                notes += shortfall(done.design, record, known)
                asked, step = done.problem.requirements, self.record.step
                start = begun_anywhere(done.experiment, record.samples, step, asked)
                result["signal"] |= start.entry
                notes += start.notes
            if record is not None and self.foresight is not None:
                foreseen = self.foresight.foreseen(record.samples, done.problem.requirements, result)
                result |= {"foreseen": foreseen.entry} if foreseen.entry else {}
            result |= {"notes": [*result.get("notes", []), *notes]} if notes else {}
        result["timing_s"] = {
            "design": solved - started,
            "check": checked - solved,
            "signal": time.perf_counter() - checked,
        }
        units = self.header.units
        outcome = typed(result).saying(foreseen.findings)
        results = Results(outcome, self.header.resolved_spec, units.time_unit, tables, curves, files)
        if record is None:
            return Delivered(results, None, None, done.confidence.alpha)
        samples, inputs = record.samples.shape
        renewed = redrawn(made.request, made.design, inputs, samples)
        seen, asked = self.foresight, done.problem.requirements
        tried = None if seen is None else partial(seen.tried, record.samples, asked)
        of_length = partial(illustrations_of_length, units, done, self.unstated, self.ellipses)
        return Delivered(results, record.samples, renewed, done.confidence.alpha, of_length, tried)

    def designed(self) -> tuple[Designed, dict[str, Json]]:
        """The design with its experiment, its status and what the solver did.

        Raises:
            InfeasibleError, InaccurateError: see `solve`.
        """
        if self.exact is None:
            return self._designed(self.question, Confidence(self.alpha, self.alpha))
        return self.exact.designed(self._designed, self.record)

    def _designed(self, question: Question, confidence: Confidence) -> tuple[Designed, dict[str, Json]]:
        kept = list(range(len(question.others)))
        design, how = (
            self._by_exchange(question)
            if self.grid is None
            else self.grid.design(
                question, tolerance=self.tolerance, any_spectrum_tolerance=self.any_spectrum_tolerance
            )
        )
        if self.plants is not None and self.plants.discard:
            kept = without_dearest(question, design, self.plants.discard)
            question = replace(question, others=[question.others[number] for number in kept])
            design, how = self._by_exchange(question)
        plants = self.plants
        if plants is not None and plants.region is not None:
            found = with_worst_plants(plants, plants.region, question, (design, how), self._by_exchange)
            plants, question, (design, how) = found
            kept = list(range(len(question.others)))
        if self.columns is not None:
            design, climbed = restrict_columns(self.columns, design)
            how |= climbed
        experiment = replace(design.problem.experiment, samples=delivered_samples(design))
        done = Designed(self.header, question, design, experiment, self.cost, confidence, kept, plants)
        return done, how

    def _by_exchange(self, question: Question) -> tuple[Design, dict[str, Json]]:
        ended: dict[str, Json] = {}
        try:
            design = solve_design(
                question, tolerance=self.tolerance, any_spectrum_tolerance=self.any_spectrum_tolerance
            )
        except UnreachableError as unreachable:
            raise explain(
                self.header.units,
                question,
                unreachable,
                self.stated,
                samples_of_record=partial(samples_of_record, self.record, question),
            ) from unreachable
        except UnfinishedDesignError as unfinished:
            if self.exact is not None:  # it need not keep the confidence that alpha is sought for
                raise
            design, ended = unfinished.design, {"ended_by": what_ended()}
        found = design.result
        status = proof_status(found.gap, self.tolerance)
        if status == "gap_open" and not ended:
            raise InaccurateError.because(
                "gap-not-closed",
                f"the design is proved only to within {found.gap:.1e} of the optimum; solver.tolerance "
                f"asks for {self.tolerance:.1e}",
                hint="loosen solver.tolerance, lower the order of the spectrum, or look for parameters "
                "that are nearly indistinguishable",
                key="solver.tolerance",
            )
        how: dict[str, Json] = {
            "method": "exchange",
            "status": "nothing_needed" if found.objective == 0.0 else status,
            "rounds": found.rounds,
            "cuts": found.cuts,
        }
        if design.any_spectrum is not None:
            how["any_spectrum_gap"] = design.any_spectrum.gap
        return design, how | ended

    def _check_length(self, result: dict[str, Json]) -> None:
        """Raise `InfeasibleError` when even the shortest experiment is longer than limits.samples."""
        most = self.most_samples
        if self.question.goal != "samples" or most is None or result["samples"] <= most:
            return
        least, units = int(np.ceil(result["objective"]["lower_bound"])), self.header.units
        enough = units.length(result["samples"], "limits")
        limit = enough.split(":")[0]
        if least <= most and "ended_by" in result["solver"]:
            raise out_of_time(
                f"the best design so far takes {result['samples']} samples, more than {limit} leaves"
            )
        longest = replace(self.question.of_length(most), goal="factor")
        best = solve_design(longest, tolerance=self.tolerance)
        problem = best.problem.on(best.result.basis)
        bought = Bought(units, self.stated, self.question.limits, problem, best.result)
        raise InfeasibleError(
            Diagnostic(
                "too-long",
                f"the shortest experiment within the power limits takes {result['samples']} samples (proved: "
                f"no fewer than {least}), but {limit} allows {most}; with these {bought.sentence}",
                f"write {enough}{self._for_the_spectrum}, allow more power, or ask for less accuracy",
                limit,
                details=bought.details,
            )
        )

    @property
    def _for_the_spectrum(self) -> str:
        """What a length leaves open that no record was made for."""
        return (
            " (of the spectrum; within limits on single samples a record may take more)"
            if (self.record.bounds.hard)
            else ""
        )

    def _signal_entry(
        self, done: Designed, made: Made, record: Record, known: Array | None
    ) -> dict[str, Json]:
        design = made.design
        entry = signal_entry(
            made.request,
            self.header.units,
            replace(design.problem.experiment, samples=done.experiment.samples),
            record,
            design.problem.requirements,
            designed=done.information if design is done.design else design.result.information,
            spectrum=designed_spectrum(made.request, design, done.experiment.inputs),
        )
        if self.exact is not None and known is not None:
            entry["confidence"] = covered(self.exact.of_record(done, record, known))
        return entry | made.entry

    def _known(self, done: Designed, record: Record | None, *, own_length: bool = True) -> Array | None:
        """The information (k, k) of the record, or of one like it as long as the design.

        None where it leaves a parameter undetermined.
        """
        if record is None or not np.isfinite(record.worst_ratio):
            return None
        plant = FiniteRecord(done.experiment, len(record.samples), self.record.step)
        told = plant.information if own_length else plant.information_of_experiment
        return told(record.samples)
