"""Express an estimate in the units of its own noise, and split signals into explained and other parts."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.kind import Echo, Echoes
from inputdesign_cli.identification.noise_first import Whitening
from inputdesign_cli.identification.problem import Point
from inputdesign_cli.identification.records import Records

DEPENDENT = 1e-6
"""Signals of norm one of which less is left depend on the others."""
# A relative variance of the noise so small changes probabilities of 0.001 by a few per cent of themselves.
_WELL_KNOWN = 1e-3
# A parameter is at its limit if it cannot move half of this number of standard deviations.
_ASIDE = 0.01


@dataclass(frozen=True)
class White:
    """An estimate in units of the covariance of its residuals, outputs interleaved.

    Attributes:
        root: R (p, p), which makes residuals white.
        samples: N of them; errors of noise before the records, M of every output, follow.
        residuals: ((N + M) p,).
        variance: of the noise, in these units: residuals lack what unknown starts explain.
        starts: ((N + M) p, m), orthonormal, what m unknown starts explain.
        explained: ((N + M) p, m + k), what they and the k parameters explain; `basis`, orthonormal.
        means: (k,), of the scores of the parameters, see `echoes`.
        known: what past errors add to the gradients of parameters of the noise, if that is known.
        whitening: filters of residuals that are not white; their coefficients come after the k parameters.
    """

    root: Array
    samples: int
    residuals: Array
    variance: float
    starts: Array
    explained: Array
    basis: Array
    means: Array
    known: Echoes | None
    whitening: Whitening | None = None

    @classmethod
    def of(cls, records: Records, point: Point, whitening: Whitening | None = None) -> White:
        """Return that of a point of the search; a parameter that stands at its limit explains nothing.

        Args:
            whitening: filters that make residuals white whose noise model is wrong. Their coefficients are
                estimated along; of the parameters of that noise model nothing is known then.
        """
        near, echoes = point.near, records.kind.echoes(point.theta, records.lengths)
        errors, psi = near.all_errors, np.where(_held(records, point)[:, None, None], 0.0, near.all_psi)
        starts = near.directions
        if whitening is not None:
            root = _root(errors, len(near.errors))
            free = starts.T.reshape(-1, *errors.shape) @ np.linalg.inv(root).T
            own = np.pad(whitening.slopes(near.errors), ((0, 0), (0, len(near.past)), (0, 0)))
            errors, free, psi = (whitening.through(x) for x in (errors, free, psi))
            psi = np.concatenate([psi, own])
        root = _root(errors, len(near.errors))
        if whitening is not None:
            starts = _orthonormal(_scaled((free @ root.T).reshape(len(free), errors.size).T))
            echoes = [(point.theta.size + k, echo) for k, echo in enumerate(whitening.echoes())]
        explained = np.column_stack([starts, (psi @ root.T).reshape(len(psi), -1).T])
        none = np.zeros(len(psi))
        found = cls(
            root,
            len(near.errors),
            (errors @ root.T).ravel(),
            near.errors.size / max(near.freedom, 1),
            starts,
            explained,
            _orthonormal(_scaled(explained)),
            none,
            echoes,
            whitening,
        )
        for index, through in echoes or ():
            none[index] = found.echoes(through)
        return found

    @property
    def foreseen(self) -> bool:
        """Return whether the means of scores of residuals are known; otherwise they are taken for zero."""
        return self.whitening is None and self.known is not None

    def columns(self, signals: NDArray[np.float64]) -> Array:
        """((N + M) p, m): signals (m, N, p) in units of the residuals, zero before the records."""
        if self.whitening is not None:
            signals = self.whitening.through(signals)
        found = np.zeros((self.residuals.size, len(signals)))
        found[: signals[0].size] = (signals @ self.root.T).reshape(len(signals), -1).T
        return found

    def echoes(self, through: Echo) -> float:
        """Return the mean of the score of a signal that is made of the residuals themselves.

        Of residuals P e, with P = I - Q Q^T for the unknown starts Q and e white, the score (T P e)^T P e has
        the mean -tr(Q^T T Q), for T, which looks back in time, has no trace.

        Args:
            through: T, of errors (N, p).
        """
        return -self.variance * self._trace(through, self.starts)

    def probability(self, statistic: float, directions: Array) -> float:
        """That of a sum of squares as large along f directions ((N + M) p, f), orthonormal, if all is noise.

        It is chi-squared in units of the noise along these directions, and what is known of that is the
        estimate. With e(t) = epsilon(t) + T_k epsilon(t) delta theta_k the log of its power changes by
        2 tr(D^T T_k D) / f for each delta theta_k; of the variance v that this has, the statistic over f is F
        with f and 2 / v degrees of freedom. White directions have v = 0, a narrow band where the noise has a
        zero or a pole next to the unit circle has 0.1 and more.
        """
        freedom = directions.shape[1]
        slopes = np.zeros(self.means.size)
        for index, through in self.known or ():
            slopes[index] = 2.0 * self._trace(through, directions) / freedom
        deviations = slopes @ self._spread
        v = self.variance * float(deviations @ deviations)
        if v <= _WELL_KNOWN:
            return float(scipy.special.chdtrc(freedom, statistic))
        return float(scipy.special.fdtrc(freedom, 2.0 / v, statistic / freedom))

    @cached_property
    def _spread(self) -> Array:
        """(k, (N + M) p): by it and the residuals' variance parameters are spread, starts being unknown."""
        scale = np.maximum(np.linalg.norm(self.explained, axis=0), 1e-300)
        inverse = np.linalg.pinv(self.explained / scale, rcond=1e-12) / scale[:, None]
        return np.asarray(inverse[len(inverse) - self.means.size :])

    def _trace(self, through: Echo, directions: Array) -> float:
        """tr(D^T T D) of directions ((N + M) p, n), for T of errors (N, p)."""
        outputs, back = len(self.root), np.linalg.inv(self.root).T
        found = 0.0
        for direction in directions[: self.samples * outputs].T:
            own = direction.reshape(-1, outputs)
            found += float(np.sum((through(own @ back) @ self.root.T) * own))
        return found

    def mean_left(self, columns: Array, means: Array) -> Array:
        """Return the means of scores of columns (N p, m) once what parameters explain is taken off, (m,)."""
        if not np.any(means) and not np.any(self.means):
            return np.zeros(columns.shape[1])
        scale = np.maximum(np.linalg.norm(self.explained, axis=0), 1e-300)
        shares = np.linalg.lstsq(self.explained / scale, columns, rcond=1e-12)[0] / scale[:, None]
        return np.asarray(means - self.means @ shares[-self.means.size :])

    @property
    def errors(self) -> Array:
        """Return the residuals in their own units, (N, p)."""
        outputs = len(self.root)
        return self.residuals[: self.samples * outputs].reshape(-1, outputs) @ np.linalg.inv(self.root).T

    def without(self, columns: Array) -> White:
        """Return the estimate where columns ((N + M) p, m) of free sizes explain residuals like starts."""
        left, sizes, _ = np.linalg.svd(self.unexplained(_scaled(columns)), full_matrices=False)
        left = left[:, sizes > DEPENDENT]
        freedom = self.residuals.size / self.variance
        return replace(
            self,
            residuals=self.residuals - left @ (left.T @ self.residuals),
            variance=self.residuals.size / max(freedom - left.shape[1], 1.0),
            starts=np.column_stack([self.starts, left]),
            explained=np.column_stack([left, self.explained]),
            basis=np.column_stack([self.basis, left]),
        )

    def unexplained(self, columns: Array) -> Array:
        """Return the part of columns (N p, m) that the estimate does not explain."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))


def _held(records: Records, point: Point) -> NDArray[np.bool_]:
    """Return the mask (k,) of dead times that the samples push against a bound.

    There the score is not zero. If the part that this parameter explains were taken off, evidence against a
    wrong model would go with it.
    """
    held = np.zeros(point.theta.size, dtype=bool)
    variance = point.cost / point.errors.size
    for j in records.dead_times:
        step = np.zeros(held.size)
        step[j] = (
            _ASIDE * np.sqrt(variance / max(float(point.hessian[j, j]), 1e-300)) * np.sign(point.slope[j])
        )
        moved = records.stabilised(point.theta + step)[j] - point.theta[j]
        held[j] = abs(moved) < 0.5 * abs(step[j])
    return held


def _root(errors: Array, samples: int) -> Array:
    """Return R (p, p) that makes errors (n, p) of `samples` samples white in space."""
    return np.linalg.inv(np.linalg.cholesky(errors.T @ errors / samples))


def _scaled(columns: Array) -> Array:
    """Columns (n, m) of norm one, or zero."""
    return np.asarray(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))


def _orthonormal(columns: Array) -> Array:
    """Return an orthonormal basis of columns (n, m), of norm one before others were taken off."""
    left, singular, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, singular > DEPENDENT])
