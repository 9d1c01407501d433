"""Test whether the model is right, by scores of regressors that the model does without ([engle-1984]).

A supplier proposes regressors: past inputs, past residuals, slow trends; `directed.py` proposes single
parameters. The part that parameters and unknown starts can explain is taken off first, so that the statistic
is chi-squared whatever was estimated. The residuals lack this part as well. Many unknown starts, as in a
record with gaps, correlate them by that alone. The mean of a score due to this correlation is subtracted.
In a narrow band the estimated noise power is uncertain, and the statistic follows F instead
([satterthwaite-1946]).

All of this holds for a right noise model. If the stated one is refuted, residuals and regressors are
whitened by filters that are estimated as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.records import Point, Records, shifted
from inputdesign_cli.identification.white import DEPENDENT, White, Whitening
from inputdesign_cli.levels import level

_LAGS = 25  # past residuals of the test with many lags
_FEW = 4  # past residuals of the test with few lags; single lags before runs of lags grow
_GROWTH = 1.35  # ratio of successive runs of lags
_FARTHEST = 400  # the largest lag of past inputs
_AHEAD = 20  # the largest lead of future inputs
_TRENDS, _WAVES = 3, 4  # powers of time and cosines in a drift
# At most one direction per this number of residuals is tried.
_SAMPLES_A_DIRECTION = 8

Fault = Literal["plant", "noise", "drift", "shift", "change", "nonlinear", "feedback"]


@dataclass(frozen=True)
class ScoreTest:
    """The result of one chi-squared score test."""

    name: str  # for example recent_inputs
    fault: Fault  # the kind of fault if it fails
    statistic: float
    freedom: int
    probability: float  # probability of a statistic as large if the model is right, see `White.probability`
    lag: int | None  # the lag of inputs or residuals that explains most; None for trends
    output: int = 0  # the output (from zero) whose residuals are explained most
    source: int = 0  # the input or residual (from zero) that explains them


class Regressors(NamedTuple):
    """The regressors of a test: columns (p, N, m) for every output, and their lags if they have any."""

    name: str
    fault: Fault
    columns: Array
    lags: tuple[int, ...] = ()
    of_residuals: bool = False

    def white(self, white: White) -> Array:
        """Return regressors as columns ((N + M) p, p m) in units of the noise, each for one output alone."""
        p, samples, m = self.columns.shape
        found = np.zeros((p, m, samples, p))
        for output, own in enumerate(self.columns):
            found[output, :, :, output] = own.T
        return white.columns(found.reshape(p * m, samples, p))

    def means(self, white: White) -> Array:
        """Return the means of the scores as (p m,): nonzero if unknown starts correlate past residuals."""
        p, _, m = self.columns.shape
        if not self.of_residuals:
            return np.zeros(p * m)
        lags = list(dict.fromkeys(self.lags))
        echoes = np.zeros((p, len(lags), p, max(lags) + 1, p, p))
        each = np.einsum("io,sj->osij", white.root, np.linalg.inv(white.root))
        for number, lag in enumerate(lags):
            echoes[:, number, :, lag] = each
        return white.mean(echoes.reshape(p * m, -1, p, p))


class Score(NamedTuple):
    """The part of residuals that regressors explain beyond estimated parameters and starts."""

    statistic: float  # chi-squared where the model is right
    directions: Array  # ((N + M) p, freedom), orthonormal basis of the unexplained regressors
    sizes: Array  # (m,), scores of the single regressors, in standard deviations up to a common factor


def score(white: White, columns: Array, means: Array) -> Score:
    """Return the score of regressors ((N + M) p, m), whose scores have the means (m,) under the model."""
    norms = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    regressors = white.unexplained(columns / norms)
    scores, mean = regressors.T @ white.residuals, white.mean_left(columns / norms, means / norms)
    left, sizes, right = np.linalg.svd(regressors, full_matrices=False)
    kept, expected, along = sizes > DEPENDENT, right @ mean, right @ scores
    # Estimated parameters contribute to the mean to first order only. A contribution beyond the deviation of
    # the score is left out; if the regressors have means of their own, the score is left out as well.
    coarse = np.abs(right @ (mean - means / norms)) > np.sqrt(white.variance) * sizes
    expected[coarse] = along[coarse] if np.any(means) else 0.0
    along = (along - expected)[kept] / sizes[kept]
    return Score(
        float(np.sum(along**2)) / white.variance,
        left[:, kept],
        (scores - right.T @ expected) / np.maximum(np.linalg.norm(regressors, axis=0), DEPENDENT),
    )


def score_tests(
    records: Records, theta: Array, white: White, *, feedback: bool, robust: White | None
) -> tuple[ScoreTest, ...]:
    """Return the score tests of past inputs, past residuals and trends at the estimate theta (k,).

    `robust` is the estimate with whitened residuals, used for all regressors but past residuals.
    """
    of_inputs = past_inputs(records, theta, feedback=feedback)
    every = [*of_inputs, *past_residuals(records, white), *_drifts(records, theta)]
    found = (tested(white if one.of_residuals else robust or white, one) for one in every)
    return tuple(test for test in found if test is not None)


def tested(white: White, tried: Regressors) -> ScoreTest | None:
    """Return the test of regressors, or None if the estimate explains all of them."""
    found = score(white, tried.white(white), tried.means(white))
    freedom = found.directions.shape[1]
    if not freedom:
        return None
    output, largest = divmod(int(np.argmax(np.abs(found.sizes))), tried.columns.shape[2])
    lag = tried.lags[largest] if tried.lags else None
    # At each lag stand all inputs, or all residuals.
    source = largest % tried.lags.count(tried.lags[0]) if tried.lags else 0
    # Past residuals are white and occupy no narrow band, so that their statistic is chi-squared.
    probability = (
        float(scipy.special.chdtrc(freedom, found.statistic))
        if tried.of_residuals
        else white.probability(found.statistic, found.directions)
    )
    return ScoreTest(tried.name, tried.fault, found.statistic, freedom, probability, lag, output, source)


def failed(
    tests: Sequence[ScoreTest],
    directed: Sequence[ScoreTest] = (),
    shifts: Sequence[ScoreTest] = (),
    looks: int = 1,
) -> tuple[ScoreTest, ...]:
    """Return the tests that refute the model, each at its share of the level of its group (Bonferroni).

    Args:
        looks: number of times that the tests are repeated as data come in; they share the level as well.
    """
    groups = ((directed, "one parameter"), (tests, "many signals"), (shifts, "level shift"))
    return tuple(
        test
        for group, name in groups
        for test in group
        if test.probability * len(group) < level(name) / looks
    )


def robust_white(
    records: Records, point: Point, white: White, *, less: White, feedback: bool, more: Sequence[Array]
) -> White | None:
    """Return the estimate with whitened residuals, or None if the stated noise model is not refuted.

    A wrong plant colours residuals as well. So the part that all regressors explain is taken off before the
    noise is judged, level shifts (`less`) and `more` columns (N, p) of single parameters among them. The part
    that inputs explain is taken off before the noise is estimated.
    """

    def white_enough(judged: White) -> bool:
        tests = (tested(judged, tried) for tried in past_residuals(records, judged))
        return not failed([test for test in tests if test is not None])

    if white_enough(white) or white_enough(less):
        return None
    of_inputs = past_inputs(records, point.theta, feedback=feedback)
    single = [white.columns(np.array(more))] if more else []
    columns = np.column_stack([*(tried.white(white) for tried in of_inputs), *single])
    trend = _trend(records, point.theta).white(white)
    # Few regressors first: many would explain a part of white residuals, and so correlate the rest.
    if any(white_enough(less.without(x)) for x in (trend, columns, np.column_stack([columns, trend]))):
        return None
    return White.of(records, point, Whitening.of(white.without(columns).errors, records.lengths))


def with_linear_faults(
    records: Records, theta: Array, white: White, tests: Sequence[ScoreTest], *, feedback: bool
) -> White:
    """Return the estimate once past inputs or a trend are free to explain residuals, where tests name them.

    A lag or a drift that a model lacks looks like a nonlinear or a time-varying plant.
    """
    named = {test.name for test in failed(tests)}
    tried = [*past_inputs(records, theta, feedback=feedback), *_drifts(records, theta)]
    columns = [one.white(white) for one in tried if one.name in named]
    return white.without(np.column_stack(columns)) if columns else white


def future_tests(records: Records, theta: Array, white: White) -> tuple[ScoreTest, ...]:
    """Return for every input the test whether its future explains prediction errors.

    In open loop no input anticipates them. An input that answers the outputs, or was logged late, does.
    Whatever past inputs explain is taken off, since the past of an input predicts the input itself.
    """
    channels = records.u.shape[1] + records.y.shape[1]
    last = min(_AHEAD, max(records.samples // (_SAMPLES_A_DIRECTION * channels), 1))
    past = [tried.white(white) for tried in past_inputs(records, theta, feedback=False)]
    white, turned = white.without(np.column_stack(past)), replace(records, parts=records.parts[::-1])
    u = records.whitened(theta, records.u)[:, ::-1]
    found = []
    for j in range(u.shape[2]):
        ahead, at = _summed(turned, u[:, :, j : j + 1], _runs(1, last + 1))
        test = tested(white, Regressors(f"future of u{j + 1}", "feedback", ahead[:, ::-1], at))
        found += [] if test is None else [replace(test, source=j)]
    return tuple(found)


def past_inputs(records: Records, theta: Array, *, feedback: bool) -> list[Regressors]:
    """Return past inputs at lags of the structure, and their sums over ever longer runs of lags."""
    n, first = records.samples, int(feedback)
    u = records.whitened(theta, records.u)
    most = max(n // _SAMPLES_A_DIRECTION, 2) // u.shape[2]
    near = _runs(first, min(records.kind.recent + _FEW, most) + 1)
    older = _runs(first, min(n // 6, _FARTHEST), growth=_GROWTH)[:most]
    return [
        Regressors("recent_inputs", "plant", *_summed(records, u, near)),
        Regressors("older_inputs", "plant", *_summed(records, u, older)),
    ]


def past_residuals(records: Records, white: White) -> list[Regressors]:
    """Return two sets of past residuals, at few lags and at many."""
    n, p = records.y.shape
    most = max(max(n // _SAMPLES_A_DIRECTION, 2) // p, 1)
    few, many = (_runs(1, min(lags, most) + 1) for lags in (_FEW, _LAGS))
    own = np.repeat(white.errors[None], p, axis=0)
    return [
        Regressors("recent_residuals", "noise", *_summed(records, own, few), of_residuals=True),
        Regressors("older_residuals", "noise", *_summed(records, own, many), of_residuals=True),
    ]


def _trend(records: Records, theta: Array) -> Regressors:
    """Return the regressors of a drift: powers of time and slow cosines."""
    time = np.concatenate([np.linspace(-1.0, 1.0, length) for length in records.lengths])
    slow = [time**power for power in range(_TRENDS)]
    slow += [np.cos(0.5 * np.pi * k * (1.0 + time)) for k in range(1, _WAVES + 1)]
    return Regressors("trend", "drift", records.whitened(theta, np.stack(slow, axis=1)))


def _drifts(records: Records, theta: Array) -> list[Regressors]:
    """Return the regressors of a drift and, of a plant that is known to integrate, of a leak."""
    leaks = np.concatenate([records.kind.leaks(theta, *part) for part in records.parts], axis=1)
    leak = Regressors("leak", "drift", leaks.transpose(2, 1, 0))
    return [_trend(records, theta), *([leak] if len(leaks) else [])]


def _runs(first: int, last: int, *, growth: float = 1.0) -> list[tuple[int, int]]:
    """Return the first lag of each run, and one past its last; runs are single lags, or grow."""
    runs: list[tuple[int, int]] = []
    begin, width = first, 1.0
    while begin < last:
        end = min(begin + int(np.ceil(width)), last)
        runs.append((begin, end))
        begin, width = end, width * (growth if end > _FEW else 1.0)
    return runs


def _summed(records: Records, x: Array, runs: Sequence[tuple[int, int]]) -> tuple[Array, tuple[int, ...]]:
    """Return sums of signals x (p, N, m) over runs of lags, and the first lag of each run."""
    pieces = np.split(x, np.cumsum(records.lengths)[:-1], axis=1)
    total = np.concatenate([np.cumsum(piece, axis=1) for piece in pieces], axis=1).swapaxes(0, 1)

    def until(lag: int) -> Array:
        return shifted(total, lag, records.lengths).swapaxes(0, 1)

    parts = [until(begin) - until(end) for begin, end in runs]
    return np.concatenate(parts, axis=2), tuple(begin for begin, _ in runs for _ in range(x.shape[2]))
