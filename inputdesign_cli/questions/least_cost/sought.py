"""The design that is sought: its requirements, and the method that finds it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from inputdesign_cli.accuracy import ModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import out_of_time, what_ended
from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.design.convex.designs import UnfinishedDesignError, solve_design
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.hillclimb import QuadraticDesign, hill_climb
from inputdesign_cli.design.convex.limits import Weight
from inputdesign_cli.design.convex.record_bound import bound_over_records
from inputdesign_cli.design.convex.textbook import solve_on_grid
from inputdesign_cli.errors import Diagnostic, InaccurateError, InfeasibleError
from inputdesign_cli.information import PowerKind
from inputdesign_cli.outcome import Solver
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.questions.common.confidence import Confidence
from inputdesign_cli.questions.common.delivery import proof_status
from inputdesign_cli.questions.common.infeasible import Bought, Reach, StatedBound, explain
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.questions.common.robust import Plants, delivered_samples, without_dearest
from inputdesign_cli.questions.least_cost.exact_confidence import ExactConfidence
from inputdesign_cli.questions.least_cost.outcome import Answer, Designed
from inputdesign_cli.questions.least_cost.robust_outcome import with_worst_plants
from inputdesign_cli.spectrum import PolynomialBasis, flat_basis, hvec, svec

# The second frequency of a grid that begins at zero, as a share of the last.
_ABOVE_ZERO = 1e-3
_STARTS = 3
_LONGEST = 20_000  # samples of the longest records over which a bound is sought


@dataclass(frozen=True)
class GridMethod:
    """Describes the papers' own program: the number of frequencies of its grid, the form of positivity."""

    lines: int
    positivity: Literal["gram", "kyp"]

    def design(self, question: Question, *, tolerance: float, any_spectrum_tolerance: float | None) -> Answer:
        """Return the design. The baseline and the bound over every spectrum are exact."""
        basis, white = question.basis, replace(question, basis=flat_basis(question.experiment))
        baseline = solve_design(white, tolerance=tolerance, any_spectrum_tolerance=any_spectrum_tolerance)
        problem = replace(baseline.problem, basis=basis)
        stated = [r for r in problem.requirements if isinstance(r, ModelError)]
        frequencies, start = self.frequencies(*stated[0].band), baseline.white_power * basis.even
        answer = solve_on_grid(problem, stated, frequencies, start, positivity=self.positivity)
        on_grid = replace(
            baseline.result,
            basis=basis,
            x=answer.x,
            objective=answer.cost,
            informations=problem.informations(answer.x),
            certificate=answer.certificate,
            active=(),
        )
        solver = Solver("lmi", tolerance, details={"grid": self.lines})
        return Answer(replace(baseline, problem=problem, result=on_grid), "optimal_on_grid", solver)

    def frequencies(self, lo: float, hi: float) -> Array:
        """Return the ends of the band, and frequencies evenly spread in log w between them, as (lines,)."""
        if lo > 0.0:
            return np.geomspace(lo, hi, self.lines)
        return np.append(0.0, hi * np.geomspace(1.0, _ABOVE_ZERO, self.lines - 1)[::-1])


@dataclass(frozen=True)
class FewColumns:
    """Holds `spectrum.factor_columns`, as in [mohan-spectral]: a number, and the seed of random starts."""

    columns: int
    seed: int

    def climbed(self, answer: Answer) -> Answer:
        """Return the best of climbs from the optimum cut to few columns, and from random factors.

        The bound of the design over all factors stays: it is the upper bound of [mohan-spectral].
        """
        design, problem = answer.design, answer.design.problem
        basis, criterion = problem.basis, problem.demands.criterion
        if not isinstance(basis, PolynomialBasis) or criterion is None:
            raise ValueError("a factor of few columns is for a criterion and a polynomial spectrum")
        values, vectors = np.linalg.eigh(basis.matrix(design.result.x))
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        functionals = zip(problem.limits, problem.limit_functionals, strict=True)
        maps = np.moveaxis(problem.information_map, 0, -1)
        quadratic = QuadraticDesign(
            np.array([[basis.gram(entry) for entry in row] for row in maps]),
            problem.baseline_information,
            tuple((basis.gram(functional.vector), limit.bound) for limit, functional in functionals),
            criterion,
        )
        columns, rng = min(self.columns, basis.gram_order), np.random.default_rng(self.seed)
        found = hill_climb(quadratic, columns, starts=_STARTS, rng=rng, guesses=[root])
        S = found.factor @ found.factor.conj().T
        x = hvec(S) if basis.hermitian else svec(S.real)
        informations = problem.informations(x)
        level = 1.0 / criterion.level(informations[0])
        result = replace(design.result, x=x, informations=informations, objective=level, s=level)
        starts = {"starts": [history[-1] for history in found.histories]}
        solver = replace(answer.solver, method="hill_climb", details=starts)
        return Answer(replace(design, result=result), "lower_bound", solver)


@dataclass(frozen=True)
class Sought:
    """Describes the requirements on a design, and the method that finds it.

    The experiment of the question has one sample if the length is sought. `exact` calibrates `alpha`;
    `plants` are plants beside the one of the spec. `tolerance` is the relative gap that is proved, and
    `any_spectrum_tolerance` that of the bound over every spectrum (None: none). `grid` replaces the exchange.
    `windows` are the longest of the bound over all records within an amplitude; 0 leaves it out.
    """

    header: Header
    question: Question
    cost: dict[PowerKind, Weight]
    alpha: float
    exact: ExactConfidence | None
    most_samples: int | None
    plants: Plants | None
    stated: Sequence[StatedBound]
    tolerance: float
    any_spectrum_tolerance: float | None
    reach: Reach
    grid: GridMethod | None = None
    columns: FewColumns | None = None
    windows: int = 0

    def designed(self, request: RecordRequest) -> Designed:
        """Return the design with its experiment, its status and what the solver did.

        It raises `InfeasibleError`, or `InaccurateError` where the proof did not close in time.
        """
        if self.exact is not None:
            return self.exact.designed(self._designed, request)
        done = self._designed(self.question, Confidence(self.alpha, self.alpha))
        return self._bounded(done, request) if done.excites and self.grid is None else done

    def _bounded(self, done: Designed, request: RecordRequest) -> Designed:
        """Return the design with its bound over all records within the amplitude, where one is known."""
        free, samples = done.design.any_spectrum, done.experiment.samples
        whole = self.question.goal == "samples" or request.length(samples) == samples
        if free is None or samples > _LONGEST or not whole:
            return done
        bound = bound_over_records(
            done.design.problem, free, samples, windows=self.windows, hold=request.settings.hold
        )
        return replace(done, answer=replace(done.answer, design=replace(done.design, any_record=bound)))

    def _designed(self, question: Question, confidence: Confidence) -> Designed:
        solve = partial(
            self._by_exchange if self.grid is None else self.grid.design,
            tolerance=self.tolerance,
            any_spectrum_tolerance=self.any_spectrum_tolerance,
        )
        answer, plants, kept = solve(question), self.plants, list(range(len(question.others)))
        if plants is not None and plants.discard:
            kept = without_dearest(question, answer.design, plants.discard)
            question = replace(question, others=[question.others[number] for number in kept])
            answer = solve(question)
        if plants is not None and plants.region is not None:
            plants, question, answer = with_worst_plants(plants, plants.region, question, answer, solve)
            kept = list(range(len(question.others)))
        if self.columns is not None:
            answer = self.columns.climbed(answer)
        experiment = answer.design.problem.experiment.with_samples(delivered_samples(answer.design))
        return Designed(self.header, question, answer, experiment, self.cost, confidence, kept, plants)

    def _by_exchange(
        self, question: Question, *, tolerance: float, any_spectrum_tolerance: float | None
    ) -> Answer:
        ended = None
        try:
            design = solve_design(
                question, tolerance=tolerance, any_spectrum_tolerance=any_spectrum_tolerance
            )
        except UnreachableError as unreachable:
            raise explain(self.header.units, question, unreachable, self.stated) from unreachable
        except UnfinishedDesignError as unfinished:
            if self.exact is not None:  # an unfinished design need not keep the confidence
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

    def check_length(self, done: Designed, *, of_record: bool) -> None:
        """Raise `InfeasibleError` (`too-long`) if the shortest experiment is longer than limits.samples."""
        most, takes = self.most_samples, done.experiment.samples
        if self.question.goal != "samples" or most is None or takes <= most:
            return
        least, units = int(np.ceil(done.design.result.certificate.bound)), self.header.units
        enough = units.length(takes, "limits")
        limit = enough.split(":")[0]
        if least <= most and done.answer.solver.ended_by is not None:
            raise out_of_time(f"the best design so far takes {takes} samples, more than {limit} allows")
        longest = replace(self.question.of_length(most), goal="factor")
        best = solve_design(longest, tolerance=self.tolerance)
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
