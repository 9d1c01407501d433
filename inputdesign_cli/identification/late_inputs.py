"""Records of inputs that are answered late, from where these are known."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array


def behind(
    records: Sequence[tuple[Array, Array]], late: NDArray[np.int64], begin: int, fewest: int = 1
) -> list[tuple[Array, Array]]:
    """The records u (n, r), y (n, p) from their sample `begin` on, each input as it was `late` (r,) before.

    Args:
        begin: no less than any of these.
        fewest: samples that must be left of a record.
    """
    return [
        (np.stack([u[begin - d : len(u) - d, j] for j, d in enumerate(late)], axis=1), y[begin:])
        for u, y in records
        if len(y) >= begin + fewest
    ]
