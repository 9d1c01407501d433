"""Rows of a file in messages: `row 5`, `rows 5 to 9, 12, ..`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_SHOWN = 5


def told(rows: Sequence[int] | np.ndarray, word: str = "row") -> str:
    """Numbers of rows, in rising order; those that follow each other as a range, the first few of many."""
    numbers = np.asarray(rows, dtype=np.int64)
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1)
    listed = [f"{run[0]} to {run[-1]}" if len(run) > 2 else ", ".join(map(str, run)) for run in runs[:_SHOWN]]
    more = ", .." if len(runs) > _SHOWN else ""
    return f"{word}{'s' * (len(numbers) > 1)} {', '.join(listed)}{more}"
