"""All tests of an estimate, and which of them refute its structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.adequacy import (
    ScoreTest,
    failed,
    future_tests,
    robust_white,
    score_tests,
    with_linear_faults,
)
from inputdesign_cli.identification.directed import Alternative, Directed, directed_tests
from inputdesign_cli.identification.level_shifts import LevelShift, chance_of_shifts, level_shifts
from inputdesign_cli.identification.records import Point, Records, shifted
from inputdesign_cli.identification.white import White
from inputdesign_cli.levels import level

# Samples that residual tests need.
_FEWEST_TESTED = 20
# Directions are not compared if one side has less than this share of the information on them.
_LEAST_INFORMATION = 1e-6
# Two-sided 99 % of the normal distribution: the band of a single correlation.
_BAND = 2.5758293035489004


class ResidualTest(NamedTuple):
    """A chi-squared test of residuals over several lags and all channels at once ([ljung-1999], 16.6)."""

    lags: Array  # (n,)
    # (n, p, columns), normalised, of residuals with earlier residuals or inputs.
    correlation: Array
    limit: float  # a single correlation of white noise stays within +- limit with probability 0.99
    statistic: float  # chi-squared if the model is right
    freedom: int  # its degrees of freedom
    probability: float  # a right model has a statistic at least as large with this probability

    @classmethod
    def of(cls, at: NDArray, correlation: NDArray, samples: int, statistic: float, freedom: int) -> Self:
        """Return the test of a statistic from `samples` samples at lags `at`."""
        probability, limit = float(scipy.special.chdtrc(freedom, statistic)), _BAND / np.sqrt(samples)
        return cls(at.astype(float), correlation, limit, float(statistic), freedom, probability)


def whiteness(
    errors: Array, *, lags: int = 25, fitted: int = 0, lengths: Sequence[int] | None = None
) -> ResidualTest:
    """Return the test of correlations of the residuals (samples, p) among all outputs at lags 1 .. `lags`.

    It has the portmanteau statistic of [hosking-1980], with the weights of [ljung-box-1978]. The `fitted`
    parameters of the noise model make residuals look whiter. Records of these `lengths` follow each other.
    """
    n, p = errors.shape
    at = np.arange(1, _most_lags(n, p * p, lags, fitted) + 1)
    products = np.array([errors.T @ shifted(errors, int(tau), lengths or (n,)) for tau in at])
    power = errors.T @ errors
    whitener = np.linalg.inv(np.linalg.cholesky(power))
    squares = np.sum((whitener @ products @ whitener.T) ** 2, axis=(1, 2))
    rms = np.sqrt(np.diag(power))
    statistic = n * (n + 2) * np.sum(squares / (n - at))
    return ResidualTest.of(at, products / np.outer(rms, rms), n, statistic, p * p * at.size - fitted)


def cross_correlations(
    errors: Array,
    u: Array,
    *,
    lags: int = 25,
    fitted: int = 0,
    feedback: bool = False,
    lengths: Sequence[int] | None = None,
) -> ResidualTest:
    """Return the score test of whether the past inputs u(t), u(t - 1), .. explain residuals.

    The `fitted` parameters of the plant take as many directions away. With `feedback` u(t) answers y(t), and
    the past begins with u(t - 1); for errors (samples, p) and `lengths` see `whiteness`.
    """
    (n, p), r = errors.shape, u.shape[1]
    at = np.arange(_most_lags(n, r, lags, fitted)) + int(feedback)
    past = np.stack([shifted(u, int(tau), lengths or (n,)) for tau in at], axis=1)
    left, singular, _ = np.linalg.svd(past.reshape(n, -1), full_matrices=False)
    left = left[:, singular > 1e-9 * singular[0]]
    covariance = errors.T @ errors / n
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    statistic = np.sum((left.T @ errors @ whitener.T) ** 2)
    rms = np.sqrt(np.outer(np.diag(covariance), np.mean(u**2, axis=0)))
    correlation = np.einsum("np,nlr->lpr", errors, past) / (n * rms)
    return ResidualTest.of(at, correlation, n, statistic, max(p * left.shape[1] - fitted, 1))


def _most_lags(samples: int, pairs: int, lags: int, fitted: int) -> int:
    """Return the number of lags asked for, or fewer in a short record, so that some freedom is left."""
    return max(min(lags, samples // (4 * pairs)), fitted // pairs + 1)


@dataclass(frozen=True)
class Tests:
    """All tests of an estimate against its own records."""

    whiteness: ResidualTest  # residuals with past residuals, correlations (lags, p, p)
    independence: ResidualTest  # residuals with past inputs, correlations (lags, p, r)
    scores: tuple[ScoreTest, ...]  # tests of the structure with many regressors
    directed: tuple[Directed, ...]  # tests of one additional parameter
    shift: LevelShift | None  # the likeliest shift of an output; None in too short records
    shifts: tuple[LevelShift, ...]  # all that refute the structure
    beside_shifts: tuple[ScoreTest, ...]  # `scores` with these removed
    # Whether the noise model is refuted. All tests except with past residuals then use whitened residuals.
    coloured: bool
    future: tuple[ScoreTest, ...]  # in open loop, whether the future of each input explains errors
    # (experiments,), the probability that each differs as much from the others; empty for a single one.
    alike: tuple[float, ...]

    @property
    def all(self) -> tuple[ScoreTest, ...]:
        """Return the tests of many signals, of one additional parameter, and of level shifts."""
        shifts = () if self.shift is None else (self.shift.test,)
        return (*self.scores, *(one.test for one in self.directed), *shifts)

    @property
    def answering(self) -> tuple[ScoreTest, ...]:
        """Return the tests of inputs that depend on past outputs, or are logged later than their effect."""
        return tuple(test for test in self.future if test.probability * len(self.future) < level("feedback"))

    @property
    def failed(self) -> tuple[ScoreTest, ...]:
        """Return the tests that refute the structure."""
        return self.failed_within(1)

    @property
    def shifted(self) -> tuple[LevelShift, ...]:
        """Return the shifts of outputs, unless another refutation of the structure is more significant.

        Tests of many signals that a shift upsets count with the shift removed.
        """
        directed = tuple(one.test for one in self.directed)
        others = failed(self.scores, directed)
        if not self.shifts or not others:
            return self.shifts
        # Likelihood ratios are compared with ratios, scores with scores.
        by_ratio, by_score = chance_of_shifts(self.shifts)
        compared = [(by_ratio if one.of_structure else by_score, one.test) for one in self.directed]
        # A refuted noise model does not speak against shifts, which are tested with whitened residuals.
        beside = [test for test in self.beside_shifts if not (self.coloured and test.fault == "noise")]
        alone = all(own < test.probability for own, test in compared if test in others)
        return self.shifts if alone and all(by_ratio < test.probability for test in beside) else ()

    @property
    def failed_besides(self) -> tuple[ScoreTest, ...]:
        """Return the tests that refute the structure once shifts, which upset other tests, are removed."""
        return failed(self.beside_shifts) if self.shifted else self.failed

    def failed_within(self, looks: int) -> tuple[ScoreTest, ...]:
        """Return the tests that refute the model in one of `looks` looks; a right one seldom fails in any."""
        shifts = () if self.shift is None or not self.shift.alone else (self.shift.test,)
        return failed(self.scores, tuple(one.test for one in self.directed), shifts, looks)


def tests_of(
    records: Records,
    point: Point,
    noise: Array,
    alternatives: Sequence[Alternative],
    *,
    experiments: Sequence[int],
    feedback: bool,
) -> Tests:
    """Return the tests of an estimate, the `point`, whose noise has this covariance (p, p).

    Args:
        alternatives: the parameters that might be missing.
        experiments: the samples of each experiment.
    """
    kind = records.kind
    # Unknown inputs before a record may explain its first samples, which are left out if enough remain.
    left, kept = np.concatenate([np.arange(n) >= records.late for n in records.lengths]), records.lengths
    if np.count_nonzero(left) < _FEWEST_TESTED:
        left[:] = True
    elif records.late:
        kept = tuple(n - records.late for n in records.lengths if n > records.late)
    errors, u = point.errors[left], records.u[left]
    white = White.of(records, point)
    shift, shifts, less = level_shifts(records, point, white)
    varying = [one for one in alternatives if one.fault not in ("plant", "noise")]
    columns = [one.column for one in varying]
    robust = robust_white(records, point, white, less=less, feedback=feedback, more=columns)
    if robust is not None:
        shift, shifts, less = level_shifts(records, point, robust)

    def scores(stated: White, judged: White | None) -> tuple[ScoreTest, ...]:
        return score_tests(records, point.theta, stated, feedback=feedback, robust=judged)

    found, judged = scores(white, robust), robust or white
    linear = with_linear_faults(records, point.theta, judged, found, feedback=feedback)
    parameters, groups = len(records.kind.model.names), [(judged, alternatives)]
    if linear is not judged:
        structural = [one for one in alternatives if one.fault in ("plant", "noise")]
        groups = [(judged, structural), (linear, varying)]
    directed = [one for own, group in groups for one in directed_tests(own, group, parameters)]
    return Tests(
        whiteness(errors, fitted=int(np.sum(kind.whitening)), lengths=kept),
        cross_correlations(errors, u, fitted=int(np.sum(kind.explaining)), feedback=feedback, lengths=kept),
        found,
        tuple(directed),
        shift,
        shifts,
        scores(less if robust is None else white, less) if shifts else (),
        robust is not None,
        () if feedback else future_tests(records, point.theta, judged),
        of_one_system(point, noise, experiments),
    )


def of_one_system(point: Point, noise: Array, experiments: Sequence[int]) -> tuple[float, ...]:
    """Return the probability that each experiment differs from the others as much, if all are of one system.

    It is the score test of separate parameters for one experiment ([engle-1984]), whose regressors are its
    gradients. The degrees of freedom are the number of parameters that both it and the others determine.
    The estimate is the joint one. For a single experiment the result is empty.
    """
    if len(experiments) < 2:
        return ()
    root, own = np.linalg.cholesky(np.linalg.inv(noise)).T, np.repeat(range(len(experiments)), experiments)
    errors, psi = point.errors @ root.T, point.psi @ root.T
    # Each experiment is scaled by its own noise, which may differ from that of the others.
    power = [max(float(np.mean(errors[own == i] ** 2)), 1e-300) for i in range(len(experiments))]
    scale = np.sqrt(power)[own][:, None]
    every, sizes, _ = np.linalg.svd((psi / scale).reshape(len(psi), -1).T, full_matrices=False)
    every, left = every[:, sizes > _LEAST_INFORMATION * sizes[0]], (errors / scale).ravel()
    found = []
    for i in range(len(experiments)):
        alone = np.where(np.repeat(own == i, len(root))[:, None], every, 0.0)
        directions, shares, _ = np.linalg.svd(alone - every @ (every.T @ alone), full_matrices=False)
        kept = shares**2 > _LEAST_INFORMATION
        statistic = float(np.sum((directions[:, kept].T @ left) ** 2))
        found.append(float(scipy.special.chdtrc(np.sum(kept), statistic)) if np.any(kept) else 1.0)
    return tuple(found)
