"""Simulate transfer matrices in s driven by samples, exactly between the samples.

Everything is at rest before the record. With a hold, outputs come from the plant behind it. Without, what
is applied is the band-limited interpolation of the samples and of zeros around them, as many on each side,
and the outputs are read at the same instants. Both by FFT: an entry is one chain of states in time, of which
its output and all its gradients are linear combinations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.plant.held import HeldEntry, integrators

# Rounding grows by e to this power over a record.
_DECAY = 4.0


@dataclass(frozen=True)
class Intersample:
    """Instants `sample_time` apart between which signals are held (`hold`), or band-limited."""

    sample_time: float
    hold: bool

    def responses(self, entry: HeldEntry, signal: Array, *, hold: bool) -> NDArray[np.float64]:
        """The columns (.., N, columns) of an entry that samples (.., N) drive from rest.

        Measured outputs are never held, whatever the input is.
        """
        samples = signal.shape[-1]
        length = 2 * scipy.fft.next_fast_len(samples, real=True)
        angles = 2.0 * np.pi * np.arange(length // 2 + 1) / length
        if not integrators(entry.denominator):
            weights, w = np.ones(samples), angles.astype(complex)
        else:  # they have no response at zero: signals are weighted with e^(-rho t)
            decay = _DECAY / samples
            weights, w = np.exp(-decay * np.arange(samples)), angles - 1j * decay
        z = np.exp(1j * w)
        columns = entry.responses(z) if hold else entry.interpolated(w / self.sample_time)
        columns = entry.forgetting(columns, z, samples)
        transform = scipy.fft.rfft(signal * weights, length, axis=-1)
        driven = scipy.fft.irfft(transform[..., None] * columns, length, axis=-2)
        return np.asarray(driven[..., :samples, :] / weights[:, None])

    def caused(self, entry: HeldEntry, u: Array) -> NDArray[np.float64]:
        """The output (.., N) of an entry that samples u (.., N) drive."""
        return np.asarray(self.responses(entry, u, hold=self.hold) @ entry.gain)
