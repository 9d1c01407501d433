"""Rows that are left out on request: where a sensor failed, or something acted that no input shows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError, Location
from inputdesign_cli.tasks.build.files import Sheet
from inputdesign_cli.tasks.build.preparation import Run


def labels(paths: Sequence[Path]) -> list[str]:
    """What messages and options call files: their names, with the folders where two have the same."""
    counts = Counter(path.name for path in paths)
    return [path.name if counts[path.name] == 1 else str(path) for path in paths]


def left_out(sheet: Sheet, runs: Sequence[Run]) -> NDArray[np.bool_]:
    """(n,): which rows of a sheet are among the runs that name its file, or none.

    Raises:
        DataError: `data-unreadable`, the file has no row of a run.
    """
    found = np.zeros(len(sheet.lines), dtype=bool)
    for name, first, last in runs:
        if name not in ("", sheet.path.name, str(sheet.path)):
            continue
        inside = (sheet.lines >= first) & (sheet.lines <= last)
        if not np.any(inside):
            which = f"{first}" if first == last else f"from {first} to {last}"
            raise DataError.because(
                "data-unreadable",
                f"{sheet.path.name} has no row {which}, which --without is to leave out",
                f"its rows of numbers are {sheet.lines[0]} to {sheet.lines[-1]}, counted as in notes: a text "
                "file line by line, its header among them",
                sheet.key,
                Location(str(sheet.path), 1, 1, ""),
            )
        found |= inside
    return found
