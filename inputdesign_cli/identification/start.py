"""Describe the unknown past of records, and take off what it can explain of prediction errors.

Level and states at the start are unknown numbers. The noise before a record is as random as the noise in it:
the later effect of stationary noise C/D e has a covariance that C and D determine ([ljung-1999], Section
10.5; [brockwell-davis-1991], Chapter 8). Both are eliminated for every theta (variable projection,
[golub-pereyra-1973]).

The likelihood is the restricted one, [harville-1977]: unknowns are integrated over, which adds a determinant.
Without it a noise model with a zero on the unit circle, which forgets no start, would explain short records
too well. Responses to free unknowns before the inverse of the noise model are made orthonormal first, so that
the measure does not depend on the parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.plant.filtering import filtered

# Roots are moved inside by this share, since some may be known to lie on the circle. There noise has no
# stationary start, and its zeros have no density.
_INSIDE = 1e-5
# Directions of the unknown starts below this size, columns scaled, are linearly dependent.
_DEPENDENT = 1e-7
_MOST_ROUNDS = 30


class Start(NamedTuple):
    """The effect of the past on the N prediction errors of one output; each row belongs to one unknown."""

    free: Array  # (m, N), due to the level and states, of which nothing is known
    disturbance: Array  # (m, N), `free` before the inverse of the noise model
    noise: Array  # (n, N), due to independent unknowns with the variance of e
    zeros: Array  # -2 log of a density of the zeros of the noise model, see `density`; a scalar

    @classmethod
    def white(cls, free: Array) -> Start:
        """Return the start under white noise, which has no past."""
        return cls(free, free, np.zeros((0, free.shape[1])), np.zeros(()))

    def through(self, C: Array, D: Array) -> Start:
        """Return the start of errors that D/C filters further; `disturbance` stays as before the filter."""
        free, noise = (filtered(D, C, block) for block in (self.free, self.noise))
        past = np.concatenate([noise, noise_before(C, D, free.shape[1])])
        return Start(free, self.disturbance, past, self.zeros + (density(C) if C.size > 1 else 0.0))


def noise_before(C: Array, D: Array, samples: int) -> Array:
    """Return the effect of stationary noise C/D e before a record on (D/C) of the record, (n, samples).

    With n the larger order, C (errors - e) is off by r(t) = sum_k>t (c_k e(t - k) - d_k v(t - k)) in the
    first n samples. Both e = D q and v = C q follow from the autoregression q = e / D. The predictors of
    all orders express its last n values by independent variables.
    """
    n = max(C.size, D.size) - 1
    if n == 0:
        return np.zeros((0, samples))
    i, j = np.indices((n, n))
    # p_k for k of 0 to 2 n, and for k of -n to n; zero outside of the coefficients.
    (c, above), (d, below) = (
        [np.concatenate([np.zeros(k), p, np.zeros(2 * n + 1 - k - p.size)]) for k in (0, n)] for p in (C, D)
    )
    past = c[1 + i + j] @ below[n + j - i] - d[1 + i + j] @ above[n + j - i]
    # Values in a row of e / D, oldest first, made of independent ones of the variance of e.
    predictors, variances = _step_down(d[: n + 1])
    onto = np.eye(n)
    for order, predictor in enumerate(predictors):
        onto[order, :order] = predictor[:0:-1]
    r = past @ np.linalg.solve(onto, np.diag(np.sqrt(variances)))[::-1]
    return np.asarray(r.T @ each_later(filtered([1.0], C, np.eye(1, samples)[0]), n))


def each_later(response: Array, count: int) -> NDArray:
    """Return a response (N,) in rows (count, N), each one sample later than the row before."""
    padded = np.concatenate([np.zeros(max(count - 1, 0)), response])
    return np.lib.stride_tricks.sliding_window_view(padded, response.size)[:count][::-1]


def density(C: Array) -> float:
    """Return -2 log of a density of the zeros of C, up to a constant: 2 log of the variance of e / C.

    It vanishes on the unit circle and is all but flat elsewhere, 1 - c_1^2 for one zero. The likelihood has
    no slope across the circle. In short records it is often largest there: noise seems to vanish at a
    frequency, and the model to be exact ([sargan-bhargava-1983]). [chung-2013] treat variances that are
    estimated as zero in the same way. A zero z moves by about 2 z / N.
    """
    return 2.0 * float(np.log(_step_down(C)[1][0]))


def _step_down(d: Array) -> tuple[list[Array], NDArray]:
    """Return the predictors of the orders 0 to n - 1 of e / D, and the variances (n,) of their errors.

    They follow from D, the predictor of order n, by the recursion of [brockwell-davis-1991], Section 5.2.
    """
    predictor, variance, found = d * (1.0 - _INSIDE) ** np.arange(d.size), 1.0, []
    while predictor.size > 1:
        last = predictor[-1]
        left = 1.0 - last**2
        predictor, variance = ((predictor - last * predictor[::-1]) / left)[:-1], variance / left
        found.append((predictor, variance))
    return [p for p, _ in found[::-1]], np.array([v for _, v in found[::-1]])


class _Basis(NamedTuple):
    """Orthonormal directions (N + n, K) of all errors that one start of N samples can explain."""

    directions: Array
    coefficients: Array  # (m + n, K), the unknowns that give each direction
    free: int  # the number of directions due to level and states
    determinant: float  # log det Z^T Z, Z being the responses to orthonormal disturbances and past noise
    gradient: Start  # half the gradient of the determinant, in the blocks of a start
    of_noise: float  # the determinant of past noise alone

    @classmethod
    def of(cls, start: Start, samples: int) -> _Basis:
        """Return the directions of a start in a record, without linearly dependent free unknowns."""
        free, disturbance, noise = (block[:, :samples] for block in start[:3])
        norm = np.linalg.norm(disturbance, axis=1)
        scale = np.where(norm > 0.0, norm, np.inf)  # a start that no output shows is left at zero
        span, s, V = np.linalg.svd(disturbance.T / scale, full_matrices=False)
        kept = s > _DEPENDENT * np.max(s, initial=0.0)
        by, past = (V[kept].T / s[kept]) / scale[:, None], len(noise)
        known = by.shape[1]
        Z = np.block([[free.T @ by, noise.T], [np.zeros((past, known)), np.eye(past)]])
        Q, R = np.linalg.qr(Z)
        inverse = np.linalg.inv(R)
        responses = (Q @ inverse.T)[:samples].T
        return cls(
            Q,
            scipy.linalg.block_diag(by, np.eye(past)) @ inverse,
            known,
            2.0 * float(np.sum(np.log(np.abs(np.diag(R))))),
            Start(by @ responses[:known], -by @ span[:, kept].T, responses[known:], np.zeros(())),
            float(np.linalg.slogdet(np.eye(past) + noise @ noise.T)[1]),
        )

    def slope(self, start: Start) -> float:
        """Return the derivative of the determinant; `start` is the derivative of the start."""
        pairs = zip(self.gradient[:3], start[:3], strict=True)
        return 2.0 * sum(float(np.sum(own * block[:, : own.shape[1]])) for own, block in pairs)


@dataclass(frozen=True)
class FreeStarts:
    """The starts of records of these `lengths`; `starts` has the longest record's, output by output.

    Rows of errors are the samples of all records, then M for the unknowns of past noise, which outputs share.
    Each is as large as an error and counts as one.
    """

    lengths: tuple[int, ...]
    starts: Sequence[Start]

    @property
    def usable(self) -> bool:
        """Return whether anything is unknown, and all numbers are finite."""
        unknown = any(len(start.free) + len(start.noise) for start in self.starts)
        return unknown and all(bool(np.all(np.isfinite(x))) for start in self.starts for x in start)

    @property
    def past(self) -> int:
        """Return M: for every record the most unknowns of past noise that an output has, added up."""
        return len(self.lengths) * max(len(start.noise) for start in self.starts)

    @cached_property
    def bases(self) -> list[tuple[int, int, _Basis]]:
        """Return the record, the output and the basis of every start; equal lengths share theirs."""
        each = list(enumerate(self.starts))
        own = {n: [(i, _Basis.of(start, n)) for i, start in each] for n in sorted(set(self.lengths))}
        return [(record, i, basis) for record, n in enumerate(self.lengths) for i, basis in own[n]]

    @property
    def determinant(self) -> float:
        """Return log det Z^T Z for all unknowns plus `Start.zeros`: both add to -2 log likelihood.

        Records share the noise model and its zeros.
        """
        zeros = sum(float(start.zeros) for start in self.starts)
        return zeros + sum(basis.determinant for *_, basis in self.bases)

    def slopes(self, starts: Sequence[Start]) -> Array:
        """Return the derivatives of the terms of the determinant from the derivatives of the starts."""
        zeros = [float(start.zeros) for start in starts]
        return np.array([*zeros, *(basis.slope(starts[i]) for _, i, basis in self.bases)])

    def combined(self, coefficients: Sequence[Array], starts: Sequence[Start]) -> Array:
        """Return the effect (N, p) of starts, or of their derivatives, for these coefficients of unknowns."""
        within = np.arange(max(self.lengths)) < np.array(self.lengths)[:, None]
        pairs = zip(coefficients, starts, strict=True)
        each = [(own @ np.concatenate([start.free, start.noise]))[within] for own, start in pairs]
        return np.stack(each, axis=1)

    def errors_of_past(self, coefficients: Sequence[Array]) -> Array:
        """Return the unknowns of past noise as errors (M, p), zero for outputs that have fewer."""
        found = np.zeros((len(self.lengths), self.past // len(self.lengths), len(self.starts)))
        for i, (own, start) in enumerate(zip(coefficients, self.starts, strict=True)):
            found[:, : len(start.noise), i] = -own[:, len(start.free) :]
        return found.reshape(-1, len(self.starts))

    def eliminated(self, errors: Array, weights: Array | None) -> tuple[list[Array], Array, Array]:
        """Return the likeliest starts of errors (N, p), the root of the weights, and explained directions.

        The starts are coefficients (records, m + n) of all unknowns by output, free ones first. The root is
        R (p, p), with R^T R the weights up to a factor. The directions ((N + M) p, K) that starts can explain
        are orthonormal, in units of R.

        Args:
            weights: W (p, p); None: by the covariance of the remaining errors.
        """
        errors = np.concatenate([errors, np.zeros((self.past, errors.shape[1]))])
        plain, of = self._directions()
        every = np.arange(of.size)

        def spread(step: Array) -> Array:
            return np.asarray(plain @ (step[:, None] * np.eye(errors.shape[1])[of]))

        # Output by output first: unknown levels alone would correlate the errors of all outputs.
        shares, previous, directions = (plain.T @ errors)[every, of], np.inf, plain
        left = errors - spread(shares)
        root = _root(left, weights)
        if len(root) > 1:
            overlap = plain.T @ plain
            for _ in range(_MOST_ROUNDS):
                root = _root(left, weights)
                unit = np.linalg.norm(root, axis=0)
                scaled = root / unit
                gram = (scaled.T @ scaled)[np.ix_(of, of)] * overlap
                step = np.linalg.solve(gram, (plain.T @ (left @ root.T @ scaled))[every, of]) / unit[of]
                shares, left = shares + step, left - spread(step)
                size = float(np.sum((left @ root.T) ** 2))
                if weights is not None or abs(size - previous) <= 1e-14 * size:
                    break
                previous = size
            directions = np.linalg.qr((plain[:, None] * scaled[:, of]).reshape(-1, of.size))[0]
        coefficients = [np.zeros((len(self.lengths), len(x.free) + len(x.noise))) for x in self.starts]
        ends = np.cumsum([basis.directions.shape[1] for *_, basis in self.bases])[:-1]
        for (record, i, basis), own in zip(self.bases, np.split(shares, ends), strict=True):
            coefficients[i][record] = basis.coefficients @ own
        return coefficients, root, directions

    def _directions(self) -> tuple[Array, NDArray[np.int64]]:
        """Return the directions (N + M, K) of all starts, and the output of each (K,)."""
        of = np.concatenate([np.full(basis.directions.shape[1], i) for _, i, basis in self.bases])
        samples, column = sum(self.lengths), 0
        found = np.zeros((samples + self.past, of.size))
        begins = np.cumsum([0, *self.lengths])
        for record, _, basis in self.bases:
            length, (rows, wide) = self.lengths[record], basis.directions.shape
            past = samples + record * (self.past // len(self.lengths))
            own = slice(column, column + wide)
            found[begins[record] : begins[record] + length, own] = basis.directions[:length]
            found[past : past + rows - length, own] = basis.directions[length:]
            column += wide
        return found, of


def _root(errors: Array, weights: Array | None) -> Array:
    """Return R (p, p), R^T R = W up to a factor; W None: the inverse covariance of errors (N, p)."""
    if weights is not None:
        return np.asarray(np.linalg.cholesky(weights).T)
    rms = np.sqrt(np.maximum(np.mean(errors**2, axis=0), 1e-300))
    correlation = errors.T @ errors / len(errors) / np.outer(rms, rms)
    lower = np.linalg.cholesky(correlation + 1e-13 * np.eye(len(rms)))
    return np.asarray(np.linalg.inv(lower) / rms)
