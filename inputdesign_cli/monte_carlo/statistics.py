"""Statistics of a finite number of runs: confidence limits of a fraction, the spread of covariances."""

from __future__ import annotations

import numpy as np
import scipy

from inputdesign_cli.arrays import Array

_DRAWS = 2000  # Wishart matrices


def binomial_limits(successes: int, runs: int, *, confidence: float = 0.95) -> tuple[float, float]:
    """Return exact two-sided confidence limits of a probability, [clopper-pearson-1934]."""
    tail = 0.5 * (1.0 - confidence)
    lower = 0.0 if successes == 0 else scipy.special.betaincinv(successes, runs - successes + 1, tail)
    upper = 1.0 if successes == runs else scipy.special.betaincinv(successes + 1, runs - successes, 1 - tail)
    return float(lower), float(upper)


def wishart_range(
    size: int, runs: int, rng: np.random.Generator, *, confidence: float = 0.99
) -> tuple[float, float]:
    """Return a range for all eigenvalues of the sample covariance of `runs` vectors N(0, I) at once.

    The Wishart distribution is drawn from by the decomposition of [bartlett-1933].
    """
    degrees = runs - 1
    lower = np.tril(rng.standard_normal((_DRAWS, size, size)), -1)
    diagonal = np.sqrt(rng.chisquare(np.maximum(degrees - np.arange(size), 1), (_DRAWS, size)))
    lower[:, np.arange(size), np.arange(size)] = diagonal
    values = np.linalg.eigvalsh(lower @ lower.transpose(0, 2, 1)) / degrees
    tail = 0.5 * (1.0 - confidence)
    return float(np.quantile(values[:, 0], tail)), float(np.quantile(values[:, -1], 1.0 - tail))


def whitened_eigenvalues(estimates: Array, information: Array) -> Array:
    """Return the eigenvalues (k,) of the covariance of `estimates` (runs, k) in units of M^-1, near one."""
    centred = estimates - estimates.mean(axis=0)
    # By a factor of M scaled to a unit diagonal, as M itself may have a condition number of 1e12.
    scale = np.sqrt(np.diag(information))
    factor = np.linalg.cholesky(information / np.outer(scale, scale))
    whitened = (centred * scale) @ factor
    return np.linalg.svd(whitened, compute_uv=False)[::-1] ** 2 / max(len(estimates) - 1, 1)
