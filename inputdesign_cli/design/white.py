"""White excitation of the least power that meets the requirements: the baseline of every design."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.optimize

from inputdesign_cli.accuracy import worst
from inputdesign_cli.design.problem import Problem, RequirementFactory
from inputdesign_cli.information import Experiment
from inputdesign_cli.spectrum import flat_basis

_POLISH = 3


def least_white_power(experiment: Experiment, factories: Sequence[RequirementFactory]) -> float:
    """The smallest white excitation power (per sample) that meets every requirement; 0 if none is needed.

    r_u falls monotonically as the power grows, so this is one scalar equation and needs no solver.
    The coordinates are whitened again at each new estimate of the power.
    """
    power = 1.0
    for _ in range(_POLISH):
        coordinates = experiment.whitened(power)
        requirements = tuple(make(coordinates) for make in factories)
        problem = Problem(coordinates, flat_basis(coordinates), {"excitation": 1.0}, requirements)

        def excess(log_power: float, problem: Problem = problem) -> float:
            information = problem.information(np.array([np.exp(log_power)]))
            return np.log(max(problem.worst_ratio(information).ratio, 1e-300))

        if np.linalg.matrix_rank(problem.baseline_information) == coordinates.size:
            without = worst([v for _, v in problem.violations(problem.baseline_information)])
            if without.ratio <= 1.0:
                return 0.0
        lo = hi = np.log(power)
        while excess(hi) > 0:
            hi += 2.0
        while excess(lo) <= 0 and lo > -200:
            lo -= 2.0
        found = float(np.exp(scipy.optimize.brentq(excess, lo, hi, xtol=1e-13, rtol=1e-14)))
        if abs(found - power) <= 1e-3 * power:
            return found
        power = found
    return power
