"""One or several experiments on one system, of which a single model is estimated.

The parts share theta. Each begins with the plant at rest, or, where the start is `free`, in a state of its
own about a level of its own. What these and the noise before it can cause is linear in unknowns, which are
eliminated from errors and gradient for every theta (variable projection, [golub-pereyra-1973]).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.identification.free_starts import FreeStarts
from inputdesign_cli.identification.kind import Kind, Part
from inputdesign_cli.identification.start import Start, central_differences

_MOST_STARTED = 3


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
        """Return the prediction errors (N + M, p) of all samples."""
        return np.concatenate([self.errors, self.past])

    @property
    def all_psi(self) -> NDArray[np.float64]:
        """(k, N + M, p)."""
        return np.concatenate([self.psi, self.past_psi], axis=1)


@dataclass(frozen=True)
class Records:
    """Records of one structure, one after the other.

    Attributes:
        kind: the structure.
        parts: u (n, r), y (n, p) of each record.
        free: whether each begins in an unknown state about an unknown level, instead of at rest at zero.
        late: samples in which unknown inputs before each act, if it is free.
        weights: W (p, p) of the errors; None to weigh by their own covariance.
        earlier: what is known besides.
        ramp: whether outputs of free records may drift along a line besides, of an unknown slope.
    """

    kind: Kind
    parts: tuple[Part, ...]
    free: bool = False
    late: int = 0
    weights: Array | None = None
    earlier: Earlier | None = None
    ramp: bool = False

    def begun_freely(self, late: int) -> Records:
        """Return the records, each begun in an unknown state after `late` samples of unknown inputs."""
        return replace(self, free=True, late=late)

    @cached_property
    def dead_times(self) -> NDArray[np.int64]:
        """Return the parameters that move dead times: there the cost has kinks."""
        return np.flatnonzero(self.kind.model.dead_times)

    def crossings(self, theta: Array) -> Array:
        """Return the crossings (m, 2, k) of sampling instants, see `Kind`."""
        return self.kind.crossings(theta, self._longest)

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

    @property
    def size(self) -> int:
        """Return the number of parameters k."""
        return len(self.kind.names)

    @cached_property
    def lengths(self) -> tuple[int, ...]:
        """Return the samples of each part."""
        return tuple(len(y) for _, y in self.parts)

    def from_rest(self, theta: Array) -> tuple[Array, NDArray[np.float64]]:
        """Return prediction errors (N, p) and their gradient (k, N, p) if each record began at rest."""
        found = [self.kind.errors_and_gradient(theta, *part) for part in self.parts]
        return np.concatenate([e for e, _ in found]), np.concatenate([psi for _, psi in found], axis=1)

    def at(self, theta: Array) -> Linearised:
        """Return prediction errors and their gradient, the unknown starts eliminated."""
        errors, psi = self.from_rest(theta)
        at_rest = Linearised.at_rest(errors, psi)
        if not all(np.all(np.isfinite(x)) for x in (errors, psi)):
            return at_rest
        starts = FreeStarts(self.lengths, self._starts(theta))
        if not (starts.any and starts.finite):
            return at_rest
        coefficients, root, directions = starts.eliminated(errors, self.weights)
        slopes = np.zeros((theta.size, starts.parts))
        moving = self._moving
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
        errors, every = self.from_rest(theta)
        starts, psi = FreeStarts(self.lengths, self._starts(theta)), every[index]
        if index not in self._moving or not (starts.past and starts.finite):
            return psi
        coefficients, _, _ = starts.eliminated(errors, self.weights)
        (change,) = self._start_slopes(theta, [index])
        return psi + starts.combined(coefficients, starts=change, free=False)

    @property
    def _longest(self) -> int:
        """Return the samples of the longest record: the past acts on all alike, on shorter ones for fewer."""
        return max(self.lengths)

    @property
    def _moving(self) -> list[int]:
        """Return the parameters on which the starts depend."""
        return self.kind.in_starts(self.late, free=self.free).tolist()

    def _starts(self, theta: Array) -> tuple[Start, ...]:
        starts = self.kind.starts(theta, self._longest, self.late, free=self.free)
        if not (self.ramp and self.free):
            return starts
        line = np.linspace(-1.0, 1.0, self._longest)[:, None]
        through = self.kind.whitened(theta, line)
        return tuple(start.and_free(own.T, line.T) for start, own in zip(starts, through, strict=True))

    def _start_slopes(self, theta: Array, indices: Sequence[int]) -> list[tuple[Start, ...]]:
        if self.ramp and self.free:
            steps = [self.kind.start_step(theta, index, self._longest) for index in indices]
            return central_differences(self._starts, theta, indices, steps)
        return self.kind.start_slopes(theta, indices, self._longest, self.late, free=self.free)

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """(p, N, m), see `Kind`."""
        pieces = np.split(signals, np.cumsum(self.lengths)[:-1])
        return np.concatenate([self.kind.whitened(theta, x) for x in pieces], axis=1)

    def stabilised(self, theta: Array) -> Array:
        """Return theta with a stable predictor."""
        return self.kind.stabilised(theta, self._longest)


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
    """Return the signals of each record; None: of the only one."""
    at = np.cumsum(lengths or [len(y)])[:-1]
    return list(zip(np.split(u, at), np.split(y, at), strict=True))


def longest(parts: Sequence[Part]) -> list[Part]:
    """Return the longest records, of which starting points are made: at most three, of similar lengths."""
    ranked = sorted(parts, key=lambda part: -len(part[1]))[:_MOST_STARTED]
    return [part for part in ranked if 2 * len(part[1]) >= len(ranked[0][1])]


def centred(parts: Sequence[Part]) -> list[Part]:
    """Return the records without their means."""
    return [(u - u.mean(axis=0), y - y.mean(axis=0)) for u, y in parts]
