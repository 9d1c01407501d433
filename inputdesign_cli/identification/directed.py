"""Is one parameter missing, or a gain not always the same? Score tests of one, and likelihood ratios.

A test of one degree of freedom sees a neglected pole or sample of delay where tests of many lags share
their power among all ([engle-1984]). It also says how far G would move, which the residuals need not show: a
narrow band of excitation hardly contradicts a model that is wrong at its edge.

A gain or a speed that varies is one parameter too. G u is replaced by G (u + x f), with a signal f that is
made of the same input: the input itself after a part of the record, or times a ramp; a power of it, its sign,
the direction of its last move. Prediction errors are linear in u, so that their response to f is the gradient
with respect to x. If x is not zero there is no single G: small changes of u see a different one in each state
of the plant. Examples of states are early and late, or near the middle of the range and far from it.

If a plant heats faster than it cools, f is made of its output: T (1 + x s) dy/dt + y = K u, where s is
the direction in which y moves, is to first order T dy/dt + y = K u - x T |dy/dt|. The added term acts without
the dead time.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.identification.adequacy import Fault, Score, ScoreTest, score
from inputdesign_cli.identification.gauss_newton import minimise
from inputdesign_cli.identification.kind import Extension, Kind
from inputdesign_cli.identification.records import RecordProblem, Records, evaluate, split
from inputdesign_cli.identification.white import White
from inputdesign_cli.levels import level
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.model import DELAY

# A parameter is not tried if the estimate explains all but this share of its effect.
_EXPLAINED = 1e-6
# Below this probability of the score, a likelihood ratio is computed too. It counts only if the mean of the
# score is at most this number of its standard deviations.
_SUGGESTIVE, _NEGLIGIBLE = 0.3, 0.1
# The data cannot distinguish directions with a larger cosine.
_SAME = 0.99
_LAGS = ("a", "f", DELAY)  # letters of poles and dead times
# Posterior odds of a missing parameter above which it speaks against a verdict. Prior odds of lags and of
# others, shared among the tried ones: most plants have a lag or a longer dead time beyond their model.
_ODDS, _PRIOR_OF_LAGS, _PRIOR_OF_OTHERS = 0.7, 1.0, 0.2
_LEAST = 1e-300
# A trial signal that differs from a straight line in the input by less than this share is the input itself.
_STRAIGHT = 1e-6
_PARTS = {"a quarter": 0.25, "half": 0.5, "three quarters": 0.75}

RISING = "rising"
"""The last word of the name of a gain that changes evenly."""


@dataclass(frozen=True)
class Alternative:
    """The model with one additional parameter, which is zero in the model."""

    name: str
    phrase: str  # description for a sentence
    fault: Fault  # the kind of fault if it is missing
    column: Array  # (N, p), minus the derivative of the prediction errors with respect to it
    slopes: Callable[[Model, ArrayLike], ComplexArray]  # derivative of G by it, by state: (states, n, p, r)
    lag: bool = False  # whether it is a pole or a dead time of the plant
    echo: Array | None = None  # (lags, p, p), the response of `column` to past errors, if it has one
    estimated: Callable[[], tuple[Model, float]] | None = None  # estimates larger model, likelihood ratio


@dataclass(frozen=True)
class Directed:
    """The test of one parameter that the model does not have, and its estimate."""

    test: ScoreTest  # the test whether these data support it
    # Alternatives that these data cannot distinguish while small; the likeliest comes first.
    alternatives: tuple[Alternative, ...]
    size: float  # estimate of the first of them, to first order
    deviation: float  # its standard deviation
    following: Array  # (k,), change of the other parameters per unit of it, to first order
    larger: Model | None = None  # the estimate of the larger model, if it was searched for

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
        parameters: their number k in the model.
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
    if white.whitening is None and white.probability(statistic, directions) < _SUGGESTIVE:
        ends = [(one[0].estimated(), one) for one in group if one[0].estimated is not None]
        if ends:
            ends.sort(key=lambda end: -end[0][1])
            larger, ratio = ends[0][0]
            group = [*(one for _, one in ends), *(one for one in group if one[0].estimated is None)]
            # The mean of a score cannot be subtracted from a likelihood ratio.
            statistic = max(statistic, ratio) if abs(mean) <= _NEGLIGIBLE else statistic
            found, _ = _score(white, group[0])
    first, column, along = group[0]
    size = float(along @ column)
    alternatives = tuple(alternative for alternative, _, _ in group)
    fault = "plant" if any(one.fault == "plant" for one in alternatives) else first.fault
    name = " or ".join(sorted(alternative.name for alternative in alternatives))
    return Directed(
        ScoreTest(name, fault, statistic, 1, white.probability(statistic, directions), None),
        alternatives,
        size=float(found.sizes[0]) / size,
        deviation=1.0 / size,
        following=-(white.spread @ column)[:parameters],
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


def alternative(extension: Extension, kind: Kind, records: Records) -> Alternative:
    """Return the parameter of a larger model of this kind as a regressor of the errors of records."""
    model, index = extension.model, extension.model.names.index(extension.name)
    larger, in_plant = replace(records, kind=kind, earlier=None), bool(model.in_plant[index])
    # If the parameters are no coefficients, the larger structure has more than one additional freedom.
    nested = set(model.names) - set(records.kind.model.names) == {extension.name}
    again = partial(_estimated, larger, model, index)
    return Alternative(
        extension.name,
        f"one more {extension.what} ({extension.name})",
        "plant" if in_plant else "noise",
        larger.gradient(model.theta, index),
        lambda _, w: model.plant_gradient(w)[None, :, index],
        lag=model.parameters[index].letter in _LAGS,
        echo=kind.echoes(model.theta, records.longest)[index],
        estimated=again if nested and records.earlier is None else None,
    )


def _estimated(records: Records, model: Model, index: int) -> tuple[Model, float]:
    """Return the larger model that a search from here finds, and -2 log of the likelihood ratio.

    Both costs have the unknown starts of the larger structure. The cost without the parameter follows by
    one Gauss-Newton step from here. If the parameter adds unknown starts, the costs are not comparable, and
    the ratio is zero.
    """
    theta: Array = model.theta
    found = minimise(RecordProblem((records,)), theta[None])
    point, others = evaluate(records, theta), np.arange(theta.size) != index
    slope, hessian = point.slope[others], point.hessian[np.ix_(others, others)]
    cost = point.cost - float(slope @ np.linalg.lstsq(hessian, slope, rcond=1e-12)[0])
    ratio = float(point.freedom * np.log(cost / max(float(found.cost[0]), 1e-300)))
    alike = evaluate(records, found.theta[0]).unknowns == point.unknowns
    return model.at(found.theta[0]), ratio if alike else 0.0


@dataclass(frozen=True)
class Moves:
    """The change of G at n frequencies by an added parameter, in units of the admissible error."""

    estimated: Array  # (n,), the change if the parameter is estimated too
    deviation: Array  # (n,), its standard deviation
    known: Array  # (n,), the standard deviation of G without the parameter

    @property
    def largest(self) -> float:
        """Return the largest estimated move of G."""
        return float(np.max(self.estimated))

    def odds(self, probability: float) -> float:
        """Return the odds that the parameter exists and G exceeds the admissible error, from even prior odds.

        The evidence is the Bayes factor of a normal estimate ([kass-raftery-1995]) whose distance from zero
        has this `probability` by chance. The prior is normal and moves G by about the admissible error.
        """
        reach = float(np.max(self.deviation))
        if reach == 0.0:
            return 0.0
        left = 1.0 / (1.0 + reach**2)  # the factor by which the prior shrinks the estimate
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

    Significance of the parameter is neither sufficient nor necessary. The odds are that it exists and that G
    then differs by more than r_adm, uncertainty included.
    """
    # A varying gain often has a large effect that the record hardly shows. It matters if it would move G by
    # more than r_adm and is significant, at a level shared among all such gains. NaN must speak against a
    # verdict, hence the negated comparisons.
    varying = [i for i, one in enumerate(tried) if not (one.of_structure or moves[i].largest <= 1.0)]
    found = [i for i in varying if not tried[i].test.probability * len(varying) >= level("varying gain")]
    structure = [i for i, one in enumerate(tried) if one.of_structure]
    among = Counter(tried[i].lag for i in structure)
    for i in structure:
        beforehand = (_PRIOR_OF_LAGS if tried[i].lag else _PRIOR_OF_OTHERS) / among[tried[i].lag]
        if not beforehand * moves[i].odds(tried[i].test.probability) <= _ODDS:
            found.append(i)
    return sorted(found)


class _Trial(NamedTuple):
    """A trial signal f (N,) that is made of an input scaled to size one."""

    name: str
    phrase: str
    fault: Fault
    f: Array
    gains: tuple[float, ...]  # df/du, one for each state of the plant
    moves: tuple[float, ...] = (0.0,)  # df / d(y(t) - y(t - 1)), one for each state
    early: int = 0  # samples by which the output term acts early

    def slopes(self, channel: int, size: float, model: Model, w: ArrayLike) -> NDArray[np.complex128]:
        """Return the derivative (states, n, p, r) of G by x, for an input of this size."""
        G = model.plant_at(w)
        own, moving = np.zeros_like(G), np.zeros_like(G)
        own[..., channel] = G[..., channel]
        turned = np.exp(1j * np.asarray(w, dtype=float))
        change = size * (1.0 - 1.0 / turned) * turned**self.early
        moving[..., channel] = change[:, None] * G[..., channel] ** 2
        moves = np.resize(self.moves, len(self.gains))
        return np.asarray(np.multiply.outer(np.array(self.gains), own) + np.multiply.outer(moves, moving))


def variations(records: Records, theta: Array, simulated: Array | None) -> tuple[Alternative, ...]:
    """Return the alternatives for each input, and for the speed of a plant with one input and output.

    For an input with two values, powers and sign are the input itself about a level: they add nothing.

    Args:
        simulated: (N, p), the response to the inputs; None if unstable, or in continuous time.
    """
    found, u, lengths = [], records.u, records.lengths
    for channel, samples in enumerate(u.T):
        name, size = "u" if u.shape[1] == 1 else f"u{channel + 1}", float(np.std(samples))
        x = (samples - np.mean(samples)) / max(size, 1e-300)
        tried = [*_changes(name, x), *_curves(name, x, lengths)]
        if simulated is not None and u.shape[1] == simulated.shape[1] == 1:
            tried += _one_way(x, simulated[:, 0], records.kind.lateness(theta) + 1, lengths)
        for one in tried:
            # The response of the outputs to f is minus the prediction errors with f as the only input.
            only = np.outer(size * one.f, np.arange(u.shape[1]) == channel)
            parts = tuple(split(only, np.zeros_like(records.y), lengths))
            column = -replace(records, parts=parts).from_rest(theta)[0]
            slopes = partial(one.slopes, channel, size)
            found.append(Alternative(one.name, one.phrase, one.fault, column, slopes))
    return tuple(found)


def _changes(name: str, x: Array) -> Iterator[_Trial]:
    """Yield the signal of a gain of x (N,) that rises evenly, and of gains that jump during the record."""
    time = np.arange(x.size) / x.size
    phrase = f"a gain of {name} that rises or falls evenly during the record"
    yield _Trial(f"{name} {RISING}", phrase, "change", (time - 0.5) * x, (-0.5, 0.5))
    for part, share in _PARTS.items():
        phrase = f"another gain of {name} after {part} of the record"
        yield _Trial(f"{name} after {part}", phrase, "change", np.where(time >= share, x, 0.0), (0.0, 1.0))


def _curves(name: str, x: Array, lengths: Sequence[int]) -> Iterator[_Trial]:
    """Yield the signals of gains that depend on samples x (N,), of mean zero and size one."""
    moves = []
    for own in np.split(x, np.cumsum(lengths)[:-1]):
        # The direction of the last move of x; before the first move, the opposite one.
        signs = np.sign(np.diff(own, prepend=own[:1]))
        first = np.flatnonzero(signs)[:1]
        signs[0] = -signs[first[0]] if first.size else 0.0
        moves.append(signs[np.maximum.accumulate(np.where(signs != 0.0, np.arange(own.size), 0))])
    for of, phrase, f, gains in (
        # Gains at one standard deviation below and above the mean.
        (f"{name}^2", f"a gain of {name} that depends on its level", x**2, (-2.0, 2.0)),
        (f"{name}^3", f"a gain of {name} that depends on its amplitude", x**3, (0.0,)),
        (f"sign of {name}", f"a dead zone or friction at {name}", np.sign(x), (0.0,)),
        (f"last move of {name}", f"play or hysteresis at {name}", np.concatenate(moves), (0.0,)),
    ):
        bent, slope = _bent(f, x, lengths)
        if np.linalg.norm(bent) > _STRAIGHT * np.linalg.norm(f):
            yield _Trial(of, phrase, "nonlinear", bent, tuple(gain - slope for gain in gains))


def _one_way(x: Array, simulated: Array, early: int, lengths: Sequence[int]) -> Iterator[_Trial]:
    """Yield the signal of a plant of inputs x (N,) that is slower where its output (N,) rises than falls."""
    each = (np.diff(own, prepend=own[:1]) for own in np.split(simulated, np.cumsum(lengths)[:-1]))
    changes = np.concatenate([np.append(own, np.zeros(early))[early:] for own in each])
    scale = float(np.std(changes))
    if not (np.all(np.isfinite(changes)) and scale > 0.0):
        return
    bent, slope = _bent(np.abs(changes) / scale, x, lengths)
    if np.linalg.norm(bent) > _STRAIGHT * np.sqrt(len(x)):
        phrase = "a plant that is slower where y rises than where it falls, or the other way round"
        states = (-slope, -slope), (-1.0 / scale, 1.0 / scale)
        yield _Trial("direction of y", phrase, "nonlinear", bent, *states, early)


def _bent(f: Array, x: Array, lengths: Sequence[int]) -> tuple[Array, float]:
    """Return f (N,) less its straight-line fit in x, record by record, and the mean slope of these lines."""
    ends = np.cumsum(lengths)[:-1]
    bent, slopes = [], []
    for own, by in zip(np.split(f, ends), np.split(x, ends), strict=True):
        line = np.column_stack([np.ones_like(by), by])
        coefficients = np.linalg.lstsq(line, own, rcond=None)[0]
        bent.append(own - line @ coefficients)
        slopes.append(coefficients[1])
    return np.concatenate(bent), float(np.average(slopes, weights=lengths))
