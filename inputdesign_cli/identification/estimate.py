"""Estimates of a model, whatever its kind, and how far to trust them: of one record, and of many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.identification.adequacy import ScoreTest, failed, score_tests
from inputdesign_cli.identification.checks import check_apart, check_noisy, covariance_of, fit_percent
from inputdesign_cli.identification.problem import inverses
from inputdesign_cli.identification.record_problem import Point, rounding
from inputdesign_cli.identification.records import Records
from inputdesign_cli.identification.residual_tests import ResidualTest, cross_correlations, whiteness
from inputdesign_cli.identification.search import Search
from inputdesign_cli.plant.polynomial import Array


@dataclass(frozen=True)
class Estimate:
    """A prediction-error estimate of a model with p outputs, r inputs and k parameters.

    Attributes:
        names, theta: (k,).
        covariance, information: (k, k) of theta; they are inverse to each other.
        noise: (p, p) covariance of e; of white noise on the samples where the model knows no other.
        errors: (samples, p) prediction errors at theta.
        converged: whether the search settled; `steps` that it took, from the best of `starts`.
        fit: output by output, per cent of the rms of y (its mean taken off) that the model's simulation
            explains; None where the model is unstable and cannot be simulated.
        simulated: (samples, p), what the inputs and the start of each record cause in the model.
        free: whether unknown starts and levels were estimated along with theta.
        first: (records, p), the first residuals if each record began at rest about zero.
        lengths: the samples of each of the records, which follow each other.
        whiteness, independence: of the residuals, and of residuals and past inputs, all channels at once;
            their correlations are (lags, p, p) and (lags, p, r).
        tests: of the structure; `failed` tells which of them refute it.
    """

    names: tuple[str, ...]
    theta: Array
    covariance: Array
    information: Array
    noise: Array
    errors: Array
    converged: bool
    steps: int
    starts: int
    fit: tuple[float | None, ...]
    simulated: Array
    free: bool
    first: Array
    lengths: tuple[int, ...]
    whiteness: ResidualTest
    independence: ResidualTest
    tests: tuple[ScoreTest, ...]

    @property
    def failed(self) -> tuple[ScoreTest, ...]:
        """The tests that refute the structure."""
        return failed(self.tests)


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
    feedback: bool,
) -> Estimate:
    """The estimate with its covariance and the tests of its residuals.

    Args:
        names: (k,).
        found: where the search ended.
        y: (samples, p), the outputs as measured.
        simulated: (samples, p), see `Estimate`; `stable` tells which of the outputs can be simulated.
        own: (p,) how many parameters each output has; shared ones count in parts.
        in_noise: number of parameters that make residuals look whiter: those of A, C and D.
        in_plant: number of parameters that take directions of past inputs away: those of B and F.
        recent: the lag up to which the structure looks at the inputs.
        feedback: whether u(t) answers y(t).

    Raises:
        SpecError: `noise-free-data` or `not-exciting`.
    """
    records, point = found.records, found.point
    noise = noise_of(point, own)
    check_noisy(np.diag(noise), records.y)
    check_apart(noise)
    if records.weights is not None:
        noise = np.asarray(np.linalg.inv(records.weights), dtype=float)
    information = information_of(records, point, noise)
    lengths = records.lengths
    return Estimate(
        names=names,
        theta=np.asarray(point.theta, dtype=float),
        covariance=covariance_of(names, information),
        information=information,
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
        first=found.first,
        lengths=lengths,
        whiteness=whiteness(point.errors, fitted=in_noise, lengths=lengths),
        independence=cross_correlations(
            point.errors, records.u, fitted=in_plant, feedback=feedback, lengths=lengths
        ),
        tests=score_tests(records, point, recent=recent, feedback=feedback),
    )


def noise_of(point: Point, own: Array) -> Array:
    """(p, p) covariance of e: the parameters `own` (p,) of every output count, and unknown starts."""
    samples, outputs = point.errors.shape
    left = np.sqrt(np.maximum(samples - own - point.near.directions.shape[1] / outputs, 1.0))
    return np.asarray(point.errors.T @ point.errors / np.outer(left, left))


def information_of(records: Records, point: Point, noise: Array) -> Array:
    """(k, k): sum over the samples of psi noise^-1 psi^T."""
    return replace(point, weights=inverses((noise + rounding(records))[None])[0][0]).hessian
