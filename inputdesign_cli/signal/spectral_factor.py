"""Spectral factors by Wilson's method, of FIR spectra and of matrix spectra.

Phi(w) = |a_0 + a_1 e^{-jw} + .. + a_m e^{-jmw}|^2 with a of minimum phase: white noise of variance
one through a has the autocovariances c_0 .. c_m. [wilson-1969].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray

_MAX_STEPS = 100
_SETTLED = 1e-13
_MATRIX_STEPS = 60
_MATRIX_SETTLED = 1e-12


@dataclass(frozen=True)
class SpectralFactor:
    """Holds taps a (m + 1,), and `residual`, the largest error of their autocovariances relative to c_0."""

    taps: Array
    residual: float

    def filtered(self, samples: int, rng: np.random.Generator) -> Array:
        """Return stationary Gaussian noise, white noise of variance one through the taps, (samples,)."""
        noise = rng.standard_normal(samples + self.taps.size - 1)
        return np.convolve(noise, self.taps, "valid")


def spectral_factor(autocovariances: Array) -> SpectralFactor:
    """Return the minimum-phase factor of c_0 .. c_m.

    Each step solves a o delta + delta o a = c + a o a (correlations o), Newton's method for a o a = c. From a
    minimum-phase start all iterates stay so. At zeros on the unit circle it slows down to halving the error
    of a, while the residual, which is quadratic in it, still vanishes. The best iterate is returned with its
    residual for the caller to judge.
    """
    c = np.asarray(autocovariances, dtype=float)
    m = c.size - 1
    lags = np.arange(m + 1)
    difference, total = lags - lags[:, None], lags + lags[:, None]
    # Index m + 1 reads a zero behind the last tap.
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
    """Return the autocorrelation sum_i a_i a_{i+r} for r = 0 .. m."""
    return np.correlate(taps, taps, mode="full")[taps.size - 1 :]


def _residual(taps: Array, c: Array) -> float:
    return float(np.abs(autocorrelation(taps) - c).max() / c[0])


@dataclass(frozen=True)
class MatrixFactor:
    """Holds taps (L, n, n) of a causal factor, Phi = psi psi^*. Shares are of the spectrum's largest value.

    `residual` is the largest error of psi psi^* on a grid twice as fine as that of the factorisation;
    `floor` the amount added at the frequencies where the spectrum vanishes.
    """

    taps: Array
    residual: float
    floor: float

    def filtered(self, samples: int, rng: np.random.Generator) -> Array:
        """Return stationary noise through the taps (samples, n)."""
        import scipy.signal  # only now: see `plant.filtering`

        n = self.taps.shape[1]
        drive = rng.standard_normal((n, samples + self.taps.shape[0] - 1))
        out = np.zeros((samples, n))
        for i in range(n):
            for j in range(n):
                out[:, i] += scipy.signal.fftconvolve(drive[j], self.taps[:, i, j], mode="valid")
        return out


def matrix_factor(
    density: Callable[[Array], ComplexArray], *, points: int = 16384, floor: float = 1e-4
) -> MatrixFactor:
    """Factor the spectrum `density(w)` (K, n, n), w in [0, pi]: [wilson-1972], in the form with FFTs.

    Args:
        points: the points of the grid of the whole circle.
        floor: eigenvalues below this share of the largest one are raised to it.
    """
    half = np.pi * np.arange(points // 2 + 1) / (points // 2)
    Phi = density(half)
    values, vectors = np.linalg.eigh(Phi)
    peak = float(values.max())
    lifted = np.maximum(values, floor * peak)
    added = float((lifted - values).max() / peak)
    Phi = (vectors * lifted[:, None, :]) @ np.conj(np.swapaxes(vectors, 1, 2))
    psi = _wilson(Phi, points)
    taps = np.fft.irfft(psi, points, axis=0)[: points // 2]
    return MatrixFactor(taps, _matrix_residual(taps, density, points, floor * peak, peak), added)


def _wilson(Phi: ComplexArray, points: int) -> ComplexArray:
    n = Phi.shape[1]
    mean = np.fft.irfft(Phi, points, axis=0)[0]
    psi = np.broadcast_to(np.linalg.cholesky(mean).astype(complex), Phi.shape).copy()
    for _ in range(_MATRIX_STEPS):
        inverse = np.linalg.inv(psi)
        ratio = inverse @ Phi @ np.conj(np.swapaxes(inverse, 1, 2)) + np.eye(n)
        causal = np.fft.irfft(ratio, points, axis=0)
        causal[points // 2 :] = 0.0
        causal[0] *= 0.5
        # The skew part of the first tap is free; this choice keeps it lower triangular.
        causal[0] += np.triu(causal[0], 1).T - np.triu(causal[0], 1)
        change = np.fft.rfft(causal, points, axis=0)
        psi = psi @ change
        if np.abs(change - np.eye(n)).max() < _MATRIX_SETTLED:
            break
    return psi


def _matrix_residual(
    taps: Array, density: Callable[[Array], ComplexArray], points: int, floor: float, peak: float
) -> float:
    fine = 2 * points
    wanted = density(np.pi * np.arange(fine // 2 + 1) / (fine // 2))
    values, vectors = np.linalg.eigh(wanted)
    wanted = (vectors * np.maximum(values, floor)[:, None, :]) @ np.conj(np.swapaxes(vectors, 1, 2))
    got = np.fft.rfft(taps, fine, axis=0)
    return float(np.abs(got @ np.conj(np.swapaxes(got, 1, 2)) - wanted).max() / peak)
