"""The three designs, each with its white baseline and its bound over every spectrum.

Least cost, best accuracy and the shortest experiment are one program in different unknowns (see
`Problem`). They differ in the white baseline, and in the design for the case that nothing is needed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError, out_of_time
from inputdesign_cli.design.convex.certificate import Certificate
from inputdesign_cli.design.convex.coordinates import balanced_powers, suited, white_power, whitened_problem
from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.design.convex.exchange import ExchangeResult, UnfinishedError
from inputdesign_cli.design.convex.feasible import KEEPS, solve_limited
from inputdesign_cli.design.convex.problem import Candidate, Problem
from inputdesign_cli.design.convex.record_bound import RecordBound
from inputdesign_cli.design.convex.repair import excess, scaled_up
from inputdesign_cli.errors import InfeasibleError, bad_spec
from inputdesign_cli.spectrum import Basis, LinesBasis, flat_basis

_ANY_SPECTRUM_TOLERANCE = 1e-6
_FAR_BELOW = 1e-12


@dataclass(frozen=True)
class Design:
    """Holds a design and the designs it is compared with.

    `problem` is stated in coordinates whitened by flat excitation (`balanced_powers`). `white` is even over
    the inputs and meets the same requirements (or exhausts the same limits). `white_power` is its power;
    `white_within` says whether it keeps to the limits. `any_spectrum` solves the same problem over all
    spectra. Its certificate bounds every excitation (limits on the density left out). It is None if it was
    not requested or if time ran out. `any_record` bounds all records within an amplitude, where it is known.
    """

    problem: Problem
    white: Candidate
    white_power: float
    white_within: bool
    result: ExchangeResult
    any_spectrum: ExchangeResult | None
    any_record: RecordBound | None = None


class UnfinishedDesignError(OutOfTimeError):
    """Raised when the time limit has passed; `design` is the best so far, with its proved bound."""

    design: Design

    @classmethod
    def of(cls, design: Design) -> UnfinishedDesignError:
        """Return the error that states how good the design is, and holds it."""
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
        SpecError: `not-identifiable` when no excitation identifies all parameters;
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
    whitened = replace(whitened, seen=whitened.demands)
    problem = suited(whitened, question, start)
    flat = replace(problem.on(flat_basis(problem.experiment)), paid="nominal")
    if question.others and _begins_flat(question.basis):
        flat = replace(flat, finer=problem)
    white = _white(question, flat, power)
    anywhere = _anywhere(question, whitened, powers)
    if power == 0.0 and not problem.has_floors:
        return Design(problem, white, 0.0, True, _nothing(problem), _nothing(anywhere))
    white_level = float(white.z[0] / white.s)
    limited = problem.limits or problem.densities or problem.side
    within = not limited or excess(flat, white) <= KEEPS
    check_excites(problem, start)
    if problem.others and problem.goal == "cost":
        start, powers = (white_level / power) * start, (white_level / power) * powers
    design = Design(problem, white, white_level, within, _nothing(problem), None)
    if not limited and np.ptp(powers) > 0.0:
        start = _cheaper(problem, start, question.basis.spread(np.full(powers.size, powers.mean())))
    try:
        result = without_faint_lines(problem, solve_limited(problem, start, tolerance))
    except UnfinishedError as ended:
        result = without_faint_lines(problem, ended.found)
        anything = result if question.basis.free else None
        found = replace(design, result=result, any_spectrum=anything)
        raise UnfinishedDesignError.of(found) from None
    if question.basis.free:
        return replace(design, result=result, any_spectrum=result)
    if any_spectrum_tolerance is None:
        return replace(design, result=result)
    loose = max(tolerance, any_spectrum_tolerance)
    try:
        anything = solve_limited(anywhere, anywhere.basis.spread(powers), loose, known=result.active)
    except OutOfTimeError as ended:
        proved = ended.found if isinstance(ended, UnfinishedError) else None
        found = replace(design, result=result, any_spectrum=proved)
        raise UnfinishedDesignError.of(found) from None
    return replace(design, result=result, any_spectrum=anything)


def _cheaper(problem: Problem, start: Array, even: Array) -> Array:
    """Return the cheaper of two spectra to begin with, so that no design costs more than even white input."""
    tried = [scaled_up(problem, _FAR_BELOW * x, 0.0, []) for x in (start, even)]
    return min(tried, key=lambda candidate: candidate.objective).z


def _begins_flat(basis: Basis) -> bool:
    """Return whether the first function is the flat spectrum of power one, whose integrals are known."""
    return basis.has_density and basis.even[0] == 1.0 and not np.any(basis.even[1:])


def _anywhere(question: Question, problem: Problem, powers: Array) -> Problem:
    experiment = problem.experiment
    if question.anywhere is not None:
        experiment = replace(experiment, band=question.anywhere)
    lines = LinesBasis.anywhere(*experiment.band, experiment.inputs).in_units(np.sqrt(powers))
    return replace(problem, experiment=experiment, basis=lines, densities=(), finer=None)


def _stopped(design: Design) -> OutOfTimeError:
    """Return the error that states the best design so far and the proved bound on all others."""
    problem = design.problem
    value, bound = design.result.objective, design.result.certificate.bound
    criterion = problem.demands.criterion
    if criterion is not None:
        best, most = criterion.value(1.0 / value), criterion.value(1.0 / max(bound, 1e-300))
        return out_of_time(
            f"the best design so far has the criterion {best:.6g}, and none has more than {most:.6g}"
        )
    if problem.goal == "factor":
        value, bound = float(np.sqrt(value)), float(np.sqrt(bound))
    what = {"cost": "costs", "samples": "takes samples:", "factor": "reaches r_u / r_adm ="}[problem.goal]
    return out_of_time(f"the best design so far {what} {value:.6g}, and none less than {bound:.6g}")


def _white(question: Question, flat: Problem, power: float) -> Candidate:
    if question.goal == "cost":
        # Enough for the nominal plant; the others may take more.
        at = np.array([power])
        return scaled_up(flat, at, 1.0, []) if power > 0.0 and flat.others else flat.candidate(at, 1.0)
    # From far below, since a spectrum that meets the requirements with room to spare is not scaled down.
    return scaled_up(replace(flat, floors_fixed=False), np.array([_FAR_BELOW * power]), 0.0, [])


def _nothing(problem: Problem) -> ExchangeResult:
    """Return a design without excitation, for when the known information meets every requirement."""
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


_UNEXCITED = 1e-13
_PLENTY = 1e9


def check_excites(problem: Problem, start: Array) -> None:
    """Raise `SpecError` (`too-few-lines`) when even all lines together leave parameters unexcited."""
    if not problem.demands.definite:
        return
    eigenvalues, vectors = np.linalg.eigh(problem.information(start))
    faint = eigenvalues <= _UNEXCITED * eigenvalues[-1]
    if not faint.any():
        _check_reachable(problem, start)
        return
    names = problem.experiment.unexcited(vectors[:, faint])
    raise bad_spec(
        "too-few-lines",
        f"these lines cannot distinguish the parameters: nothing is learnt about {names}",
        hint="each sinusoid determines at most two parameters (one at frequency 0 or pi): give more "
        "frequencies, or use type: free",
        key="spectrum",
    )


def _check_reachable(problem: Problem, start: Array) -> None:
    """Raise `InfeasibleError` when no power of these lines is enough: they excite too few directions.

    The noise alone then keeps the information matrix regular, but its part does not grow with power.
    """
    if problem.goal != "cost" or problem.basis.has_density:
        return
    excited = np.linalg.eigvalsh(problem.excited(start)[0])
    if excited[0] > _UNEXCITED * excited[-1]:
        return
    try:
        ratio = problem.demands.worst_ratio(problem.informations(_PLENTY * start)).ratio
    except np.linalg.LinAlgError:
        ratio = np.inf
    if ratio > 1.0:
        raise InfeasibleError.because(
            "infeasible",
            "no power of these lines reaches the accuracy: they excite only "
            f"{int(np.sum(excited > _UNEXCITED * excited[-1]))} combinations of the "
            f"{problem.experiment.size} parameters",
            "each sinusoid determines at most two parameters: give more frequencies, or use type: free",
            "spectrum",
        )


# Removed lines may change the information by this share of its least eigenvalue: with limits, and without.
_ROUNDING, _FAINT = 1e-12, 1e-9


def without_faint_lines(problem: Problem, found: ExchangeResult) -> ExchangeResult:
    """Return the design without the sinusoids that together hardly change its information.

    The solver keeps a little power everywhere. Power alone does not show which lines can go. In a loop with
    integral action, power near frequency zero costs almost nothing and far exceeds the power of lines that
    matter. If the cost is minimised, the other lines make up for the removed ones.
    """
    if found.basis.has_density or problem.has_floors or not found.x.any():
        return found
    at = problem.on(found.basis)
    least = np.linalg.eigvalsh(found.informations)[:, 0]
    if least.min() <= 0.0:
        return found
    samples = found.s if problem.goal == "samples" else 1.0  # the samples that `found.informations` belong to
    shares = samples * found.x * np.max(np.linalg.norm(at.information_maps, axis=(2, 3)) / least, axis=1)
    order = np.argsort(shares)
    lost = np.cumsum(shares[order])
    # Under limits the remaining lines can make up for rounding only.
    tight = problem.scaled or problem.limits or problem.densities
    faint = lost <= (_ROUNDING if tight else _FAINT)
    if not np.any(faint):
        return found
    x = found.x.copy()
    x[order[faint]] = 0.0
    if problem.scaled:
        return replace(found, x=x)
    x *= 1.0 + 2.0 * lost[faint][-1]
    return replace(found, x=x, objective=at.cost_at(x), informations=at.informations(x))
