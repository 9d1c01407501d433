"""Better times to switch between two levels, by trying, where limits keep a signal from its spectrum.

Ramps between the levels take power from high frequencies, the more the closer together they are, which no
spectrum of the levels knows. Each try moves, adds or removes a few switches, and is kept where it helps.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import time_is_over

_MOST_CHANGES = 3
_SHIFTED = 0.6  # the share of the changes that shift a switch; the others add or remove one
# After this number of tries, or a sixth of all: would the same gain, repeated, be enough?
_STRETCH, _STRETCHES = 100, 6


def better_switching(
    values: Array,
    figure: Callable[[Array], float],
    rng: np.random.Generator,
    tries: int,
    enough: float | None = None,
) -> Array:
    """The best of the signals of two levels (n, r) that are met from `values` on; out of time, that so far.

    Args:
        figure: of a signal of two levels, to be small.
        enough: ends the search; so does a pace that would not lead there. None: as small as it gets.
    """
    best, least = values, float(figure(values))
    stretch = max(min(_STRETCH, tries // _STRETCHES), 1)
    for left in range(tries, 0, -stretch):
        before = least
        for _ in range(min(left, stretch)):
            if time_is_over() or (enough is not None and least <= enough):
                return best
            tried = best
            for _ in range(rng.integers(1, _MOST_CHANGES + 1)):
                tried = _changed(tried, rng)
            reached = float(figure(tried))
            if reached < least:
                best, least = tried, reached
        if enough is not None and (before - least) * (left / stretch - 1.0) < least - enough:
            return best
    return best


def _changed(values: Array, rng: np.random.Generator) -> Array:
    """The signal with one switch of one input shifted, added or removed."""
    changed = values.copy()
    column = changed[:, rng.integers(changed.shape[1])]
    switches = 1 + np.flatnonzero(np.diff(np.sign(column)))
    chance = rng.random()
    if switches.size and chance < _SHIFTED:
        furthest = max(1, column.size // (2 * switches.size))
        at, by = int(rng.choice(switches)), int(rng.integers(1, furthest + 1))
        column[slice(at, at + by) if rng.random() < 0.5 else slice(max(at - by, 0), at)] *= -1.0
    elif switches.size and chance < 0.5 * (1.0 + _SHIFTED):
        column[int(rng.choice(switches)) :] *= -1.0
    else:
        column[int(rng.integers(column.size)) :] *= -1.0
    return changed
