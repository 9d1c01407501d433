"""Of long records the stretch in which the inputs move most."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts


def busiest(parts: Parts, most: int) -> list[tuple[Array, Array]]:
    """At most so many samples: of long records the stretch in which the inputs move most."""
    share = most // len(parts)
    return [(u[at], y[at]) for u, y in parts for at in [_window(u, share if len(parts) > 1 else most)]]


def _window(u: NDArray[np.float64], length: int) -> slice:
    if len(u) <= length:
        return slice(0, len(u))
    moves = np.sum((np.diff(u, axis=0) / np.maximum(u.std(axis=0), 1e-300)) ** 2, axis=1)
    total = np.concatenate([[0.0], np.cumsum(moves)])
    begin = int(np.argmax(total[length - 1 :] - total[: len(total) - length + 1]))
    return slice(begin, begin + length)
