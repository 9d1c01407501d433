"""Estimates of a model, whatever its kind, and how far to trust them: of one record, and of many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import SpecError
from inputdesign_cli.identification.checks import check_noisy, factor_of_data
from inputdesign_cli.identification.directed import alternative
from inputdesign_cli.identification.records import Point, Records, inverses, shares
from inputdesign_cli.identification.search import Rival, Search
from inputdesign_cli.identification.tests import Tests, tests_of
from inputdesign_cli.identification.variations import variations
from inputdesign_cli.information.coordinates import triangular_factor

# Parameters this share apart are the same to rounding.
_LAST_DIGITS = 8.0 * float(np.finfo(float).eps)


class Ended(NamedTuple):
    """How a search ended: whether it settled, after `steps` from the best of `starts`, and other minima."""

    converged: bool
    steps: int
    starts: int
    rivals: tuple[Rival, ...]


class Begun(NamedTuple):
    """How the records begin."""

    free: bool  # whether unknown starts and levels were estimated along with theta
    rest_refuted: bool  # whether the records say that they do not begin at rest about zero
    first: Array  # (records, p), the first residuals if each record began at rest about zero


class Simulation(NamedTuple):
    """What the inputs and the start of each record cause in the model, `outputs` (samples, p).

    Attributes:
        fit: output by output, per cent of the rms of y (its mean taken off) that it explains; None if the
            model is unstable and cannot be simulated.
    """

    outputs: Array
    fit: tuple[float | None, ...]


class Agreement(NamedTuple):
    """How an earlier estimate, which is combined with the data, goes with them."""

    differing: float  # the probability that two estimates of one system differ as much
    alike: float  # the probability that one from other data agrees as closely


@dataclass(frozen=True)
class Estimate:
    """A prediction-error estimate of a model with p outputs, r inputs and k parameters.

    Attributes:
        names, theta: (k,).
        factor: L (k, k), lower triangular; L L^T is the `information`, its inverse the `covariance` of theta.
    """

    names: tuple[str, ...]
    theta: Array
    factor: Array
    noise: Array  # (p, p) covariance of e; of white noise on the samples where the model knows no other
    errors: Array  # (samples, p) prediction errors at theta
    lengths: tuple[int, ...]  # the samples of each of the records, which follow each other
    search: Ended
    start: Begun
    simulation: Simulation
    prior: Agreement | None  # None without an earlier estimate
    tests: Tests

    def with_rivals(self, rivals: tuple[Rival, ...]) -> Estimate:
        """Return the estimate with other rivals."""
        return replace(self, search=self.search._replace(rivals=rivals))

    @cached_property
    def information(self) -> Array:
        """Return the information matrix (k, k)."""
        return self.factor @ self.factor.T

    @cached_property
    def covariance(self) -> Array:
        """(k, k), by way of the factor: the information itself may be singular to rounding."""
        half = scipy.linalg.solve_triangular(self.factor, np.eye(len(self.factor)), lower=True)
        return np.asarray(half.T @ half)


@dataclass(frozen=True)
class BatchEstimate:
    """Prediction-error estimates of many records.

    Attributes:
        information: (runs, k, k) sum over the samples of psi noise^-1 psi^T; its inverse is the covariance of
            theta.
        converged, steps: (runs,) of the search.
    """

    theta: Array  # (runs, k)
    noise: NDArray[np.float64]  # (runs, p, p) covariance of e, unbiased to first order
    information: NDArray[np.float64]
    converged: NDArray[np.bool_]
    steps: NDArray[np.int64]


def concluded(found: Search, y: Array, *, experiments: Sequence[int], feedback: bool) -> Estimate:
    """Return the estimate with its covariance and the tests of its residuals.

    Args:
        found: where the search ended.
        y: (samples, p), the outputs as measured.
        experiments: the samples of each experiment.
        feedback: whether u(t) depends on y(t).

    Raises:
        SpecError: `noise-free-data` or `not-exciting`.
    """
    records, point, kind, theta = found.records, found.point, found.records.kind, found.point.theta
    noise = noise_of(records, point)
    check_noisy(noise, records.y)
    factor, earlier = factor_at(records, point, noise), records.earlier
    simulation = _simulation(records, point, y)
    known = None if kind.continuous or None in simulation.fit else simulation.outputs
    larger = [alternative(one, records) for one in kind.extensions(theta, feedback=feedback)]
    alternatives = [*larger, *variations(records, theta, known)]
    prior = None
    if earlier is not None:
        prior = Agreement(earlier.agreement(theta, factor), earlier.likeness(theta, factor))
    return Estimate(
        kind.names,
        np.asarray(theta, dtype=float),
        _over_minima(found, factor, noise),
        noise,
        point.errors,
        records.lengths,
        Ended(found.converged, found.steps, found.starts, found.rivals),
        Begun(records.free, found.rest_refuted, found.first),
        simulation,
        prior,
        tests_of(records, point, noise, alternatives, experiments=experiments, feedback=feedback),
    )


def _simulation(records: Records, point: Point, y: Array) -> Simulation:
    """Return the simulation of the inputs, and the part that unknown starts explain."""
    kind, lengths = records.kind, records.lengths
    model, every = kind.model.at(point.theta), records.from_rest(point.theta)[0] - point.near.begun
    with np.errstate(over="ignore", invalid="ignore"):  # outputs of an unstable plant are not shown
        noise = [
            model.simulate(0.0 * u, e, 1.0)[1]
            for (u, _), e in zip(records.parts, np.split(every, np.cumsum(lengths)[:-1]), strict=True)
        ]
    outputs = y - np.concatenate(noise)
    varying = np.concatenate([own - own.mean(axis=0) for own in np.split(y, np.cumsum(lengths)[:-1])])
    with np.errstate(over="ignore", invalid="ignore"):  # of unstable outputs
        left = np.linalg.norm(y - outputs, axis=0) / np.linalg.norm(varying, axis=0)
    able = kind.simulates(point.theta)
    fit = (float(100.0 * (1.0 - x)) if runs else None for x, runs in zip(left, able, strict=True))
    return Simulation(outputs, tuple(fit))


def noise_of(records: Records, point: Point) -> Array:
    """(p, p) covariance of e: the parameters of every output count, and unknown starts."""
    samples, outputs = point.errors.shape
    own = shares(np.any(records.from_rest(point.theta)[1], axis=1))
    left = np.sqrt(np.maximum(samples - own - point.near.unknowns / outputs, 1.0))
    every = point.near.all_errors
    return np.asarray(every.T @ every / np.outer(left, left))


def factor_at(records: Records, point: Point, noise: Array) -> Array:
    """Return the information of records about the parameters, in factors.

    Raises:
        SpecError: `not-exciting`.
    """
    # What is known besides the data counts as further rows.
    known = np.zeros((0, point.theta.size)) if records.earlier is None else records.earlier.rows
    root = np.linalg.cholesky(_weights(records, noise)).T
    last = _LAST_DIGITS * np.resize([1.0, -1.0], point.theta.size)
    rows, again = (
        np.concatenate([(psi @ root.T).reshape(len(psi), -1).T, known])
        for psi in (point.near.all_psi, records.at(point.theta * (1.0 + last)).all_psi)
    )
    return factor_of_data(records.kind.names, point.theta, rows, again)


def _over_minima(found: Search, factor: Array, noise: Array) -> Array:
    """Return the information where minima beyond sampling instants are about as likely: of their mixture.

    Each has the weight of its likelihood times the square root of the determinant of its covariance
    (Laplace's method, [tierney-kadane-1986]); the covariance is that of the mixture about the estimate.

    Args:
        factor: L (k, k) of the best minimum alone, its information L L^T.
    """
    logarithms, spreads = [0.0], [np.eye(len(factor))]
    for point, excess in found.beside:
        try:
            own = factor_at(found.records, point, noise)
        except SpecError:  # what determines nothing there has no covariance to count
            continue
        # In units of the best minimum's own deviations.
        half = scipy.linalg.solve_triangular(own, factor, lower=True)
        away = factor.T @ (point.theta - found.point.theta)
        spreads.append(half.T @ half + np.outer(away, away))
        smaller = np.sum(np.log(np.abs(np.diag(factor) / np.diag(own))))
        logarithms.append(float(smaller - 0.5 * excess))
    if len(logarithms) == 1:
        return factor
    weights = np.exp(np.array(logarithms) - max(logarithms))
    mixture = np.tensordot(weights, spreads, 1) / np.sum(weights)
    rows = scipy.linalg.solve_triangular(np.linalg.cholesky(mixture), factor.T, lower=True)
    return triangular_factor(rows)[0]


def information_of(records: Records, point: Point, noise: Array) -> Array:
    """Return sum over the samples of psi noise^-1 psi^T, (k, k)."""
    return replace(point.of_errors, weights=_weights(records, noise)).hessian


def _weights(records: Records, noise: Array) -> Array:
    """Return W (p, p), the inverse of the noise, which may be no more than rounding."""
    return inverses((noise + records.rounding)[None])[0][0]
