"""Outputs that were not measured at every sample, but drawn as straight lines between some of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Array

# A line goes on where its rise changes by less than this share of the usual rise.
_STRAIGHT = 1e-6
# So many of the samples at which an output moves are on lines, and these have so many rises at least.
_MOSTLY, _FEWEST = 0.6, 10


def interpolated_outputs(parts: Sequence[tuple[Array, Array]]) -> list[int]:
    """The outputs (from zero) of records u (n, r), y (n, p) that are straight lines between some samples.

    Noise bends a measured output at every sample, and a plant without noise bends it, too.
    """
    found = []
    for i in range(parts[0][1].shape[1]):
        rises = [np.diff(y[:, i]) for _, y in parts if len(y) > 2]
        before, after = (
            np.concatenate([own[piece] for own in rises] or [np.zeros(0)])
            for piece in (slice(None, -1), slice(1, None))
        )
        moving = (before != 0.0) | (after != 0.0)
        if not np.any(moving):
            continue
        bends = np.abs(after - before)[moving] > _STRAIGHT * np.sqrt(np.mean(before[moving] ** 2))
        if np.sum(bends) >= _FEWEST and np.mean(bends) <= 1.0 - _MOSTLY:
            found.append(i)
    return found
