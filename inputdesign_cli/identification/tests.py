"""All tests of an estimate, and which of them refute its structure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.adequacy import ScoreTest, failed, future_tests, robust_white, score_tests
from inputdesign_cli.identification.directed import Alternative, Directed, directed_tests
from inputdesign_cli.identification.level_shifts import LevelShift, chance_of_shifts, level_shifts
from inputdesign_cli.identification.records import Point, Records
from inputdesign_cli.identification.residual_tests import ResidualTest, cross_correlations, whiteness
from inputdesign_cli.identification.white import White
from inputdesign_cli.levels import level

# Samples that residual tests need.
_FEWEST_TESTED = 20
# Directions of which one experiment has less than this share of the information are the others' alone.
_OF_ONE_SIDE = 1e-6


@dataclass(frozen=True)
class Tests:
    """Tests of an estimate against its own records.

    Attributes:
        whiteness, independence: of the residuals, and of residuals and past inputs, all channels at once;
            their correlations are (lags, p, p) and (lags, p, r).
        scores: of the structure, and `directed` of one additional parameter.
        shift: where an output most likely shifts, whatever the inputs do; None in too short records.
        shifts: all that refute the structure; `beside_shifts`, `scores` once they are taken off.
        coloured: whether the noise has more structure than its model; all tests except of past residuals are
            then made with whitened residuals.
        future: in open loop, whether the future of each input explains errors.
        alike: of several experiments, the probability that each differs as much from the others.
    """

    whiteness: ResidualTest
    independence: ResidualTest
    scores: tuple[ScoreTest, ...]
    directed: tuple[Directed, ...]
    shift: LevelShift | None
    shifts: tuple[LevelShift, ...]
    beside_shifts: tuple[ScoreTest, ...]
    coloured: bool
    future: tuple[ScoreTest, ...]
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
        # Likelihood ratios are compared with one, scores with the other.
        by_ratio, by_score = chance_of_shifts(self.shifts)
        of_structure = {one.test for one in self.directed if one.of_structure}
        # Where the noise is refuted, that says nothing of shifts: they are tested with white residuals.
        beside = [test for test in self.beside_shifts if not (self.coloured and test.fault == "noise")]
        compared = [(by_ratio, test) for test in beside]
        compared += [
            (by_ratio if test in of_structure else by_score, test) for test in directed if test in others
        ]
        return self.shifts if all(own < test.probability for own, test in compared) else ()

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
    """Return the tests of an estimate.

    Args:
        point: the estimate.
        noise: (p, p), the covariance of e.
        alternatives: the parameters that might be missing.
        experiments: the samples of each experiment.
        feedback: whether u(t) depends on y(t).
    """
    kind = records.kind
    left, kept = _not_explained(records)
    errors, u = point.errors[left], records.u[left]
    white = White.of(records, point)
    shift, shifts, less = level_shifts(records, point, white)
    varying = [one.column for one in alternatives if one.fault not in ("plant", "noise")]
    robust = robust_white(records, point, white, less=less, feedback=feedback, more=varying)
    if robust is not None:
        shift, shifts, less = level_shifts(records, point, robust)

    def scores(stated: White, judged: White | None) -> tuple[ScoreTest, ...]:
        return score_tests(records, point.theta, stated, feedback=feedback, robust=judged)

    return Tests(
        whiteness(errors, fitted=int(np.sum(kind.whitening)), lengths=kept),
        cross_correlations(errors, u, fitted=int(np.sum(kind.explaining)), feedback=feedback, lengths=kept),
        scores(white, robust),
        directed_tests(robust or white, alternatives, records.size),
        shift,
        shifts,
        scores(less if robust is None else white, less) if shifts else (),
        robust is not None,
        () if feedback else future_tests(records, point.theta, robust or white),
        of_one_system(point, noise, experiments),
    )


def _not_explained(records: Records) -> tuple[NDArray[np.bool_], tuple[int, ...]]:
    """(N,): the samples that unknown inputs before each record do not explain whatever they are, and lengths.

    All of them, where too few are left to be tested.
    """
    left = np.concatenate([np.arange(n) >= records.late for n in records.lengths])
    if np.count_nonzero(left) < _FEWEST_TESTED:
        return np.ones_like(left), records.lengths
    return left, tuple(n - records.late for n in records.lengths if n > records.late)


def of_one_system(point: Point, noise: Array, experiments: Sequence[int]) -> tuple[float, ...]:
    """Return the probability that each experiment differs from the others as much, if all are of one system.

    It is the score test of parameters of its own ([engle-1984]): regressors are the gradients, in this
    experiment alone. It has as many degrees of freedom as both it and the others determine parameters.

    Args:
        point: the joint estimate.
        noise: (p, p), the covariance of e.
        experiments: the samples of each; of a single one nothing is said.
    """
    if len(experiments) < 2:
        return ()
    root, own = np.linalg.cholesky(np.linalg.inv(noise)).T, np.repeat(range(len(experiments)), experiments)
    errors, psi = point.errors @ root.T, point.psi @ root.T
    # Of each by its own noise, which need not be that of the others.
    power = [max(float(np.mean(errors[own == i] ** 2)), 1e-300) for i in range(len(experiments))]
    scale = np.sqrt(power)[own][:, None]
    every, sizes, _ = np.linalg.svd((psi / scale).reshape(len(psi), -1).T, full_matrices=False)
    every, left = every[:, sizes > _OF_ONE_SIDE * sizes[0]], (errors / scale).ravel()
    found = []
    for i in range(len(experiments)):
        alone = np.where(np.repeat(own == i, len(root))[:, None], every, 0.0)
        directions, shares, _ = np.linalg.svd(alone - every @ (every.T @ alone), full_matrices=False)
        kept = shares**2 > _OF_ONE_SIDE
        statistic = float(np.sum((directions[:, kept].T @ left) ** 2))
        found.append(float(scipy.special.chdtrc(np.sum(kept), statistic)) if np.any(kept) else 1.0)
    return tuple(found)
