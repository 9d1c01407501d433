"""White excitation of the least power that meets the requirements: the baseline of every design."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.accuracy import worst
from inputdesign_cli.compute.time_limit import seconds_left
from inputdesign_cli.design.convex.demands import RequirementFactory
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.information import Experiment
from inputdesign_cli.spectrum import flat_basis

_POLISH = 3
# Logarithms: an excitation so much stronger is as good as any, and a ratio that moves less stands still.
_PLENTY, _STILL = 46.0, 1e-6
_FAINT = -650.0  # below, powers underflow
_EXACT = 1e-13
_SUITED = 8.0  # how far from their own power coordinates serve


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
                if lo < _FAINT:
                    return 0.0  # nothing is asked
        except np.linalg.LinAlgError:
            return 0.0  # the noise alone meets the requirement, and has no information on other parameters
        found = float(np.exp(scipy.optimize.brentq(excess, lo, hi, xtol=1e-13, rtol=1e-14)))
        if abs(found - power) <= 1e-3 * power:
            return found
        power = found
    return power


def suffices(problem: Problem, informations: NDArray[np.float64]) -> bool:
    """Whether informations (S, k, k) of the scenarios meet every requirement."""
    if any(np.linalg.matrix_rank(M) < len(M) for M in informations):
        return False
    return worst([v for _, v in problem.demands.violations(informations)]).ratio <= 1.0


@dataclass(frozen=True)
class _Trial:
    """Flat excitation in coordinates that suit the power whose logarithm is `at`."""

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
        """Return this trial, or one in coordinates for the power `at` if that is far from its own."""
        return self if abs(at - self.at) <= _SUITED else _Trial.of(self.experiment, self.factories, at)

    def excess(self, log_power: float) -> float:
        """The logarithm of the worst ratio.

        Raises:
            OutOfTimeError: see `seconds_left`.
        """
        seconds_left()
        informations = self.problem.informations(np.array([np.exp(log_power)]))
        return float(np.log(max(self.problem.demands.worst_ratio(informations).ratio, 1e-300)))


def _enough(trial: _Trial) -> tuple[float, float, _Trial]:
    """Logarithms of two powers, from that of the trial on, at the second of which the excess is gone."""
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
        "no power is enough: the accuracy asks for parameters of which only the noise tells, and the "
        f"error stays at {ratio:.6g} times what is asked",
        f"take {ratio**2:.4g} times as many samples, or allow {ratio:.4g} times the error",
        "accuracy",
    )
