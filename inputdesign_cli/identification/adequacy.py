"""Is the model right? Score tests of what a larger model would add ([engle-1984]).

Each test regresses the residuals on signals that the model does without: past inputs, past residuals, slow
trends. What the parameters and unknown starts can explain is taken off these signals first, so that the
statistic is chi-squared whatever was estimated. Few signals find a fault of a known shape, many one of any;
`directed.py` has the fewest, one parameter more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.special
from numpy.typing import NDArray

from inputdesign_cli.identification.record_problem import Point
from inputdesign_cli.identification.records import Records, shifted
from inputdesign_cli.plant.polynomial import Array

# A right model fails some test of many signals, and some of one parameter, with at most these probabilities.
LEVEL, DIRECTED_LEVEL = 0.005, 0.015
_LAGS = 25
_FEW = 4
_GROWTH = 1.35
_FARTHEST = 400
_TRENDS, _WAVES = 3, 4
# Of each residual at most one direction in so many is tried.
_SAMPLES_A_DIRECTION = 8
_DEPENDENT = 1e-6

Fault = Literal["plant", "noise", "drift"]


@dataclass(frozen=True)
class ScoreTest:
    """One chi-squared test.

    Attributes:
        name: of the test.
        fault: what is wrong where it fails.
        probability: of a statistic as large, with so many degrees of freedom, if the model is right.
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


@dataclass(frozen=True)
class White:
    """An estimate in units of the covariance of its residuals, outputs interleaved.

    Attributes:
        root: R (p, p), which makes residuals white.
        residuals: (N p,).
        explained: (N p, m + k), what m unknown starts and the k parameters explain; `basis`, orthonormal.
    """

    root: Array
    residuals: Array
    explained: Array
    basis: Array

    @classmethod
    def of(cls, point: Point) -> White:
        """That of a point of the search."""
        root = np.linalg.inv(np.linalg.cholesky(point.errors.T @ point.errors / len(point.errors)))
        psi = (point.psi @ root.T).reshape(len(point.psi), -1).T
        explained = np.column_stack([point.near.directions, psi])
        return cls(root, (point.errors @ root.T).ravel(), explained, _orthonormal(_scaled(explained)))

    def unexplained(self, columns: Array) -> Array:
        """What the estimate leaves of columns (N p, m)."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))


def score_tests(
    records: Records, point: Point, *, recent: int, feedback: bool = False
) -> tuple[ScoreTest, ...]:
    """The tests of an estimate.

    Args:
        recent: the lag up to which the structure looks at the inputs.
        feedback: whether u(t) answers y(t); then past inputs begin with u(t - 1).
    """
    n, p = point.errors.shape
    white = White.of(point)
    tests = []
    for signals in _tried(records, point, recent, int(feedback)):
        columns = np.einsum("pnm,qp->nqpm", signals.columns, white.root).reshape(n * p, -1)
        regressors = white.unexplained(_scaled(columns))
        scores = regressors.T @ white.residuals
        scores = scores / np.maximum(np.linalg.norm(regressors, axis=0), _DEPENDENT)
        directions = _orthonormal(regressors)
        statistic, freedom = float(np.sum((directions.T @ white.residuals) ** 2)), directions.shape[1]
        if not freedom:
            continue
        output, largest = divmod(int(np.argmax(np.abs(scores))), signals.columns.shape[2])
        lag = signals.lags[largest] if signals.lags else None
        # Lag by lag all inputs, or all residuals.
        source = largest % signals.lags.count(signals.lags[0]) if signals.lags else 0
        probability = float(scipy.special.chdtrc(freedom, statistic))
        found = (signals.name, signals.fault, statistic, freedom, probability, lag, output, source)
        tests.append(ScoreTest(*found))
    return tuple(tests)


def failed(tests: Sequence[ScoreTest], directed: Sequence[ScoreTest] = ()) -> tuple[ScoreTest, ...]:
    """Those that refute the model, each at its share of the level of its group (Bonferroni)."""
    groups = ((directed, DIRECTED_LEVEL), (tests, LEVEL))
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
        _Signals("recent_residuals", "noise", *_lagged(records, own, few)),
        _Signals("older_residuals", "noise", *_lagged(records, own, many)),
    ]
    time = np.concatenate([np.linspace(-1.0, 1.0, length) for length in records.lengths])
    slow = [time**power for power in range(_TRENDS)]
    slow += [np.cos(0.5 * np.pi * k * (1.0 + time)) for k in range(1, _WAVES + 1)]
    trends = np.stack(slow, axis=1)
    return [*found, _Signals("trend", "drift", records.whitened(point.theta, trends))]


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


def _scaled(columns: Array) -> Array:
    """Columns (n, m) of norm one, or zero."""
    return np.asarray(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))


def _orthonormal(columns: Array) -> Array:
    """An orthonormal basis of what columns (n, m) span that were of norm one before others were taken off."""
    left, singular, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, singular > _DEPENDENT])
