"""Do a few prediction errors decide what a record says? Faults of measurement do, and single events."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.identification.repeated import NORMAL
from inputdesign_cli.plant.polynomial import Array

# Farther from zero than so many robust standard deviations; of as few samples as this, than twice as many.
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
