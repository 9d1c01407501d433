"""Where samples of a record stand: their files and rows, and the option that leaves them out."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.units import Units

SHOWN = 5
# Rows that an option lists.
_LISTED = 12


@dataclass(frozen=True)
class Recorded:
    """Holds the signals as the files have them.

    Attributes:
        values: (samples, r + p), of inputs and outputs.
        rows: (samples,), where each sample stands; the nearest one, where times were evened out.
        held: (samples, p), whether an output was recorded as it was a sample before.
        resolution: (p,), the step in which each output is recorded.
    """

    values: Array
    rows: NDArray[np.int64]
    held: NDArray[np.bool_]
    resolution: Array

    def at(self, samples: NDArray[np.int64]) -> Recorded:
        """Return some of the samples."""
        return replace(self, values=self.values[samples], rows=self.rows[samples], held=self.held[samples])


@dataclass(frozen=True)
class Samples:
    """Holds recorded experiments, their segments one after the other.

    Attributes:
        u, y: (N, r), (N, p), inputs and outputs, without gaps.
        r: (N, r), the reference of a loop; None if some file does not have it.
        time: (N,), in `time_unit`; counted from zero in a file that has none.
        lengths: the samples of each segment.
        files: the name of each file and its samples.
        recorded: the signals as the files have them; None: not known.
    """

    u: Array
    y: Array
    r: Array | None
    time: Array
    lengths: tuple[int, ...]
    files: tuple[tuple[str, int], ...]
    recorded: Recorded | None = None


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
