"""Express an estimate in the units of its own noise, and split signals into explained and other parts.

Tests of a model compare residuals with their own noise. Where the stated model of that noise is refuted, slow
noise looks like a drift, or like a plant that is not linear: so the noise is estimated first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.kind import FADED
from inputdesign_cli.identification.polynomial_starts import noise_polynomials
from inputdesign_cli.identification.records import Point, Records, shifted
from inputdesign_cli.identification.stability import reflected
from inputdesign_cli.plant.filtering import filtered

DEPENDENT = 1e-6
"""A signal of norm one depends on others if its unexplained part is no larger."""
# Up to this relative variance of the noise power, probabilities of 0.001 change by a few per cent only.
_WELL_KNOWN = 1e-3
# A parameter is at its limit if it cannot move half of this number of standard deviations.
_ASIDE = 0.01
# Orders of C and D that are tried for the noise of residuals.
_ORDERS = ((0, 1), (1, 0), (1, 1), (0, 2), (2, 2))
# Coefficients of the filter that whitens residuals: samples needed for each, and the most that are tried.
_SAMPLES_A_COEFFICIENT, _MOST = 20, 12

Noise = tuple[Array, Array]
"""C and D, monic."""


def noises_of_residuals(errors: Array, lengths: Sequence[int]) -> list[list[Noise]]:
    """Return C and D of every output's residuals (N, p), with the fewest coefficients first.

    BIC decides between equal numbers.

    Args:
        lengths: samples of the records that follow each other; the longest determines the polynomials.
    """
    at, ranked = int(np.argmax(lengths)), []
    begin = sum(lengths[:at])
    for v in errors[begin : begin + lengths[at]].T:
        tried = []
        for c, d in _ORDERS:
            C, D = (reflected(np.append(1.0, p)) for p in noise_polynomials(v, c, d))
            power = max(float(np.mean(filtered(D, C, v) ** 2)), 1e-300)
            criterion = v.size * np.log(power) + (c + d) * np.log(v.size)
            tried.append((c + d, float(criterion), (C, D)))
        ranked.append([noise for *_, noise in sorted(tried, key=lambda one: one[:2])])
    return [list(noises) for noises in zip(*ranked, strict=True)]


@dataclass(frozen=True)
class Whitening:
    """Monic filters, one an output, that make residuals of records white; their inverses are stable."""

    filters: tuple[Array, ...]
    lengths: tuple[int, ...]

    @classmethod
    def of(cls, errors: Array, lengths: tuple[int, ...]) -> Whitening:
        """Return the filters for residuals (N, p): autoregressions by least squares, of orders by BIC."""
        most = max(min(_MOST, len(errors) // _SAMPLES_A_COEFFICIENT), 1)
        found, orders = [], np.arange(most + 1)
        for v in errors.T:
            past = np.stack([shifted(v, lag, lengths) for lag in range(1, most + 1)], axis=1)
            # The sums of squares of all orders, which are nested, follow from one triangular factor.
            triangle = np.linalg.qr(np.column_stack([past, v]))[1]
            left = np.cumsum(triangle[::-1, -1] ** 2)[::-1]
            left = np.maximum(left[: most + 1], 1e-300)
            order = int(np.argmin(v.size * np.log(left) + orders * np.log(v.size)))
            ahead = scipy.linalg.solve_triangular(triangle[:order, :order], triangle[:order, -1])
            found.append(reflected(np.append(1.0, -ahead)))
        return cls(tuple(found), lengths)

    def through(self, signals: Array) -> Array:
        """Return signals (.., N + M, p) filtered record by record; the M errors before the records stay.

        The first samples of a record, whose past is not known, are zero.
        """
        found, begin = np.array(signals), 0
        for length in self.lengths:
            own = slice(begin, begin + length)
            for i, filter in enumerate(self.filters):
                found[..., own, i] = filtered(filter, [1.0], signals[..., own, i])
                found[..., begin : begin + min(filter.size - 1, length), i] = 0.0
            begin += length
        return found

    def slopes(self, errors: Array) -> Array:
        """Return minus the derivative (m, N, p) of filtered residuals by every coefficient."""
        at = [(i, lag) for i, filter in enumerate(self.filters) for lag in range(1, filter.size)]
        found = np.zeros((len(at), *errors.shape))
        for k, (i, lag) in enumerate(at):
            found[k, :, i] = -shifted(errors[:, i], lag, self.lengths)
        return found

    def echoes(self) -> Array:
        """Return the responses (m, lags, p, p) of `slopes` to past white errors; see `Kind.echoes`."""
        samples, p = min(max(self.lengths), FADED), len(self.filters)
        alone, impulse = replace(self, lengths=(samples,)), np.eye(1, samples)[0]
        coloured = np.stack([filtered([1.0], filter, impulse) for filter in self.filters], axis=1)
        return alone.slopes(coloured)[:, :, :, None] * np.eye(p)


@dataclass(frozen=True)
class White:
    """An estimate in units of the covariance of its residuals, outputs interleaved."""

    root: Array  # R (p, p), which makes residuals white
    lengths: tuple[int, ...]  # samples of the records, N in all; M errors of noise before them follow
    residuals: Array  # ((N + M) p,)
    variance: float  # noise variance in these units: residuals lack the part that unknown starts explain
    starts: Array  # ((N + M) p, m), orthonormal directions that m unknown starts explain
    explained: Array  # ((N + M) p, m + k), these directions and the gradients by the k parameters
    basis: Array  # orthonormal basis of `explained`
    echoes: Array  # (k, lags, p, p), see `Kind.echoes`, in the units of residuals
    whitening: Whitening | None = None  # filters of residuals that are not white, estimated too

    @classmethod
    def of(cls, records: Records, point: Point, whitening: Whitening | None = None) -> White:
        """Return the estimate at a point of the search; a parameter at its limit explains nothing.

        Args:
            whitening: filters that make residuals white if the noise model is wrong. Their coefficients are
                estimated too; echoes of the parameters of that noise model then count as zero.
        """
        starts = point.directions
        errors, psi = point.all_errors, np.where(_held(records, point)[:, None, None], 0.0, point.all_psi)
        root = _root(errors, point.samples)
        if whitening is None:
            echoes = records.kind.echoes(point.theta, records.longest)
        else:
            free = starts.T.reshape(-1, *errors.shape) @ np.linalg.inv(root).T
            own = np.pad(whitening.slopes(point.errors), ((0, 0), (0, len(errors) - point.samples), (0, 0)))
            errors, free, psi = (whitening.through(x) for x in (errors, free, psi))
            echoes = whitening.echoes()
            echoes = np.concatenate([np.zeros((len(psi), *echoes.shape[1:])), echoes])
            psi, root = np.concatenate([psi, own]), _root(errors, point.samples)
            starts = _orthonormal(_scaled((free @ root.T).reshape(len(free), errors.size).T))
        explained = np.column_stack([starts, (psi @ root.T).reshape(len(psi), -1).T])
        return cls(
            root,
            records.lengths,
            (errors @ root.T).ravel(),
            point.errors.size / max(point.freedom, 1),
            starts,
            explained,
            _orthonormal(_scaled(explained)),
            root @ echoes @ np.linalg.inv(root),
            whitening,
        )

    def columns(self, signals: Array) -> Array:
        """Return signals (m, N, p) as ((N + M) p, m) in units of the residuals, zero before the records."""
        if self.whitening is not None:
            signals = self.whitening.through(signals)
        found = np.zeros((self.residuals.size, len(signals)))
        found[: signals[0].size] = (signals @ self.root.T).reshape(len(signals), -1).T
        return found

    def mean(self, echoes: Array) -> Array:
        """Return the means (m,) of the scores of signals that are made of the residuals themselves.

        Residuals are P e, with P = I - Q Q^T for the unknown starts Q, and e white. The score (T P e)^T P e
        of echoes T (m, lags, p, p) has the mean -tr(Q^T T Q), since T looks back in time and has no trace.
        Under whitening it is zero.
        """
        known = self.whitening is None and self.starts.shape[1]
        return -self.variance * _traces(echoes, self._of_starts) if known else np.zeros(len(echoes))

    @cached_property
    def _of_starts(self) -> Array:
        return self._correlations(self.starts)

    @cached_property
    def means(self) -> Array:
        """Return the means (k,) of the scores of the parameters."""
        return -self.variance * _traces(self.echoes, self._of_starts)

    def probability(self, statistic: float, directions: Array) -> float:
        """Return the probability of a sum of squares as large by chance, along orthonormal D ((N + M) p, f).

        It is chi-squared in units of the noise along these directions, whose power is estimated.
        With e(t) = epsilon(t) + T_k epsilon(t) delta theta_k the log of this power changes by
        2 tr(D^T T_k D) / f for each delta theta_k. If v is the variance of this change, the statistic over f
        is F with f and 2 / v degrees of freedom. White directions have v = 0. A narrow band where the noise
        has a zero or a pole next to the unit circle has 0.1 and more.
        """
        freedom, v = directions.shape[1], 0.0
        if np.any(self.echoes):
            slopes = 2.0 * _traces(self.echoes, self._correlations(directions)) / freedom
            v = self.variance * float(np.sum((slopes @ self.spread) ** 2))
        if v <= _WELL_KNOWN:
            return float(scipy.special.chdtrc(freedom, statistic))
        return float(scipy.special.fdtrc(freedom, 2.0 / v, statistic / freedom))

    @cached_property
    def spread(self) -> Array:
        """Return the matrix (k, (N + M) p) that maps residuals to parameters if starts are unknown."""
        scale = np.linalg.norm(self.explained, axis=0)
        inverse = np.linalg.pinv(self.explained / np.where(scale > 0.0, scale, 1.0), rcond=1e-12)
        # A parameter at its limit does not move, not even by rounding.
        inverse = np.divide(inverse, scale[:, None], out=np.zeros_like(inverse), where=scale[:, None] > 0.0)
        return inverse[len(inverse) - len(self.echoes) :]

    def _correlations(self, directions: Array) -> Array:
        """Return sum over t and directions of D(t) D(t - lag)^T within the records, (lags, p, p)."""
        outputs, ends = len(self.root), np.cumsum(self.lengths)
        signals = directions[: ends[-1] * outputs].reshape(ends[-1], outputs, -1 if directions.size else 0)
        found = np.zeros((max(self.lengths), outputs, outputs))
        for own in np.split(signals, ends[:-1]):
            lines = np.fft.rfft(own[:, :, np.any(own, axis=(0, 1))], 2 * len(own), axis=0)
            power = np.einsum("wim,wjm->wij", lines, lines.conj())
            found[: len(own)] += np.fft.irfft(power, 2 * len(own), axis=0)[: len(own)]
        return found

    def mean_left(self, columns: Array, means: Array) -> Array:
        """Return the means (m,) of scores of columns ((N + M) p, m) less the part that parameters explain."""
        if not np.any(means) and not np.any(self.means):
            return np.zeros(columns.shape[1])
        return np.asarray(means - self.means @ (self.spread @ columns))

    @property
    def errors(self) -> Array:
        """Return the residuals (N, p) in their own units."""
        samples, outputs = sum(self.lengths), len(self.root)
        return self.residuals[: samples * outputs].reshape(-1, outputs) @ np.linalg.inv(self.root).T

    def without(self, columns: Array) -> White:
        """Return the estimate if columns ((N + M) p, m) of free sizes explain residuals like starts."""
        left = _orthonormal(self.unexplained(_scaled(columns)))
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
        """Return the part of columns ((N + M) p, m) that the estimate does not explain."""
        return np.asarray(columns - self.basis @ (self.basis.T @ columns))


def _traces(echoes: Array, correlations: Array) -> Array:
    """Return tr(D^T T D) for T (m, lags, p, p) and directions with these correlations (lags, p, p)."""
    lags = min(echoes.shape[1], len(correlations))
    return np.asarray(np.tensordot(echoes[:, :lags], correlations[:lags], axes=3))


def _held(records: Records, point: Point) -> NDArray[np.bool_]:
    """Return the mask (k,) of dead times that the data push against a bound.

    There the score is not zero. If the part that this parameter explains were taken off, evidence against a
    wrong model would go with it.
    """
    held = np.zeros(point.theta.size, dtype=bool)
    variance = point.cost / point.errors.size
    for j in records.dead_times:
        size = _ASIDE * np.sqrt(variance / max(float(point.hessian[j, j]), 1e-300))
        step = size * np.sign(point.slope[j]) * (np.arange(held.size) == j)
        held[j] = abs((records.stabilised(point.theta + step) - point.theta)[j]) < 0.5 * size
    return held


def _root(errors: Array, samples: int) -> Array:
    """Return R (p, p) that makes errors (n, p) of `samples` samples uncorrelated between outputs."""
    return np.linalg.inv(np.linalg.cholesky(errors.T @ errors / samples))


def _scaled(columns: Array) -> Array:
    """Return columns (n, m) scaled to norm one, or zero."""
    return np.asarray(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300))


def _orthonormal(columns: Array) -> Array:
    """Return an orthonormal basis of columns (n, m), which had norm one before projections."""
    left, singular, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, singular > DEPENDENT])
