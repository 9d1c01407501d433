"""Estimates of a model, whatever its kind, and how far to trust them: of one record, and of many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import SpecError
from inputdesign_cli.identification.adequacy import ScoreTest, failed, future_tests, robust_white, score_tests
from inputdesign_cli.identification.checks import check_apart, check_noisy, factor_of_data, fit_percent
from inputdesign_cli.identification.directed import Alternative, Directed, directed_tests
from inputdesign_cli.identification.level_shifts import LevelShift, chance_of_shifts, level_shifts
from inputdesign_cli.identification.one_system import of_one_system
from inputdesign_cli.identification.problem import inverses
from inputdesign_cli.identification.record_problem import Point, rounding
from inputdesign_cli.identification.records import Records
from inputdesign_cli.identification.repeated import Repetition, repetition
from inputdesign_cli.identification.residual_tests import ResidualTest, cross_correlations, whiteness
from inputdesign_cli.identification.rivals import Rival
from inputdesign_cli.identification.search import Search
from inputdesign_cli.identification.white import Echoes, White
from inputdesign_cli.information.coordinates import triangular_factor
from inputdesign_cli.levels import level

# Samples that residual tests need.
_FEWEST_TESTED = 20
# Parameters this share apart are the same to rounding.
_LAST_DIGITS = 8.0 * float(np.finfo(float).eps)


@dataclass(frozen=True)
class Estimate:
    """A prediction-error estimate of a model with p outputs, r inputs and k parameters.

    Attributes:
        names, theta: (k,).
        factor: L (k, k), lower triangular; L L^T is the `information`, its inverse the `covariance` of theta.
        noise: (p, p) covariance of e; of white noise on the samples where the model knows no other.
        errors: (samples, p) prediction errors at theta.
        converged: whether the search settled; `steps` that it took, from the best of `starts`.
        fit: output by output, per cent of the rms of y (its mean taken off) that the model's simulation
            explains; None if the model is unstable and cannot be simulated.
        simulated: (samples, p), what the inputs and the start of each record cause in the model.
        free: whether unknown starts and levels were estimated along with theta.
        rest_refuted: whether the records say that they do not begin at rest about zero.
        first: (records, p), the first residuals if each record began at rest about zero.
        agreement: the probability that an earlier estimate, which is combined with the data, differs as
            much; None without one.
        likeness: the probability that one from other data agrees as closely; None without one.
        lengths: the samples of each of the records, which follow each other.
        rivals: other minima that explain the data nearly as well.
        alike: of several experiments, the probability that each differs as much from the others.
        repeated: where errors repeat, as for samples that are given twice.
        whiteness, independence: of the residuals, and of residuals and past inputs, all channels at once;
            their correlations are (lags, p, p) and (lags, p, r).
        tests: of the structure, and `directed` of one additional parameter; `failed` are the ones that
            refute it.
        shift: where an output most likely shifts, whatever the inputs do; None in too short records.
        shifts: all that refute the structure; `beside_shifts`, `tests` once they are taken off.
        coloured: whether the noise has more structure than its model; all tests except of past residuals are
            then made with whitened residuals.
        future: in open loop, whether the future of each input explains errors.
    """

    names: tuple[str, ...]
    theta: Array
    factor: Array
    noise: Array
    errors: Array
    converged: bool
    steps: int
    starts: int
    fit: tuple[float | None, ...]
    simulated: Array
    free: bool
    rest_refuted: bool
    first: Array
    agreement: float | None
    likeness: float | None
    lengths: tuple[int, ...]
    whiteness: ResidualTest
    independence: ResidualTest
    tests: tuple[ScoreTest, ...]
    directed: tuple[Directed, ...]
    shift: LevelShift | None
    shifts: tuple[LevelShift, ...]
    beside_shifts: tuple[ScoreTest, ...]
    coloured: bool
    future: tuple[ScoreTest, ...]
    alike: tuple[float, ...]
    rivals: tuple[Rival, ...]
    repeated: Repetition | None

    @cached_property
    def information(self) -> Array:
        """Return the information matrix (k, k)."""
        return self.factor @ self.factor.T

    @cached_property
    def covariance(self) -> Array:
        """(k, k), by way of the factor: the information itself may be singular to rounding."""
        half = scipy.linalg.solve_triangular(self.factor, np.eye(len(self.factor)), lower=True)
        return np.asarray(half.T @ half)

    @property
    def all_tests(self) -> tuple[ScoreTest, ...]:
        """Return the tests of many signals, of one additional parameter, and of level shifts."""
        shifts = () if self.shift is None else (self.shift.test,)
        return (*self.tests, *(one.test for one in self.directed), *shifts)

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
        others = failed(self.tests, directed)
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
        return failed(self.tests, tuple(one.test for one in self.directed), shifts, looks)


@dataclass(frozen=True)
class BatchEstimate:
    """Prediction-error estimates of many records.

    Attributes:
        theta: (runs, k).
        noise: (runs, p, p) covariance of e, unbiased to first order.
        information: (runs, k, k) sum over the samples of psi noise^-1 psi^T; its inverse is the covariance of
            theta.
        converged, steps: (runs,) of the search.
    """

    theta: Array
    noise: NDArray[np.float64]
    information: NDArray[np.float64]
    converged: NDArray[np.bool_]
    steps: NDArray[np.int64]


def _not_explained(records: Records) -> tuple[NDArray[np.bool_], tuple[int, ...]]:
    """(N,): the samples that unknown inputs before each record do not explain whatever they are, and lengths.

    All of them, where too few are left to be tested.
    """
    left = np.concatenate([np.arange(n) >= records.late for n in records.lengths])
    if np.count_nonzero(left) < _FEWEST_TESTED:
        return np.ones_like(left), records.lengths
    return left, tuple(n - records.late for n in records.lengths if n > records.late)


def concluded(
    names: tuple[str, ...],
    found: Search,
    y: Array,
    simulated: Array,
    stable: Sequence[bool],
    *,
    own: Array,
    in_noise: int,
    in_plant: int,
    recent: int,
    alternatives: Sequence[Alternative],
    experiments: Sequence[int],
    feedback: bool,
    echoes: Echoes | None,
) -> Estimate:
    """Return the estimate with its covariance and the tests of its residuals.

    Args:
        names: (k,).
        found: where the search ended.
        y: (samples, p), the outputs as measured.
        simulated: (samples, p), see `Estimate`; `stable`: which outputs can be simulated.
        own: (p,) how many parameters each output has; shared ones count in parts.
        in_noise: number of parameters that make residuals look whiter, in A, C and D.
        in_plant: number of parameters that take directions of past inputs away, in B and F.
        recent: the lag up to which the structure looks at the inputs.
        alternatives: the parameters that might be missing.
        experiments: the samples of each experiment.
        feedback: whether u(t) depends on y(t).
        echoes: what past errors add to the gradients of parameters.

    Raises:
        SpecError: `noise-free-data` or `not-exciting`.
    """
    records, point = found.records, found.point
    noise = noise_of(point, own)
    check_noisy(np.diag(noise), records.y)
    check_apart(noise)
    if records.weights is not None:
        noise = np.asarray(np.linalg.inv(records.weights), dtype=float)
    lengths, earlier = records.lengths, records.earlier
    factor = factor_at(names, records, point, noise)
    left, kept = _not_explained(records)
    white = White.of(records, point, echoes)

    shift, shifts, less = level_shifts(records, point, white)
    varying = [one.column for one in alternatives if not one.of_structure]
    robust = robust_white(
        records, point, white, less=less, recent=recent, feedback=feedback, echoes=echoes, more=varying
    )

    def tested(stated: White, judged: White | None) -> tuple[ScoreTest, ...]:
        return score_tests(
            records, point, stated, recent=recent, feedback=feedback, echoes=echoes, robust=judged
        )

    if robust is not None:
        shift, shifts, less = level_shifts(records, point, robust)
    return Estimate(
        names=names,
        theta=np.asarray(point.theta, dtype=float),
        factor=_over_minima(names, found, factor, noise),
        noise=noise,
        errors=point.errors,
        converged=found.converged,
        steps=found.steps,
        starts=found.starts,
        fit=tuple(
            fit_percent(measured, explained, lengths) if runs else None
            for measured, explained, runs in zip(y.T, simulated.T, stable, strict=True)
        ),
        simulated=simulated,
        free=records.free,
        rest_refuted=found.rest_refuted,
        first=found.first,
        agreement=None if earlier is None else earlier.agreement(point.theta, factor),
        likeness=None if earlier is None else earlier.likeness(point.theta, factor),
        lengths=lengths,
        whiteness=whiteness(point.errors[left], fitted=in_noise, lengths=kept),
        independence=cross_correlations(
            point.errors[left], records.u[left], fitted=in_plant, feedback=feedback, lengths=kept
        ),
        tests=tested(white, robust),
        directed=directed_tests(
            robust or white, alternatives, len(names), echoes if robust is None else None
        ),
        shift=shift,
        shifts=shifts,
        beside_shifts=tested(less if robust is None else white, less) if shifts else (),
        coloured=robust is not None,
        future=() if feedback else future_tests(records, point.theta, robust or white, recent, echoes),
        alike=of_one_system(point, noise, experiments),
        rivals=found.rivals,
        repeated=repetition(point.errors, records.u, feedback=feedback),
    )


def noise_of(point: Point, own: Array) -> Array:
    """(p, p) covariance of e: the parameters `own` (p,) of every output count, and unknown starts."""
    samples, outputs = point.errors.shape
    left = np.sqrt(np.maximum(samples - own - point.near.unknowns / outputs, 1.0))
    every = point.near.all_errors
    return np.asarray(every.T @ every / np.outer(left, left))


def factor_at(names: tuple[str, ...], records: Records, point: Point, noise: Array) -> Array:
    """Return the information of records about the parameters, in factors.

    Raises:
        SpecError: `not-exciting`.
    """
    return factor_of_data(names, point.theta, *_gradients(records, point, noise))


def _over_minima(names: tuple[str, ...], found: Search, factor: Array, noise: Array) -> Array:
    """Return the information where minima beyond sampling instants are about as likely: of their mixture.

    Each has the weight of its likelihood times the square root of the determinant of its covariance
    (Laplace's method, [tierney-kadane-1986]); the covariance is that of the mixture about the estimate.

    Args:
        factor: L (k, k) of the best minimum alone, its information L L^T.
    """
    logarithms, spreads = [0.0], [np.eye(len(factor))]
    for point, excess in found.beside:
        try:
            own = factor_at(names, found.records, point, noise)
        except SpecError:  # what determines nothing there has no covariance to count
            continue
        # In units of the best minimum's own deviations.
        half = scipy.linalg.solve_triangular(own, factor, lower=True)
        away = factor.T @ (point.theta - found.point.theta)
        spreads.append(half.T @ half + np.outer(away, away))
        smaller = np.sum(np.log(np.abs(np.diag(factor)))) - np.sum(np.log(np.abs(np.diag(own))))
        logarithms.append(float(smaller - 0.5 * excess))
    if len(logarithms) == 1:
        return factor
    weights = np.exp(np.array(logarithms) - max(logarithms))
    mixture = np.tensordot(weights, spreads, 1) / np.sum(weights)
    rows = scipy.linalg.solve_triangular(np.linalg.cholesky(mixture), factor.T, lower=True)
    return triangular_factor(rows)[0]


def _gradients(records: Records, point: Point, noise: Array) -> tuple[Array, Array]:
    """psi ((N + M) p, k) in units of the noise, and the same at parameters that differ in their last digits.

    What is known besides the data counts as further rows.
    """
    root = np.linalg.cholesky(_weights(records, noise)).T
    last = _LAST_DIGITS * np.resize([1.0, -1.0], point.theta.size)
    found = [point.near.all_psi, records.at(point.theta * (1.0 + last)).all_psi]
    rows, again = ((psi @ root.T).reshape(len(psi), -1).T for psi in found)
    if records.earlier is None:
        return rows, again
    known = records.earlier.rows
    return np.concatenate([rows, known]), np.concatenate([again, known])


def information_of(records: Records, point: Point, noise: Array) -> Array:
    """(k, k): sum over the samples of psi noise^-1 psi^T."""
    return replace(point.of_errors, weights=_weights(records, noise)).hessian


def _weights(records: Records, noise: Array) -> Array:
    """Return W (p, p), the inverse of the noise, which may be no more than rounding."""
    return inverses((noise + rounding(records))[None])[0][0]
