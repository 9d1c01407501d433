"""Measure outputs at lines that an input does not excite, where only a nonlinear plant responds.

[pintelon-schoukens-2012], Section 4.3: an even nonlinearity answers odd harmonics at even ones, an odd one at
odd ones. The scatter of the periods shows how much of it is noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray

# Neighbouring lines over which the spectrum of the noise is taken to be even, where it is not known.
_NEIGHBOURS = 15


@dataclass(frozen=True)
class SilentLines:
    """The power of p outputs at `lines` lines without excitation.

    Attributes:
        over_noise: (p,) mean of the power there over that of the noise; about one for noise alone.
        probability: (p,) that noise alone has as much, by an F test over all lines.
        rms: (p,) of the part beyond the noise.
        beyond: (lines, p) mean squares of the transforms that are beyond the noise, over neighbouring lines.
    """

    lines: int
    over_noise: Array
    probability: Array
    rms: Array
    beyond: NDArray[np.float64]


def silent_lines(Y: ComplexArray, shape: NDArray[np.float64] | None = None) -> SilentLines | None:
    """From transforms (blocks, periods, lines, p) of outputs; None without lines or without scatter.

    Args:
        shape: (lines, p) of the spectrum of the noise, up to a factor; None: that of the scatter, smoothed.
    """
    blocks, periods, lines, _ = Y.shape
    if lines == 0 or periods < 2:
        return None
    mean = Y.mean(axis=1, keepdims=True)
    noise = np.sum(np.abs(Y - mean) ** 2, axis=(0, 1)) / (blocks * (periods - 1))
    if np.any(noise <= 0.0):
        return None
    level: NDArray[np.float64] = periods * np.mean(np.abs(mean[:, 0]) ** 2, axis=0)
    even = _smoothed(noise) if shape is None else shape
    # Over the shape of the noise all lines count alike.
    ratio = np.sum(level / even, axis=0) / np.sum(noise / even, axis=0)
    freedom = 2 * blocks * lines
    # Where strong noise at some lines hides the sum, what is beyond it is taken to have its shape.
    like_noise = (ratio - 1.0) * np.mean(noise / even, axis=0) * np.sum(even, axis=0)
    plain = np.sum(level - noise, axis=0)
    beyond = np.where(plain > 0.0, plain, np.maximum(like_noise, 0.0))
    return SilentLines(
        lines,
        np.asarray(ratio),
        np.asarray(scipy.special.fdtrc(freedom, freedom * (periods - 1), ratio)),
        np.sqrt(2.0 * beyond / periods),
        np.maximum(_smoothed(level - noise), 0.0) / periods,
    )


def _smoothed(noise: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return means over neighbouring lines (lines, p), at the ends over equally many nearest ones."""
    window = min(_NEIGHBOURS, len(noise))
    sums = np.concatenate([np.zeros((1, noise.shape[1])), np.cumsum(noise, axis=0)])
    first = np.clip(np.arange(len(noise)) - window // 2, 0, len(noise) - window)
    return np.asarray((sums[first + window] - sums[first]) / window)
