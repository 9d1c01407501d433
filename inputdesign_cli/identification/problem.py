"""Prediction errors of all outputs, weighed: what a search minimises, for many runs at once.

With weights W (p, p) the cost is the sum over the samples of epsilon^T W epsilon. Without, it is
N det(S / N)^(1/p), S the sum of epsilon epsilon^T, which with one output is S itself. Its minimiser is that
of the cost with the inverse covariance of its own residuals, the maximum-likelihood estimate for Gaussian
noise of unknown covariance ([ljung-1999], (7.87)-(7.96) and Section 15.2). Its gradient is that of the
weighted cost at W = N det(S / N)^(1/p) S^-1 / p, and so is its Hessian up to what vanishes at the minimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.orders import OutputOrders
from inputdesign_cli.identification.predictor import block_length, stream
from inputdesign_cli.identification.stability import is_stable, reflected, without_integrators


@dataclass(frozen=True)
class Sums:
    """Sums of products of residuals and gradients over the samples, for each run.

    epsilon epsilon^T (runs, p, p), psi epsilon^T (runs, m, p) and psi psi^T (runs, m, m), psi the gradients
    of one output after the other, m in all.
    """

    errors: NDArray[np.float64]
    slopes: NDArray[np.float64]
    products: NDArray[np.float64]


@dataclass(frozen=True)
class PredictionErrors:
    """The problem of fitting `rows` to records.

    Attributes:
        rows: one an output.
        places: of each row, where its parameters stand in theta (k,); outputs may share some.
        u, y: signals (samples, runs), one an input and one an output.
        weights: W (p, p), or None to weigh by the residuals' own covariance.
    """

    rows: tuple[OutputOrders, ...]
    places: tuple[NDArray[np.int64], ...]
    u: tuple[Array, ...]
    y: tuple[Array, ...]
    weights: Array | None = None

    @classmethod
    def single(cls, row: OutputOrders, u: Sequence[Array], y: Array) -> PredictionErrors:
        """Return the problem of one output alone: the sum of squared prediction errors."""
        return cls((row,), (np.arange(row.size),), tuple(u), (y,))

    def repeated(self, starts: int) -> PredictionErrors:
        """Return the record, (samples, 1) signals, repeated for a search from several starts."""
        u, y = (tuple(np.repeat(x, starts, axis=1) for x in signals) for signals in (self.u, self.y))
        return replace(self, u=u, y=y)

    @cached_property
    def size(self) -> int:
        """Return the number of parameters k."""
        return 1 + max(int(place.max(initial=-1)) for place in self.places)

    @property
    def errors(self) -> int:
        """Return the number of prediction errors of a run."""
        return len(self.y) * self.y[0].shape[0]

    def kept(self, runs: NDArray[np.bool_]) -> PredictionErrors:
        """Return the problem with some of the runs only."""
        u, y = (tuple(x[:, runs] for x in signals) for signals in (self.u, self.y))
        return replace(self, u=u, y=y)

    def stabilised(self, theta: Array) -> Array:
        """Return theta (runs, k) with the roots of C, D and F mirrored into the unit circle if they leave it.

        Roots of F that are exactly one belong to integrators, and stay.
        """
        theta = theta.copy()
        for letter, columns in self._monic:
            monic = np.concatenate([np.ones((theta.shape[0], 1)), theta[:, columns]], axis=1)
            for run in np.flatnonzero(~is_stable(monic)):
                moving = without_integrators(monic[run]) if letter == "f" else monic[run]
                if not is_stable(moving[None])[0]:
                    theta[run, columns] = reflected(monic[run])[1:]
        return theta

    def at(self, theta: Array) -> tuple[Array, NDArray[np.float64], Array]:
        """Cost (runs,), psi^T W psi (runs, k, k) and psi^T W epsilon (runs, k); overflow costs infinity."""
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            sums = self.sums(theta)
            cost, weights = self._weighed(sums.errors)
            hessian, slope = self.gathered(sums, weights)
        finite = np.isfinite(cost) & np.isfinite(hessian).all(axis=(1, 2)) & np.isfinite(slope).all(axis=1)
        if not np.all(finite):
            cost, hessian[~finite], slope[~finite] = np.where(finite, cost, np.inf), np.eye(self.size), 0.0
        return cost, hessian, slope

    def sums(self, theta: Array) -> Sums:
        """Return the sums from which the cost and its derivatives are computed."""
        p, m = len(self.rows), len(self._owner)
        samples, runs = self.y[0].shape
        own = [theta[:, place] for place in self.places]
        order = max(row.polynomials(t).order for row, t in zip(self.rows, own, strict=True))
        length = block_length(samples, runs, order)
        flows = [stream(row, t, self.u, y, length) for row, t, y in zip(self.rows, own, self.y, strict=True)]
        found, slopes, products = np.zeros((p, p, runs)), np.zeros((m, p, runs)), np.zeros((m, m, runs))
        for parts in zip(*flows, strict=True):
            errors = [part[1] for part in parts]
            columns = [column for part in parts for column in part[2]]
            for i, left in enumerate(errors):
                for j, right in enumerate(errors[: i + 1]):
                    found[i, j] += _dot(left, right)
            for i, left in enumerate(columns):
                for j, right in enumerate(errors):
                    slopes[i, j] += _dot(left, right)
                for j, right in enumerate(columns[: i + 1]):
                    products[i, j] += _dot(left, right)
        return Sums(_whole(found), np.ascontiguousarray(np.moveaxis(slopes, -1, 0)), _whole(products))

    def gathered(self, sums: Sums, weights: NDArray[np.float64]) -> tuple[NDArray[np.float64], Array]:
        """Return psi^T W psi (runs, k, k) and psi^T W epsilon (runs, k) for weights (runs, p, p)."""
        owner, spread = self._owner, self._spread
        products = sums.products * weights[:, owner[:, None], owner[None, :]]
        slopes = np.sum(sums.slopes * weights[:, owner, :], axis=2)
        return spread.T @ products @ spread, slopes @ spread

    def _weighed(self, errors: NDArray[np.float64]) -> tuple[Array, NDArray[np.float64]]:
        """Return cost (runs,) and the weights (runs, p, p) of its derivatives."""
        p = len(self.rows)
        if self.weights is not None:
            weights = np.broadcast_to(self.weights, errors.shape)
            return np.sum(weights * errors, axis=(1, 2)), weights
        if p == 1:  # the sum of squares, whose derivatives are not weighed
            return errors[:, 0, 0], np.ones_like(errors)
        samples = self.y[0].shape[0]
        inverse, logarithm = inverses(errors / samples)
        cost = samples * np.exp(logarithm / p)
        return cost, (cost / (p * samples))[:, None, None] * inverse

    @cached_property
    def _owner(self) -> NDArray[np.int64]:
        """(m,): the output that each gradient is of."""
        return np.repeat(np.arange(len(self.rows)), [row.size for row in self.rows])

    @cached_property
    def _spread(self) -> Array:
        """(m, k): which parameter each gradient is with respect to."""
        return np.eye(self.size)[np.concatenate(self.places)]

    @cached_property
    def _monic(self) -> tuple[tuple[str, NDArray[np.int64]], ...]:
        """Return the letters of C, D and F, and where the coefficients of each stand in theta."""
        found = {
            (letter, tuple(place[block.columns].tolist()))
            for row, place in zip(self.rows, self.places, strict=True)
            for letter in "cdf"
            for block in row.by_letter[letter]
            if block.lags
        }
        return tuple((letter, np.array(columns)) for letter, columns in sorted(found))


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


def _dot(left: Array, right: Array) -> Array:
    return np.einsum("tr,tr->r", left, right)


def _whole(lower: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return symmetric matrices (runs, m, m) from their lower triangles (m, m, runs)."""
    moved = np.ascontiguousarray(np.moveaxis(lower, -1, 0))
    return moved + np.swapaxes(np.tril(moved, -1), 1, 2)
