"""Is one parameter missing, or a gain not always the same? Score tests of one, and likelihood ratios.

A test of one degree of freedom sees a neglected pole or sample of delay where tests of many lags share
their power among all ([engle-1984]). It also says how far G would move, which the residuals need not show: a
narrow band of excitation hardly contradicts a model that is wrong at its edge.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.identification.adequacy import Fault, Score, ScoreTest, score
from inputdesign_cli.identification.gauss_newton import minimise
from inputdesign_cli.identification.kind import Extension
from inputdesign_cli.identification.records import RecordProblem, Records, evaluate
from inputdesign_cli.identification.white import White
from inputdesign_cli.levels import level
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.model import DELAY

# A parameter of whose effect the estimate explains all but this share is not tried.
_EXPLAINED = 1e-6
# A score of a larger probability is final. A mean below this number of deviations counts as zero.
_OPEN, _LITTLE = 0.3, 0.1
# Directions with a larger cosine are one.
_SAME = 0.99
_LAGS = ("a", "f", DELAY)
# The odds from which nothing is promised any more. Odds beforehand that something is missing, shared among
# parameters that stand for it: what plants mostly have beyond their model is a lag or a longer dead time.
_ODDS, _OF_LAGS, _OF_OTHERS = 0.7, 1.0, 0.2
_LEAST = 1e-300


@dataclass(frozen=True)
class Alternative:
    """The model with one additional parameter, which is zero in the model."""

    name: str  # of the parameter
    phrase: str  # what it is, for a sentence
    fault: Fault  # what is wrong if it is missing
    column: NDArray[np.float64]  # (N, p), minus the derivative of the prediction errors with respect to it
    slopes: Callable[[Model, ArrayLike], ComplexArray]  # dG by it at (n,), of each state, (states, n, p, r)
    lag: bool = False  # whether it is a pole or a dead time of the plant
    echo: NDArray[np.float64] | None = None  # (lags, p, p), how `column` responds to past errors, if it does
    estimated: Callable[[], tuple[Model, float]] | None = None  # larger model, its likelihood ratio


@dataclass(frozen=True)
class Directed:
    """The test of one parameter that the model does not have, and its estimate."""

    test: ScoreTest  # whether these data ask for it
    # That act alike on these data where they are small, the likeliest first.
    alternatives: tuple[Alternative, ...]
    size: float  # of the first of them, to first order
    deviation: float  # its standard deviation
    following: Array  # (k,), how the parameters of the model change with it, to first order
    larger: Model | None = None  # the estimate of the larger model, where it was looked for

    @property
    def of_structure(self) -> bool:
        """Return whether the parameter belongs to a larger structure, not to a varying gain."""
        return self.test.fault in ("plant", "noise")

    @property
    def lag(self) -> bool:
        """Return whether one of the parameters that act alike is a pole or a dead time of the plant."""
        return any(alternative.lag for alternative in self.alternatives)

    def moves(self, model: Model, w: ArrayLike) -> ComplexArray:
        """Return the change (states, n, p, r) of G of the estimated `model` if the parameter is estimated."""
        if self.larger is not None:
            return np.asarray(self.larger.plant_at(w) - model.plant_at(w))[None]
        return self.size * self.slope(model, w)

    def slope(self, model: Model, w: ArrayLike) -> ComplexArray:
        """Return the derivative (states, n, p, r) of G by the parameter if the others follow."""
        others = np.tensordot(self.following, model.plant_gradient(w), axes=(0, 1))
        return np.asarray(others + self.alternatives[0].slopes(model, w))


_Tried = tuple[Alternative, Array, Array]
"""An alternative, its column ((N + M) p,) in white units, and the direction that is not explained."""


def directed_tests(
    white: White, alternatives: Sequence[Alternative], parameters: int
) -> tuple[Directed, ...]:
    """Return the test of every alternative; alternatives that these data cannot distinguish share one test.

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
        alike = next((group for group in groups if abs(group[0][2] @ tried[2]) > _SAME), None)
        groups.append([tried]) if alike is None else alike.append(tried)
    return tuple(_tested(white, group, parameters) for group in groups)


def _tested(white: White, group: list[_Tried], parameters: int) -> Directed:
    found, mean = _score(white, group[0])
    statistic, directions = found.statistic, found.directions
    larger: Model | None = None
    if white.whitening is None and white.probability(statistic, directions) < _OPEN:
        ends = [(one[0].estimated(), one) for one in group if one[0].estimated is not None]
        if ends:
            ends.sort(key=lambda end: -end[0][1])
            larger, ratio = ends[0][0]
            group = [*(one for _, one in ends), *(one for one in group if one[0].estimated is None)]
            # A likelihood ratio has no mean to be compared with.
            statistic = max(statistic, ratio) if abs(mean) <= _LITTLE else statistic
            found, _ = _score(white, group[0])
    first, column, along = group[0]
    size = float(along @ column)
    scale = np.maximum(np.linalg.norm(white.explained, axis=0), 1e-300)
    explained = np.linalg.lstsq(white.explained / scale, column, rcond=1e-12)[0] / scale
    alternatives = tuple(alternative for alternative, _, _ in group)
    fault = "plant" if any(one.fault == "plant" for one in alternatives) else first.fault
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
    """Return the score of a regressor, and its mean in standard deviations of the score."""
    alternative, column, along = tried
    mean = np.zeros(1)
    if alternative.echo is not None:
        mean = white.mean((white.root @ alternative.echo @ np.linalg.inv(white.root))[None])
    expected = float(white.mean_left(column[:, None], mean)[0])
    return score(white, column[:, None], mean), expected / float(along @ column)


def alternative(extension: Extension, records: Records) -> Alternative:
    """Return the parameter as a regressor of the prediction errors of records."""
    model, index = extension.model, extension.model.names.index(extension.name)
    larger, in_plant = replace(records, kind=extension.kind, earlier=None), bool(model.in_plant[index])
    again = partial(_estimated, larger, model, index)
    return Alternative(
        extension.name,
        f"one more {extension.what} ({extension.name})",
        "plant" if in_plant else "noise",
        larger.gradient(model.theta, index),
        lambda model, w: extension.model.plant_gradient(w)[None, :, index],
        lag=model.parameters[index].letter in _LAGS,
        echo=extension.kind.echoes(model.theta, records.longest)[index],
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
    ratio = float(point.freedom * np.log(cost / max(float(found.cost[0]), 1e-300)))
    return model.at(found.theta[0]), ratio


@dataclass(frozen=True)
class Moves:
    """The change of G at n frequencies by an added parameter, in units of the admissible error."""

    estimated: Array  # (n,), how far G moves if the parameter is estimated along
    deviation: Array  # (n,), the standard deviation of that
    known: Array  # (n,), the largest standard deviation of G of the model itself

    @property
    def largest(self) -> float:
        """Return the largest estimated move of G."""
        return float(np.max(self.estimated))

    def odds(self, probability: float) -> float:
        """Return the odds that the parameter exists and G exceeds the admissible error, from even prior odds.

        The evidence for the parameter is the Bayes factor of a normal estimate ([kass-raftery-1995]). A
        priori it is normal about zero, of a size that moves G by about the admissible error.

        Args:
            probability: of an estimate as far from zero, if the parameter is not there.
        """
        reach = float(np.max(self.deviation))
        if reach == 0.0:
            return 0.0
        left = 1.0 / (1.0 + reach**2)  # of the estimate, once the prior draws it to zero
        statistic = float(scipy.special.chdtri(1.0, max(probability, _LEAST)))
        evidence = np.exp(0.5 * (np.log1p(-left) + left * statistic))
        spread = np.sqrt(self.known**2 + left * self.deviation**2)
        beyond = sum(
            scipy.special.ndtr((sign * left * self.estimated - 1.0) / np.maximum(spread, _LEAST))
            for sign in (1.0, -1.0)
        )
        return float(evidence * np.max(beyond))


def that_matter(tried: Sequence[Directed], moves: Sequence[Moves]) -> list[int]:
    """Return the indices of the parameters that speak against a verdict of |error of G| <= r_adm.

    It is neither enough nor necessary that the parameter is significant. It must exist, and G must be beyond
    r_adm after the estimated move and with its uncertainty.
    """
    # A gain that varies often has a large effect that the record hardly shows: it matters where it would move
    # G by more than is admitted, at a level that is shared among all that would. What is not a number is no
    # promise: it is compared so that it speaks against one.
    varying = [i for i, one in enumerate(tried) if not (one.of_structure or moves[i].largest <= 1.0)]
    found = [i for i in varying if not tried[i].test.probability * len(varying) >= level("varying gain")]
    structure = [i for i, one in enumerate(tried) if one.of_structure]
    among = Counter(tried[i].lag for i in structure)
    for i in structure:
        beforehand = (_OF_LAGS if tried[i].lag else _OF_OTHERS) / among[tried[i].lag]
        if not beforehand * moves[i].odds(tried[i].test.probability) <= _ODDS:
            found.append(i)
    return sorted(found)
