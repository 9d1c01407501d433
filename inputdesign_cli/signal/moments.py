"""Signals whose second moments are given: regressors with Phi^T Phi = R, and delayed copies of one input."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.signal.sinusoids import Sinusoids

_RANK = 1e-13

Start = Literal["steady", "zero"]


def rank(R: Array) -> int:
    """Return the rank of R (n, n), to rounding."""
    values = np.linalg.eigvalsh(R)
    return max(1, int(np.sum(values > _RANK * values[-1])))


def free_regressors(R: Array, samples: int, period: int) -> NDArray[np.float64]:
    """Return regressors Phi (samples, n) of the given period with Phi^T Phi = R to rounding.

    Phi = C Lambda^{1/2} Q^T with R = Q Lambda Q^T and orthonormal columns C, cosines of the period (the
    first of them constant).

    Args:
        period: divides `samples` and is at least the rank of R.
    """
    count = rank(R)
    if samples % period or period < count:
        raise ValueError("the period must divide the samples and be at least the rank of R")
    values, vectors = np.linalg.eigh(R)
    time = np.arange(period)[:, None] + 0.5
    columns = np.cos(np.pi * time * np.arange(count) / period) * np.sqrt(2.0 / samples)
    columns[:, 0] = np.sqrt(1.0 / samples)
    largest = np.argsort(values)[::-1][:count]
    one = columns @ (vectors[:, largest] * np.sqrt(values[largest])).T
    return np.tile(one, (samples // period, 1))


def periodic_input(shares: Array, power: float, samples: int, period: int, rng: np.random.Generator) -> Array:
    """Return cosines of random phases and this mean square, of a period that divides `samples`, (samples,).

    Args:
        shares: (period // 2 + 1,) shares of the power on the lines 2 pi l / period.
    """
    lines = Sinusoids.on_grid(shares * power, period)
    return np.tile(lines.record(lines.random_phases(rng)), samples // period)


def delayed_regressors(u: Array, taps: int, start: Start) -> NDArray[np.float64]:
    """Return rows u(t), u(t - 1), .. with the periodic past, or from rest, (samples, taps)."""
    columns = [np.roll(u, k) for k in range(taps)]
    if start == "zero":
        for k, column in enumerate(columns):
            column[:k] = 0.0
    return np.column_stack(columns)
