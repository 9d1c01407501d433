"""Is one parameter missing? The score test of each, and the likelihood ratio where that leaves it open.

A test of one degree of freedom sees a neglected pole or sample of delay where tests of many lags share
their power among all ([engle-1984]). It also tells how far G would move, which the residuals need not show: a
narrow band of excitation hardly contradicts a model that is wrong at its edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from inputdesign_cli.identification.adequacy import Echoes, Fault, ScoreTest, White
from inputdesign_cli.identification.extensions import Extension
from inputdesign_cli.identification.record_problem import Point
from inputdesign_cli.identification.records import Records
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.polynomial import Array, ComplexArray

# A parameter that would move G by more than is admitted counts as missing with a probability below this,
# shared among all that would (Bonferroni).
BEYOND_CHANCE = 0.05
# A score of a larger probability is the last word.
_OPEN = 0.3
# A parameter of whose effect the estimate explains all but this share is not tried.
_EXPLAINED = 1e-6
# A mean of the score that is less than this, in standard deviations, does not matter.
_LITTLE = 0.1
# Directions with a larger cosine are one.
_SAME = 0.99


@dataclass(frozen=True)
class Directed:
    """One parameter more than the model has.

    Attributes:
        test: whether these data ask for it.
        extensions: the parameters that act alike on these data where they are small, the likeliest first.
        deviation: the standard deviation of the first one.
        following: (k,), how the parameters of the model change with it, to first order.
        size: what it is to first order; `larger`, the estimate of the larger model where there is one.
    """

    test: ScoreTest
    extensions: tuple[Extension, ...]
    deviation: float
    following: Array
    size: float
    larger: Model | None

    def moves(self, model: Model, w: ArrayLike) -> ComplexArray:
        """(n, p, r): how G of the estimated `model` changes if the parameter is estimated along."""
        if self.larger is not None:
            return np.asarray(self.larger.plant_at(w) - model.plant_at(w))
        return self.size * self.slope(model, w)

    def slope(self, model: Model, w: ArrayLike) -> ComplexArray:
        """(n, p, r): the derivative of G with respect to the parameter, the others following."""
        extension = self.extensions[0]
        own = np.tensordot(self.following, model.plant_gradient(w), axes=(0, 1))
        return np.asarray(own + extension.model.plant_gradient(w)[:, extension.index])

    def matters(self, moves: float, among: int) -> bool:
        """Whether it speaks against a verdict that G `moves` by so many times what is admitted.

        Args:
            among: how many parameters would move it by more than is admitted.
        """
        return moves > 1.0 and self.test.probability * among < BEYOND_CHANCE


@dataclass(frozen=True)
class _Tried:
    """An extension and its gradient (N p,) in white units; what the estimate leaves of it; the mean score."""

    extension: Extension
    column: Array
    left: Array
    mean: float

    @property
    def size(self) -> float:
        return float(np.linalg.norm(self.left))

    def like(self, other: _Tried) -> bool:
        return bool(abs(self.left @ other.left) > _SAME * self.size * other.size)


def directed_tests(
    records: Records, point: Point, extensions: Sequence[Extension], echoes: Echoes | None = None
) -> tuple[Directed, ...]:
    """The test of every extension; those that these data cannot tell apart share one."""
    white = White.of(point, echoes)
    groups: list[list[_Tried]] = []
    for extension in extensions:
        column = (extension.column(records) @ white.root.T).ravel()
        known = extension.echo is not None and echoes is not None
        through = extension.echo(records.lengths) if known and extension.echo else None
        own = np.array([0.0 if through is None else white.echoes(through)])
        mean = float(white.mean_left(column[:, None], own)[0])
        tried = _Tried(extension, column, white.unexplained(column), mean)
        if tried.size > _EXPLAINED * np.linalg.norm(column):
            alike = next((group for group in groups if tried.like(group[0])), None)
            groups.append([tried]) if alike is None else alike.append(tried)
    return tuple(_tested(records, point, white, group) for group in groups)


def _tested(records: Records, point: Point, white: White, group: list[_Tried]) -> Directed:
    statistic = float(group[0].left @ white.residuals - group[0].mean) ** 2
    statistic /= group[0].size ** 2 * white.variance
    larger: Model | None = None
    if _probability(statistic) < _OPEN and group[0].extension.nested and records.earlier is None:
        ends = [tried.extension.estimated(records) for tried in group]
        costs = np.array([cost for _, cost, _ in ends])
        group = [group[i] for i in np.argsort(costs)]
        best = int(np.argmin(costs))
        # A likelihood ratio has no mean to be compared with.
        if abs(group[0].mean) <= _LITTLE * group[0].size:
            statistic = max(statistic, _ratio(records, ends[best][2], costs[best]) / white.variance)
        larger = group[0].extension.model.at(ends[best][0])
    first = group[0]
    scale = np.maximum(np.linalg.norm(white.explained, axis=0), 1e-300)
    explained = np.linalg.lstsq(white.explained / scale, first.column, rcond=1e-12)[0] / scale
    extensions = tuple(tried.extension for tried in group)
    name = " or ".join(sorted(extension.name for extension in extensions))
    fault: Fault = "plant" if any(extension.in_plant for extension in extensions) else "noise"
    return Directed(
        ScoreTest(name, fault, statistic, 1, _probability(statistic), None),
        extensions,
        deviation=1.0 / first.size,
        following=-explained[explained.size - point.theta.size :],
        size=float(first.left @ white.residuals - first.mean) / first.size**2,
        larger=larger,
    )


def _ratio(records: Records, cost: float, less: float) -> float:
    """-2 log of the likelihood ratio of two minima."""
    if records.weights is not None:
        return cost - less
    return float(records.y.size * np.log(cost / max(less, 1e-300)))


def _probability(statistic: float) -> float:
    return float(scipy.special.chdtrc(1, statistic))
