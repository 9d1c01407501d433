"""Least-cost design: the cheapest spectrum that meets the requirements, beside white and any spectrum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.design.certificate import Certificate
from inputdesign_cli.design.exchange import ExchangeResult, exchange
from inputdesign_cli.design.problem import Problem, RequirementFactory
from inputdesign_cli.design.white import least_white_power
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.spectrum import FirBasis, LinesBasis

_ANY_SPECTRUM_TOLERANCE = 1e-6


@dataclass(frozen=True)
class LeastCost:
    """A least-cost design and what it is compared with.

    `problem` is stated in coordinates whitened at the white baseline. `any_spectrum` is the same
    problem over all spectra; its certificate bounds the cost of every excitation whatever.
    """

    problem: Problem
    white_power: float
    result: ExchangeResult
    any_spectrum: ExchangeResult


def least_cost(
    experiment: Experiment,
    basis: FirBasis,
    cost: Mapping[PowerKind, float],
    factories: Sequence[RequirementFactory],
    *,
    tolerance: float,
) -> LeastCost:
    """Solve a least-cost problem by exchange, with its baseline and its bound over every spectrum.

    Raises:
        SpecError: `not-identifiable` when no excitation can tell some parameters apart.
    """
    power = least_white_power(experiment, factories)
    problem = whitened_problem(experiment, basis, cost, factories, power)
    lines = LinesBasis.anywhere(problem.grid)
    anything = replace(problem, basis=lines)
    if power == 0.0:
        return LeastCost(problem, 0.0, _nothing(problem), _nothing(anything))
    return LeastCost(
        problem=problem,
        white_power=power,
        result=exchange(problem, power * basis.white, tolerance=tolerance),
        any_spectrum=exchange(
            anything, power * lines.flat, tolerance=max(tolerance, _ANY_SPECTRUM_TOLERANCE)
        ),
    )


def whitened_problem(
    experiment: Experiment,
    basis: FirBasis,
    cost: Mapping[PowerKind, float],
    factories: Sequence[RequirementFactory],
    white_power: float,
) -> Problem:
    """The problem in coordinates where white excitation of this power (if any) gives M = I."""
    coordinates = experiment.whitened(white_power or 1.0)
    return Problem(coordinates, basis, cost, tuple(make(coordinates) for make in factories))


def _nothing(problem: Problem) -> ExchangeResult:
    """The answer when what is known already meets every requirement: no excitation at all."""
    k = problem.experiment.size
    return ExchangeResult(
        basis=problem.basis,
        x=np.zeros(problem.basis.size),
        cost=0.0,
        information=problem.baseline_information,
        certificate=Certificate(0.0, np.zeros((k, k)), np.zeros(0)),
        active=(),
        rounds=0,
        cuts=0,
    )
