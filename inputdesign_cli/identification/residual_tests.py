"""Test whether residuals are white, and independent of past inputs. [ljung-1999], Section 16.6.

For several outputs all channels are tested at once, in units of the residuals' own covariance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.records import shifted

# Two-sided 99 % of the normal distribution: the band of a single correlation.
_BAND = 2.5758293035489004


@dataclass(frozen=True)
class ResidualTest:
    """A chi-squared test over several lags.

    Attributes:
        lags: (n,).
        correlation: (n, p, columns), normalised; entry (i, j) of lag tau is that of residual i and of
            residual or input j, tau samples earlier.
        limit: a single correlation of white noise stays within +- limit with probability 0.99.
        statistic, freedom: chi-squared with this many degrees of freedom if the model is right.
        probability: of a statistic at least as large if the model is right; small values refute it.
    """

    lags: Array
    correlation: NDArray[np.float64]
    limit: float
    statistic: float
    freedom: int
    probability: float


def whiteness(
    errors: Array, *, lags: int = 25, fitted: int = 0, lengths: Sequence[int] | None = None
) -> ResidualTest:
    """Return correlations of the residuals (samples, p) among all outputs at the lags 1 .. `lags`.

    The portmanteau statistic of [hosking-1980], with the weights of [ljung-box-1978], to which it reduces for
    one output.

    Args:
        errors: (samples, p).
        lags: how many.
        fitted: number of estimated parameters of the noise model, which make residuals look whiter.
        lengths: of the records that follow each other; None for one.
    """
    n, p = errors.shape
    at = np.arange(1, _most_lags(n, p * p, lags, fitted) + 1)
    products = np.array([errors.T @ shifted(errors, int(tau), lengths or (n,)) for tau in at])
    power = errors.T @ errors
    whitener = np.linalg.inv(np.linalg.cholesky(power))
    squares = np.sum((whitener @ products @ whitener.T) ** 2, axis=(1, 2))
    rms = np.sqrt(np.diag(power))
    statistic = n * (n + 2) * np.sum(squares / (n - at))
    return _test(at, products / np.outer(rms, rms), n, statistic, p * p * at.size - fitted)


def cross_correlations(
    errors: Array,
    u: Array,
    *,
    lags: int = 25,
    fitted: int = 0,
    feedback: bool = False,
    lengths: Sequence[int] | None = None,
) -> ResidualTest:
    """Do the past inputs u(t), u(t - 1), .. explain residuals? A score test of a regression on them.

    Args:
        errors, u: (samples, p), (samples, r).
        lags: how far back the inputs are looked at.
        fitted: number of estimated parameters of the plant, which take as many directions away.
        feedback: whether u(t) answers y(t), hence e(t); then the past begins with u(t - 1).
        lengths: see `whiteness`.
    """
    n, p = errors.shape
    r = u.shape[1]
    at = np.arange(_most_lags(n, r, lags, fitted)) + int(feedback)
    past = np.stack([shifted(u, int(tau), lengths or (n,)) for tau in at], axis=1)
    regressors = past.reshape(n, -1)
    left, singular, _ = np.linalg.svd(regressors, full_matrices=False)
    left = left[:, singular > 1e-9 * singular[0]]
    covariance = errors.T @ errors / n
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    statistic = np.sum((left.T @ errors @ whitener.T) ** 2)
    products = np.einsum("np,nlr->lpr", errors, past)
    rms = np.sqrt(np.outer(np.diag(covariance), np.mean(u**2, axis=0)))
    return _test(at, products / (n * rms), n, statistic, max(p * left.shape[1] - fitted, 1))


def _most_lags(samples: int, pairs: int, lags: int, fitted: int) -> int:
    """As many lags as asked for, fewer in a short record, enough for some freedom to be left."""
    return max(min(lags, samples // (4 * pairs)), fitted // pairs + 1)


def _test(at: NDArray, correlation: NDArray, samples: int, statistic: float, freedom: int) -> ResidualTest:
    probability = float(scipy.special.chdtrc(freedom, statistic))
    limit = _BAND / np.sqrt(samples)
    return ResidualTest(at.astype(float), correlation, limit, float(statistic), freedom, probability)
