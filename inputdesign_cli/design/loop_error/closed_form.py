"""The spectrum that is best at each frequency, given what a unit of power costs there.

Minimising tr(A Phi^-1) + tr(M Phi) over Phi gives A = Phi M Phi, hence
Phi = M^-1/2 (M^1/2 A M^1/2)^1/2 M^-1/2; with M = I it is A^1/2 = Z^{T/2} ([rojas-asymptotic], Section VI).
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.loop_error.weight import adjoint


def eigen(matrix: ComplexArray) -> tuple[Array, ComplexArray]:
    """Eigenvalues (K, n), rounding below zero removed, and eigenvectors of Hermitian matrices."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + adjoint(matrix)))
    return np.maximum(values, 0.0), vectors


def power_of(matrix: ComplexArray, exponent: float) -> ComplexArray:
    """A Hermitian nonnegative matrix to a power, for each frequency."""
    values, vectors = eigen(matrix)
    with np.errstate(divide="ignore"):
        scaled = vectors * (values**exponent)[:, None, :]
    return np.asarray(scaled @ adjoint(vectors))


def best_spectrum(A: ComplexArray, M: ComplexArray) -> ComplexArray:
    """Phi (K, n, n) from A = Z^T and the price M > 0 of power, both (K, n, n)."""
    outer, inner = power_of(M, 0.5), power_of(M, -0.5)
    return np.asarray(inner @ power_of(outer @ A @ outer, 0.5) @ inner)


def error_of(A: ComplexArray, Phi: ComplexArray) -> Array:
    """(K,): tr(A Phi^-1), zero where A is, infinite where A acts on the null space of Phi."""
    values, vectors = eigen(Phi)
    share = np.einsum("kai,kab,kbi->ki", np.conj(vectors), A, vectors).real
    negligible = share <= 1e-14 * np.abs(share).max(initial=0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.where(negligible & (values <= 0), 0.0, share / values)
    return parts.sum(axis=1)
