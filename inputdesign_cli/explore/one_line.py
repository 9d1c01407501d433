"""Inputs that are one sinusoid but for what moves the outputs too little to be seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.inputs import left_over, past, untold

# The share of the power of an input from which it is a sinusoid, mostly, and the level at which what is left
# of the input moves what is left of the output.
MOSTLY, _CERTAIN = 0.9, 1e-3
_LAGS = 30
_REFINED = 40
# A cycle has so many harmonics, its strongest line may be the first to the third of them, and a record has
# two cycles at least.
_HARMONICS, _STRONGEST, _CYCLES = 6, 3, 2
_HELD = 0.5  # of the samples, at fewer of which an input moves that is held


def one_line(parts: Sequence[tuple[Array, Array]]) -> float | None:
    """The share of the power of u (n, 1) that a sinusoid has, if the rest moves no output of y (n, p).

    Such a record tells G at one frequency ([ljung-1999], Section 13.2), and two slow signals that have a
    period in common, as of days, are alike there without one moving the other. None of other
    inputs, and of those that are held: a step is much like a part of a sinusoid.
    """
    u, y = max(parts, key=lambda part: len(part[1]))
    lags = min(_LAGS, len(y) // (6 * (1 + y.shape[1])))
    if lags < 1 or is_held(u):
        return None
    t = np.arange(len(u))
    level = np.column_stack([np.ones(len(u)), t - t.mean()])
    level = level / np.linalg.norm(level, axis=0)
    varying = untold([level], [u[:, 0]])[0]
    line = np.column_stack([level, wave(strongest(varying, level), len(u))])
    left, answers = untold([line], [u[:, 0]])[0], untold([line], [y])[0]
    share = 1.0 - float(left @ left) / max(float(varying @ varying), 1e-300)
    if share < MOSTLY:
        return None
    own = past(answers, lags)
    both = np.column_stack([own, left[lags:], past(left[:, None], lags)])
    for answer in answers[lags:].T:
        gained = np.log(left_over(own, answer) / max(left_over(both, answer), 1e-300))
        statistic = max(len(answer) - both.shape[1], 0) * gained
        if y.shape[1] * scipy.special.chdtrc(lags + 1, statistic) < _CERTAIN:
            return None
    return share


def is_held(u: Array) -> bool:
    """Whether an input (n, 1) moves at less than half of its samples."""
    return bool(np.mean(np.diff(u[:, 0]) != 0.0) < _HELD)


def cycle(u: Array, level: Array) -> tuple[Array, float]:
    """Columns (n, m) of a cycle with its harmonics that leaves least of u (n,), those of `level` before them.

    With them the share of the power of what `level` leaves that they explain.
    """
    varying = untold([level], [u])[0]
    peak = strongest(varying, level)
    lowest = 2.0 * np.pi * _CYCLES / len(u)
    found = [(level, left_over(level, u))]
    for part in range(1, _STRONGEST + 1):
        frequency = peak / part
        if frequency >= lowest:
            harmonics = [n for n in range(1, _HARMONICS + 1) if n * frequency < np.pi]
            columns = np.column_stack([level, *(wave(n * frequency, len(u)) for n in harmonics)])
            found.append((columns, left_over(columns, u)))
    columns, left = min(found, key=lambda each: each[1])
    return columns, 1.0 - left / max(float(varying @ varying), 1e-300)


def strongest(x: Array, level: Array) -> float:
    """The frequency, in rad per sample, at which a sinusoid leaves least of x (n,), beside columns (n, m)."""
    peak = max(int(np.argmax(np.abs(np.fft.rfft(x)))), 1)
    tried = 2.0 * np.pi / len(x) * np.linspace(max(peak - 1.0, 0.25), peak + 1.0, _REFINED)
    return float(min(tried, key=lambda w: left_over(np.column_stack([level, wave(w, len(x))]), x)))


def wave(frequency: float, samples: int) -> Array:
    """Cosine and sine (n, 2) of a frequency in rad per sample."""
    phase = frequency * np.arange(samples)
    return np.column_stack([np.cos(phase), np.sin(phase)])
