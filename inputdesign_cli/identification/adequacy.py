"""Is the model right? Score tests of what a larger model would add ([engle-1984]).

Each test regresses the residuals on signals that the model does without: past inputs, past residuals, slow
trends. What the parameters and unknown starts can explain is taken off these signals first, so that the
statistic is chi-squared whatever was estimated. Past residuals lack what was estimated as well: where unknown
starts are many, as those of a record with gaps, that alone correlates residuals, and it is what scores are
compared with. In a narrow band the noise is known no better than its model there, and a statistic follows F
instead ([satterthwaite-1946]). Few signals find a fault of a known shape, many one of any; `directed.py` has
the fewest, one parameter more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.record_problem import Point
from inputdesign_cli.identification.records import Records, shifted
from inputdesign_cli.identification.white import DEPENDENT, Echoes, White

# A right model fails some test of many signals, some of one parameter, and that of level shifts, with at most
# these probabilities.
LEVEL, DIRECTED_LEVEL, SHIFT_LEVEL = 0.005, 0.015, 0.001
_LAGS = 25
_FEW = 4
_GROWTH = 1.35
_FARTHEST = 400
_TRENDS, _WAVES = 3, 4
# Of each residual at most one direction in so many is tried.
_SAMPLES_A_DIRECTION = 8

Fault = Literal["plant", "noise", "drift", "shift", "change", "nonlinear"]


@dataclass(frozen=True)
class ScoreTest:
    """One chi-squared test.

    Attributes:
        name: of the test.
        fault: what is wrong where it fails.
        probability: of a statistic as large, with so many degrees of freedom, if the model is right; see
            `White.probability`.
        lag: of past inputs or residuals, where they explain most; of trends None.
        output: of which residuals are explained most; `source`, by which input or other residual.
    """

    name: str
    fault: Fault
    statistic: float
    freedom: int
    probability: float
    lag: int | None
    output: int = 0
    source: int = 0


@dataclass(frozen=True)
class _Signals:
    """What is tried: columns (N, m) for every output, and their lags if they have any."""

    name: str
    fault: Fault
    columns: NDArray[np.float64]  # (p, N, m)
    lags: tuple[int, ...] = ()
    of_residuals: bool = False


def score_tests(
    records: Records,
    point: Point,
    white: White,
    *,
    recent: int,
    feedback: bool = False,
    echoes: Echoes | None = None,
) -> tuple[ScoreTest, ...]:
    """The tests of an estimate.

    Args:
        white: the estimate in the units of its noise.
        echoes: what past errors add to the gradients of parameters, where they add anything; None where that
            is not known: then scores are compared with zero.
        recent: the lag up to which the structure looks at the inputs.
        feedback: whether u(t) answers y(t); then past inputs begin with u(t - 1).
    """
    tests = []
    for signals in _tried(records, point, recent, int(feedback)):
        columns = white.columns(_of_outputs(signals.columns))
        norms = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        regressors = white.unexplained(columns / norms)
        own = np.zeros(norms.size)
        if signals.of_residuals and echoes is not None:
            own = _mean_scores(records, white, signals.lags)
        scores = regressors.T @ white.residuals - white.mean_left(columns / norms, own / norms)
        left, sizes, right = np.linalg.svd(regressors, full_matrices=False)
        kept = sizes > DEPENDENT
        freedom = int(np.sum(kept))
        if not freedom:
            continue
        along = (right[kept] @ scores) / sizes[kept]
        statistic = float(np.sum(along**2)) / white.variance
        scores = scores / np.maximum(np.linalg.norm(regressors, axis=0), DEPENDENT)
        output, largest = divmod(int(np.argmax(np.abs(scores))), signals.columns.shape[2])
        lag = signals.lags[largest] if signals.lags else None
        # Lag by lag all inputs, or all residuals.
        source = largest % signals.lags.count(signals.lags[0]) if signals.lags else 0
        # What past residuals explain has no band of its own.
        probability = (
            float(scipy.special.chdtrc(freedom, statistic))
            if signals.of_residuals
            else white.probability(statistic, left[:, kept])
        )
        found = (signals.name, signals.fault, statistic, freedom, probability, lag, output, source)
        tests.append(ScoreTest(*found))
    return tuple(tests)


def failed(
    tests: Sequence[ScoreTest],
    directed: Sequence[ScoreTest] = (),
    shifts: Sequence[ScoreTest] = (),
    looks: int = 1,
) -> tuple[ScoreTest, ...]:
    """Those that refute the model, each at its share of the level of its group (Bonferroni).

    Args:
        looks: how often they are asked as data come in; the looks share the level as well.
    """
    groups = ((directed, DIRECTED_LEVEL / looks), (tests, LEVEL / looks), (shifts, SHIFT_LEVEL / looks))
    return tuple(test for group, level in groups for test in group if test.probability * len(group) < level)


def _tried(records: Records, point: Point, recent: int, first: int) -> list[_Signals]:
    n, p = point.errors.shape
    u = records.whitened(point.theta, records.u)
    most = max(n // _SAMPLES_A_DIRECTION, 2)
    near = tuple(range(first, min(recent + _FEW, most // u.shape[2]) + 1))
    bins = _bins(first, min(n // 6, _FARTHEST), most // u.shape[2])
    few, many = (tuple(range(1, min(lags, max(most // p, 1)) + 1)) for lags in (_FEW, _LAGS))
    own = np.repeat(point.errors[None], p, axis=0)
    found = [
        _Signals("recent_inputs", "plant", *_lagged(records, u, near)),
        _Signals("older_inputs", "plant", *_summed(records, u, bins)),
        _Signals("recent_residuals", "noise", *_lagged(records, own, few), of_residuals=True),
        _Signals("older_residuals", "noise", *_lagged(records, own, many), of_residuals=True),
    ]
    time = np.concatenate([np.linspace(-1.0, 1.0, length) for length in records.lengths])
    slow = [time**power for power in range(_TRENDS)]
    slow += [np.cos(0.5 * np.pi * k * (1.0 + time)) for k in range(1, _WAVES + 1)]
    trends = np.stack(slow, axis=1)
    return [*found, _Signals("trend", "drift", records.whitened(point.theta, trends))]


def _of_outputs(signals: NDArray[np.float64]) -> NDArray[np.float64]:
    """(p m, N, p): signals (p, N, m), each of its output and zero of the others."""
    p, samples, m = signals.shape
    found = np.zeros((p, m, samples, p))
    for output, own in enumerate(signals):
        found[output, :, :, output] = own.T
    return found.reshape(p * m, samples, p)


def _mean_scores(records: Records, white: White, lags: Sequence[int]) -> Array:
    """(p lags,): see `White.echoes`, of the residuals of every output at every lag, for every output."""
    p = len(white.root)
    starts = white.starts.reshape(white.residuals.size // p, p, -1)[: white.samples]
    here = np.einsum("nqm,qp->nmp", starts, white.root)
    there = np.einsum("nqm,qp->nmp", starts, np.linalg.inv(white.root).T)
    each = [
        -white.variance * np.einsum("nmp,nms->ps", here, shifted(there, lag, records.lengths))
        for lag in dict.fromkeys(lags)
    ]
    return np.stack(each, axis=1).reshape(-1)


def _lagged(
    records: Records, x: NDArray[np.float64], lags: Sequence[int]
) -> tuple[NDArray[np.float64], tuple[int, ...]]:
    """Signals x (p, N, m) at every lag, (p, N, lags m), and the lag of each."""
    parts = [shifted(x.swapaxes(0, 1), lag, records.lengths).swapaxes(0, 1) for lag in lags]
    return np.concatenate(parts, axis=2), tuple(lag for lag in lags for _ in range(x.shape[2]))


def _bins(first: int, last: int, most: int) -> list[tuple[int, int]]:
    """Lags from `first` on, one by one and then in ever longer runs: first and one past the last."""
    bins: list[tuple[int, int]] = []
    begin, width = first, 1.0
    while begin < last and len(bins) < most:
        end = min(begin + int(np.ceil(width)), last)
        bins.append((begin, end))
        begin, width = end, width * (_GROWTH if end > _FEW else 1.0)
    return bins


def _summed(
    records: Records, x: NDArray[np.float64], bins: Sequence[tuple[int, int]]
) -> tuple[NDArray[np.float64], tuple[int, ...]]:
    """The same of sums over runs of lags."""
    pieces = np.split(x, np.cumsum(records.lengths)[:-1], axis=1)
    total = np.concatenate([np.cumsum(piece, axis=1) for piece in pieces], axis=1).swapaxes(0, 1)

    def until(lag: int) -> NDArray[np.float64]:
        return shifted(total, lag, records.lengths).swapaxes(0, 1)

    parts = [until(begin) - until(end) for begin, end in bins]
    return np.concatenate(parts, axis=2), tuple(begin for begin, _ in bins for _ in range(x.shape[2]))
