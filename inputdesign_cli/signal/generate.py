"""Time series with a given spectrum: filtered noise, and the lines that stand for a density."""

from __future__ import annotations

import numpy as np
import scipy.signal

from inputdesign_cli.plant.polynomial import Array


def filtered_noise(taps: Array, samples: int, rng: np.random.Generator) -> Array:
    """(samples,): stationary Gaussian noise, white noise of variance one through the `taps` (m + 1,)."""
    noise = rng.standard_normal(samples + taps.size - 1)
    return scipy.signal.lfilter(taps, [1.0], noise)[taps.size - 1 :]


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
