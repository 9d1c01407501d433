"""Sums of sinusoids as functions of their phases, with the slopes that optimising them needs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray

Selection = Literal["odd"] | int | Sequence[int] | None


@dataclass(frozen=True)
class Sinusoids:
    """Sinusoids of mean squares `powers` (L,) at `frequencies` (L,) in rad/sample over `samples` samples.

    With `harmonics` (L,), integers, the frequencies are 2 pi harmonics / samples and the record is one
    period: then the FFT does the work.
    """

    frequencies: Array
    powers: Array
    samples: int
    harmonics: NDArray[np.int_] | None = None

    @classmethod
    def on_grid(cls, line_power: Array, samples: int) -> Sinusoids:
        """Return the lines of a period that carry power, from all powers (samples // 2 + 1,)."""
        kept = np.flatnonzero(line_power > 0).astype(np.int_)
        return cls(2 * np.pi * kept / samples, line_power[kept], samples, kept)

    @cached_property
    def real(self) -> NDArray[np.bool_]:
        """Return sinusoids at 0 and pi, which have a sign but no phase, (L,)."""
        return (self.frequencies < 1e-12) | (self.frequencies > np.pi - 1e-12)

    @cached_property
    def amplitudes(self) -> Array:
        """Return amplitudes A with mean square A^2 / 2, at 0 and pi A^2, (L,)."""
        return np.where(self.real, 1.0, np.sqrt(2.0)) * np.sqrt(np.maximum(self.powers, 0.0))

    @cached_property
    def _table(self) -> ComplexArray:
        """Return e^{j w t}, for lines off the grid, (samples, L)."""
        return np.exp(1j * np.outer(np.arange(self.samples), self.frequencies))

    def random_phases(self, rng: np.random.Generator) -> Array:
        """Return phases, uniform on the circle, (L,); 0 or pi where only a sign is free."""
        phases = 2.0 * np.pi * rng.random(self.frequencies.size)
        return np.where(self.real, np.where(phases < np.pi, 0.0, np.pi), phases)

    def schroeder_phases(self) -> Array:
        """Return phases whose group delay follows the share of power below each line, (L,).

        [schroeder-1970]: phi_n = phi_1 - 2 pi sum_{l<n} (n - l) p_l with the relative powers p_l. It presumes
        equally spaced lines; for others the phase is the integral of that group delay over frequency, which
        is the same thing.
        """
        share = self.powers / self.powers.sum()
        below = np.cumsum(share) - 0.5 * share
        delay = self.samples * below
        step = np.diff(self.frequencies, prepend=self.frequencies[:1])
        middle = 0.5 * (delay + np.concatenate([delay[:1], delay[:-1]]))
        phases = -np.cumsum(step * middle)
        return np.where(self.real, np.where(np.cos(phases) >= 0, 0.0, np.pi), phases)

    def record(self, phases: Array, gains: ComplexArray | None = None) -> Array:
        """Return the sum (.., samples), or its filtered values for `gains` (.., L) at the lines."""
        vectors = self._vectors(phases, gains)
        if self.harmonics is None:
            return (vectors @ self._table.T).real
        spectra = np.zeros((*vectors.shape[:-1], self.samples // 2 + 1), dtype=complex)
        spectra[..., self.harmonics] = vectors * np.where(self.real, 1.0, 0.5) * self.samples
        return np.fft.irfft(spectra, self.samples)

    def slopes(self, phases: Array, weights: Array, gains: ComplexArray | None = None) -> Array:
        """Return sum_t weight_t d record_t / d phase (.., L); zero where there is only a sign."""
        if self.harmonics is None:
            transform = weights @ self._table
        else:
            transform = np.fft.rfft(weights)[..., self.harmonics].conj()
        return np.where(self.real, 0.0, -(self._vectors(phases, gains) * transform).imag)

    def _vectors(self, phases: Array, gains: ComplexArray | None) -> ComplexArray:
        """Return complex amplitudes behind the filters (.., L)."""
        vector = self.amplitudes * np.exp(1j * phases)
        return vector if gains is None else vector * gains


def select(line_power: NDArray, lines: Selection) -> NDArray:
    """Gather the powers (P // 2 + 1, ..) of a period into some of its lines; the total is kept.

    The power of each line goes to the nearest chosen one, halves to both if two are equally near.

    Args:
        lines: "odd" harmonics, this many lines spread evenly over the powered band, harmonic numbers, or
            None for all.
    """
    if lines is None:
        return line_power
    top = len(line_power) - 1
    if lines == "odd":
        chosen = np.arange(1, top + 1, 2)
    elif isinstance(lines, int):
        chosen = np.unique(np.rint(np.linspace(1, top, min(lines, top))).astype(int))
    else:
        chosen = np.unique(np.asarray(lines, dtype=int))
    every = np.arange(len(line_power))
    right = np.clip(np.searchsorted(chosen, every), 0, chosen.size - 1)
    left = np.maximum(right - 1, 0)
    to_left, to_right = np.abs(every - chosen[left]), np.abs(chosen[right] - every)
    share = np.where(to_left < to_right, 1.0, np.where(to_left == to_right, 0.5, 0.0))
    share = share.reshape(-1, *np.ones(line_power.ndim - 1, dtype=int))
    gathered = np.zeros_like(line_power)
    np.add.at(gathered, chosen[left], share * line_power)
    np.add.at(gathered, chosen[right], (1.0 - share) * line_power)
    return gathered
