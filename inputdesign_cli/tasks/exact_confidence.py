"""Designs and records that keep an exact confidence: alpha is calibrated to what simulated estimates do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.accuracy import ModelError, Requirement
from inputdesign_cli.accuracy.calibration import Calibration, Coverage, with_alpha
from inputdesign_cli.design.convex.coordinates import white_power, whitened_problem
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Json
from inputdesign_cli.signal import Record
from inputdesign_cli.spectrum import flat_basis
from inputdesign_cli.tasks.confidence import SETTLED, Confidence, bounded_errors, settled_alpha
from inputdesign_cli.tasks.record import Made, RecordRequest, worst_ratio
from inputdesign_cli.tasks.record_search import fitting_record
from inputdesign_cli.tasks.result.design import Designed

# A record that needs a larger alpha is made anew, this often at the most.
_RECORDS = 4

MakeDesign = Callable[[Question, Confidence], tuple[Designed, dict[str, Json]]]
Known = Callable[[Record | None], Array | None]


@dataclass(frozen=True)
class ExactConfidence:
    """The confidence that is asked of the answer to a question; `usual` is the chi-squared alpha."""

    calibration: Calibration
    usual: float
    question: Question

    def designed(self, design: MakeDesign) -> tuple[Designed, dict[str, Json]]:
        """The design that needs just the alpha that it is for, and what the solver did.

        Raises:
            InfeasibleError, InaccurateError: see `settled_alpha`.
        """
        found = dict[float, tuple[Designed, dict[str, Json]]]()

        def needed(alpha: float) -> float | None:
            try:
                found[alpha] = design(self.question.at_alpha(alpha), Confidence(alpha, self.usual))
            except InfeasibleError:  # a smaller alpha may do
                return None
            done = found[alpha][0]
            return self.calibration.alpha(bounded_errors(done.problem.requirements), done.information)

        alpha = settled_alpha(needed, self._first_alpha())
        done, how = found[alpha]
        coverage = self.coverage(done.problem.requirements, done.information)
        confidence = Confidence(alpha, self.usual, self.calibration.probability, coverage)
        return replace(done, confidence=confidence), {**how, "designs": len(found)}

    def recorded(self, done: Designed, made: Made, request: RecordRequest, known: Known) -> Made:
        """The record `made`, or one that keeps the confidence by its own samples.

        A record distributes its information otherwise than the design, so that it may need a larger alpha.

        Args:
            known: the information (k, k) of a record; None where it leaves a parameter undetermined.
        """
        design, alpha = done.design, done.confidence.alpha
        for _ in range(_RECORDS):
            information = known(made.record)
            if information is None or not (made.record and made.record.met):
                return made
            needed = self.calibration.alpha(bounded_errors(done.problem.requirements), information)
            if needed <= alpha * (1.0 + SETTLED):
                break
            alpha = needed
            stricter = tuple(with_alpha(design.problem.requirements, alpha))
            design = replace(design, problem=replace(design.problem, requirements=stricter))
            made = fitting_record(request, done.question.at_alpha(alpha), design, done.experiment.samples)
        information = known(made.record)
        if made.record is None or information is None:
            return made
        ratio = worst_ratio(done.problem.requirements)(information)
        return replace(made, record=replace(made.record, worst_ratio=ratio))

    def coverage(self, requirements: Sequence[Requirement], information: Array) -> Coverage:
        """How many of fresh simulated estimates keep the bounds at this information (k, k)."""
        errors = bounded_errors(requirements)
        return self.calibration.coverage(errors, information, self._reached(errors, information))

    def _reached(self, errors: Sequence[ModelError], information: Array) -> float:
        """What r_adm is multiplied by: where the best accuracy is sought, the ratio that was reached."""
        if self.question.goal != "factor":
            return 1.0
        return max(error.worst(information).ratio for error in errors)

    def _first_alpha(self) -> float:
        """That of white excitation where the least cost is sought, lest the first design be out of reach."""
        question, experiment = self.question, self.question.experiment
        power = white_power(question) if question.goal == "cost" else 0.0
        if power == 0.0:
            return self.usual
        flat = replace(question, basis=flat_basis(experiment))
        problem = whitened_problem(flat, np.full(experiment.inputs, power / experiment.inputs))
        errors = bounded_errors(problem.requirements)
        return self.calibration.alpha(errors, problem.information(np.array([power])))
