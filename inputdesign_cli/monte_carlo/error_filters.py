"""What the error of an estimated model makes of r - v: polynomial matrices of many runs at once."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.loop_error.desired_loop import DesiredLoop
from inputdesign_cli.design.loop_error.laws import complement
from inputdesign_cli.design.loop_error.plant import MatrixPlant
from inputdesign_cli.plant import TransferMatrix
from inputdesign_cli.plant.polynomial import delay_of, determinant_and_adjugate, multiply
from inputdesign_cli.plant.transfer import product_of


def error_filters(plant: MatrixPlant, desired: DesiredLoop, A: Array, B: Array) -> tuple[Array, Array]:
    """Return numerators (runs, n, n, l) and denominators (runs, m) of the filter behind `prefilter`.

    The loop of an estimate is (I + E) T' (I + E T')^-1 with E = G G_hat^-1 - I and T' = b' F, where b' =
    det / m keeps the zeros of the estimate. With E = E' / (rho det), F = F_n / d and P = rho m d I + E' F_n,

        y - y0 = (d I - F_n) adj(P) E' / det(P) F (r - v)                               where b is one, and
        y - y0 = adj(P) ((b_d d - b_n f) E' + (det b_d - b_n m) rho d I) / det(P) f / (b_d d) (r - v)

    for F = f I / d and b = b_n / b_d of the true plant. No factor outside the circle has to cancel.

    Args:
        A, B: polynomials of the estimates, (runs, n, p) and (runs, n, n, q).
    """
    n, runs = plant.outputs, A.shape[0]
    F, d = desired.free.common_fraction()
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
    inside = desired.mirrored(det)
    error = _plus(ratio, -_on_diagonal(_times(det, rho), n))
    lead = _times(_times(inside, rho), d)
    det_P, adj_P = determinant_and_adjugate(_plus(_on_diagonal(lead, n), multiply(error, F[None])))
    if _is_scalar(F):
        b_n, b_d = desired.kept.numerator, desired.kept.denominator_polynomial
        late = _plus(np.convolve(b_d, d), -np.convolve(b_n, F[0, 0]))
        moved = _times(_times(_plus(_times(det, b_d), -_times(inside, b_n)), rho), d)
        numerator = multiply(adj_P, _plus(_times(error, late), _on_diagonal(moved, n)))
    else:
        numerator = multiply(complement(F, d)[None], multiply(adj_P, error))
    shift = delay_of(det_P)
    lengths = max(numerator.shape[-1], det_P.shape[-1]) - shift
    above, below = (_trimmed(_resized(p[..., shift:], lengths)) for p in (numerator, det_P))
    return above, below


def prefilter(desired: DesiredLoop) -> TransferMatrix:
    """The part of the filter from r - v to y - y0 that is the same in all runs, applied first."""
    F, d = desired.free.common_fraction()
    if not _is_scalar(F):
        return desired.free
    return TransferMatrix(F, ((d, desired.kept.denominator_polynomial),) * len(F))


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


def _on_diagonal(polynomials: Array, n: int) -> Array:
    """(runs, n, n, l) from (runs, l)."""
    return polynomials[:, None, None] * np.eye(n)[:, :, None]
