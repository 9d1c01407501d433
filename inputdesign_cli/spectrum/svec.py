"""Symmetric matrices as vectors: the upper triangle by columns, off-diagonal entries times sqrt(2).

The scaling makes svec(A) . svec(B) = tr(A B); the order is the one that Clarabel uses ([goulart-chen-2024]).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array


@lru_cache(maxsize=64)
def svec_layout(order: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Array]:
    """Return row, column and scale of each entry of svec of an (order, order) matrix."""
    columns, rows = np.tril_indices(order)
    return rows, columns, np.where(rows == columns, 1.0, np.sqrt(2.0))


def svec_length(order: int) -> int:
    """Return the number of entries of svec of an (order, order) matrix."""
    return order * (order + 1) // 2


def svec(matrix: NDArray[np.float64]) -> Array:
    """Return symmetric matrices (..., k, k) as vectors (..., k (k + 1) / 2)."""
    rows, columns, scale = svec_layout(matrix.shape[-1])
    return matrix[..., rows, columns] * scale


def smat(vector: Array) -> Array:
    """Return the inverse of `svec` for a single vector."""
    order = int((np.sqrt(8 * vector.size + 1) - 1) / 2)
    rows, columns, scale = svec_layout(order)
    matrix = np.zeros((order, order))
    matrix[rows, columns] = vector / scale
    matrix[columns, rows] = vector / scale
    return matrix


@lru_cache(maxsize=64)
def hvec_layout(order: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Array, NDArray[np.bool_]]:
    """Return row, column, scale and whether imaginary of each entry of hvec of an (order, order) matrix."""
    columns, rows = np.tril_indices(order)
    copies = np.where(rows == columns, 1, 2)
    imaginary = np.zeros(int(copies.sum()), dtype=bool)
    imaginary[np.cumsum(copies)[copies == 2] - 1] = True
    rows, columns = np.repeat(rows, copies), np.repeat(columns, copies)
    return rows, columns, np.where(rows == columns, 1.0, np.sqrt(2.0)), imaginary


def hvec(matrix: NDArray[np.complex128]) -> Array:
    """Return Hermitian (..., k, k) as real vectors (..., k^2), by columns; tr(A B) is the inner product."""
    rows, columns, scale, imaginary = hvec_layout(matrix.shape[-1])
    entries = matrix[..., rows, columns] * scale
    return np.where(imaginary, entries.imag, entries.real)


def hmat(vector: Array) -> NDArray[np.complex128]:
    """Return the inverse of `hvec` for a single vector."""
    order = round(np.sqrt(vector.size))
    rows, columns, scale, imaginary = hvec_layout(order)
    upper = np.zeros((order, order), dtype=complex)
    np.add.at(upper, (rows, columns), vector / scale * np.where(imaginary, 1j, 1.0))
    return upper + np.triu(upper, 1).conj().T
