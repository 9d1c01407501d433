"""Coordinates in which white excitation, or the spectrum a design starts from, gives M = I."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.candidate import least_scale
from inputdesign_cli.design.convex.limits import implied_power
from inputdesign_cli.design.convex.problem import Problem
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.design.convex.white import least_white_power, suffices
from inputdesign_cli.information import Experiment, jointly_whitened
from inputdesign_cli.spectrum import LinesBasis, flat_basis

_EVEN = 1e-9
_FAINT = 1e-9
_UNSUITED = 1e8  # a condition beyond which coordinates do not suit


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
    if question.goal == "samples" and suffices(unit, unit.fixed_information):
        return 0.0
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
    if np.ptp(prices) <= _EVEN * prices.max():
        return even
    return power * prices.mean() / (r * prices)


def whitened_problem(question: Question, powers: Array) -> Problem:
    """The problem in coordinates where flat excitation of these powers gives M = I, each plant in its own."""
    whitened = jointly_whitened([one.experiment for one in question.plants], powers)
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


def suited(problem: Problem, question: Question, start: Array) -> Problem:
    """Return the problem in coordinates where `start` gives M = I, if flat excitation does not suit it.

    A pole next to the unit circle may dominate the information of flat excitation. Lines away from it then
    add little information on any parameter, and yet identify them all. Otherwise, return the problem itself.
    """
    informations = problem.informations(start)
    if np.all(np.linalg.cond(informations) < _UNSUITED):
        return problem
    pairs = zip(problem.scenarios, informations, strict=True)
    coordinates = [_suited_to(problem, one.experiment, told, start) for one, told in pairs]
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
        paid=question.paid,
    )
