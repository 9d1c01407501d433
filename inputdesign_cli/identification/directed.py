"""Is one parameter missing, or a gain not always the same? Score tests of one, and likelihood ratios.

A test of one degree of freedom sees a neglected pole or sample of delay where tests of many lags share
their power among all ([engle-1984]). It also says how far G would move, which the residuals need not show: a
narrow band of excitation hardly contradicts a model that is wrong at its edge.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.identification.adequacy import Fault, Score, ScoreTest, score
from inputdesign_cli.identification.gauss_newton import minimise
from inputdesign_cli.identification.kind import Echo, Extension
from inputdesign_cli.identification.problem import RecordProblem, evaluate
from inputdesign_cli.identification.records import Records
from inputdesign_cli.identification.white import White
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.model import DELAY

# A parameter of whose effect the estimate explains all but this share is not tried.
_EXPLAINED = 1e-6
# A score of a larger probability is final. A mean below this number of deviations counts as zero.
_OPEN, _LITTLE = 0.3, 0.1
# Directions with a larger cosine are one.
_SAME = 0.99
_LAGS = ("a", "f", DELAY)


@dataclass(frozen=True)
class Alternative:
    """The model with one additional parameter, which is zero in the model.

    Attributes:
        name: of the parameter; `phrase`, what it is, for a sentence.
        fault: what is wrong if it is missing.
        column: (N, p), minus the derivative of the prediction errors with respect to it.
        slopes: of a model at frequencies (n,), the derivative of G with respect to it, (states, n, p, r): in
            each state that a plant may be in.
        lag: whether it is a pole or a dead time of the plant.
        echo: what past errors add to `column`; None if they add nothing.
        estimated: returns the larger model from the same data, and the statistic of its likelihood ratio;
            None if no larger model is estimated.
    """

    name: str
    phrase: str
    fault: Fault
    column: NDArray[np.float64]
    slopes: Callable[[Model, ArrayLike], ComplexArray]
    lag: bool = False
    echo: Echo | None = None
    estimated: Callable[[], tuple[Model, float]] | None = None

    @property
    def of_structure(self) -> bool:
        """Return whether the parameter belongs to a larger structure, not to a varying gain."""
        return self.fault in ("plant", "noise")


@dataclass(frozen=True)
class Directed:
    """One parameter more than the model has.

    Attributes:
        test: whether these data ask for it.
        alternatives: the parameters that act alike on these data where they are small, the likeliest first.
        size: the first of them, to first order; `deviation`, its standard deviation.
        following: (k,), how the parameters of the model change with it, to first order.
        larger: the estimate of the larger model, where it was looked for.
    """

    test: ScoreTest
    alternatives: tuple[Alternative, ...]
    size: float
    deviation: float
    following: Array
    larger: Model | None = None

    @property
    def of_structure(self) -> bool:
        """Return whether the parameter belongs to a larger structure, not to a varying gain."""
        return self.test.fault in ("plant", "noise")

    @property
    def lag(self) -> bool:
        """Return whether one of the parameters that act alike is a pole or a dead time of the plant."""
        return any(alternative.lag for alternative in self.alternatives)

    def moves(self, model: Model, w: ArrayLike) -> ComplexArray:
        """Return how G of the estimated `model` changes if the parameter is estimated, (states, n, p, r)."""
        if self.larger is not None:
            return np.asarray(self.larger.plant_at(w) - model.plant_at(w))[None]
        return self.size * self.slope(model, w)

    def slope(self, model: Model, w: ArrayLike) -> ComplexArray:
        """Return the derivative of G by the parameter, the others following: (states, n, p, r)."""
        others = np.tensordot(self.following, model.plant_gradient(w), axes=(0, 1))
        return np.asarray(others + self.alternatives[0].slopes(model, w))


_Tried = tuple[Alternative, Array, Array]
"""An alternative, its column ((N + M) p,) in white units, and the direction that is not explained."""


def directed_tests(
    white: White, alternatives: Sequence[Alternative], parameters: int
) -> tuple[Directed, ...]:
    """Return the test of every alternative; alternatives that these data cannot distinguish share one.

    Args:
        parameters: k of the model.
    """
    groups: list[list[_Tried]] = []
    for alternative in alternatives:
        column = white.columns(alternative.column[None])[:, 0]
        left = white.unexplained(column)
        size = float(np.linalg.norm(left))
        if size <= _EXPLAINED * np.linalg.norm(column):
            continue
        tried = (alternative, column, left / size)
        alike = (group for group in groups if abs(group[0][2] @ tried[2]) > _SAME)
        group = next(alike, None)
        groups.append([tried]) if group is None else group.append(tried)
    return tuple(_tested(white, group, parameters) for group in groups)


def _tested(white: White, group: list[_Tried], parameters: int) -> Directed:
    found, mean = _score(white, group[0])
    statistic, directions = found.statistic, found.directions
    larger: Model | None = None
    if white.whitening is None and white.probability(statistic, directions) < _OPEN:
        ends = [(one.estimated(), one) for one, _, _ in group if one.estimated is not None]
        if ends:
            ends.sort(key=lambda end: -end[0][1])
            larger, ratio = ends[0][0]
            likeliest = [one for _, one in ends]
            group.sort(key=lambda tried: likeliest.index(tried[0]) if tried[0] in likeliest else len(group))
            # A likelihood ratio has no mean to be compared with.
            statistic = max(statistic, ratio) if abs(mean) <= _LITTLE else statistic
            found, _ = _score(white, group[0])
    _, column, along = group[0]
    size = float(along @ column)
    scale = np.maximum(np.linalg.norm(white.explained, axis=0), 1e-300)
    explained = np.linalg.lstsq(white.explained / scale, column, rcond=1e-12)[0] / scale
    alternatives = tuple(alternative for alternative, _, _ in group)
    faults = [alternative.fault for alternative in alternatives]
    fault: Fault = "plant" if "plant" in faults else faults[0]
    name = " or ".join(sorted(alternative.name for alternative in alternatives))
    return Directed(
        ScoreTest(name, fault, statistic, 1, white.probability(statistic, directions), None),
        alternatives,
        size=float(found.sizes[0]) / size,
        deviation=1.0 / size,
        following=-explained[white.starts.shape[1] :][:parameters],
        larger=larger,
    )


def _score(white: White, tried: _Tried) -> tuple[Score, float]:
    """Return the score of a regressor, and the mean of it in its standard deviations."""
    alternative, column, along = tried
    own = white.echoes(alternative.echo) if white.foreseen and alternative.echo is not None else 0.0
    mean = np.array([own])
    expected = float(white.mean_left(column[:, None], mean)[0])
    return score(white, column[:, None], mean), expected / float(along @ column)


def alternative(extension: Extension, records: Records) -> Alternative:
    """Return the parameter as a regressor of the prediction errors of records."""
    model, index = extension.model, extension.model.names.index(extension.name)
    larger = replace(records, kind=extension.kind, earlier=None)
    again = partial(_estimated, larger, model, index)
    return Alternative(
        extension.name,
        f"one more {extension.what} ({extension.name})",
        "plant" if model.in_plant[index] else "noise",
        larger.gradient(model.theta, index),
        lambda model, w: extension.model.plant_gradient(w)[None, :, index],
        lag=model.parameters[index].letter in _LAGS,
        echo=None if extension.through is None else extension.through(records.lengths),
        estimated=again if extension.nested and records.earlier is None else None,
    )


def _estimated(records: Records, model: Model, index: int) -> tuple[Model, float]:
    """Return the larger model that a search from here finds, and -2 log of the likelihood ratio.

    Both costs are with the unknown starts of the larger structure; that without the parameter is by one
    step of Gauss and Newton from here.
    """
    theta: Array = model.theta
    found = minimise(RecordProblem((records,)), theta[None])
    point, others = evaluate(records, theta), np.arange(theta.size) != index
    slope, hessian = point.slope[others], point.hessian[np.ix_(others, others)]
    cost = point.cost - float(slope @ np.linalg.lstsq(hessian, slope, rcond=1e-12)[0])
    ratio = float(point.near.freedom * np.log(cost / max(float(found.cost[0]), 1e-300)))
    return model.at(found.theta[0]), ratio
