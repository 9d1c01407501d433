"""Inputs that are held for several samples, as those of a controller that runs less often than the log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Array

# Fewer values that are held tell nothing; an input that moves at a smaller share of them is held longer.
_FEWEST, _MOVES = 40, 1.0 / 3.0
Parts = Sequence[tuple[Array, Array]]


def of_moves(parts: Parts) -> list[Parts]:
    """Records of the samples at which inputs may move, where these are every k-th one, k > 1; else none.

    One has the outputs at these samples, which a controller answers at once. The other has those of the last
    sample for which the input is held, so that what the next value answers lies in the past, and a plant that
    acts at once has not answered it yet.

    Args:
        parts: records u (n, r), y (n, p).
    """
    moves = [np.flatnonzero(np.any(np.diff(u, axis=0) != 0.0, axis=1)) + 1 for u, _ in parts]
    step = int(np.gcd.reduce(np.concatenate([np.diff(at) for at in moves])))
    if step < 2:
        return []
    grids = [
        (u, y, np.arange(at[0] % step, len(u) - step + 1, step))
        for (u, y), at in zip(parts, moves, strict=True)
        if at.size
    ]
    values = sum(rows.size for *_, rows in grids)
    if values < _FEWEST or sum(at.size for at in moves) < _MOVES * values:
        return []
    return [[(u[rows], y[rows + late]) for u, y, rows in grids] for late in (0, step - 1)]
