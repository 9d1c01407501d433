"""What theory says of the loss of a run: the root of a quadratic form of Gaussian parameter errors."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.plant.polynomial import Array

_REACH = 90.0
_STEP = 0.02


def error_eigenvalues(W: Array, covariance: Array) -> Array:
    """Eigenvalues of P^1/2 W P^1/2, nonnegative: the weights of the squared normal variables."""
    root = np.linalg.cholesky(covariance)
    return np.asarray(np.maximum(np.linalg.eigvalsh(root.T @ W @ root), 0.0))


def root_moments(eigenvalues: Array) -> tuple[float, float]:
    """Mean and standard deviation of sqrt(sum_i eigenvalue_i z_i^2), z_i standard normal.

    E sqrt(Q) = (1 / 2 sqrt(pi)) integral over s > 0 of (1 - E exp(-s Q)) s^-3/2, and
    E exp(-s Q) = prod (1 + 2 s eigenvalue_i)^-1/2; the trapezoidal rule in log s is exact to rounding.
    """
    scale = float(eigenvalues.sum())
    s = np.arange(-_REACH, _REACH, _STEP)
    logarithm = -0.5 * np.log1p(2 * np.exp(s)[:, None] * eigenvalues / scale).sum(axis=1)
    mean = float(np.sum(-np.expm1(logarithm) * np.exp(-0.5 * s))) * _STEP / (2 * np.sqrt(np.pi))
    return mean * np.sqrt(scale), float(np.sqrt(max(scale * (1 - mean**2), 0.0)))
