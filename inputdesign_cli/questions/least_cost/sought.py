"""The design that is sought: what it must meet, and how it is found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from inputdesign_cli.compute.time_limit import out_of_time, what_ended
from inputdesign_cli.design.convex.cost import Weight
from inputdesign_cli.design.convex.designs import UnfinishedDesignError, solve_design
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.errors import Diagnostic, InaccurateError, InfeasibleError
from inputdesign_cli.information import PowerKind
from inputdesign_cli.outcome import Solver
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.questions.common.confidence import Confidence
from inputdesign_cli.questions.common.reach import Reach
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.questions.common.robust import Plants, delivered_samples, without_dearest
from inputdesign_cli.questions.common.status import proof_status
from inputdesign_cli.questions.common.within_limits import Bought, StatedBound
from inputdesign_cli.questions.least_cost.exact_confidence import ExactConfidence
from inputdesign_cli.questions.least_cost.infeasible import explain
from inputdesign_cli.questions.least_cost.methods import FewColumns, GridMethod
from inputdesign_cli.questions.least_cost.outcome import Answer, Designed
from inputdesign_cli.questions.least_cost.record_search import samples_of_record
from inputdesign_cli.questions.least_cost.worst_case import with_worst_plants


@dataclass(frozen=True)
class Method:
    """How a design is found.

    Attributes:
        tolerance: the relative gap that is proved.
        any_spectrum_tolerance: of the bound over every spectrum; None leaves it out.
        reach: how far spectra reach.
        grid: the program of the papers in place of the exchange.
        columns: a factor of few columns, see `FewColumns`.
    """

    tolerance: float
    any_spectrum_tolerance: float | None
    reach: Reach
    grid: GridMethod | None = None
    columns: FewColumns | None = None


@dataclass(frozen=True)
class Sought:
    """What is asked of a design.

    Attributes:
        question: in it the experiment has one sample if the length is sought.
        alpha: sizes the confidence region of r_u; `exact` calibrates it.
        exact: None for the alpha as stated.
        most_samples: the longest experiment allowed.
        plants: that the design is for, beside the plant of the spec.
        stated: the numbers of the spec that bound errors.
    """

    header: Header
    question: Question
    cost: dict[PowerKind, Weight]
    alpha: float
    exact: ExactConfidence | None
    most_samples: int | None
    plants: Plants | None
    stated: Sequence[StatedBound]

    def designed(self, method: Method, request: RecordRequest) -> Designed:
        """Return the design with its experiment, its status and what the solver did.

        Raises:
            InfeasibleError: nothing within the limits meets the requirements.
            InaccurateError: the proof did not close, or nothing that meets everything was found in time.
        """
        design = partial(self._designed, method, request)
        if self.exact is None:
            return design(self.question, Confidence(self.alpha, self.alpha))
        return self.exact.designed(design, request)

    def _designed(
        self, method: Method, request: RecordRequest, question: Question, confidence: Confidence
    ) -> Designed:
        solve = partial(self._by_exchange, method, request)
        if method.grid is None:
            answer = solve(question)
        else:
            answer = method.grid.design(
                question, tolerance=method.tolerance, any_spectrum_tolerance=method.any_spectrum_tolerance
            )
        plants, kept = self.plants, list(range(len(question.others)))
        if plants is not None and plants.discard:
            kept = without_dearest(question, answer.design, plants.discard)
            question = replace(question, others=[question.others[number] for number in kept])
            answer = solve(question)
        if plants is not None and plants.region is not None:
            plants, question, answer = with_worst_plants(plants, plants.region, question, answer, solve)
            kept = list(range(len(question.others)))
        if method.columns is not None:
            answer = method.columns.climbed(answer)
        experiment = replace(answer.design.problem.experiment, samples=delivered_samples(answer.design))
        return Designed(self.header, question, answer, experiment, self.cost, confidence, kept, plants)

    def _by_exchange(self, method: Method, request: RecordRequest, question: Question) -> Answer:
        tolerance, ended = method.tolerance, None
        try:
            design = solve_design(
                question, tolerance=tolerance, any_spectrum_tolerance=method.any_spectrum_tolerance
            )
        except UnreachableError as unreachable:
            raise explain(
                self.header.units,
                question,
                unreachable,
                self.stated,
                samples_of_record=partial(samples_of_record, request, question),
            ) from unreachable
        except UnfinishedDesignError as unfinished:
            if self.exact is not None:  # it need not keep the confidence that alpha is sought for
                raise
            design, ended = unfinished.design, what_ended()
        found = design.result
        status = proof_status(found.gap, tolerance)
        if status == "gap_open" and not ended:
            raise InaccurateError.because(
                "gap-not-closed",
                f"the design is proved only to within {found.gap:.1e} of the optimum; solver.tolerance "
                f"asks for {tolerance:.1e}",
                hint="loosen solver.tolerance, lower the order of the spectrum, or look for parameters "
                "that are nearly indistinguishable",
                key="solver.tolerance",
            )
        solver = Solver(
            "exchange",
            tolerance,
            rounds=found.rounds,
            cuts=found.cuts,
            any_spectrum_gap=None if design.any_spectrum is None else design.any_spectrum.gap,
            ended_by=ended,
        )
        return Answer(design, "nothing_needed" if found.objective == 0.0 else status, solver)

    def check_length(self, done: Designed, tolerance: float, *, of_record: bool) -> None:
        """Raise `InfeasibleError` (`too-long`) if the shortest experiment is longer than limits.samples.

        Args:
            tolerance: of the design of the longest experiment, for the message.
            of_record: whether single samples are limited, so that a record may take more.
        """
        most, takes = self.most_samples, done.experiment.samples
        if self.question.goal != "samples" or most is None or takes <= most:
            return
        least, units = int(np.ceil(done.design.result.certificate.bound)), self.header.units
        enough = units.length(takes, "limits")
        limit = enough.split(":")[0]
        if least <= most and done.answer.solver.ended_by is not None:
            raise out_of_time(f"the best design so far takes {takes} samples, more than {limit} allows")
        longest = replace(self.question.of_length(most), goal="factor")
        best = solve_design(longest, tolerance=tolerance)
        problem = best.problem.on(best.result.basis)
        bought = Bought(units, self.stated, self.question.limits, problem, best.result)
        more = " (of the spectrum; within limits on single samples a record may take more)"
        raise InfeasibleError(
            Diagnostic(
                "too-long",
                f"the shortest experiment within the power limits takes {takes} samples (proved: "
                f"no fewer than {least}), but {limit} allows {most}; with these {bought.sentence}",
                f"write {enough}{more if of_record else ''}, allow more power, or ask for less accuracy",
                limit,
                details=bought.details,
            )
        )
