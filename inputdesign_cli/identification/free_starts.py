"""Eliminate unknown starts from prediction errors (variable projection, and its determinant).

Each start acts on one output of one record alone. Its responses are made orthonormal there; only the weights
of the errors couple the outputs.

The likelihood is the restricted one, [harville-1977]. The unknowns are integrated over, not only estimated,
which adds the determinant. Without it a noise model with a zero on the unit circle, which forgets no start,
would explain short records too well. Responses to free unknowns before the inverse of the noise model are
made orthonormal first, so that the measure does not depend on the parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.start import Start

# Directions of the unknown starts below this size, columns scaled, are linearly dependent.
_DEPENDENT = 1e-7
_MOST_ROUNDS = 30
# Normal equations of outputs whose errors are alike beyond this lose too many digits.
_ALIKE = 1e-6


class Elimination(NamedTuple):
    """What the starts are likely to be, of records of N samples and M independent unknowns of past noise.

    Attributes:
        coefficients: of every block (m + n,), its free unknowns first.
        root: R (p, p), R^T R being the weights of the errors up to a factor.
        directions: ((N + M) p, m + n) orthonormal, the errors in units of R that the starts can explain.
    """

    coefficients: tuple[Array, ...]
    root: Array
    directions: Array


@dataclass(frozen=True)
class _Basis:
    """Orthonormal directions (N + n, m + n) of all errors that one start of N samples can explain.

    Attributes:
        coefficients: (K, m + n), of its unknowns for each direction.
        span: (N, m), of the disturbance that free unknowns cause, orthonormal; `by` (K, m) of these.
        inverse: of the factor R of Z = Q R, Z being the responses to directions of `span` and past noise.
        determinant: log det Z^T Z; `of_noise`, the one of past noise alone.
    """

    directions: Array
    coefficients: Array
    span: Array
    by: Array
    inverse: Array
    determinant: float
    of_noise: float

    def slope(self, start: Start) -> float:
        """Return the derivative of the determinant; `start` is the derivative of the start."""
        free, noise, disturbance = self._gradient
        found = np.sum(free * start.free) + np.sum(noise * start.noise)
        return 2.0 * float(found - np.sum(disturbance * start.disturbance))

    @cached_property
    def _gradient(self) -> tuple[Array, Array, Array]:
        """Return half the gradient of the determinant in the blocks of a start; in the last, its negative."""
        samples, known = self.span.shape
        of_responses = (self.directions @ self.inverse.T)[:samples].T
        return self.by @ of_responses[:known], of_responses[known:], self.by @ self.span.T


class _Block(NamedTuple):
    """One output of one record: its rows among all errors, its start and what that can explain."""

    rows: NDArray[np.int64]
    output: int
    start: Start
    basis: _Basis

    @property
    def samples(self) -> NDArray[np.int64]:
        """Return the rows of the record; the others are of past noise."""
        return self.rows[: self.start.free.shape[1]]


@dataclass(frozen=True)
class FreeStarts:
    """The starts of records of these `lengths`; `starts` has the longest record's, output by output.

    Rows of errors are the samples of all records, then M for the unknowns of past noise, which outputs share:
    as large as an error each, they are errors of their own.
    """

    lengths: tuple[int, ...]
    starts: Sequence[Start]

    @property
    def finite(self) -> bool:
        """Return whether all starts are finite."""
        return all(start.finite for start in self.starts)

    @property
    def any(self) -> bool:
        """Return whether anything is unknown."""
        return any(len(start.free) + len(start.noise) for start in self.starts)

    @property
    def past(self) -> int:
        """M: of every record the most unknowns of past noise that an output has."""
        return len(self.lengths) * self._past

    @cached_property
    def unknowns(self) -> int:
        """Return the number m of free unknowns, without linearly dependent ones."""
        return sum(block.basis.span.shape[1] for block in self._blocks)

    @cached_property
    def determinant(self) -> float:
        """log det Z^T Z, which integrating over all unknowns adds to -2 log likelihood, and `Start.zeros`.

        Records share the noise model and its zeros.
        """
        zeros = sum(float(start.zeros) for start in self.starts)
        return zeros + sum(block.basis.determinant for block in self._blocks)

    @property
    def of_noise(self) -> float:
        """Return the part of the determinant due to past noise; its unknowns have a density of their own."""
        return sum(block.basis.of_noise for block in self._blocks)

    def slopes(self, starts: Sequence[Start]) -> Array:
        """Return the derivatives (parts,) of the determinant's terms from the derivatives of the starts."""
        zeros = [float(start.zeros) for start in starts]
        own = {
            (length, i): basis.slope(starts[i].cropped(length)) for (length, i), basis in self._bases.items()
        }
        return np.array([*zeros, *(own[length, i] for length in self.lengths for i in range(len(starts)))])

    @property
    def parts(self) -> int:
        """Return the number of terms of which the determinant is the sum."""
        return len(self.starts) * (1 + len(self.lengths))

    def combined(
        self,
        coefficients: Sequence[Array],
        *,
        starts: Sequence[Start] | None = None,
        free: bool = True,
        noise: bool = True,
    ) -> Array:
        """(N, p): the responses by the coefficients of every block, to free unknowns and to past noise.

        Args:
            starts: in place of these, their derivatives.
        """
        found = np.zeros((sum(self.lengths), len(self.starts)))
        for block, own in zip(self._blocks, coefficients, strict=True):
            known, start = len(block.start.free), block.start
            if starts is not None:
                start = starts[block.output].cropped(len(block.samples))
            if free:
                found[block.samples, block.output] += own[:known] @ start.free
            if noise:
                found[block.samples, block.output] += own[known:] @ start.noise
        return found

    def errors_of_past(self, coefficients: Sequence[Array]) -> Array:
        """Return the unknowns of past noise as errors, of outputs that have fewer zero, (M, p)."""
        found = np.zeros((self.past, len(self.starts)))
        for block, own in zip(self._blocks, coefficients, strict=True):
            past = block.rows[len(block.samples) :] - sum(self.lengths)
            found[past, block.output] = -own[len(block.start.free) :]
        return found

    def eliminated(self, errors: Array, weights: Array | None) -> Elimination:
        """The likeliest starts of errors (N, p), weighed by W (p, p); None: as the covariance left asks."""
        errors = np.concatenate([errors, np.zeros((self.past, errors.shape[1]))])
        blocks = self._blocks
        sizes = [block.basis.directions.shape[1] for block in blocks]
        at = [slice(*ends) for ends in pairwise(np.cumsum([0, *sizes]))]
        overlap = _overlaps(blocks, at)
        outputs = np.repeat([block.output for block in blocks], sizes)

        def projected(weighed: Array) -> Array:
            return np.concatenate([b.basis.directions.T @ weighed[b.rows, b.output] for b in blocks])

        def spread(step: Array) -> Array:
            found = np.zeros_like(errors)
            for block, own in zip(blocks, at, strict=True):
                found[block.rows, block.output] += block.basis.directions @ step[own]
            return found

        # Output by output first: levels alone would make all errors look alike.
        shares, previous = projected(errors), np.inf
        left = errors - spread(shares)
        for _ in range(_MOST_ROUNDS):
            root = _root(left, weights)
            unit = np.linalg.norm(root, axis=0)
            scaled = root / unit
            gram = (scaled.T @ scaled)[np.ix_(outputs, outputs)] * overlap
            if len(root) == 1:
                break
            step = np.linalg.solve(gram, projected(left @ root.T @ scaled)) / unit[outputs]
            shares, left = shares + step, left - spread(step)
            size = float(np.sum((left @ root.T) ** 2))
            if weights is not None or abs(size - previous) <= 1e-14 * size:
                break
            previous = size
        columns = np.zeros((*errors.shape, len(gram)))
        for block, own in zip(blocks, at, strict=True):
            columns[block.rows, :, own] = block.basis.directions[:, None] * scaled[:, block.output, None]
        coefficients = (b.basis.coefficients @ shares[own] for b, own in zip(blocks, at, strict=True))
        return Elimination(tuple(coefficients), root, _orthogonal(columns.reshape(-1, len(gram)), gram))

    @property
    def _past(self) -> int:
        return max(len(start.noise) for start in self.starts)

    @cached_property
    def _bases(self) -> dict[tuple[int, int], _Basis]:
        """Return the basis for each length of record and each output."""
        return {
            (length, i): _orthonormal(start.cropped(length))
            for length in sorted(set(self.lengths))
            for i, start in enumerate(self.starts)
        }

    @cached_property
    def _blocks(self) -> list[_Block]:
        found, begin, past = [], 0, sum(self.lengths)
        for length in self.lengths:
            for i, start in enumerate(self.starts):
                rows = (np.arange(begin, begin + length), np.arange(past, past + len(start.noise)))
                own = (start.cropped(length), self._bases[length, i])
                found.append(_Block(np.concatenate(rows), i, *own))
            begin, past = begin + length, past + self._past
        return found


def _orthonormal(start: Start) -> _Basis:
    """Return the directions of one start, without linearly dependent free unknowns."""
    norm = np.linalg.norm(start.disturbance, axis=1)
    scale = np.where(norm > 0.0, norm, np.inf)  # a start that no output shows is left at zero
    span, s, V = np.linalg.svd(start.disturbance.T / scale, full_matrices=False)
    kept = s > _DEPENDENT * np.max(s, initial=0.0)
    by, past = (V[kept].T / s[kept]) / scale[:, None], len(start.noise)
    if start.is_white:
        own = span[:, kept]
        return _Basis(own, by, own, by, np.eye(by.shape[1]), 0.0, 0.0)
    Z = np.block([[(by.T @ start.free).T, start.noise.T], [np.zeros((past, by.shape[1])), np.eye(past)]])
    Q, R = np.linalg.qr(Z)
    inverse = np.linalg.inv(R)
    chosen = scipy.linalg.block_diag(by, np.eye(past))
    of_noise = float(np.linalg.slogdet(np.eye(past) + start.noise @ start.noise.T)[1])
    whole = 2.0 * float(np.sum(np.log(np.abs(np.diag(R)))))
    return _Basis(Q, chosen @ inverse, span[:, kept], by, inverse, whole, of_noise)


def _orthogonal(columns: Array, gram: Array) -> Array:
    """What columns (n, m) of unit length span, `gram` being their products."""
    if np.count_nonzero(gram) == len(gram):
        return columns
    if np.linalg.eigvalsh(gram)[0] < _ALIKE:
        return np.asarray(np.linalg.qr(columns)[0])
    return np.asarray(columns @ np.linalg.inv(np.linalg.cholesky(gram)).T)


def _overlaps(blocks: Sequence[_Block], at: Sequence[slice]) -> Array:
    """(m, m): the products of all directions, as if of one output; of different records they are zero."""
    found = np.eye(at[-1].stop)
    for j, (one, own) in enumerate(zip(blocks, at, strict=True)):
        first = j - one.output
        for other, beside in zip(blocks[first:j], at[first:j], strict=True):
            both = min(len(one.rows), len(other.rows))
            found[own, beside] = one.basis.directions[:both].T @ other.basis.directions[:both]
            found[beside, own] = found[own, beside].T
    return found


def _root(errors: Array, weights: Array | None) -> Array:
    """R (p, p) with R^T R = W, up to a factor; W None: the inverse of the covariance of errors (N, p)."""
    if weights is not None:
        return np.asarray(np.linalg.cholesky(weights).T)
    rms = np.sqrt(np.maximum(np.mean(errors**2, axis=0), 1e-300))
    correlation = errors.T @ errors / len(errors) / np.outer(rms, rms)
    lower = np.linalg.cholesky(correlation + 1e-13 * np.eye(len(rms)))
    return np.asarray(np.linalg.inv(lower) / rms)
