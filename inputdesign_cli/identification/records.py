"""One or several experiments on one system, of which a single model is estimated.

The parts share theta. Each begins from rest, or, where the start is `free`, in a state of its own about a
level of its own: what these can cause is linear in so many unknowns, which are eliminated from errors and
gradient for every theta (variable projection, [golub-pereyra-1973]).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.identification.earlier import Earlier
from inputdesign_cli.plant.polynomial import Array

# Directions of the unknown starts that are smaller than this, columns scaled, are the same as others.
_DEPENDENT = 1e-7
_MOST_ROUNDS = 30
_MOST_STARTED = 3


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
        """Number of parameters k."""

    def errors_and_gradient(self, theta: Array) -> tuple[Array, NDArray[np.float64]]:
        """Prediction errors (N, p) from rest, and psi = -d errors / d theta (k, N, p)."""

    def free_responses(self, theta: Array) -> tuple[NDArray[np.float64], ...]:
        """Of each output (m, N): what m unknowns, its level and its past, add to its prediction errors."""

    def past_noise(self, theta: Array) -> tuple[NDArray[np.float64], ...]:
        """Of each output (m, N): what noise before the record adds to its prediction errors from rest.

        None where the predictor forgets it within its order.
        """

    def lateness(self, theta: Array) -> int:
        """The samples after which inputs from before the record no longer act but through the states."""

    @property
    def dead_times(self) -> NDArray[np.int64]:
        """The parameters that move dead times: there the cost has kinks."""

    def remembering(self, late: int) -> Self:
        """The same, with free responses of inputs before it that act for so many samples."""

    @property
    def in_starts(self) -> NDArray[np.int64]:
        """The parameters on which the free responses depend."""

    def free_slopes(self, theta: Array, index: int) -> tuple[NDArray[np.float64], ...]:
        """The derivatives of the free responses with respect to one of them."""

    def noise_in_regressors(self, theta: Array, errors: Array) -> NDArray[np.float64]:
        """(k, N, p): what measured outputs in place of the model's add to psi."""

    def whitened(self, theta: Array, signals: Array) -> NDArray[np.float64]:
        """(p, N, m): signals (N, m) through the inverse of each output's noise model."""

    def stabilised(self, theta: Array) -> Array:
        """theta with a stable predictor."""


@dataclass(frozen=True)
class Linearised:
    """Prediction errors near one theta.

    Attributes:
        errors: (N, p), what unknown starts explain taken off.
        psi: (k, N, p) = -d errors / d theta, the starts following.
        begun: (N, p), what the starts explain.
        directions: (N p, m) orthonormal, the errors in white units that they can explain.
    """

    errors: Array
    psi: NDArray[np.float64]
    begun: Array
    directions: Array


@dataclass(frozen=True)
class Records:
    """Records of one structure, one after the other.

    Attributes:
        free: whether each begins in an unknown state about an unknown level, instead of at rest at zero.
        late: samples in which unknown inputs before each act, if it is free.
        weights: W (p, p) of the errors; None to weigh by their own covariance.
        earlier: what is known besides.
    """

    parts: tuple[Record, ...]
    free: bool = False
    late: int = 0
    weights: Array | None = None
    earlier: Earlier | None = None

    def begun_freely(self, late: int) -> Records:
        """The same, each begun in an unknown state, after unknown inputs that act for `late` samples."""
        parts = tuple(part.remembering(late) for part in self.parts)
        return replace(self, parts=parts, free=True, late=late)

    def lateness(self, theta: Array) -> int:
        """The longest of all parts."""
        return max(part.lateness(theta) for part in self.parts)

    @property
    def dead_times(self) -> NDArray[np.int64]:
        """See `Record`."""
        return self.parts[0].dead_times

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
        """Their number N."""
        return len(self.y)

    @property
    def size(self) -> int:
        """Number of parameters k."""
        return self.parts[0].size

    @cached_property
    def lengths(self) -> tuple[int, ...]:
        """The samples of each part."""
        return tuple(len(part.y) for part in self.parts)

    def at(self, theta: Array) -> Linearised:
        """Prediction errors and their gradient, the unknown starts eliminated."""
        found = [part.errors_and_gradient(theta) for part in self.parts]
        errors = np.concatenate([e for e, _ in found])
        psi = np.concatenate([gradient for _, gradient in found], axis=1)
        starts = self.starts(theta)
        if not len(starts) or not all(np.all(np.isfinite(x)) for x in (errors, psi, starts)):
            return Linearised(errors, psi, np.zeros_like(errors), np.zeros((errors.size, 0)))
        coefficients, root, directions = self._fitted(starts, errors)
        begun = np.tensordot(coefficients, starts, 1)
        for k in self.parts[0].in_starts:
            slopes = self._placed([part.free_slopes(theta, int(k)) for part in self.parts])
            psi[k] += np.tensordot(coefficients, slopes, 1)
        flat = (psi @ root.T).reshape(len(psi), -1)
        flat = flat - (flat @ directions) @ directions.T
        psi = flat.reshape(psi.shape) @ np.linalg.inv(root).T
        return Linearised(errors - begun, psi, begun, directions)

    def starts(self, theta: Array) -> NDArray[np.float64]:
        """(m, N, p): what the unknowns of all parts add to the prediction errors, each to one output."""
        if not self.free:
            return np.zeros((0, *self.y.shape))
        return self._placed([part.free_responses(theta) for part in self.parts])

    def past_noise(self, theta: Array) -> NDArray[np.float64]:
        """(m, N, p): what noise before the records adds to errors; none beside unknown starts, its part."""
        if self.free:
            return np.zeros((0, *self.y.shape))
        return self._placed([part.past_noise(theta) for part in self.parts])

    def _placed(self, found: Sequence[tuple[NDArray[np.float64], ...]]) -> NDArray[np.float64]:
        """Responses of every part and output as (m, N, p)."""
        columns, begin = [], 0
        for part, own in zip(self.parts, found, strict=True):
            end = begin + len(part.y)
            for output, responses in enumerate(own):
                block = np.zeros((len(responses), *self.y.shape))
                block[:, begin:end, output] = responses
                columns.append(block)
            begin = end
        return np.concatenate(columns)

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
        """theta with a stable predictor."""
        return max(self.parts, key=lambda part: len(part.y)).stabilised(theta)

    def _fitted(self, starts: NDArray[np.float64], errors: Array) -> tuple[Array, Array, Array]:
        """The likeliest coefficients (m,) of the starts, R (p, p), and what R times the starts span."""
        left, previous = errors, np.inf
        for _ in range(_MOST_ROUNDS):
            root = self._root(left)
            flat = (starts @ root.T).reshape(len(starts), -1).T
            norm = np.linalg.norm(flat, axis=0)
            scale = np.where(norm > 0.0, norm, np.inf)  # a start that no output shows is left at zero
            U, s, V = np.linalg.svd(flat / scale, full_matrices=False)
            kept = s > _DEPENDENT * s[0]
            directions = U[:, kept]
            coefficients = (V[kept].T / s[kept]) @ (directions.T @ (errors @ root.T).ravel()) / scale
            left = errors - np.tensordot(coefficients, starts, 1)
            size = float(np.sum((left @ root.T) ** 2))
            if errors.shape[1] == 1 or self.weights is not None or abs(size - previous) <= 1e-14 * size:
                break
            previous = size
        return coefficients, root, directions

    def _root(self, errors: Array) -> Array:
        """R (p, p) with R^T R = W, up to a factor."""
        if self.weights is not None:
            return np.asarray(np.linalg.cholesky(self.weights).T)
        rms = np.sqrt(np.maximum(np.mean(errors**2, axis=0), 1e-300))
        correlation = errors.T @ errors / len(errors) / np.outer(rms, rms)
        lower = np.linalg.cholesky(correlation + 1e-13 * np.eye(len(rms)))
        return np.asarray(np.linalg.inv(lower) / rms)


def shifted(x: Array, lag: int, lengths: Sequence[int]) -> Array:
    """x(t - lag) along the first axis; zero before each part begins."""
    out = np.zeros_like(x)
    begin = 0
    for length in lengths:
        keep = max(length - lag, 0)
        out[begin + length - keep : begin + length] = x[begin : begin + keep]
        begin += length
    return out


def split(u: Array, y: Array, lengths: Sequence[int] | None) -> list[tuple[Array, Array]]:
    """The signals of each record; None: of the only one."""
    at = np.cumsum(lengths or [len(y)])[:-1]
    return list(zip(np.split(u, at), np.split(y, at), strict=True))


def longest(parts: Sequence[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """The longest records, of which starting points are made: at most three, of similar lengths."""
    ranked = sorted(parts, key=lambda part: -len(part[1]))[:_MOST_STARTED]
    return [part for part in ranked if 2 * len(part[1]) >= len(ranked[0][1])]


def centred(parts: Sequence[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """The same without their means."""
    return [(u - u.mean(axis=0), y - y.mean(axis=0)) for u, y in parts]
