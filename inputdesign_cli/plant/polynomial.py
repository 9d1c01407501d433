"""Polynomials in the delay operator q^-1, coefficients ascending, and matrices (rows, columns, l) of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike

from inputdesign_cli.arrays import Array, ComplexArray

_MODERATE = 1e100  # quotients up to this are no overflow


def roots_in_z(coefficients: ArrayLike) -> ComplexArray:
    """Return the roots in z = q of a polynomial in q^-1; leading zeros (pure delay) contribute none.

    Trailing zeros are roots at the origin and are left out: they neither resonate nor destabilise.
    """
    c = np.asarray(coefficients, dtype=float)
    there = np.flatnonzero(c)
    if there.size < 2:
        return np.zeros(0, dtype=complex)
    first, last = int(there[0]), int(there[-1])
    if last == first + 1 and abs(c[last]) <= _MODERATE * abs(c[first]):  # by far the most are of first order
        return np.asarray(-c[last : last + 1] / c[first], dtype=complex)
    return np.asarray(np.roots(c[first : last + 1]), dtype=complex)


def all_roots(polynomials: Iterable[ArrayLike]) -> ComplexArray:
    """Return all roots in z of several polynomials in one array."""
    return np.concatenate([np.zeros(0, dtype=complex), *map(roots_in_z, polynomials)])


# A coefficient this small beside the largest one is rounding of the transforms below.
_ROUNDING = 1e-13


def stack(entries: Sequence[Sequence[Sequence[float] | Array]]) -> Array:
    """Return rows of columns of coefficient lists as one array (rows, columns, longest)."""
    longest = max(len(p) for row in entries for p in row)
    full = np.zeros((len(entries), len(entries[0]), longest))
    for i, row in enumerate(entries):
        for j, polynomial in enumerate(row):
            full[i, j, : len(polynomial)] = polynomial
    return full


def at(matrix: Array, q: ComplexArray) -> ComplexArray:
    """Return the values (.., K, rows, columns) of (.., rows, columns, l) at `q` (K,), which stands for q^-1.

    The values of an entry are contiguous in memory.
    """
    values = polyval(q, np.moveaxis(matrix[..., None, :], -1, 0), tensor=False)
    return np.asarray(np.moveaxis(values, -1, -3), dtype=complex)


def multiply(left: Array, right: Array) -> Array:
    """Return the product of two matrices of polynomials (.., a, b, l) and (.., b, c, m)."""
    size = left.shape[-1] + right.shape[-1] - 1
    shape = np.broadcast_shapes(left.shape[:-3], right.shape[:-3])
    product = np.zeros((*shape, left.shape[-3], right.shape[-2], size))
    # Coefficient by coefficient, so that zeros stay zeros: they are delays.
    for lag in range(left.shape[-1]):
        part = np.einsum("...ab,...bcm->...acm", left[..., lag], right)
        product[..., lag : lag + right.shape[-1]] += part
    return product


def determinant_and_adjugate(matrix: Array) -> tuple[Array, Array]:
    """Return det (.., l) and adj (.., n, n, l) of matrices of polynomials, by interpolation on the circle.

    The entries of the adjugate are minors, so no entry is divided by a determinant that may vanish.
    """
    n = matrix.shape[-2]
    size = n * (matrix.shape[-1] - 1) + 1
    values = np.moveaxis(np.fft.fft(matrix, size), -1, -3)
    det = np.fft.ifft(np.linalg.det(values), axis=-1).real
    minors = np.empty_like(values)
    for i in range(n):
        for j in range(n):
            rest = np.delete(np.delete(values, i, axis=-2), j, axis=-1)
            minors[..., j, i] = (-1) ** (i + j) * (np.linalg.det(rest) if n > 1 else 1.0)
    adj = np.fft.ifft(np.moveaxis(minors, -3, -1), axis=-1).real
    rows = np.abs(matrix).sum(axis=(-2, -1))
    largest = np.prod(rows, axis=-1)
    others = np.prod(rows, axis=-1, keepdims=True) / np.where(rows > 0, rows, 1.0)
    return _rounded(det, largest[..., None]), _rounded(adj, others[..., None, :, None])


def _rounded(coefficients: Array, scale: Array) -> Array:
    """Return coefficients with rounding of the transforms set to zero: zeros mean delays, or no inverse.

    `scale` bounds their size: the product of the sums of the rows that enter.
    """
    return np.where(np.abs(coefficients) > _ROUNDING * scale, coefficients, 0.0)


def delay_of(coefficients: Array) -> int:
    """Return the number of leading coefficients that vanish in every entry; of a zero polynomial, all."""
    nonzero = np.flatnonzero(np.any(coefficients.reshape(-1, coefficients.shape[-1]) != 0, axis=0))
    return int(nonzero[0]) if nonzero.size else coefficients.shape[-1]
