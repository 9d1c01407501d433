"""Designs and records that keep an exact confidence: alpha is calibrated to simulated estimates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.accuracy import worst_ratio
from inputdesign_cli.accuracy.calibration import Calibration, Coverage, with_alpha
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.coordinates import white_power, whitened_problem
from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.questions.common.confidence import (
    SETTLED,
    Confidence,
    SimulatedEstimates,
    beyond_chance,
    bounded_errors,
    settled_alpha,
)
from inputdesign_cli.questions.common.record import Made, RecordRequest, as_long, redrawn
from inputdesign_cli.questions.least_cost.outcome import Designed
from inputdesign_cli.questions.least_cost.record_search import fitting_record
from inputdesign_cli.signal.selection import Record
from inputdesign_cli.spectrum import flat_basis

# A record that needs a larger alpha is made anew, this often at the most.
_RECORDS = 4
# Simulated experiments correct the design this often at the most, until they change alpha by this share.
_CORRECTIONS, _CORRECTED = 5, 0.01
# If other runs do not confirm the correction, this multiple of runs corrects it.
_SETS = 4

MakeDesign = Callable[[Question, Confidence], Designed]
Known = Callable[[Record | None], Array | None]


@dataclass(frozen=True)
class ExactConfidence:
    """Holds the confidence asked, and the `usual` alpha of the chi-squared distribution.

    Without a `simulator` the estimates are drawn from their asymptotic distribution.
    """

    calibration: Calibration
    usual: float
    question: Question
    simulator: SimulatedEstimates | None

    def designed(self, design: MakeDesign, request: RecordRequest) -> Designed:
        """Return the design that needs just the alpha that it is for."""
        calibration, alpha, designs, sets = self.calibration, self._first_alpha(), 0, 1
        for _ in range(_CORRECTIONS):
            done, made = self._settled(design, calibration, alpha)
            designs += made
            simulated, coverage = self._of_spectrum(done, request, sets), None
            if simulated is None:
                break
            errors, before = bounded_errors(done.problem.requirements), calibration.excess
            calibration = simulated.corrected(calibration, errors, done.information)
            if abs(calibration.excess / before - 1.0) <= _CORRECTED:
                coverage = self._coverage(done, done.information, simulated)
                if sets > 1 or not beyond_chance(coverage, self.calibration.probability):
                    break
                sets = _SETS
                calibration = replace(simulated, sets=sets).corrected(calibration, errors, done.information)
            alpha = done.confidence.alpha * calibration.excess / before
        coverage = coverage or self._coverage(done, done.information, simulated)
        solver = done.answer.solver
        solver = replace(solver, details={**solver.details, "designs": designs})
        confidence = replace(done.confidence, coverage=coverage)
        return replace(done, confidence=confidence, answer=replace(done.answer, solver=solver))

    def _settled(self, design: MakeDesign, calibration: Calibration, start: float) -> tuple[Designed, int]:
        """Return the design that needs just the alpha that it is for, and how many were made."""
        found = dict[float, Designed]()

        def needed(alpha: float) -> float | None:
            try:
                found[alpha] = design(
                    self.question.at_alpha(alpha), Confidence(alpha, self.usual, calibration)
                )
            except InfeasibleError:  # a smaller alpha may do
                return None
            done = found[alpha]
            return calibration.alpha(bounded_errors(done.problem.requirements), done.information)

        return found[settled_alpha(needed, start)], len(found)

    def recorded(self, done: Designed, made: Made, request: RecordRequest, known: Known) -> Made:
        """Return the record `made`, or one that keeps the confidence: samples may need a larger alpha."""
        design, alpha, sets = done.design, done.confidence.alpha, 1
        errors = bounded_errors(done.problem.requirements)

        def needed(record: Record, information: Array) -> float:
            """Return the alpha of a record with this information (k, k)."""
            simulated, calibration = self._of_record(record), self.calibration
            if simulated is not None:
                calibration = replace(simulated, sets=sets).corrected(calibration, errors, information)
            return calibration.alpha(errors, information)

        for _ in range(_RECORDS):
            information = known(made.record)
            if information is None or not (made.record and made.record.met):
                return made
            found = needed(made.record, information)
            if found <= alpha * (1.0 + SETTLED) and sets == 1:
                coverage = self.of_record(done, made.record, information)
                if beyond_chance(coverage, self.calibration.probability) < 0:
                    sets = _SETS
                    found = needed(made.record, information)
            if found <= alpha * (1.0 + SETTLED):
                break
            alpha = found
            stricter = tuple(with_alpha(design.problem.requirements, alpha))
            design = replace(design, problem=replace(design.problem, requirements=stricter))
            made = fitting_record(request, done.question.at_alpha(alpha), design, done.experiment.samples)
        information = known(made.record)
        if made.record is None or information is None:
            return made
        ratio = worst_ratio(done.problem.requirements)(information)
        return replace(made, record=replace(made.record, worst_ratio=ratio))

    def of_record(self, done: Designed, record: Record, information: Array) -> Coverage:
        """Return the share of fresh estimates within the bounds, for a record of information (k, k)."""
        return self._coverage(done, information, self._of_record(record))

    def _coverage(self, done: Designed, information: Array, simulated: SimulatedEstimates | None) -> Coverage:
        errors, within = bounded_errors(done.problem.requirements), 1.0
        if self.question.goal == "factor":  # r_adm is multiplied by the ratio that was reached
            within = max(error.worst(done.information).ratio for error in errors)
        coverage = self.calibration.coverage(errors, information, within)
        return coverage if simulated is None else simulated.checked(coverage, errors, within)

    def _of_spectrum(self, done: Designed, request: RecordRequest, sets: int) -> SimulatedEstimates | None:
        """Return estimates of records of the designed spectrum; None if not asked for, or not made."""
        samples, found = as_long(request, done.experiment), done.design.result
        if self.simulator is None or samples is None or not done.excites:
            return None
        return self.simulator.of(redrawn(request, found.basis, found.x, samples), samples, sets)

    def _of_record(self, record: Record) -> SimulatedEstimates | None:
        return None if self.simulator is None else self.simulator.of_record(record.samples)

    def _first_alpha(self) -> float:
        """Return alpha for white excitation if least cost is sought, so that the first design is feasible."""
        question, experiment = self.question, self.question.experiment
        power = white_power(question) if question.goal == "cost" else 0.0
        if power == 0.0:
            return self.usual
        flat = replace(question, basis=flat_basis(experiment))
        problem = whitened_problem(flat, np.full(experiment.inputs, power / experiment.inputs))
        errors = bounded_errors(problem.requirements)
        return self.calibration.alpha(errors, problem.information(np.array([power])))
