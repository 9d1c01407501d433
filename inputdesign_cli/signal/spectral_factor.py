"""Spectral factors of FIR spectra by Wilson's method.

Phi(w) = |a_0 + a_1 e^{-jw} + .. + a_m e^{-jmw}|^2 with a of minimum phase: white noise of variance
one through a has the autocovariances c_0 .. c_m. [wilson-1969].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array

_MAX_STEPS = 100
_SETTLED = 1e-13


@dataclass(frozen=True)
class SpectralFactor:
    """The taps a (m + 1,), and `residual`, the largest error of their autocovariances relative to c_0."""

    taps: Array
    residual: float

    def filtered(self, samples: int, rng: np.random.Generator) -> Array:
        """(samples,): stationary Gaussian noise, white noise of variance one through the taps."""
        noise = rng.standard_normal(samples + self.taps.size - 1)
        return np.convolve(noise, self.taps, "valid")


def spectral_factor(autocovariances: Array) -> SpectralFactor:
    """The minimum-phase factor of c_0 .. c_m.

    Each step solves a o delta + delta o a = c + a o a (correlations o), Newton's method for
    a o a = c. From a minimum-phase start all iterates stay so; at zeros on the unit circle it
    slows down to halving the error of a, while the residual, which is quadratic in it, still
    vanishes. The best iterate is returned with its residual for the caller to judge.
    """
    c = np.asarray(autocovariances, dtype=float)
    m = c.size - 1
    lags = np.arange(m + 1)
    difference, total = lags - lags[:, None], lags + lags[:, None]
    # One past the last tap stands a zero.
    toeplitz = np.where(difference < 0, m + 1, difference)
    hankel = np.minimum(total, m + 1)
    taps = np.zeros(m + 1)
    taps[0] = np.sqrt(np.abs(c).sum())
    best = SpectralFactor(taps, _residual(taps, c))
    for _ in range(_MAX_STEPS):
        padded = np.append(taps, 0.0)
        try:
            taps = np.linalg.solve(padded[toeplitz] + padded[hankel], c + autocorrelation(taps))
        except np.linalg.LinAlgError:
            break
        residual = _residual(taps, c)
        if not np.isfinite(residual):
            break
        if residual < best.residual:
            best = SpectralFactor(taps, residual)
        if best.residual < _SETTLED:
            break
    return best


def autocorrelation(taps: Array) -> Array:
    """sum_i a_i a_{i+r} for r = 0 .. m."""
    return np.correlate(taps, taps, mode="full")[taps.size - 1 :]


def _residual(taps: Array, c: Array) -> float:
    return float(np.abs(autocorrelation(taps) - c).max() / c[0])
