"""Difference equations: filter samples by a filter in q^-1, from rest."""

from __future__ import annotations

import numpy as np
import scipy.linalg.blas
from numpy.typing import ArrayLike, NDArray

# Samples times coefficients beyond which it pays to load scipy.signal, which takes a third of the start-up.
# The second number is for several rows, whose recursions take less time per sample if they are short.
_LARGE, _LARGE_TOGETHER = 50_000, 200_000


def filtered(numerator: ArrayLike, denominator: ArrayLike, values: NDArray, axis: int = -1) -> NDArray:
    """Return real or complex values of any shape filtered along an axis, from rest.

    The numerator (m,) and the denominator (k,), whose first is not zero, are ascending in q^-1.
    """
    b, a = np.atleast_1d(numerator), np.atleast_1d(denominator)
    b, a = b / a[0], a / a[0]
    if a.size == b.size == 1 or values.size == 0:
        return b[0] * values
    coefficients = max(a.size, b.size)
    if values.shape[axis] * coefficients > _LARGE or values.size * coefficients > _LARGE_TOGETHER:
        import scipy.signal

        return np.asarray(scipy.signal.lfilter(b, a, values, axis=axis))
    if values.ndim == 1:
        return _of_rows(b, a, values[None])[0]
    turned = values.swapaxes(axis, -1)
    rows = _of_rows(b, a, turned.reshape(-1, values.shape[axis]))
    return rows.reshape(turned.shape).swapaxes(axis, -1)


def _of_rows(b: NDArray, a: NDArray, rows: NDArray) -> NDArray:
    """Filter rows (m, n) by b / a, a[0] being one."""
    driven = rows * b[0]
    for lag in range(1, min(b.size, rows.shape[1])):
        driven[:, lag:] += b[lag] * rows[:, :-lag]
    return _recursion(a, driven) if a.size > 1 else driven


def _recursion(a: NDArray, driven: NDArray) -> NDArray:
    """Solve sum_i a_i y(t - i) = driven(t) for rows y (m, n): a triangular system with few diagonals."""
    samples = driven.shape[1]
    order = min(a.size, samples) - 1
    diagonals = np.empty((order + 1, samples), dtype=driven.dtype)
    diagonals[:] = a[: order + 1, None]
    solve = scipy.linalg.blas.ztbsv if np.iscomplexobj(driven) else scipy.linalg.blas.dtbsv
    return np.array([solve(order, diagonals, row, lower=1, diag=1) for row in driven])
