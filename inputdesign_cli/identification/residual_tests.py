"""Is what the model leaves unexplained white, and free of the past input? Ljung (1999), Section 16.6."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.special

from inputdesign_cli.plant.polynomial import Array

# Two-sided 99 % of the normal distribution: the band of a single correlation.
_BAND = 2.5758293035489004


@dataclass(frozen=True)
class ResidualTest:
    """A chi-squared test over several lags.

    Attributes:
        lags, correlation: (n,) normalised correlations.
        limit: a single correlation of white noise stays within +- limit with probability 0.99.
        statistic, freedom: chi-squared with this many degrees of freedom if the model is right.
        probability: of a statistic at least as large if the model is right; small values refute it.
    """

    lags: Array
    correlation: Array
    limit: float
    statistic: float
    freedom: int
    probability: float


def whiteness(errors: Array, *, lags: int = 25, fitted: int = 0) -> ResidualTest:
    """Autocorrelation of the residuals (samples,) at the lags 1 .. `lags` (statistic of Ljung and Box).

    Args:
        fitted: number of estimated parameters of the noise model, which make residuals look whiter.
    """
    n = errors.size
    lags = max(min(lags, n // 4), fitted + 1)
    at = np.arange(1, lags + 1)
    power = float(errors @ errors)
    r = np.array([errors[tau:] @ errors[:-tau] for tau in at]) / power
    statistic = float(n * (n + 2) * np.sum(r**2 / (n - at)))
    freedom = lags - fitted
    probability = float(scipy.special.chdtrc(freedom, statistic))
    return ResidualTest(at.astype(float), r, _BAND / np.sqrt(n), statistic, freedom, probability)


def cross_correlation(errors: Array, u: Array, *, lags: int = 25, fitted: int = 0) -> ResidualTest:
    """Do the past inputs u(t), u(t - 1), .. explain residuals? A score test of a regression on them.

    Args:
        fitted: number of estimated parameters of the plant, which take as many directions away.
    """
    n = errors.size
    lags = max(min(lags, n // 4), fitted + 1)
    at = np.arange(lags)
    past = np.stack([np.concatenate([np.zeros(tau), u[: n - tau]]) for tau in at], axis=1)
    left, singular, _ = np.linalg.svd(past, full_matrices=False)
    left = left[:, singular > 1e-9 * singular[0]]
    variance = float(np.mean(errors**2))
    statistic = float(np.sum((left.T @ errors) ** 2) / variance)
    freedom = max(left.shape[1] - fitted, 1)
    r = past.T @ errors / (n * np.sqrt(variance * np.mean(u**2)))
    probability = float(scipy.special.chdtrc(freedom, statistic))
    return ResidualTest(at.astype(float), r, _BAND / np.sqrt(n), statistic, freedom, probability)
