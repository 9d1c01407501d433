"""The best spectrum at each frequency, given the price of a unit of power there.

Minimising tr(A Phi^-1) + tr(M Phi) over Phi gives A = Phi M Phi, hence
Phi = M^-1/2 (M^1/2 A M^1/2)^1/2 M^-1/2; with M = I it is A^1/2 = Z^{T/2} ([rojas-asymptotic], Section VI).
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.loop_error.laws import sensitivity


def eigen(matrix: ComplexArray) -> tuple[Array, ComplexArray]:
    """Return eigenvalues (K, n), rounding below zero removed, and eigenvectors of Hermitian matrices."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + adjoint(matrix)))
    return np.maximum(values, 0.0), vectors


def power_of(matrix: ComplexArray, exponent: float) -> ComplexArray:
    """Raise a Hermitian nonnegative matrix to a power, for each frequency."""
    values, vectors = eigen(matrix)
    with np.errstate(divide="ignore"):
        scaled = vectors * (values**exponent)[:, None, :]
    return np.asarray(scaled @ adjoint(vectors))


def best_spectrum(A: ComplexArray, M: ComplexArray) -> ComplexArray:
    """Return the best spectrum Phi (K, n, n) for A = Z^T and the price M > 0 of power, both (K, n, n)."""
    outer, inner = power_of(M, 0.5), power_of(M, -0.5)
    return np.asarray(inner @ power_of(outer @ A @ outer, 0.5) @ inner)


def error_of(A: ComplexArray, Phi: ComplexArray) -> Array:
    """Return tr(A Phi^-1), zero where A is zero, infinite where A acts on the null space of Phi, (K,)."""
    values, vectors = eigen(Phi)
    share = np.einsum("kai,kab,kbi->ki", np.conj(vectors), A, vectors).real
    negligible = share <= 1e-14 * np.abs(share).max(initial=0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        parts = np.where(negligible & (values <= 0), 0.0, share / values)
    return parts.sum(axis=1)


def adjoint(matrix: ComplexArray) -> ComplexArray:
    """Return the conjugate transpose for each frequency."""
    return np.conj(np.swapaxes(matrix, -1, -2))


def weight(T: ComplexArray, G: ComplexArray, entering: ComplexArray, noise: ComplexArray) -> ComplexArray:
    """Return the weight Z (K, n, n) of the variance of the plant estimate in the error of a loop T at G.

    [rojas-asymptotic] (19) without the factor n/(2 pi N): for n = 1, N E||y - y0||^2 is the mean over
    frequency of tr(Z Phi^-T). C S = G^-1 T is finite where S has a zero and C a pole.

    Args:
        entering: Phi_r + Phi_v, the spectrum that drives the error of the loop.
        noise: Phi_v.
    """
    S, CS = sensitivity(T), np.linalg.inv(G) @ T
    passed = np.trace(S @ noise @ adjoint(S), axis1=1, axis2=2).real
    return np.asarray(passed[:, None, None] * np.conj(CS @ entering @ adjoint(CS)))
