"""Moments without structure: [eckhard-mse] Theorem 2 in a form that is stable for alpha = 0 and L2 = 0.

The optimal R is rank one, along v = [L1; (1 + k) L2]: regressors that move together in one direction.
"""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.regression.model import Regression


def least_energy(regression: Regression, target: float) -> Array:
    """Return the R (n, n) of least trace with worst mean-squared error `target` ([eckhard-mse], Theorem 2).

    k solves k^2 |L2|^2 alpha^2 + k S + gamma = 0. k and 1 + k, which solves another quadratic, are both
    written as the quotient with a sum of terms of one sign. So nothing cancels and nothing is divided by
    alpha or |L2|.
    """
    a2 = regression.neglected_norm**2
    first = a2 * float(regression.estimated @ regression.estimated)
    second = a2 * float(regression.neglected @ regression.neglected)
    S = first + second + target
    # S^2 - 4 |L2|^2 gamma alpha^2 as a sum of squares.
    root = np.sqrt((first + second - target) ** 2 + 4.0 * target * first)
    k = -2.0 * target / (S + root)
    T = S - 2.0 * second
    kept = 2.0 * first / (T + root) if T >= 0.0 else (root - T) / (2.0 * second)
    v = np.concatenate([regression.estimated, kept * regression.neglected])
    return regression.variance * np.outer(v, v) / (target - k**2 * second)


def least_error(regression: Regression, energy: float) -> Array:
    """Return the R of trace `energy` with the least worst mean-squared error, (n, n).

    By [eckhard-mse], Lemma 1, the error of R along v = [L1; L2 + delta] is
    alpha^2 |delta|^2 + sigma^2 |v|^2 / energy, a quadratic in delta with its minimum at
    delta = -sigma^2 L2 / (alpha^2 energy + sigma^2).
    """
    gain = regression.neglected_norm**2 * energy
    v = np.concatenate([regression.estimated, gain / (gain + regression.variance) * regression.neglected])
    return energy * np.outer(v, v) / (v @ v)


def energy_bound(regression: Regression, target: float, R: Array) -> float:
    """Return a lower bound on the least energy of any R >= 0, whatever its structure.

    Energy is at least |y|^2 / q for y = [L1; z], z = R21 w, and q = w^T R11 w (Schur complement), and
    |y|^2 / q >= 2 s^T y - q |s|^2 for every s. With sigma^2 q <= gamma - alpha^2 |z - L2|^2 the minimum
    over z is explicit. s is read off `R`; the bound holds for any s.
    """
    s = _slope(regression, R)
    size = float(s @ s)
    a2, variance = regression.neglected_norm**2, regression.variance
    linear = 2.0 * float(s @ np.concatenate([regression.estimated, regression.neglected]))
    second = float(s[regression.m :] @ s[regression.m :])
    if second == 0.0:
        shift = 0.0
    elif a2 > 0.0:
        shift = second * variance / (a2 * size)
    else:
        return 0.0  # z is free, and s weighs it
    return linear - size * target / variance - shift


def error_bound(regression: Regression, energy: float) -> float:
    """Return a lower bound on the error of any R >= 0 of trace `energy`, whatever its structure.

    The error is at least alpha^2 |d|^2 + sigma^2 (|L1|^2 + |L2 + d|^2) / E for some d. Further, alpha^2 |d|^2
    >= 2 p^T d - |p|^2 / alpha^2 for every p. The p of the optimum is taken.
    """
    a2, variance = regression.neglected_norm**2, regression.variance
    fixed = variance * float(regression.estimated @ regression.estimated) / energy
    if a2 == 0.0:
        return fixed
    p = -a2 * variance / (a2 * energy + variance) * regression.neglected
    size = float(p @ p)
    return fixed - size / a2 - 2.0 * float(p @ regression.neglected) - size * energy / variance


def _slope(regression: Regression, R: Array) -> Array:
    reached = regression.bias(R) + regression.neglected
    if regression.neglected_norm == 0.0:
        reached = np.zeros_like(reached)
    y = np.concatenate([regression.estimated, reached])
    return y * (float(np.trace(R)) / float(y @ y))
