"""Records of one system, from which a single model is estimated, and the cost that is minimised.

The records share theta. Each begins with the plant at rest, or, where the start is `free`, in a state of its
own about a level of its own; see `start.py` for what these and the noise before it can explain.

With S = sum e(t) e(t)^T / N the cost is N det(S)^(1/p), the sum of squares for one output. Its minimum is the
largest likelihood of Gaussian noise of unknown covariance ([ljung-1999], (7.87)-(7.96) and Section 15.2).
Minus half its gradient is sum psi(t) W e(t), half its Hessian sum psi W psi^T up to terms that vanish at the
minimum, with W = cost / (p N) S^-1. Known weights W stay fixed.

With m free unknowns and n = N p - m, -2 log likelihood is n log cost. Integrating over the starts adds a
determinant, and an earlier estimate adds its squared distance q, -2 log of its density. Both multiply the
cost by exp(q / n); with known weights they are added.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.identification.kind import Kind, Part
from inputdesign_cli.identification.start import FreeStarts, Start

_MOST_STARTED = 3  # records that starting points are estimated from
# Errors of this power relative to the output are rounding. It is added to S, so that an output without
# noise does not hide the others.
_EXACT = 1e-20


@dataclass(frozen=True)
class Point:
    """Prediction errors of records near theta (k,), and their cost.

    The likely values of noise before the records count as M more errors of each output.
    """

    theta: Array
    all_errors: Array  # (N + M, p), without the part that unknown starts explain
    all_psi: Array  # (k, N + M, p) = -d errors / d theta, the starts eliminated
    samples: int  # N
    directions: Array  # ((N + M) p, m) orthonormal, errors in white units that unknown starts can explain
    towards: Array  # (k,), minus half the gradient of the terms of the cost beside the errors
    known: Array  # (k, k), half the Hessian of these terms, approximately
    weights: Array  # W (p, p)
    unknowns: int = 0  # the number of unknown levels and states
    determinant: float = 0.0  # the term of -2 log likelihood due to integrating over the starts
    of_noise: float = 0.0  # its part due to noise before the records
    cost: float = np.inf

    @classmethod
    def at_rest(cls, theta: Array, errors: Array, psi: Array) -> Point:
        """Return errors and gradient without unknown starts, not yet weighted."""
        k, none, weights = theta.size, np.zeros((errors.size, 0)), np.eye(errors.shape[1])
        return cls(theta, errors, psi, len(errors), none, np.zeros(k), np.zeros((k, k)), weights)

    @property
    def errors(self) -> Array:
        """Return the prediction errors (N, p) of the records."""
        return self.all_errors[: self.samples]

    @property
    def psi(self) -> Array:
        """Return the negative gradient psi (k, N, p) of the prediction errors."""
        return self.all_psi[:, : self.samples]

    @property
    def freedom(self) -> int:
        """Return the number of errors less the number of unknown levels and states."""
        return self.errors.size - self.unknowns

    @property
    def slope(self) -> Array:
        """Return minus half the gradient (k,) of the cost."""
        return np.asarray(self._weighed @ self.all_errors.ravel() + self.towards)

    @property
    def hessian(self) -> Array:
        """Return half the Hessian (k, k) of the cost, to first order."""
        return np.asarray(self._weighed @ self.all_psi.reshape(self.theta.size, -1).T + self.known)

    @property
    def of_errors(self) -> Point:
        """Return the point without the terms that do not come from the errors."""
        return replace(self, known=np.zeros_like(self.known), towards=np.zeros_like(self.towards))

    @property
    def _weighed(self) -> Array:
        return (self.all_psi @ self.weights).reshape(self.theta.size, -1)


@dataclass(frozen=True)
class Records:
    """Records of one structure, which follow each other."""

    kind: Kind  # the structure
    parts: tuple[Part, ...]  # u (n, r), y (n, p) of each record
    free: bool = False  # whether each begins in an unknown state about an unknown level, not at rest at zero
    late: int = 0  # samples in which unknown inputs before each act, if it is free
    weights: Array | None = None  # W (p, p) of the errors; None to weigh by their own covariance
    earlier: Earlier | None = None  # an estimate from other data
    ramp: bool = False  # whether outputs of free records may drift along a line besides, of an unknown slope

    def begun_freely(self, late: int) -> Records:
        """Return the records, each begun in an unknown state after `late` samples of unknown inputs."""
        return replace(self, free=True, late=late)

    @cached_property
    def dead_times(self) -> NDArray[np.int64]:
        """Return the indices of the parameters that move dead times: there the cost has kinks."""
        return np.flatnonzero(self.kind.model.dead_times)

    @cached_property
    def u(self) -> Array:
        """Return the inputs (N, r)."""
        return np.concatenate([u for u, _ in self.parts])

    @cached_property
    def y(self) -> Array:
        """Return the outputs (N, p)."""
        return np.concatenate([y for _, y in self.parts])

    @property
    def samples(self) -> int:
        """Return the number of samples N."""
        return len(self.y)

    @cached_property
    def lengths(self) -> tuple[int, ...]:
        """Return the number of samples of each part."""
        return tuple(len(y) for _, y in self.parts)

    @cached_property
    def longest(self) -> int:
        """Return the length of the longest record, for which the effect of the past is computed."""
        return max(self.lengths)

    @cached_property
    def rounding(self) -> Array:
        """Return a covariance (p, p) below which errors count as rounding."""
        return _EXACT * np.diag(np.mean(self.y**2, axis=0))

    def from_rest(self, theta: Array) -> tuple[Array, Array]:
        """Return prediction errors (N, p) and their gradient (k, N, p) if each record began at rest."""
        found = [self.kind.errors_and_gradient(theta, *part) for part in self.parts]
        return np.concatenate([e for e, _ in found]), np.concatenate([psi for _, psi in found], axis=1)

    def at(self, theta: Array) -> Point:
        """Return prediction errors and their gradient, the unknown starts eliminated, not yet weighted."""
        errors, psi = self.from_rest(theta)
        finite = bool(np.all(np.isfinite(errors)) and np.all(np.isfinite(psi)))
        point = Point.at_rest(theta, errors, psi)
        if not (finite and (free := FreeStarts(self.lengths, self._starts(theta))).usable):
            return point
        coefficients, root, directions = free.eliminated(errors, self.weights)
        slopes = np.zeros((theta.size, len(self.lengths) * len(free.starts) + len(free.starts)))
        for k in self._moving:
            change = self._start_slope(theta, k)
            psi[k] += free.combined(coefficients, change)
            slopes[k] = 0.5 * free.slopes(change)
        psi = np.concatenate([psi, np.zeros((len(psi), free.past, errors.shape[1]))], axis=1)
        flat = (psi @ root.T).reshape(len(psi), -1)
        flat = flat - (flat @ directions) @ directions.T
        left = errors - free.combined(coefficients, free.starts)
        return replace(
            point,
            all_errors=np.concatenate([left, free.errors_of_past(coefficients)]),
            all_psi=flat.reshape(psi.shape) @ np.linalg.inv(root).T,
            directions=directions,
            towards=-slopes.sum(axis=1),
            known=slopes @ slopes.T,
            unknowns=sum(basis.free for *_, basis in free.bases),
            determinant=free.determinant,
            of_noise=sum(basis.of_noise for *_, basis in free.bases),
        )

    def gradient(self, theta: Array, index: int) -> Array:
        """Return minus the derivative (N, p) of the errors by a parameter; past noise stays as estimated."""
        errors, every = self.from_rest(theta)
        starts, psi = FreeStarts(self.lengths, self._starts(theta)), every[index]
        if index not in self._moving or not (starts.past and starts.usable):
            return psi
        coefficients, _, _ = starts.eliminated(errors, self.weights)
        for own, start in zip(coefficients, starts.starts, strict=True):
            own[:, : len(start.free)] = 0.0
        return psi + starts.combined(coefficients, self._start_slope(theta, index))

    @property
    def _moving(self) -> list[int]:
        """Return the indices of the parameters on which the starts depend."""
        return np.flatnonzero(self.kind.in_starts(self.late, free=self.free)).tolist()

    def _starts(self, theta: Array) -> tuple[Start, ...]:
        starts = self.kind.starts(theta, self.longest, self.late, free=self.free)
        if not (self.ramp and self.free):
            return starts
        line = np.linspace(-1.0, 1.0, self.longest)[:, None]
        return tuple(
            start._replace(
                free=np.concatenate([start.free, own.T]),
                disturbance=np.concatenate([start.disturbance, line.T]),
            )
            for start, own in zip(starts, self.kind.whitened(theta, line), strict=True)
        )

    def _start_slope(self, theta: Array, index: int) -> tuple[Start, ...]:
        """Return the derivative of the starts by a parameter, by central differences."""
        size = float(self.kind.start_steps(theta, self.longest)[index])
        step = size * np.eye(theta.size)[index]
        ends = zip(self._starts(theta + step), self._starts(theta - step), strict=True)
        return tuple(
            Start(*(np.subtract(a, b) / (2.0 * size) for a, b in zip(*pair, strict=True))) for pair in ends
        )

    def whitened(self, theta: Array, signals: Array) -> Array:
        """Return signals filtered by the inverse noise models, (p, N, m); see `Kind`."""
        pieces = np.split(signals, np.cumsum(self.lengths)[:-1])
        return np.concatenate([self.kind.whitened(theta, x) for x in pieces], axis=1)

    def stabilised(self, theta: Array) -> Array:
        """Return theta, changed where its predictor would be unstable."""
        return self.kind.stabilised(theta, self.longest)


def shifted(x: Array, lag: int, lengths: Sequence[int]) -> Array:
    """Return x(t - lag) along the first axis; zero before each part begins."""
    out = np.zeros_like(x)
    begin = 0
    for length in lengths:
        keep = max(length - lag, 0)
        out[begin + length - keep : begin + length] = x[begin : begin + keep]
        begin += length
    return out


def split(u: Array, y: Array, lengths: Sequence[int] | None) -> list[Part]:
    """Return the signals of each record; `lengths` None stands for a single record."""
    at = np.cumsum(lengths or [len(y)])[:-1]
    return list(zip(np.split(u, at), np.split(y, at), strict=True))


def longest(parts: Sequence[Part]) -> list[Part]:
    """Return the longest records, for starting points: at most three, of similar lengths."""
    ranked = sorted(parts, key=lambda part: -len(part[1]))[:_MOST_STARTED]
    return [part for part in ranked if 2 * len(part[1]) >= len(ranked[0][1])]


def centred(parts: Sequence[Part]) -> list[Part]:
    """Return the records without their means."""
    return [(u - u.mean(axis=0), y - y.mean(axis=0)) for u, y in parts]


def evaluate(records: Records, theta: Array) -> Point:
    """Return errors and cost of records at theta: infinite on overflow, zero if errors are rounding."""
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        near = records.at(theta)
        S = near.all_errors.T @ near.all_errors / records.samples
    if not all(np.all(np.isfinite(x)) for x in (S, near.psi, near.determinant, near.towards)):
        return Point.at_rest(theta, np.zeros(near.errors.shape), np.zeros(near.psi.shape))
    if np.all(np.diag(S) <= np.diag(records.rounding)):
        return replace(near.of_errors, cost=0.0)
    q, towards, known, earlier = near.determinant, near.towards, near.known, records.earlier
    if earlier is not None:
        q, towards = q + earlier.q(theta), towards - earlier.slope(theta)
        known = known + earlier.information
    if records.weights is not None:
        cost = records.samples * float(np.sum(records.weights * S)) + q
        return replace(near, weights=records.weights, cost=cost, known=known, towards=towards)
    costs, every = weighing((S + records.rounding)[None], records.samples)
    with np.errstate(over="ignore"):
        factor = float(np.exp(q / near.freedom))
    cost = factor * float(costs[0])
    if not np.isfinite(cost):
        return replace(near.of_errors, weights=every[0])
    share = cost / near.freedom
    known, towards = share * known, share * towards
    return replace(near, weights=factor * every[0], cost=cost, known=known, towards=towards)


@dataclass(frozen=True)
class RecordProblem:
    """The problem of fitting records of one structure, one a run; see `gauss_newton.Problem`."""

    records: tuple[Records, ...]

    @property
    def errors(self) -> int:
        """Return the number of output errors of a run."""
        return self.records[0].y.size

    def at(self, theta: Array) -> tuple[Array, Array, Array]:
        """Return cost (runs,), psi^T W psi (runs, k, k) and psi^T W e (runs, k)."""
        points = [evaluate(record, row) for record, row in zip(self.records, theta, strict=True)]
        hessian = np.array([point.hessian for point in points])
        slope = np.array([point.slope for point in points])
        return np.array([point.cost for point in points]), hessian, slope

    def stabilised(self, theta: Array) -> Array:
        """Return theta (runs, k) with stable poles."""
        return np.array([self.records[0].stabilised(row) for row in theta]).reshape(theta.shape)

    def concluded(self, theta: Array) -> tuple[Array, Array]:
        """Return the covariance (runs, p, p) of e and the information (runs, k, k) at theta (runs, k)."""
        points = [evaluate(record, row) for record, row in zip(self.records, theta, strict=True)]
        noise = [noise_of(*each) for each in zip(self.records, points, strict=True)]
        information = [information_of(*each) for each in zip(self.records, points, noise, strict=True)]
        return np.array(noise), np.array(information)

    def kept(self, runs: NDArray[np.bool_]) -> RecordProblem:
        """Return the same problem with some of its runs only."""
        return RecordProblem(tuple(r for r, kept in zip(self.records, runs, strict=True) if kept))


def noise_of(records: Records, point: Point) -> Array:
    """Return the covariance (p, p) of e, corrected for the parameters of every output and unknown starts."""
    samples, outputs = point.errors.shape
    own = shares(np.any(records.from_rest(point.theta)[1], axis=1))
    left = np.sqrt(np.maximum(samples - own - point.unknowns / outputs, 1.0))
    every = point.all_errors
    return np.asarray(every.T @ every / np.outer(left, left))


def information_of(records: Records, point: Point, noise: Array) -> Array:
    """Return the information matrix (k, k): the sum over the samples of psi noise^-1 psi^T."""
    return replace(point.of_errors, weights=weights_of(records, noise)).hessian


def weights_of(records: Records, noise: Array) -> Array:
    """Return the weights W (p, p): the inverse covariance of the noise, with rounding added."""
    return inverses((noise + records.rounding)[None])[0][0]


def shares(acting: NDArray[np.bool_]) -> Array:
    """Return the number of parameters of each output (p,); one `acting` (k, p) at n outputs counts as 1/n."""
    return np.asarray(np.sum(acting / np.maximum(np.sum(acting, axis=1, keepdims=True), 1), axis=0))


def weighing(S: Array, samples: int) -> tuple[Array, Array]:
    """Return cost (runs,) and weights W (runs, p, p) of errors with covariances S (runs, p, p)."""
    inverse, logarithm = inverses(S)
    root = np.exp(logarithm / S.shape[1])
    return samples * root, (root / S.shape[1])[:, None, None] * inverse


def inverses(covariances: Array) -> tuple[Array, Array]:
    """Return the inverses of covariances (runs, p, p) and the logarithms of their determinants (runs,).

    They follow from correlations, since outputs may differ by orders of magnitude. Eigenvalues of zero are
    raised to rounding. A covariance that has overflowed has an infinite determinant.
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
