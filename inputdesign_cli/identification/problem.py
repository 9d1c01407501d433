"""Prediction errors weighed by their own covariance: what is minimised, for many runs at once.

With S = sum e(t) e(t)^T / N the cost is N det(S)^(1/p), the sum of squares for one output. It falls with the
likelihood of Gaussian noise of unknown covariance ([ljung-1999], (7.87)-(7.96) and Section 15.2). Minus half
its gradient is sum psi(t) W e(t), half its Hessian sum psi W psi^T up to what vanishes at the minimum, with
W = cost / (p N) S^-1. Known weights are kept.

What unknown starts explain is taken off. Of the n = N p - m errors that m free unknowns leave, n log cost is
-2 log likelihood. Integrating over the starts adds a determinant to that, and an earlier estimate at a
distance q, -2 log of its density, adds q: they multiply the cost by exp(q / n); with known weights they are
added.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.records import Linearised, Records

# Errors of this power relative to the output are rounding. It is added to S, so that an output without
# noise does not hide the others.
_EXACT = 1e-20


@dataclass(frozen=True)
class Point:
    """Errors, gradient, weights W (p, p) and cost of records at theta (k,).

    Attributes:
        known: (k, k), half the Hessian of the terms of an earlier estimate and of integrating over unknown
            starts; `towards` (k,), minus half their gradient.
    """

    theta: Array
    near: Linearised
    weights: Array
    cost: float
    known: Array
    towards: Array

    @property
    def errors(self) -> Array:
        """Return the prediction errors (N, p)."""
        return self.near.errors

    @property
    def psi(self) -> NDArray[np.float64]:
        """Return psi, minus the slopes of the prediction errors, (k, N, p)."""
        return self.near.psi

    @property
    def slope(self) -> Array:
        """Return minus half the gradient (k,) of the cost."""
        near = self.near
        return np.asarray(self._weighed(near.all_psi) @ near.all_errors.ravel() + self.towards)

    @property
    def hessian(self) -> Array:
        """Return half the Hessian (k, k) of the cost, to first order."""
        every = self.near.all_psi
        return np.asarray(self._weighed(every) @ every.reshape(len(every), -1).T + self.known)

    def against(self, regressors: NDArray[np.float64]) -> Array:
        """Return `hessian` (k, k) with regressors phi (k, N, p) for one psi, and without past noise."""
        return np.asarray(self._weighed(self.psi) @ regressors.reshape(len(regressors), -1).T + self.known)

    @property
    def of_errors(self) -> Point:
        """Return the point without the terms that do not come from the errors."""
        return replace(self, known=np.zeros_like(self.known), towards=np.zeros_like(self.towards))

    def _weighed(self, psi: NDArray[np.float64]) -> Array:
        return (psi @ self.weights).reshape(len(psi), -1)


def rounding(records: Records) -> Array:
    """Return a covariance (p, p) of errors so small that they are rounding."""
    return _EXACT * np.diag(np.mean(records.y**2, axis=0))


def evaluate(records: Records, theta: Array) -> Point:
    """Return the cost of records; infinite where it overflows, zero where all errors are rounding."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        near = records.at(theta)
        S = near.all_errors.T @ near.all_errors / records.samples
    none, nowhere = np.zeros((theta.size, theta.size)), np.zeros(theta.size)
    if not all(np.all(np.isfinite(x)) for x in (S, near.psi, near.determinant, near.slope)):
        nothing = Linearised.at_rest(np.zeros(near.errors.shape), np.zeros(near.psi.shape))
        return Point(theta, nothing, np.eye(len(S)), np.inf, none, nowhere)
    floor = rounding(records)
    if np.all(np.diag(S) <= np.diag(floor)):
        return Point(theta, near, np.eye(len(S)), 0.0, none, nowhere)
    if records.weights is not None:
        cost, weights = records.samples * float(np.sum(records.weights * S)), records.weights
    else:
        costs, every = weighing((S + floor)[None], records.samples)
        cost, weights = float(costs[0]), every[0]
    return _with_known(records, Point(theta, near, weights, cost, none, nowhere))


def _with_known(records: Records, point: Point) -> Point:
    """Return a point with the terms of unknown starts and of an earlier estimate."""
    near, earlier = point.near, records.earlier
    q, towards, known = near.determinant, -near.slope, near.curvature
    if earlier is not None:
        q, towards = q + earlier.q(point.theta), towards - earlier.slope(point.theta)
        known = known + earlier.information
    if records.weights is not None:
        return replace(point, cost=point.cost + q, known=known, towards=towards)
    with np.errstate(over="ignore"):
        factor = float(np.exp(q / near.freedom))
    if not np.isfinite(factor * point.cost):
        return replace(point, cost=np.inf)
    cost = factor * point.cost
    share = cost / near.freedom
    return replace(
        point, weights=factor * point.weights, cost=cost, known=share * known, towards=share * towards
    )


@dataclass(frozen=True)
class RecordProblem:
    """The problem of fitting records of one structure, one a run; see `gauss_newton.Problem`."""

    records: tuple[Records, ...]

    @property
    def errors(self) -> int:
        """Return the number of output errors of a run."""
        return self.records[0].y.size

    def at(self, theta: Array) -> tuple[Array, NDArray[np.float64], Array]:
        """Return cost (runs,), psi^T W psi (runs, k, k) and psi^T W e (runs, k)."""
        points = [evaluate(record, row) for record, row in zip(self.records, theta, strict=True)]
        hessian = np.array([point.hessian for point in points])
        slope = np.array([point.slope for point in points])
        return np.array([point.cost for point in points]), hessian, slope

    def stabilised(self, theta: Array) -> Array:
        """Return theta (runs, k) with stable poles."""
        return np.array([self.records[0].stabilised(row) for row in theta]).reshape(theta.shape)

    def kept(self, runs: NDArray[np.bool_]) -> RecordProblem:
        """Return the same problem with some of its runs only."""
        return RecordProblem(tuple(r for r, kept in zip(self.records, runs, strict=True) if kept))


def weighing(S: NDArray[np.float64], samples: int) -> tuple[Array, NDArray[np.float64]]:
    """Return cost (runs,) and weights W (runs, p, p) of errors of the covariances S (runs, p, p)."""
    inverse, logarithm = inverses(S)
    root = np.exp(logarithm / S.shape[1])
    return samples * root, (root / S.shape[1])[:, None, None] * inverse


def inverses(covariances: NDArray[np.float64]) -> tuple[NDArray[np.float64], Array]:
    """Return the inverses of covariances (runs, p, p) and the logarithms of their determinants (runs,).

    Through correlations, since outputs may differ by orders of magnitude; a singular correlation is raised
    to rounding, and one that has overflowed has an infinite determinant.
    """
    usable = np.atleast_1d(np.isfinite(covariances).all(axis=(1, 2)))
    known = np.where(usable[:, None, None], covariances, np.eye(covariances.shape[1]))
    rms = np.sqrt(np.maximum(np.einsum("rii->ri", known), 1e-300))
    scale = rms[:, :, None] * rms[:, None, :]
    values, vectors = np.linalg.eigh(known / scale)
    values = np.maximum(values, np.finfo(float).eps)
    logarithm = np.sum(np.log(values), axis=1) + 2.0 * np.sum(np.log(rms), axis=1)
    inverse = (vectors / values[:, None, :]) @ vectors.swapaxes(1, 2) / scale
    return inverse, np.where(usable, logarithm, np.inf)
