"""One or several experiments on one system, of which a single model is estimated.

The parts share theta. Each begins with the plant at rest, or, where the start is `free`, in a state of its
own about a level of its own. What these and the noise before it can cause is linear in unknowns, which are
eliminated from errors and gradient for every theta (variable projection, [golub-pereyra-1973]).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.identification.free_starts import FreeStarts
from inputdesign_cli.identification.start import Start

_MOST_STARTED = 3
# Of a coefficient of the noise, or of one: central differences of a filtered line lose about half the digits.
_STEP = 1e-6


class Record(Protocol):
    """One experiment and the structure that is to explain it by parameters theta (k,)."""

    @property
    def u(self) -> Array:
        """(N, r)."""

    @property
    def y(self) -> Array:
        """(N, p)."""

    @property
    def size(self) -> int:
        """Return the number of parameters k."""

    def errors_and_gradient(self, theta: Array) -> tuple[Array, NDArray[np.float64]]:
        """Return prediction errors (N, p) from rest, and psi = -d errors / d theta (k, N, p)."""

    def starts(self, theta: Array, *, free: bool) -> tuple[Start, ...]:
        """Return for each output the effect of the past of the record on its prediction errors.

        Args:
            free: whether level and states are unknown; else the plant is at rest at zero, and noise is not.
        """

    def lateness(self, theta: Array) -> int:
        """Return the samples in which inputs from before the record act by other ways than the states."""

    @property
    def dead_times(self) -> NDArray[np.int64]:
        """Return the parameters that move dead times: there the cost has kinks."""

    def crossings(self, theta: Array) -> Array:
        """Return steps (m, 2, k) of a dead time to sampling instants (kinks of the cost), and beyond."""

    def remembering(self, late: int) -> Self:
        """Return the record with free responses to inputs before it, which act for `late` samples."""

    def in_starts(self, *, free: bool) -> NDArray[np.int64]:
        """Return the parameters on which the starts depend."""

    def start_slopes(self, theta: Array, indices: Sequence[int], *, free: bool) -> list[tuple[Start, ...]]:
        """Return the derivatives of the starts with respect to each of these."""

    def noise_in_regressors(self, theta: Array, errors: Array) -> NDArray[np.float64]:
        """Return the change of psi (k, N, p) if measured outputs replace the model's."""

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """Return signals (N, m) through the inverse of each output's noise model (p, N, m)."""

    def stabilised(self, theta: Array) -> Array:
        """Return theta with a stable predictor."""


@dataclass(frozen=True)
class Linearised:
    """Prediction errors near one theta.

    What noise before the records is likely to have been counts as M more errors of each output.

    Attributes:
        errors: (N, p), what unknown starts explain taken off.
        psi: (k, N, p) = -d errors / d theta, the starts following.
        past: (M, p), errors before the records, and `past_psi` (k, M, p).
        begun: (N, p), what levels and states at the start explain.
        directions: ((N + M) p, m) orthonormal, the errors in white units that unknown starts can explain.
        unknowns: how many of these are levels and states, of which nothing is known.
        determinant: what integrating over the starts adds to -2 log likelihood; `slope` (k,), half its
            gradient; `curvature` (k, k), about half its Hessian; `of_noise`, the part that belongs to noise
            before the records.
    """

    errors: Array
    psi: NDArray[np.float64]
    past: Array
    past_psi: NDArray[np.float64]
    begun: Array
    directions: Array
    unknowns: int
    determinant: float
    slope: Array
    curvature: Array
    of_noise: float

    @classmethod
    def at_rest(cls, errors: Array, psi: NDArray[np.float64]) -> Linearised:
        """Return the errors and gradient without unknown starts."""
        k, p = len(psi), errors.shape[1]
        begun, slope, curvature = np.zeros_like(errors), np.zeros(k), np.zeros((k, k))
        past, directions = np.zeros((0, p)), np.zeros((errors.size, 0))
        nothing = np.zeros((k, 0, p))
        return cls(errors, psi, past, nothing, begun, directions, 0, 0.0, slope, curvature, 0.0)

    @property
    def freedom(self) -> int:
        """Return the number of errors that levels and states leave."""
        return self.errors.size - self.unknowns

    @property
    def all_errors(self) -> Array:
        """(N + M, p)."""
        return np.concatenate([self.errors, self.past])

    @property
    def all_psi(self) -> NDArray[np.float64]:
        """(k, N + M, p)."""
        return np.concatenate([self.psi, self.past_psi], axis=1)


@dataclass(frozen=True)
class Records:
    """Records of one structure, one after the other.

    Attributes:
        free: whether each begins in an unknown state about an unknown level, instead of at rest at zero.
        late: samples in which unknown inputs before each act, if it is free.
        weights: W (p, p) of the errors; None to weigh by their own covariance.
        earlier: what is known besides.
        ramp: whether outputs of free records may drift along a line besides, of an unknown slope.
    """

    parts: tuple[Record, ...]
    free: bool = False
    late: int = 0
    weights: Array | None = None
    earlier: Earlier | None = None
    ramp: bool = False

    def begun_freely(self, late: int) -> Records:
        """Return the records, each begun in an unknown state after `late` samples of unknown inputs."""
        parts = tuple(part.remembering(late) for part in self.parts)
        return replace(self, parts=parts, free=True, late=late)

    def lateness(self, theta: Array) -> int:
        """Return the largest lateness of all parts."""
        return max(part.lateness(theta) for part in self.parts)

    @property
    def dead_times(self) -> NDArray[np.int64]:
        """See `Record`."""
        return self.parts[0].dead_times

    def crossings(self, theta: Array) -> Array:
        """See `Record`."""
        return max((part.crossings(theta) for part in self.parts), key=len)

    @cached_property
    def u(self) -> Array:
        """(N, r)."""
        return np.concatenate([part.u for part in self.parts])

    @cached_property
    def y(self) -> Array:
        """(N, p)."""
        return np.concatenate([part.y for part in self.parts])

    @property
    def samples(self) -> int:
        """Return the number of samples N."""
        return len(self.y)

    @property
    def size(self) -> int:
        """Return the number of parameters k."""
        return self.parts[0].size

    @cached_property
    def lengths(self) -> tuple[int, ...]:
        """Return the samples of each part."""
        return tuple(len(part.y) for part in self.parts)

    def at(self, theta: Array) -> Linearised:
        """Return prediction errors and their gradient, the unknown starts eliminated."""
        found = [part.errors_and_gradient(theta) for part in self.parts]
        errors = np.concatenate([e for e, _ in found])
        psi = np.concatenate([gradient for _, gradient in found], axis=1)
        at_rest = Linearised.at_rest(errors, psi)
        if not all(np.all(np.isfinite(x)) for x in (errors, psi)):
            return at_rest
        starts = self._starts(theta)
        if not (starts.any and starts.finite):
            return at_rest
        coefficients, root, directions = starts.eliminated(errors, self.weights)
        slopes = np.zeros((theta.size, starts.parts))
        moving = self.parts[0].in_starts(free=self.free).tolist()
        for k, change in zip(moving, self._start_slopes(theta, moving), strict=True):
            psi[k] += starts.combined(coefficients, starts=change)
            slopes[k] = 0.5 * starts.slopes(change)
        past = np.zeros((starts.past, errors.shape[1]))
        psi = np.concatenate([psi, np.zeros((len(psi), *past.shape))], axis=1)
        flat = (psi @ root.T).reshape(len(psi), -1)
        flat = flat - (flat @ directions) @ directions.T
        psi = flat.reshape(psi.shape) @ np.linalg.inv(root).T
        return Linearised(
            errors - starts.combined(coefficients),
            psi[:, : self.samples],
            starts.errors_of_past(coefficients),
            psi[:, self.samples :],
            starts.combined(coefficients, noise=False),
            directions,
            starts.unknowns,
            starts.determinant,
            slopes.sum(axis=1),
            slopes @ slopes.T,
            starts.of_noise,
        )

    def gradient(self, theta: Array, index: int) -> Array:
        """Return minus the derivative (N, p) of the errors by a parameter; past noise stays as estimated."""
        found = [part.errors_and_gradient(theta) for part in self.parts]
        psi = np.concatenate([gradient[index] for _, gradient in found])
        starts = self._starts(theta)
        if index not in self.parts[0].in_starts(free=self.free) or not (starts.past and starts.finite):
            return psi
        coefficients, _, _ = starts.eliminated(np.concatenate([e for e, _ in found]), self.weights)
        (change,) = self._start_slopes(theta, [index])
        return psi + starts.combined(coefficients, starts=change, free=False)

    @cached_property
    def _longest(self) -> Record:
        """Return the longest record: the past acts on all alike, on shorter ones for fewer samples."""
        return max(self.parts, key=lambda part: len(part.y))

    def _starts(self, theta: Array) -> FreeStarts:
        starts = self._longest.starts(theta, free=self.free)
        if self.ramp and self.free:
            line = self._line
            through = self._longest.whitened(theta, line)
            starts = tuple(start.and_free(own.T, line.T) for start, own in zip(starts, through, strict=True))
        return FreeStarts(self.lengths, starts)

    def _start_slopes(self, theta: Array, indices: Sequence[int]) -> list[tuple[Start, ...]]:
        slopes = self._longest.start_slopes(theta, indices, free=self.free)
        if not (self.ramp and self.free):
            return slopes
        still, found = np.zeros_like(self._line).T, []
        for index, starts in zip(indices, slopes, strict=True):
            step = _STEP * max(abs(float(theta[index])), 1.0) * np.eye(theta.size)[index]
            above, below = (self._longest.whitened(end, self._line) for end in (theta + step, theta - step))
            change = (above - below) / (2.0 * step[index])
            found.append(
                tuple(start.and_free(own.T, still) for start, own in zip(starts, change, strict=True))
            )
        return found

    @property
    def _line(self) -> Array:
        """Return a line (N, 1) through the longest record."""
        return np.linspace(-1.0, 1.0, len(self._longest.y))[:, None]

    def noise_in_regressors(self, theta: Array, errors: Array) -> NDArray[np.float64]:
        """(k, N, p), see `Record`."""
        pieces = np.split(errors, np.cumsum(self.lengths)[:-1])
        found = [part.noise_in_regressors(theta, e) for part, e in zip(self.parts, pieces, strict=True)]
        return np.concatenate(found, axis=1)

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """(p, N, m), see `Record`."""
        pieces = np.split(signals, np.cumsum(self.lengths)[:-1])
        found = [part.whitened(theta, x) for part, x in zip(self.parts, pieces, strict=True)]
        return np.concatenate(found, axis=1)

    def stabilised(self, theta: Array) -> Array:
        """Return theta with a stable predictor."""
        return self._longest.stabilised(theta)


def shifted(x: Array, lag: int, lengths: Sequence[int]) -> Array:
    """Return x(t - lag) along the first axis; zero before each part begins."""
    out = np.zeros_like(x)
    begin = 0
    for length in lengths:
        keep = max(length - lag, 0)
        out[begin + length - keep : begin + length] = x[begin : begin + keep]
        begin += length
    return out


def split(u: Array, y: Array, lengths: Sequence[int] | None) -> list[tuple[Array, Array]]:
    """Return the signals of each record; None: of the only one."""
    at = np.cumsum(lengths or [len(y)])[:-1]
    return list(zip(np.split(u, at), np.split(y, at), strict=True))


def longest(parts: Sequence[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """Return the longest records, of which starting points are made: at most three, of similar lengths."""
    ranked = sorted(parts, key=lambda part: -len(part[1]))[:_MOST_STARTED]
    return [part for part in ranked if 2 * len(part[1]) >= len(ranked[0][1])]


def centred(parts: Sequence[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """Return the records without their means."""
    return [(u - u.mean(axis=0), y - y.mean(axis=0)) for u, y in parts]
