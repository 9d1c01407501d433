"""Polynomials in the delay operator q^-1, coefficients ascending, and matrices (rows, columns, l) of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray

Key = TypeVar("Key")
_latest: list[tuple[NDArray, ComplexArray]] = [(np.zeros(0), np.zeros(0, dtype=complex))]
_WORTH_KEEPING = 128  # frequencies; fewer are sooner computed than compared
_MODERATE = 1e100  # quotients up to this are no overflow


def unit_circle(w: ArrayLike) -> ComplexArray:
    """Return q^-1 at normalised frequencies `w` (rad/sample), in the same shape.

    At w - j rho it is on a circle of radius e^-rho: the transform of signals weighted with e^(-rho t).
    """
    at = np.asarray(w)
    asked, known = _latest[0]
    # G, H and their gradients are asked for at the same frequencies in turn, also for similar plants.
    if at.shape == asked.shape and np.array_equal(at, asked):
        return known
    q = np.asarray(np.exp(-1j * at))
    if at.size < _WORTH_KEEPING:
        return q
    q.setflags(write=False)
    _latest[0] = (at.copy(), q)
    return q


def evaluate(coefficients: ArrayLike, q: ComplexArray) -> ComplexArray:
    """Return the value of sum_i coefficients[i] q^i at each element of `q` (q stands for q^-1).

    Several polynomials (S, l) have values (S, ..).
    """
    stated = np.asarray(coefficients, dtype=float)
    if stated.ndim == 2 and len(stated) > 1:
        return _horner(stated.reshape(len(stated), *(1 for _ in np.shape(q)), -1), q)
    if stated.ndim == 2:
        return evaluate(stated[0], q)[None]
    c = stated.tolist()
    if len(c) == 1:
        return np.full(np.shape(q), c[0], dtype=complex)
    value: ComplexArray = c[-1] * q
    value += c[-2]
    for coefficient in c[-3::-1]:  # Horner
        value *= q
        value += coefficient
    return value


def _horner(coefficients: Array, q: ComplexArray) -> ComplexArray:
    """Return sum_i coefficients[.., i] q^i for coefficients (.., l), broadcast against q."""
    value = np.zeros(np.broadcast_shapes(coefficients.shape[:-1], np.shape(q)), dtype=complex)
    value += coefficients[..., -1]
    for lag in range(coefficients.shape[-1] - 2, -1, -1):
        value *= q
        value.real += coefficients[..., lag]
    return value


def evaluate_all(polynomials: Mapping[Key, Sequence[Array]], q: ComplexArray) -> dict[Key, ComplexArray]:
    """Return values (S, 1, n) at `q` of polynomials of S models each; of constants (S, 1, 1)."""
    tables = {key: np.array(one) for key, one in polynomials.items()}
    found = {key: one[:, None].astype(complex) for key, one in tables.items() if one.shape[1] == 1}
    varying = [key for key, one in tables.items() if one.shape[1] > 1]
    if varying:
        longest = max(tables[key].shape[1] for key in varying)
        models = len(tables[varying[0]])
        rows = np.zeros((len(varying), models, longest))
        for row, key in zip(rows, varying, strict=True):
            row[:, : tables[key].shape[1]] = tables[key]
        at_q = evaluate(rows.reshape(-1, longest), q).reshape(len(varying), models, 1, q.size)
        found |= dict(zip(varying, at_q, strict=True))
    return found


def powers(q: ComplexArray, highest: int) -> list[ComplexArray]:
    """Return the powers of q up to the `highest`, from q^0 on; at least up to the first."""
    found = [np.ones_like(q), q]
    for _ in range(highest - 1):
        found.append(found[-1] * q)
    return found


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
    value = _horner(matrix[..., None, :], q)
    *leading, rows, columns, last = range(value.ndim)
    return value.transpose(*leading, last, rows, columns)


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
