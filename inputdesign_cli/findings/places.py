"""Where samples of a record stand: their files and rows, and the option that leaves them out."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.units import Units

SHOWN = 5
# Rows that an option lists.
_LISTED = 12


class Recorded(Protocol):
    """Outputs as the files contain them; see `Recorded` of the data."""

    @property
    def rows(self) -> NDArray[np.int64]:
        """(samples,): where each sample stands."""

    @property
    def held(self) -> NDArray[np.bool_]:
        """(samples, p): whether a value is that of the sample before."""

    @property
    def resolution(self) -> Array:
        """(p,): the step in which each output is recorded."""


class Samples(Protocol):
    """Records one after the other, u (samples, r) and y (samples, p)."""

    @property
    def u(self) -> Array:
        """(samples, r)."""

    @property
    def y(self) -> Array:
        """(samples, p)."""

    @property
    def r(self) -> Array | None:
        """Return the reference of a loop (samples, r), or None if it is not known."""

    @property
    def time(self) -> Array:
        """(samples,)."""

    @property
    def lengths(self) -> tuple[int, ...]:
        """Return the samples of each stretch without gaps."""

    @property
    def files(self) -> tuple[tuple[str, int], ...]:
        """Return the name of each file and its samples."""

    @property
    def recorded(self) -> Recorded | None:
        """What is known of the files."""


def file_of(files: Sequence[tuple[str, int]], at: int) -> str:
    """Return the file of a sample, empty where there is one alone; `files` are names and samples."""
    ends = np.cumsum([samples for _, samples in files])
    return files[int(np.searchsorted(ends, at, side="right"))][0] if len(files) > 1 else ""


def of_file(record: Samples, at: int) -> str:
    """Return ` of NAME` for a sample where there are several files."""
    name = file_of(record.files, at)
    return f" of {name}" if name else ""


def rows_of(record: Samples, runs: Sequence[tuple[int, int]]) -> list[tuple[str, int, int]]:
    """Return the file, the first and the last row of runs of samples; nothing where rows are not known."""
    if record.recorded is None:
        return []
    rows = record.recorded.rows
    return [(file_of(record.files, first), int(rows[first]), int(rows[last])) for first, last in runs]


def without_option(runs: Sequence[tuple[str, int, int]]) -> str:
    """Return the option that leaves out runs of rows, each with its file (if need be), first and last row."""
    listed = [
        f"{f'{name}:' if name else ''}{first}{f'-{last}' if last > first else ''}"
        for name, first, last in runs
    ]
    return f"--without {shlex.quote(','.join(listed))}" if 0 < len(listed) <= _LISTED else "--without"


def places(units: Units, record: Samples, samples: Sequence[int]) -> str:
    """Return when samples were taken, and in which file: the first few of many."""
    shown = [f"{record.time[at]:.10g} {units.time_unit}{of_file(record, at)}" for at in samples[:SHOWN]]
    return ", ".join(shown) + ", .." * (len(samples) > SHOWN)
