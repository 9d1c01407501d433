"""Difference equations: what a filter in q^-1 makes of samples, from rest."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray

# Samples times coefficients beyond which it pays to load scipy.signal: that takes a third of the start.
_LARGE = 50_000


def filtered(numerator: ArrayLike, denominator: ArrayLike, values: NDArray, axis: int = -1) -> NDArray:
    """The values along an axis through numerator / denominator, ascending in q^-1, from rest.

    Args:
        numerator, denominator: (m,), (k,); denominator[0] is not zero.
        values: real or complex, of any shape.
    """
    b, a = np.atleast_1d(numerator), np.atleast_1d(denominator)
    b, a = b / a[0], a / a[0]
    if a.size == b.size == 1 or values.size == 0:
        return b[0] * values
    if values.size * max(a.size, b.size) > _LARGE:
        import scipy.signal

        return np.asarray(scipy.signal.lfilter(b, a, values, axis=axis))
    columns = np.moveaxis(values, axis, -1).reshape(-1, values.shape[axis])
    driven = columns * b[0]
    for lag in range(1, min(b.size, columns.shape[1])):
        driven[:, lag:] += b[lag] * columns[:, :-lag]
    if a.size > 1:
        driven = _recursion(a, driven)
    shape = np.moveaxis(values, axis, -1).shape
    return np.moveaxis(driven.reshape(shape), -1, axis)


def _recursion(a: NDArray, driven: NDArray) -> NDArray:
    """Rows y (m, n) with sum_i a_i y(t - i) = driven(t): a triangular system with few diagonals."""
    samples = driven.shape[1]
    order = min(a.size, samples) - 1
    diagonals = np.repeat(a[: order + 1, None].astype(driven.dtype), samples, axis=1)
    solve = scipy.linalg.get_blas_funcs("tbsv", (driven,))
    return np.array([solve(order, diagonals, row, lower=1, diag=1) for row in driven])
