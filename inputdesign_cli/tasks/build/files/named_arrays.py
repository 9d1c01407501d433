"""Named arrays of numbers or moments as the columns of a sheet."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.tasks.build.files import numeric_dates
from inputdesign_cli.tasks.build.files.sheet import Array, Column, Sheet, unreadable


def of_arrays(path: Path, key: str, arrays: Sequence[tuple[str, NDArray]]) -> Sheet:
    """Named arrays, (n,) or (n, m), as columns: those of one array are called x1, x2, ..

    Raises:
        DataError: the arrays have no rows, or not as many as each other.
    """
    names: list[str] = []
    columns: list[Column] = []
    for name, array in arrays:
        dated = array.dtype.kind in "mM"
        wide = _seconds(array) if dated else array
        wide = wide[:, None] if wide.ndim == 1 else wide
        wide = wide.T if wide.shape[0] == 1 else wide
        single = wide.shape[1] == 1
        names += [name if single else f"{name}{i + 1}" for i in range(wide.shape[1])]
        began = _began(array) if array.dtype.kind == "M" else 0.0
        for numbers in wide.T:
            of_dates = None if dated else numeric_dates.of_numbers(numbers)
            plain = np.asarray(numbers, dtype=float)
            columns.append(of_dates or Column(plain, _infinite(plain), dated, began=began))
    lengths = {len(column.numbers) for column in columns}
    if lengths in (set(), {0}):
        raise unreadable(path, key, "holds no rows of numbers", "save the signals as arrays u, y and time")
    if len(lengths) > 1:
        told = ", ".join(f"{name} {' x '.join(map(str, array.shape))}" for name, array in arrays)
        hint = "keep the signals of one experiment in a file, all of one length, a sample in each row"
        raise unreadable(path, key, f"holds arrays of different lengths ({told})", hint)
    return Sheet(
        path, key, tuple(names), tuple(columns), np.arange(1, lengths.pop() + 1), (1, ", ".join(names))
    )


def _seconds(moments: NDArray) -> Array:
    """Dates and times, or lengths of time, in seconds since the first; NaN where there is none."""
    since = moments - moments.ravel()[0] if moments.dtype.kind == "M" else moments
    seconds = since / np.timedelta64(1, "s")
    return np.asarray(seconds, dtype=float)


def _began(moments: NDArray) -> float:
    """The first of dates, in seconds since 1970; NaN where there is none."""
    return float((moments.ravel()[0] - np.datetime64(0, "s")) / np.timedelta64(1, "s"))


def _infinite(numbers: Array) -> tuple[int, str] | None:
    found = np.flatnonzero(np.isinf(numbers))
    return (int(found[0]), "inf") if found.size else None
