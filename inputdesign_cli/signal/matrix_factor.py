"""Causal factors of matrix spectra, by Wilson's method on a grid of the circle.

Phi = psi psi^*, psi causal with causal inverse: white noise of covariance I through psi has the spectrum.
[wilson-1972], in the form with FFTs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array, ComplexArray

_MAX_STEPS = 60
_SETTLED = 1e-12


@dataclass(frozen=True)
class MatrixFactor:
    """Taps (L, n, n) of psi; `residual` and `floor` are relative to the largest value of the spectrum.

    `residual` is the largest error of psi psi^* on a grid twice as fine as that of the factorisation;
    `floor` what had to be added at the frequencies where the spectrum vanishes.
    """

    taps: Array
    residual: float
    floor: float

    def filtered(self, samples: int, rng: np.random.Generator) -> Array:
        """(samples, n): stationary noise through the taps."""
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
    """Factor the spectrum `density(w)` (K, n, n), w in [0, pi].

    Args:
        points: of the grid of the whole circle.
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
    return MatrixFactor(taps, _residual(taps, density, points, floor * peak, peak), added)


def _wilson(Phi: ComplexArray, points: int) -> ComplexArray:
    n = Phi.shape[1]
    mean = np.fft.irfft(Phi, points, axis=0)[0]
    psi = np.broadcast_to(np.linalg.cholesky(mean).astype(complex), Phi.shape).copy()
    for _ in range(_MAX_STEPS):
        inverse = np.linalg.inv(psi)
        ratio = inverse @ Phi @ np.conj(np.swapaxes(inverse, 1, 2)) + np.eye(n)
        causal = np.fft.irfft(ratio, points, axis=0)
        causal[points // 2 :] = 0.0
        causal[0] *= 0.5
        # The skew part of the first tap is free; this choice keeps it lower triangular.
        causal[0] += np.triu(causal[0], 1).T - np.triu(causal[0], 1)
        change = np.fft.rfft(causal, points, axis=0)
        psi = psi @ change
        if np.abs(change - np.eye(n)).max() < _SETTLED:
            break
    return psi


def _residual(
    taps: Array, density: Callable[[Array], ComplexArray], points: int, floor: float, peak: float
) -> float:
    fine = 2 * points
    wanted = density(np.pi * np.arange(fine // 2 + 1) / (fine // 2))
    values, vectors = np.linalg.eigh(wanted)
    wanted = (vectors * np.maximum(values, floor)[:, None, :]) @ np.conj(np.swapaxes(vectors, 1, 2))
    got = np.fft.rfft(taps, fine, axis=0)
    return float(np.abs(got @ np.conj(np.swapaxes(got, 1, 2)) - wanted).max() / peak)
