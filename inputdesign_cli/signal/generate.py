"""Time series with a given FIR spectrum: filtered noise, or a multisine on the record's own lines."""

from __future__ import annotations

import numpy as np
import scipy.signal

from inputdesign_cli.plant.polynomial import Array


def filtered_noise(taps: Array, samples: int, rng: np.random.Generator) -> Array:
    """(samples,): stationary Gaussian noise, white noise of variance one through the `taps` (m + 1,)."""
    noise = rng.standard_normal(samples + taps.size - 1)
    return scipy.signal.lfilter(taps, [1.0], noise)[taps.size - 1 :]


def multisine(line_power: Array, samples: int, rng: np.random.Generator) -> Array:
    """(samples,): one period of a sum of sinusoids at 2 pi l / samples with random phases.

    `line_power` (samples // 2 + 1,) are the mean squares of the lines l = 0 .. samples // 2; they are
    realised exactly.
    """
    spectrum = np.exp(2j * np.pi * rng.random(line_power.size)) * np.sqrt(line_power / 2.0)
    ends = [0] if samples % 2 else [0, samples // 2]
    signs = np.where(rng.random(len(ends)) < 0.5, -1.0, 1.0)
    spectrum[ends] = signs * np.sqrt(line_power[ends])
    return np.fft.irfft(spectrum * samples, samples)


def line_powers(density: Array, samples: int) -> Array:
    """(samples // 2 + 1,): the power that each line stands for, from Phi on the lines 0 .. samples // 2.

    The lines sample the circle evenly, so the powers add up to that of the spectrum whenever its
    order is below `samples`.
    """
    power = 2.0 * np.maximum(density, 0.0) / samples
    power[0] /= 2.0
    if samples % 2 == 0:
        power[-1] /= 2.0
    return power
