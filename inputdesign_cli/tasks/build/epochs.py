"""Times that a clock counts from 1970 in parts of a second."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np

from inputdesign_cli.arrays import Array

_PARTS = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9}
# Counts of these years: those of one part are none of another, and in seconds they would be millennia away.
_FIRST, _LAST = (datetime(year, 1, 1, tzinfo=UTC).timestamp() for year in (2000, 2100))


def since_epoch(time: Array) -> tuple[Array, str]:
    """Such times (n,) in seconds since the first, and what they count; others as they are, and nothing."""
    there = time[~np.isnan(time)]
    for parts, a_second in _PARTS.items():
        if there.size and a_second * _FIRST <= there.min() and there.max() <= a_second * _LAST:
            begun = datetime.fromtimestamp(there[0] / a_second, UTC)
            told = f"{parts} since 1970 (the first is {begun:%Y-%m-%d %H:%M:%S} UTC)"
            return (time - there[0]) / a_second, told
    return time, ""
