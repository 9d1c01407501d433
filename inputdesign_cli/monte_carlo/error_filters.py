"""What the error of an estimated model makes of r - v: polynomial matrices of many runs at once."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.loop_error.laws import complement
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.plant import TransferMatrix
from inputdesign_cli.plant.polynomial_matrix import delay_of, determinant_and_adjugate, multiply
from inputdesign_cli.plant.transfer import product_of


def error_filters(plant: MatrixPlant, target: TransferMatrix, A: Array, B: Array) -> tuple[Array, Array]:
    """Numerators (runs, n, n, l) and denominators (runs, m) of what follows `prefilter` in each run.

    With polynomials R_i = A_i of the true plant, T = T_n / d and P = rho det d I + E' T_n, the filter
    from r - v to y - y0 is (d I - T_n) adj(P) E' / det(P) after T.

    Args:
        A, B: polynomials of the estimates, (runs, n, p) and (runs, n, n, q).
    """
    n, runs = plant.outputs, A.shape[0]
    T, d = target.common_fraction()
    rows = plant.per_output(plant.A)
    common = all(np.array_equal(rows[0], a) for a in rows)
    rho = product_of(rows[:1] if common else rows)
    # rho R^-1 N, with R the diagonal of the A: a polynomial matrix again.
    scaled = np.zeros((1, n, n, plant.numerator.shape[-1] + rho.size - 1))
    for i in range(n):
        rest = np.ones(1) if common else product_of((*rows[:i], *rows[i + 1 :]))
        for j in range(n):
            product = np.convolve(rest, plant.numerator[i, j])
            scaled[0, i, j, : product.size] = product
    det, adj = determinant_and_adjugate(B)
    estimated = np.zeros((runs, n, n, A.shape[-1]))
    estimated[:, np.arange(n), np.arange(n)] = A
    ratio = multiply(multiply(scaled, adj), estimated)
    bare = _times(det[:, None, None], rho)
    error = _plus(ratio, -_on_diagonal(bare, n))
    lead = _times(bare, d)
    through = multiply(error, T[None])
    det_P, adj_P = determinant_and_adjugate(_plus(_on_diagonal(lead, n), through))
    numerator = multiply(adj_P, error)
    if not _is_scalar(T):
        numerator = multiply(complement(T, d)[None], numerator)
    shift = delay_of(det_P)
    lengths = max(numerator.shape[-1], det_P.shape[-1]) - shift
    above, below = (_trimmed(_resized(p[..., shift:], lengths)) for p in (numerator, det_P))
    return above, below


def prefilter(target: TransferMatrix) -> TransferMatrix:
    """The part of the filter from r - v to y - y0 that is the same in all runs, applied first.

    It is T in general. For T = t I what `error_filters` begins with commutes with everything, and joins it.
    """
    T, d = target.common_fraction()
    if not _is_scalar(T):
        return target
    return TransferMatrix(multiply(complement(T, d), T), ((d,),) * len(T))


def _is_scalar(numerator: Array) -> bool:
    """Whether a matrix of polynomials (n, n, l) is a multiple of I."""
    return np.array_equal(numerator, np.eye(len(numerator))[:, :, None] * numerator[0, 0])


def _trimmed(polynomials: Array) -> Array:
    """Without coefficients at the end that vanish in all runs."""
    held = np.flatnonzero(np.any(polynomials.reshape(-1, polynomials.shape[-1]) != 0, axis=0))
    return polynomials[..., : int(held[-1]) + 1 if held.size else 1]


def _times(left: Array, right: Array) -> Array:
    """Polynomials (.., l) times one polynomial (m,)."""
    product = np.zeros((*left.shape[:-1], left.shape[-1] + right.size - 1))
    for lag, factor in enumerate(right):
        product[..., lag : lag + left.shape[-1]] += factor * left
    return product


def _plus(left: Array, right: Array) -> Array:
    size = max(left.shape[-1], right.shape[-1])
    return _resized(left, size) + _resized(right, size)


def _resized(polynomial: Array, size: int) -> Array:
    """Padded with zeros at the end, or cut there."""
    missing = size - polynomial.shape[-1]
    if missing <= 0:
        return polynomial[..., :size]
    return np.concatenate([polynomial, np.zeros((*polynomial.shape[:-1], missing))], axis=-1)


def _on_diagonal(polynomial: Array, n: int) -> Array:
    """(runs, n, n, l) from (runs, 1, 1, l) or (runs, l)."""
    rows = polynomial.reshape(polynomial.shape[0], 1, 1, polynomial.shape[-1])
    return rows * np.eye(n)[:, :, None]
