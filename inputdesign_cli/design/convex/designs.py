"""The three designs, each with its white baseline and its bound over every spectrum.

Least cost, best accuracy and the shortest experiment are one program in different unknowns (see
`Problem`); what differs is what white excitation is worth and what stands for "nothing is needed".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from inputdesign_cli.accuracy.calibration import with_alpha
from inputdesign_cli.compute.time_limit import OutOfTimeError, out_of_time
from inputdesign_cli.design.convex.candidate import (
    Candidate,
    Place,
    candidate_at,
    excess,
    least_scale,
    scaled_up,
)
from inputdesign_cli.design.convex.certificate import Certificate
from inputdesign_cli.design.convex.exchange import ExchangeResult, UnfinishedError, exchange
from inputdesign_cli.design.convex.feasible import strictly_feasible
from inputdesign_cli.design.convex.limits import DensityLimit, PowerLimit, implied_power
from inputdesign_cli.design.convex.problem import Goal, Problem, RequirementFactory, Scenario, Weight
from inputdesign_cli.design.convex.white import least_white_power
from inputdesign_cli.errors import InfeasibleError, bad_spec
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spectrum import Basis, LinesBasis, flat_basis

_ANY_SPECTRUM_TOLERANCE = 1e-6
_KEEPS = 1e-9
# Shares of the least eigenvalue of the information that lines may take with them.
_ROUNDING, _FAINT = 1e-12, 1e-9
_FAR_BELOW = 1e-12
_UNEXCITED = 1e-13
_PLENTY = 1e9
_UNSUITED = 1e8  # a condition beyond which coordinates do not suit


@dataclass(frozen=True)
class Alternative:
    """Another plant that the design must serve, in raw parameters; see `Question`."""

    experiment: Experiment
    requirements: Sequence[RequirementFactory]
    side: Sequence[RequirementFactory] = ()

    def at(self, coordinates: Experiment) -> Scenario:
        """Its requirements in the coordinates of this experiment."""
        required = tuple(make(coordinates) for make in self.requirements)
        return Scenario(coordinates, required, tuple(make(coordinates) for make in self.side))


@dataclass(frozen=True)
class Question:
    """What is asked, in raw parameters: requirements are made for the coordinates of a design.

    `goal_requirements` are what the goal "factor" improves on (a criterion, or all requirements);
    `side` must hold besides. The other goals meet all of them. All of that is asked of the nominal plant,
    that of `experiment`, and of each of the `others`; `mean_cost` as in `Problem`.
    """

    experiment: Experiment
    basis: Basis
    goal: Goal
    requirements: Sequence[RequirementFactory]
    side: Sequence[RequirementFactory] = ()
    cost: Mapping[PowerKind, Weight] = field(default_factory=dict)
    limits: Sequence[PowerLimit] = ()
    densities: Sequence[DensityLimit] = ()
    others: Sequence[Alternative] = ()
    mean_cost: bool = False

    @property
    def plants(self) -> list[Alternative]:
        """All that must be served, the nominal plant first."""
        return [Alternative(self.experiment, self.requirements, self.side), *self.others]

    def at_alpha(self, alpha: float) -> Question:
        """The same question with another confidence factor of the model errors of the nominal plant."""

        def changed(make: RequirementFactory) -> RequirementFactory:
            return lambda experiment: with_alpha([make(experiment)], alpha)[0]

        return replace(
            self, requirements=list(map(changed, self.requirements)), side=list(map(changed, self.side))
        )

    def of_length(self, samples: int) -> Question:
        """The same question of experiments with so many samples."""
        others = [replace(one, experiment=replace(one.experiment, samples=samples)) for one in self.others]
        return replace(self, experiment=replace(self.experiment, samples=samples), others=others)


@dataclass(frozen=True)
class Design:
    """A design and what it is compared with.

    `problem` is stated in coordinates whitened by flat excitation (`balanced_powers`). `white` is even
    over the inputs and meets the same requirements (or exhausts the same limits); `white_power` is its power,
    `white_within` tells whether it keeps to the limits. `any_spectrum` is the same problem over all
    spectra; its certificate bounds every excitation whatever (limits on the density left out). None where
    it was not asked for, or there was no time for it.
    """

    problem: Problem
    white: Candidate
    white_power: float
    white_within: bool
    result: ExchangeResult
    any_spectrum: ExchangeResult | None


class UnfinishedDesignError(OutOfTimeError):
    """The time limit has passed; `design` is the best so far, with what is proved of it."""

    design: Design

    @classmethod
    def of(cls, design: Design) -> UnfinishedDesignError:
        """The error that tells what the design reaches."""
        error = cls(_stopped(design).diagnostics)
        error.design = design
        return error


def solve_design(
    question: Question, *, tolerance: float, any_spectrum_tolerance: float | None = _ANY_SPECTRUM_TOLERANCE
) -> Design:
    """Solve a design problem with its baseline and its bound over every spectrum, each to its relative gap.

    Args:
        any_spectrum_tolerance: None leaves out the bound over every spectrum.

    Raises:
        SpecError: `not-identifiable` when no excitation can tell some parameters apart;
            `too-few-lines` when the given lines cannot.
        UnreachableError: the requirements cannot be met within the limits.
        UnfinishedDesignError: with the best design so far.
        OutOfTimeError: no design that meets everything is known yet.
    """
    power = white_power(question)
    powers = balanced_powers(question, power or 1.0)
    question = replace(question, basis=question.basis.in_units(np.sqrt(powers)))
    start = question.basis.spread(powers)
    whitened = whitened_problem(question, powers)
    problem = _suited(whitened, question, start)
    flat = replace(problem.on(flat_basis(problem.experiment)), mean_cost=False)
    if question.others and _begins_flat(question.basis):
        flat = replace(flat, finer=problem)
    white = _white(question, flat, power)
    white_level = float(white.z[0] / white.s)
    anywhere = _anywhere(question, whitened, powers)
    if power == 0.0 and not problem.has_floors:
        return Design(problem, white, 0.0, True, _nothing(problem), _nothing(anywhere))
    limited = problem.limits or problem.densities or problem.side
    within = not limited or excess(flat, white) <= _KEEPS
    _check_excites(problem, start)
    if problem.others and problem.goal == "cost":
        start, powers = (white_level / power) * start, (white_level / power) * powers
    design = Design(problem, white, white_level, within, _nothing(problem), None)
    try:
        result = _without_faint_lines(problem, _solve(problem, start, tolerance))
    except UnfinishedError as ended:
        result = _without_faint_lines(problem, ended.found)
        anything = result if question.basis.free else None
        found = replace(design, result=result, any_spectrum=anything)
        raise UnfinishedDesignError.of(found) from None
    if question.basis.free:
        return replace(design, result=result, any_spectrum=result)
    if any_spectrum_tolerance is None:
        return replace(design, result=result)
    loose = max(tolerance, any_spectrum_tolerance)
    try:
        anything = _solve(anywhere, anywhere.basis.spread(powers), loose, known=result.active)
    except OutOfTimeError as ended:
        proved = ended.found if isinstance(ended, UnfinishedError) else None
        found = replace(design, result=result, any_spectrum=proved)
        raise UnfinishedDesignError.of(found) from None
    return replace(design, result=result, any_spectrum=anything)


def _begins_flat(basis: Basis) -> bool:
    """Whether its first function is the flat spectrum of power one, so that its integrals are known."""
    return basis.has_density and basis.even[0] == 1.0 and not np.any(basis.even[1:])


def white_power(question: Question) -> float:
    """The power of white excitation that answers the question at the nominal plant, 0 where none is needed.

    Where the nominal plant needs none it is that of the first scenario that does.
    """
    if question.goal == "cost":
        powers = (least_white_power(one.experiment, one.requirements) for one in question.plants)
        return next((power for power in powers if power > 0.0), 0.0)
    unit = whitened_problem(
        replace(question, basis=flat_basis(question.experiment)),
        np.full(question.experiment.inputs, 1.0 / question.experiment.inputs),
    )
    return 1.0 / least_scale(unit, np.ones(1))


def balanced_powers(question: Question, power: float) -> Array:
    """The powers (r,) of the inputs that take equal shares of the price of white excitation.

    Where the units of the inputs differ, so do their prices or limits: an excitation even over the
    inputs would then be a poor start, and its information matrix a poor measure. One input has `power`.
    """
    r = question.experiment.inputs
    even = np.full(r, power / r)
    if r == 1:
        return even
    lines = LinesBasis.anywhere(*question.experiment.band, r)
    price = _stated(replace(question, basis=lines, others=()), question.experiment).price
    prices = np.array([price.at(lines.spread(channel)) for channel in np.eye(r)])
    if np.ptp(prices) <= _KEEPS * prices.max():
        return even
    return power * prices.mean() / (r * prices)


def whitened_problem(question: Question, powers: Array) -> Problem:
    """The problem in coordinates where flat excitation of these powers gives M = I, each plant in its own."""
    whitened = [one.experiment.whitened(powers) for one in question.plants]
    return _restated(_stated(question, question.experiment), question, whitened)


def _restated(problem: Problem, question: Question, coordinates: Sequence[Experiment]) -> Problem:
    """The problem with everything that is required, each plant in the coordinates of its experiment."""
    nominal, *others = (
        one.at(experiment) for one, experiment in zip(question.plants, coordinates, strict=True)
    )
    return replace(
        problem,
        experiment=nominal.experiment,
        requirements=nominal.requirements,
        side=nominal.side,
        others=tuple(others),
    )


def _suited(problem: Problem, question: Question, start: Array) -> Problem:
    """The problem in coordinates where `start` gives M = I, if flat excitation does not suit it.

    A pole next to the unit circle may dominate what flat excitation tells: lines away from it then tell
    little of all parameters, and yet tell them apart. Otherwise, the problem itself.
    """
    informations = problem.informations(start)
    if np.all(np.linalg.cond(informations) < _UNSUITED):
        return problem
    pairs = zip(problem.scenarios, informations, strict=True)
    coordinates = [_suited_to(problem, one.experiment, told, start) for one, told in pairs]
    return _restated(problem, question, coordinates)


def _suited_to(problem: Problem, experiment: Experiment, information: Array, start: Array) -> Experiment:
    """One plant's experiment in such coordinates; `information` (k, k) is what `start` tells of it."""
    if np.linalg.cond(information) < _UNSUITED:
        return experiment
    # Parameters in units of their own: of what the start tells, and only by their sizes.
    unit = np.diag(np.sqrt(np.maximum(np.diag(experiment.to_raw(information)), _FAINT)))
    in_units = replace(experiment, factor=unit)
    scaled = replace(problem, experiment=in_units, others=(), finer=None).information(start)
    if not np.linalg.cond(scaled) < _UNSUITED:
        return experiment
    return replace(experiment, factor=unit @ np.linalg.cholesky(scaled))


def _stated(question: Question, experiment: Experiment) -> Problem:
    """The problem but for what it requires."""
    densities = tuple(question.densities)
    # A limit holds at every plant; of the powers that are the same at all it stands there once.
    everywhere = [
        replace(limit, scenario=number)
        for limit in question.limits
        if experiment.depends_on_plant(limit.kind)
        for number in range(1, len(question.plants))
    ]
    implied = [implied_power(d, experiment.inputs) for d in densities if d.upper]
    return Problem(
        experiment=experiment,
        basis=question.basis,
        cost=question.cost,
        requirements=(),
        limits=(*question.limits, *implied, *everywhere),
        densities=densities,
        goal=question.goal,
        mean_cost=question.mean_cost,
    )


def _anywhere(question: Question, problem: Problem, powers: Array) -> Problem:
    experiment = question.experiment
    lines = LinesBasis.anywhere(*experiment.band, experiment.inputs).in_units(np.sqrt(powers))
    return replace(problem, basis=lines, densities=(), finer=None)


def _solve(problem: Problem, start: Array, tolerance: float, known: Sequence[Place] = ()) -> ExchangeResult:
    floors, limited = problem.has_floors, bool(problem.limits or problem.densities)
    free: ExchangeResult | None = None
    if problem.goal == "cost" and limited and not floors:
        # Limits that the cheapest design keeps anyway cost nothing.
        unlimited = replace(problem, limits=(), densities=(), finer=problem)
        try:
            free = exchange(unlimited, start, tolerance=tolerance, known=known)
        except UnfinishedError as ended:
            raise _within_limits(ended, problem, start, ended.found) from None
        if _keeps_limits(problem, free):
            return _unweighted(problem, free)
    basis, interior = problem.basis, None
    if floors or problem.side or (problem.goal == "cost" and limited):
        try:
            basis, interior = strictly_feasible(problem, start)
        except OutOfTimeError as ended:
            raise _within_limits(ended, problem, start, free) from None
    return exchange(problem.on(basis), start, tolerance=tolerance, interior=interior, known=known)


def _within_limits(
    ended: OutOfTimeError, problem: Problem, start: Array, free: ExchangeResult | None
) -> OutOfTimeError:
    """The error with a design that keeps the limits, if one is known.

    Args:
        free: of the problem without limits. It may keep them, or else even excitation; its bound holds.
    """
    within = None if free is None else _known_within_limits(problem, start, free)
    if within is None:
        return out_of_time("no design within the limits is known yet")
    return UnfinishedError.of(ended, within)


def _known_within_limits(problem: Problem, start: Array, free: ExchangeResult) -> ExchangeResult | None:
    if _keeps_limits(problem, free):
        return _unweighted(problem, free)
    even = scaled_up(replace(problem, limits=(), densities=(), finer=problem), start, 0.0, [])
    found = replace(
        free,
        basis=problem.basis,
        x=even.z,
        objective=even.objective,
        informations=even.informations,
        active=(),
    )
    return _unweighted(problem, found) if _keeps_limits(problem, found) else None


def _keeps_limits(problem: Problem, found: ExchangeResult) -> bool:
    kept = problem.on(found.basis)
    return excess(kept, candidate_at(kept, found.x, 1.0)) <= _KEEPS


def _unweighted(problem: Problem, free: ExchangeResult) -> ExchangeResult:
    """A design without limits as one of the problem with limits, which have no weight."""
    no_weight = replace(free.certificate, limits=np.zeros(len(problem.limits)))
    return replace(free, certificate=no_weight)


def _stopped(design: Design) -> OutOfTimeError:
    """The error that tells the best design so far and what is proved of all others."""
    problem = design.problem
    value, bound = design.result.objective, design.result.certificate.bound
    criterion = problem.stated_criterion
    if criterion is not None:
        best, most = criterion.value(1.0 / value), criterion.value(1.0 / max(bound, 1e-300))
        return out_of_time(
            f"the best design so far has the criterion {best:.6g}, and none has more than {most:.6g}"
        )
    if problem.goal == "factor":
        value, bound = float(np.sqrt(value)), float(np.sqrt(bound))
    what = {"cost": "costs", "samples": "takes samples:", "factor": "reaches r_u / r_adm ="}[problem.goal]
    return out_of_time(f"the best design so far {what} {value:.6g}, and none less than {bound:.6g}")


def _without_faint_lines(problem: Problem, found: ExchangeResult) -> ExchangeResult:
    """The same design without the sinusoids that together hardly change its information.

    The solver leaves a little power everywhere. Power alone does not tell what can go: in a loop with
    integral action power near frequency zero is almost free of charge, and dwarfs that of lines that matter.
    Where the cost is sought the other lines make up for those that go.
    """
    if found.basis.has_density or problem.has_floors or not found.x.any():
        return found
    at = problem.on(found.basis)
    least = np.linalg.eigvalsh(found.informations)[:, 0]
    if least.min() <= 0.0:
        return found
    samples = found.s if problem.goal == "samples" else 1.0  # of the information that was found
    told = samples * found.x * np.max(np.linalg.norm(at.information_maps, axis=(2, 3)) / least, axis=1)
    order = np.argsort(told)
    lost = np.cumsum(told[order])
    # Beside limits there is no room to make up for more than rounding.
    tight = problem.scaled or problem.limits or problem.densities
    faint = lost <= (_ROUNDING if tight else _FAINT)
    if not np.any(faint):
        return found
    x = found.x.copy()
    x[order[faint]] = 0.0
    if problem.scaled:
        return replace(found, x=x)
    x *= 1.0 + 2.0 * lost[faint][-1]
    return replace(found, x=x, objective=at.price.at(x), informations=at.informations(x))


def _white(question: Question, flat: Problem, power: float) -> Candidate:
    if question.goal == "cost":
        # Enough for the nominal plant; the others may take more.
        at = np.array([power])
        return scaled_up(flat, at, 1.0, []) if power > 0.0 and flat.others else candidate_at(flat, at, 1.0)
    # From far below, since what meets the requirements with room to spare is not scaled down.
    return scaled_up(replace(flat, floors_fixed=False), np.array([_FAR_BELOW * power]), 0.0, [])


def _check_excites(problem: Problem, start: Array) -> None:
    """Raise `SpecError` (`too-few-lines`) when even all lines together leave parameters unexcited."""
    if not problem.needs_definite:
        return
    eigenvalues, vectors = np.linalg.eigh(problem.information(start))
    faint = eigenvalues <= _UNEXCITED * eigenvalues[-1]
    if not faint.any():
        _check_reachable(problem, start)
        return
    names = problem.experiment.unexcited(vectors[:, faint])
    raise bad_spec(
        "too-few-lines",
        f"these lines cannot tell the parameters apart: nothing is learnt about {names}",
        hint="each sinusoid tells at most two parameters apart (one at frequency 0 or pi): give more "
        "frequencies, or use type: free",
        key="spectrum",
    )


def _check_reachable(problem: Problem, start: Array) -> None:
    """Raise `InfeasibleError` when no power of these lines is enough: they excite too few directions.

    What the noise alone tells keeps the information matrix regular then, but does not grow with power.
    """
    if problem.goal != "cost" or problem.basis.has_density:
        return
    excited = np.linalg.eigvalsh(problem.excited(start)[0])
    if excited[0] > _UNEXCITED * excited[-1]:
        return
    try:
        ratio = problem.worst_ratio(problem.informations(_PLENTY * start)).ratio
    except np.linalg.LinAlgError:
        ratio = np.inf
    if ratio > 1.0:
        raise InfeasibleError.because(
            "infeasible",
            "no power of these lines reaches the accuracy: they excite only "
            f"{int(np.sum(excited > _UNEXCITED * excited[-1]))} combinations of the "
            f"{problem.experiment.size} parameters",
            "each sinusoid tells at most two parameters apart: give more frequencies, or use type: free",
            "spectrum",
        )


def _nothing(problem: Problem) -> ExchangeResult:
    """The answer when what is known already meets every requirement: no excitation at all."""
    none = Certificate(0.0, np.zeros_like(problem.baselines), np.zeros(0), np.zeros(len(problem.limits)))
    return ExchangeResult(
        basis=problem.basis,
        x=np.zeros(problem.basis.size),
        s=1.0,
        objective=0.0,
        informations=problem.baselines,
        certificate=none,
        active=(),
        rounds=0,
        cuts=0,
    )
