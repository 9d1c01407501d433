"""Levels and starts that nobody knows, eliminated from prediction errors (variable projection).

Each acts on one output of one record alone. Their responses are made orthonormal there; only the weights of
the errors tie the outputs together.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.plant.polynomial import Array

# Directions of the unknown starts that are smaller than this, columns scaled, are the same as others.
_DEPENDENT = 1e-7
_MOST_ROUNDS = 30
# Normal equations of outputs whose errors are alike beyond this lose too many digits.
_ALIKE = 1e-6


class Elimination(NamedTuple):
    """What the starts are likely to be.

    Attributes:
        coefficients: (m,) of every block of responses.
        root: R (p, p), R^T R being the weights of the errors up to a factor.
        directions: (N p, m) orthonormal, the errors in units of R that the starts can explain.
    """

    coefficients: tuple[Array, ...]
    root: Array
    directions: Array


class _Basis(NamedTuple):
    """Orthonormal directions (n, m) of one block, and the coefficients (K, m) that they are made by."""

    rows: slice
    output: int
    directions: Array
    coefficients: Array


@dataclass(frozen=True)
class FreeStarts:
    """The responses (m, n) of the unknowns, record by record (of these `lengths`) and output by output."""

    lengths: tuple[int, ...]
    responses: Sequence[Sequence[NDArray[np.float64]]]

    @property
    def finite(self) -> bool:
        """Whether all are."""
        return all(bool(np.all(np.isfinite(block))) for _, _, block in self._blocks())

    def combined(self, coefficients: Sequence[Array]) -> Array:
        """(N, p): the responses by coefficients (m,) of every block."""
        found = np.zeros((sum(self.lengths), len(self.responses[0])))
        for (rows, output, block), own in zip(self._blocks(), coefficients, strict=True):
            found[rows, output] = own @ block
        return found

    def eliminated(self, errors: Array, weights: Array | None) -> Elimination:
        """The likeliest starts of errors (N, p), weighed by W (p, p); None: as the covariance left asks."""
        bases = [_orthonormal(*block) for block in self._blocks()]
        at = [slice(*ends) for ends in pairwise(np.cumsum([0, *(len(b.directions.T) for b in bases)]))]
        overlap = _overlaps(bases, at)
        outputs = np.concatenate([[basis.output] * len(basis.directions.T) for basis in bases])

        def projected(weighed: Array) -> Array:
            return np.concatenate([b.directions.T @ weighed[b.rows, b.output] for b in bases])

        def spread(step: Array) -> Array:
            found = np.zeros_like(errors)
            for basis, own in zip(bases, at, strict=True):
                found[basis.rows, basis.output] += basis.directions @ step[own]
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
        for basis, own in zip(bases, at, strict=True):
            columns[basis.rows, :, own] = basis.directions[:, None] * scaled[:, basis.output, None]
        coefficients = (basis.coefficients @ shares[own] for basis, own in zip(bases, at, strict=True))
        return Elimination(tuple(coefficients), root, _orthogonal(columns.reshape(-1, len(gram)), gram))

    def _blocks(self) -> Iterator[tuple[slice, int, NDArray[np.float64]]]:
        begin = 0
        for length, own in zip(self.lengths, self.responses, strict=True):
            for output, block in enumerate(own):
                yield slice(begin, begin + length), output, block
            begin += length


def _orthonormal(rows: slice, output: int, responses: NDArray[np.float64]) -> _Basis:
    """The directions of responses (m, n), those that are the same as others left out."""
    norm = np.linalg.norm(responses, axis=1)
    scale = np.where(norm > 0.0, norm, np.inf)  # a start that no output shows is left at zero
    U, s, V = np.linalg.svd(responses.T / scale, full_matrices=False)
    kept = s > _DEPENDENT * s[0]
    return _Basis(rows, output, U[:, kept], (V[kept].T / s[kept]) / scale[:, None])


def _orthogonal(columns: Array, gram: Array) -> Array:
    """What columns (n, m) of unit length span, `gram` being their products."""
    if np.count_nonzero(gram) == len(gram):
        return columns
    if np.linalg.eigvalsh(gram)[0] < _ALIKE:
        return np.asarray(np.linalg.qr(columns)[0])
    return np.asarray(columns @ np.linalg.inv(np.linalg.cholesky(gram)).T)


def _overlaps(bases: Sequence[_Basis], at: Sequence[slice]) -> Array:
    """(m, m): the products of all directions, as if of one output; of different records they are zero."""
    found = np.eye(at[-1].stop)
    for j, (one, own) in enumerate(zip(bases, at, strict=True)):
        for other, beside in zip(bases[:j], at[:j], strict=True):
            if other.rows == one.rows:
                found[own, beside] = one.directions.T @ other.directions
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
