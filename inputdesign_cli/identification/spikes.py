"""Do a few prediction errors decide what a record says? Faults of measurement do, and single events."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.identification.repeated import NORMAL

# A spike is farther from zero than _FAR robust standard deviations, twice that of _UNSURE samples.
_FAR, _UNSURE = 8.0, 20
# Not more of the samples than this, which hold this share of the sum of squares.
_FEW, _MOST = 0.05, 0.5


@dataclass(frozen=True)
class Spikes:
    """Samples whose errors in one output hold the `share` of the sum of squares there."""

    output: int
    samples: tuple[int, ...]
    share: float


def spikes(errors: Array) -> list[Spikes]:
    """Of prediction errors (samples, p): output by output, where few hold most of the sum of squares."""
    found = []
    for output, e in enumerate(errors.T):
        spread = float(np.median(np.abs(e))) / NORMAL
        far = np.flatnonzero(np.abs(e) > _FAR * (1.0 + _UNSURE / e.size) * spread)
        if not far.size or not spread > 0.0 or far.size > _FEW * e.size:
            continue
        size = np.abs(e).max()
        share = float(np.sum((e[far] / size) ** 2) / np.sum((e / size) ** 2))
        if share >= _MOST:
            found.append(Spikes(output, tuple(far.tolist()), share))
    return found


def period_spikes(y: Array, periods: Periods, *, repeats: int = 1) -> list[Spikes]:
    """Of outputs (N, p) of inputs that repeat, by how each of the periods that count differs from the others.

    Medians of the periods, and over them, so that neither a spike nor a level that drifts counts elsewhere.

    Args:
        repeats: how many records of equal length with the same input follow each other.
    """
    parts = np.concatenate([periods.parts(one) for one in np.split(y, repeats)], axis=1)
    apart = parts - np.median(parts, axis=1, keepdims=True)
    levelled = parts - np.median(apart, axis=2, keepdims=True)
    errors = levelled - np.median(levelled, axis=1, keepdims=True)
    index = np.arange(float(len(y)))[:, None]
    where = np.concatenate([periods.parts(one) for one in np.split(index, repeats)], axis=1)
    at = where.reshape(-1).astype(np.int64)
    found = spikes(errors.reshape(-1, y.shape[1]))
    return [replace(one, samples=tuple(sorted(at[list(one.samples)].tolist()))) for one in found]
