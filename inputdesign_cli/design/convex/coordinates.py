"""White excitation, the baseline of every design, and coordinates in which it gives M = I.

Where it does not suit, the spectrum that a design starts from takes its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.accuracy import worst
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.design.convex.demands import Question, RequirementFactory
from inputdesign_cli.design.convex.limits import implied_power
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.design.convex.repair import least_scale
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.information import Experiment, jointly_whitened
from inputdesign_cli.spectrum import LinesBasis, flat_basis

_EVEN = 1e-9
_FAINT = 1e-9
_UNSUITED = 1e8  # the condition number beyond which coordinates are replaced


def white_power(question: Question) -> float:
    """Return the white power that answers the question at the nominal plant, 0 where none is needed.

    Where the nominal plant needs none, the first scenario that needs power sets it.
    """
    if question.goal == "cost":
        powers = (least_white_power(one.experiment, one.requirements) for one in question.plants)
        return next((power for power in powers if power > 0.0), 0.0)
    unit = whitened_problem(
        replace(question, basis=flat_basis(question.experiment)),
        np.full(question.experiment.inputs, 1.0 / question.experiment.inputs),
    )
    if question.goal == "samples" and suffices(unit, unit.fixed_information):
        return 0.0
    return 1.0 / least_scale(unit, np.ones(1))


def balanced_powers(question: Question, power: float) -> Array:
    """Return the powers (r,) of the inputs that take equal shares of the price of white excitation.

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
    if np.ptp(prices) <= _EVEN * prices.max():
        return even
    return power * prices.mean() / (r * prices)


def whitened_problem(question: Question, powers: Array) -> Problem:
    """Return the problem in coordinates where flat excitation of these powers gives M = I at each plant."""
    whitened = jointly_whitened([one.experiment for one in question.plants], powers)
    return _restated(_stated(question, question.experiment), question, whitened)


def _restated(problem: Problem, question: Question, coordinates: Sequence[Experiment]) -> Problem:
    """Return the problem with all its requirements, each plant in the coordinates of its experiment."""
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


def suited(problem: Problem, question: Question, start: Array) -> Problem:
    """Return the problem in coordinates where `start` gives M = I, if flat excitation does not suit it.

    A pole next to the unit circle may dominate the information of flat excitation. Lines away from it then
    add little information on any parameter, and yet identify them all. Otherwise, return the problem itself.
    """
    informations = problem.informations(start)
    if np.all(np.linalg.cond(informations) < _UNSUITED):
        return problem
    pairs = zip(problem.scenarios, informations, strict=True)
    coordinates = [_suited_to(problem, one.experiment, known, start) for one, known in pairs]
    return _restated(problem, question, coordinates)


def _suited_to(problem: Problem, experiment: Experiment, information: Array, start: Array) -> Experiment:
    """Return one plant's experiment in coordinates where `start` gives M = I, if M is ill-conditioned.

    `information` (k, k) is M of `start` in the present coordinates.
    """
    if np.linalg.cond(information) < _UNSUITED:
        return experiment
    # Scale each parameter by its own information from the start.
    unit = np.diag(np.sqrt(np.maximum(np.diag(experiment.to_raw(information)), _FAINT)))
    in_units = replace(experiment, factor=unit)
    scaled = replace(problem, experiment=in_units, others=(), finer=None).information(start)
    if not np.linalg.cond(scaled) < _UNSUITED:
        return experiment
    return replace(experiment, factor=unit @ np.linalg.cholesky(scaled))


def _stated(question: Question, experiment: Experiment) -> Problem:
    """Return the problem without its requirements."""
    densities = tuple(question.densities)
    # A limit holds at every plant. On a power that does not depend on the plant it is stated once.
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
        paid=question.paid,
    )


_POLISH = 3
# Logarithms: the rise of the power beyond which more is useless, and the least fall of a ratio that counts.
_PLENTY, _STILL = 46.0, 1e-6
_UNDERFLOW = -650.0  # the logarithm of the least power, before powers underflow
_EXACT = 1e-13
_SUITED = 8.0  # coordinates serve powers whose logarithm differs by no more from their own


def least_white_power(experiment: Experiment, factories: Sequence[RequirementFactory]) -> float:
    """Return the smallest white excitation power (per sample) that meets every requirement, possibly 0.

    r_u falls monotonically as the power grows, so this is one scalar equation and needs no solver.
    The coordinates are whitened again at each new estimate of the power.

    Raises:
        InfeasibleError: no power is enough, since only the noise informs on the required accuracy.
        OutOfTimeError: see `seconds_left`.
    """
    power = 1.0
    for _ in range(_POLISH):
        trial = _Trial.of(experiment, factories, np.log(power))
        problem = trial.problem
        if suffices(problem, problem.baselines):
            return 0.0
        # The ratio falls as the root of the power if only the excitation informs on the requirement.
        at_once = trial.at + 2.0 * trial.excess(trial.at)
        if abs(at_once - trial.at) <= _SUITED and abs(trial.excess(at_once)) <= _EXACT:
            return float(np.exp(at_once))
        lo, hi, trial = _enough(trial)
        excess = cache(trial.excess)
        try:
            while excess(lo) <= 0:
                lo -= 2.0
                if lo < _UNDERFLOW:
                    return 0.0  # there is no requirement
        except np.linalg.LinAlgError:
            return 0.0  # the noise alone meets the requirement, and has no information on other parameters
        found = float(np.exp(scipy.optimize.brentq(excess, lo, hi, xtol=1e-13, rtol=1e-14)))
        if abs(found - power) <= 1e-3 * power:
            return found
        power = found
    return power


def suffices(problem: Problem, informations: NDArray[np.float64]) -> bool:
    """Return whether information matrices (S, k, k) of the scenarios meet every requirement."""
    if any(np.linalg.matrix_rank(M) < len(M) for M in informations):
        return False
    return worst([v for _, v in problem.demands.violations(informations)]).ratio <= 1.0


@dataclass(frozen=True)
class _Trial:
    """Holds flat excitation in coordinates that suit the power whose logarithm is `at`."""

    experiment: Experiment
    factories: Sequence[RequirementFactory]
    at: float
    problem: Problem

    @classmethod
    def of(cls, experiment: Experiment, factories: Sequence[RequirementFactory], at: float) -> _Trial:
        coordinates = experiment.whitened(float(np.exp(at)))
        requirements = tuple(make(coordinates) for make in factories)
        flat = Problem(coordinates, flat_basis(coordinates), {"excitation": 1.0}, requirements)
        return cls(experiment, factories, at, flat)

    def near(self, at: float) -> _Trial:
        """Return this trial, or one in coordinates for the power `at` if this one's power is far from it."""
        return self if abs(at - self.at) <= _SUITED else _Trial.of(self.experiment, self.factories, at)

    def excess(self, log_power: float) -> float:
        """Return the logarithm of the worst ratio.

        Raises:
            OutOfTimeError: see `seconds_left`.
        """
        seconds_left()
        informations = self.problem.informations(np.array([np.exp(log_power)]))
        return float(np.log(max(self.problem.demands.worst_ratio(informations).ratio, 1e-300)))


def _enough(trial: _Trial) -> tuple[float, float, _Trial]:
    """Find the logarithms of two powers, at the second of which the requirements are met."""
    start = before = at = trial.at
    found = trial.excess(at)
    while found > 0.0:
        before, at = at, at + 2.0
        trial = trial.near(at)
        later = trial.excess(at)
        if found - later < _STILL and at > start + _PLENTY:
            raise _out_of_reach(found)
        found = later
    return before, at, trial


def _out_of_reach(excess: float) -> InfeasibleError:
    ratio = float(np.exp(excess))
    return InfeasibleError.because(
        "infeasible",
        "no power is enough: the accuracy asks for parameters that act on the noise only, and the "
        f"error stays at {ratio:.6g} times what is asked",
        f"take {ratio**2:.4g} times as many samples, or allow {ratio:.4g} times the error",
        "accuracy",
    )
