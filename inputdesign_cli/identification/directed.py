"""Is one parameter missing, or a gain not always the same? Score tests, then likelihood ratios.

A test of one degree of freedom sees a neglected pole or sample of delay where tests of many lags share
their power among all ([engle-1984]). It also tells how far G would move, which the residuals need not show: a
narrow band of excitation hardly contradicts a model that is wrong at its edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.identification.adequacy import Fault, ScoreTest
from inputdesign_cli.identification.record_problem import Point
from inputdesign_cli.identification.records import Records
from inputdesign_cli.identification.white import Echo, Echoes, White
from inputdesign_cli.plant import Model

# A score of a larger probability is the last word.
_OPEN = 0.3
# A parameter of whose effect the estimate explains all but this share is not tried.
_EXPLAINED = 1e-6
# A mean of the score that is less than this, in standard deviations, does not matter.
_LITTLE = 0.1
# Directions with a larger cosine are one.
_SAME = 0.99


class Alternative(Protocol):
    """The model with one parameter more, which is zero in the model."""

    @property
    def name(self) -> str:
        """Of the parameter."""

    @property
    def phrase(self) -> str:
        """What it is, for a sentence."""

    @property
    def fault(self) -> Fault:
        """What is wrong where it is missing."""

    @property
    def lag(self) -> bool:
        """Whether it is a pole or a dead time of the plant."""

    def column(self, records: Records) -> NDArray[np.float64]:
        """(N, p): minus the derivative of the prediction errors with respect to it."""

    def slopes(self, model: Model, w: ArrayLike) -> ComplexArray:
        """(states, n, p, r): the derivative of G with respect to it, in each state that a plant may be in."""

    def echo(self, lengths: Sequence[int]) -> Echo | None:
        """What past errors add to `column` in records of these lengths; None where they add nothing."""

    def estimated(self, records: Records) -> tuple[Model, float, float] | None:
        """The model with it, estimated, the cost of that and the cost without it; None: not to be had."""


@dataclass(frozen=True)
class Directed:
    """One parameter more than the model has.

    Attributes:
        test: whether these data ask for it.
        alternatives: the parameters that act alike on these data where they are small, the likeliest first.
        deviation: the standard deviation of the first one.
        following: (k,), how the parameters of the model change with it, to first order.
        size: what it is to first order; `larger`, the estimate of the larger model where there is one.
    """

    test: ScoreTest
    alternatives: tuple[Alternative, ...]
    deviation: float
    following: Array
    size: float
    larger: Model | None

    @property
    def of_structure(self) -> bool:
        """Whether it is a parameter of a larger structure, not a gain that is not always the same."""
        return self.test.fault in ("plant", "noise")

    @property
    def lag(self) -> bool:
        """Whether one of the parameters that act alike is a pole or a dead time of the plant."""
        return any(alternative.lag for alternative in self.alternatives)

    def moves(self, model: Model, w: ArrayLike) -> ComplexArray:
        """(states, n, p, r): how G of the estimated `model` changes if the parameter is estimated along."""
        if self.larger is not None:
            return np.asarray(self.larger.plant_at(w) - model.plant_at(w))[None]
        return self.size * self.slope(model, w)

    def slope(self, model: Model, w: ArrayLike) -> ComplexArray:
        """(states, n, p, r): the derivative of G with respect to the parameter, the others following."""
        others = np.tensordot(self.following, model.plant_gradient(w), axes=(0, 1))
        return np.asarray(others + self.alternatives[0].slopes(model, w))


@dataclass(frozen=True)
class _Tried:
    """An alternative, its gradient (N p,) in white units, what the estimate leaves of it, the mean score."""

    alternative: Alternative
    column: Array
    left: Array
    mean: float

    @property
    def size(self) -> float:
        return float(np.linalg.norm(self.left))

    def like(self, other: _Tried) -> bool:
        return bool(abs(self.left @ other.left) > _SAME * self.size * other.size)


def directed_tests(
    records: Records,
    point: Point,
    white: White,
    alternatives: Sequence[tuple[Alternative, NDArray[np.float64]]],
    echoes: Echoes | None = None,
) -> tuple[Directed, ...]:
    """Return the test of every alternative; those that these data cannot distinguish share one.

    Args:
        alternatives: each with its column (N, p).
    """
    groups: list[list[_Tried]] = []
    for alternative, own_column in alternatives:
        column = white.columns(own_column[None])[:, 0]
        through = None if echoes is None else alternative.echo(records.lengths)
        own = np.array([0.0 if through is None else white.echoes(through)])
        mean = float(white.mean_left(column[:, None], own)[0])
        tried = _Tried(alternative, column, white.unexplained(column), mean)
        if tried.size > _EXPLAINED * np.linalg.norm(column):
            alike = next((group for group in groups if tried.like(group[0])), None)
            groups.append([tried]) if alike is None else alike.append(tried)
    return tuple(_tested(records, point, white, group) for group in groups)


def _tested(records: Records, point: Point, white: White, group: list[_Tried]) -> Directed:
    statistic = float(group[0].left @ white.residuals - group[0].mean) ** 2
    statistic /= group[0].size ** 2 * white.variance
    larger: Model | None = None
    along = group[0].left[:, None] / group[0].size
    if white.probability(statistic, along) < _OPEN and records.earlier is None and white.whitening is None:
        ends = [(tried.alternative.estimated(records), tried) for tried in group]
        known = [(end, tried) for end, tried in ends if end is not None]
        if known:
            known.sort(key=lambda each: each[0][1])
            (larger, cost, without), best = known[0]
            group = [tried for _, tried in known] + [tried for end, tried in ends if end is None]
            # A likelihood ratio has no mean to be compared with.
            if abs(best.mean) <= _LITTLE * best.size:
                statistic = max(statistic, _ratio(records, point, without, cost))
    first = group[0]
    scale = np.maximum(np.linalg.norm(white.explained, axis=0), 1e-300)
    explained = np.linalg.lstsq(white.explained / scale, first.column, rcond=1e-12)[0] / scale
    alternatives = tuple(tried.alternative for tried in group)
    name = " or ".join(sorted(alternative.name for alternative in alternatives))
    faults = [alternative.fault for alternative in alternatives]
    fault: Fault = "plant" if "plant" in faults else faults[0]
    return Directed(
        ScoreTest(name, fault, statistic, 1, white.probability(statistic, along), None),
        alternatives,
        deviation=1.0 / first.size,
        following=-explained[white.starts.shape[1] :][: point.theta.size],
        size=float(first.left @ white.residuals - first.mean) / first.size**2,
        larger=larger,
    )


def _ratio(records: Records, point: Point, cost: float, less: float) -> float:
    """-2 log of the likelihood ratio of two minima."""
    if records.weights is not None:
        return cost - less
    return float(point.near.freedom * np.log(cost / max(less, 1e-300)))
