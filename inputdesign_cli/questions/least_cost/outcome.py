"""Design -> outcome: every number is recomputed from the spectrum, and bounds come from the certificates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from inputdesign_cli import outcome as out
from inputdesign_cli.accuracy import Criterion, OnModelError, Requirement, model_errors
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.design.convex.limits import Weight, paid_for, weighted_sum
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings import designs
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.outcome import LimitUse, ModelError, Outcome, RequirementMet
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.questions.common.bound_curves import distinct
from inputdesign_cli.questions.common.confidence import Confidence
from inputdesign_cli.questions.common.delivery import KINDS
from inputdesign_cli.questions.common.robust import Plants, delivered
from inputdesign_cli.spectrum import Basis, flat_basis, matrices

# A limit binds when the design uses all but this share of it.
_BINDS = 1e-6


@dataclass(frozen=True)
class Answer:
    """Holds a design, the status of its proof, and the work of the solver."""

    design: Design
    status: str
    solver: out.Solver


@dataclass(frozen=True)
class Designed:
    """Holds an answer with its question and the experiment of the delivered length.

    `kept` are the numbers of the `plants` that the design is for; others of them are left out.
    """

    header: Header
    question: Question
    answer: Answer
    experiment: Experiment
    cost: dict[PowerKind, Weight]
    confidence: Confidence
    kept: Sequence[int] = ()
    plants: Plants | None = None

    @cached_property
    def design(self) -> Design:
        """Return the design of the answer."""
        return self.answer.design

    @cached_property
    def problem(self) -> Problem:
        """Return the problem on the basis of the answer, which may have grown."""
        return self.design.problem.on(self.design.result.basis)

    @property
    def excites(self) -> bool:
        """Return whether any excitation is needed."""
        return bool(self.design.result.x.any())

    @property
    def asked(self) -> tuple[Requirement, ...]:
        """Return the requirements that the design must meet."""
        return (*self.design.problem.requirements, *self.design.problem.side)

    @cached_property
    def information(self) -> Array:
        """Return the information (k, k) of the delivered spectrum over the delivered number of samples."""
        return np.asarray(delivered(self.problem, self.design, self.experiment.samples)[0])


def design_outcome(done: Designed) -> Outcome:
    """Return the outcome of a design without its record and its time."""
    found, problem, answer = done.design.result, done.design.problem, done.answer
    used, costs = spent(done, found.basis, found.x)
    cost = paid_for(problem.paid, costs)
    spectrum = dict(found.basis.described(found.x, done.header.units.frequency))
    outcome = Outcome(
        title=done.header.title,
        status=answer.status,
        objective=_objective(done.design),
        cost=cost,
        samples=done.experiment.samples,
        power=used,
        limits=(*_power_limits(done), *_density_limits(done)) or None,
        information=information_of(done.experiment, done.information),
        spectrum=out.Spectrum(str(spectrum.pop("type")), spectrum),
        baseline=out.Baseline(_white(done, cost)),
        solver=answer.solver,
    )
    if answer.status != "nothing_needed":
        error, listed = accuracy_of(
            done.header.units, done.confidence, done.asked, done.information, found.active_frequencies
        )
        outcome = replace(outcome, model_error=error, requirements=listed)
    return outcome.saying(_findings(done, used))


def information_of(experiment: Experiment, information: Array) -> out.Information:
    """Return the information matrix in raw parameters, its inverse and the predicted standard deviations."""
    found = out.Information(tuple(experiment.model.names), experiment.to_raw(information))
    try:
        covariance = experiment.raw_covariance(information)
    except np.linalg.LinAlgError:  # some parameter is not excited at all
        return found
    deviations = np.sqrt(np.diag(covariance)).tolist()
    named = dict(zip(found.parameters, deviations, strict=True))
    return replace(found, covariance=covariance, standard_deviation=named)


def accuracy_of(
    units: Units,
    confidence: Confidence,
    requirements: Sequence[Requirement],
    information: Array,
    active: Array,
) -> tuple[ModelError, tuple[RequirementMet, ...] | None]:
    """Return the largest ratio of the model error, and each requirement with its own, by M (k, k)."""
    listed: list[RequirementMet] = []
    error = ModelError(
        confidence.alpha, confidence=None if confidence.coverage is None else confidence.reported
    )
    for requirement in requirements:
        if isinstance(requirement, Criterion):
            continue
        met = requirement_met(units, requirement, information)
        listed.append(met)
        if isinstance(requirement, OnModelError) and met.worst_ratio > (error.worst_ratio or 0.0):
            error = replace(error, worst_ratio=met.worst_ratio)
            if met.frequency is not None:
                at = distinct(active, requirement.band[1]) / units.frequency
                error = replace(error, worst_frequency=met.frequency, active_frequencies=at)
    return error, tuple(listed) or None


def requirement_met(units: Units, requirement: Requirement, information: Array) -> RequirementMet:
    """Return a requirement with its worst ratio and where that is; information (k, k)."""
    violation = requirement.worst(information)
    matrix = requirement.entry is not None and not units.single
    loop = None
    for error in model_errors([requirement]):
        kept = error.admissible.kept
        if kept is not None and kept.settings is not None:
            loop = out.read_plain(out.Loop, {**kept.settings, **kept.margins(error.grid)})
    return RequirementMet(
        requirement.name,
        violation.ratio,
        frequency=None if violation.frequency is None else violation.frequency / units.frequency,
        entry=units.entry(*requirement.entry) if matrix and requirement.entry is not None else None,
        norm="frobenius" if requirement.of_the_norm and not matrix else None,
        loop=loop,
    )


def spent(done: Designed, basis: Basis, x: Array) -> tuple[out.Powers, list[float]]:
    """Return the mean squares of a spectrum at the plant of the spec, and its cost at each that pays."""
    problem = done.design.problem.on(basis)
    used = [problem.powers(x, at) for at in problem.paying]
    return out.Powers.of(used[0]), [weighted_sum(done.cost, one) for one in used]


def _stated(problem: Problem, value: float) -> float:
    """Return a value of the program as the outcome states it: a criterion, an accuracy factor, or as it is.

    The program minimises the inverse of the criterion, or the square of the factor.
    """
    if problem.goal != "factor":
        return value
    criterion = problem.demands.criterion
    return float(np.sqrt(value)) if criterion is None else criterion.value(1.0 / max(value, 1e-300))


def _objective(design: Design) -> out.Objective:
    """Return the value with the bounds that are proved."""
    found, anything, problem = design.result, design.any_spectrum, design.problem
    value, bound = found.objective, found.certificate.bound
    any_bound = 0.0 if anything is None else anything.certificate.bound
    reached, limit = _stated(problem, value), _stated(problem, bound)
    of_any = _stated(problem, any_bound) if any_bound > 0.0 or value == 0.0 else None
    of_records = None if design.any_record is None else _stated(problem, design.any_record.bound)
    criterion = problem.demands.criterion
    if problem.goal == "factor" and criterion is not None:
        # A lower bound of the inverse is an upper bound of the criterion.
        upper = limit if bound > 0.0 or value == 0.0 else None
        size = problem.experiment.size if criterion.letter == "D" else abs(reached)
        gap = None if upper is None else abs(upper - reached) / size
        bounds = {"upper_bound": upper, "any_spectrum_bound": of_any, "any_record_bound": of_records}
        return out.Objective(criterion.letter, reached, relative_gap=gap, **bounds)
    gap = abs(reached - limit) / reached if reached > 0 else 0.0
    bounds = {"lower_bound": limit, "any_spectrum_bound": of_any, "any_record_bound": of_records}
    return out.Objective(KINDS[problem.goal], reached, relative_gap=gap, **bounds)


def _white(done: Designed, cost: float) -> out.White:
    """Return flat excitation that meets the same requirements, or exhausts the same limits."""
    design, problem = done.design, done.design.problem
    basis, x = flat_basis(problem.experiment), np.array([design.white_power])
    used, costs = spent(done, basis, x)
    white_cost = paid_for(problem.paid, costs)
    return out.White(
        cost=white_cost,
        power=used,
        ratio=white_cost / cost if cost > 0 else 1.0,
        samples=int(np.ceil(design.white.s * (1 - 1e-9))) if problem.goal == "samples" else None,
        value=_stated(problem, design.white.objective) if problem.goal == "factor" else None,
        within_limits=design.white_within if done.question.limits or done.question.densities else None,
    )


def _power_limits(done: Designed) -> Iterator[LimitUse]:
    """Yield each power limit with what the design uses of it."""
    x, at = done.design.result.x, done.problem
    for limit in done.question.limits:
        # If the power depends on the plant, the scenario that comes nearest to the limit counts.
        alike = [at.limits[index].scenario for index in limit.everywhere(at.limits)]
        values = [at.power(limit.kind, limit.channel, scenario).at(x) for scenario in alike]
        value = max(values) if limit.upper else min(values)
        slack = (limit.bound - value) if limit.upper else (value - limit.bound)
        yield LimitUse(
            limit.key.removeprefix("limits."),
            slack <= _BINDS * limit.bound,
            channel=None if limit.channel is None else limit.channel + 1,
            max=limit.bound if limit.upper else None,
            min=None if limit.upper else limit.bound,
            value=value,
        )


def _density_limits(done: Designed) -> Iterator[LimitUse]:
    """Yield the tightest place of each limit on the density."""
    for index, density in enumerate(done.question.densities):
        breaches = done.problem.density_breaches(done.design.result.x, 1.0, above=-np.inf)
        tightest = max((b for b in breaches if b.place.limit == index), key=lambda b: b.ratio)
        yield LimitUse(
            "spectrum",
            tightest.ratio >= 1.0 - _BINDS,
            kind="max" if density.upper else "min",
            worst_ratio=tightest.ratio,
            frequency=tightest.place.frequency / done.header.units.frequency,
        )


def _findings(done: Designed, used: out.Powers) -> list[Finding]:
    """Return the findings that a user should know before trusting a number."""
    found, problem = done.design.result, done.problem
    if not done.excites:
        return [designs.nothing_needed(done.experiment)]
    findings = [
        *designs.inputs_without_power(used.excitation or ()),
        *designs.short_experiment(done.experiment),
        *designs.few_samples(done.experiment),
    ]
    findings += designs.sign_open(problem.requirements)
    if done.header.units.closed_loop and not found.basis.has_density:
        lines, powers_of_lines = found.basis.lines(found.x)
        # The price of unit power that is spread evenly over the channels.
        prices = [matrices(problem.price.density(w)) for w in (lines, problem.gradients.grid)]
        costs, all_costs = (np.einsum("naa->n", price).real / price.shape[1] for price in prices)
        power = np.einsum("naa->n", powers_of_lines).real
        findings += designs.almost_free(done.header.units, lines, power, costs, float(all_costs.max()))
    return findings
