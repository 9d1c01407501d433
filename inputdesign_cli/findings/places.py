"""Records of experiments: where their samples stand in files, and the option that leaves some out."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding
from inputdesign_cli.outcome.units import Units

SHOWN = 5  # places that a message lists
SHORTEST = 10
"""Samples of the shortest segment."""
# The most runs of rows that an option lists.
_LISTED = 40


def is_called(role: str, name: str) -> bool:
    """Return whether the name of a column, in small letters, begins with the letter of a role: u, u1, y2."""
    return re.match(rf"{role[0]}\d*(?![a-z0-9])", name) is not None


@dataclass(frozen=True)
class Recorded:
    """Holds the signals as the files have them.

    Attributes:
        values: (samples, r + p), inputs and outputs.
        rows: (samples,), the row of each sample; the nearest one if times were evened out.
        held: (samples, p), whether an output equals the sample before.
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
class Record:
    """Holds recorded experiments with what was done to them, their segments one after the other.

    Attributes:
        u, y: (N, r), (N, p), inputs and outputs, without gaps.
        r: (N, r), the reference of a loop; None if some file does not have it.
        time: (N,), in `time_unit`; counted from zero in a file that has none.
        lengths: the samples of each segment.
        files: the name of each file and its samples.
        recorded: the signals as the files have them; None: not known.
        names: names of the columns, by channel.
        step, time_unit: the sample time.
        findings: the findings on the record and its preparation.
        header: the names of the columns of the first file, in small letters.
        means: (r,), means of the inputs as recorded, before trends or levels were removed; None: unknown.
        repeated: findings on files that have samples in common.
        lined: whether a line was subtracted from an output. Its slope is then estimated with the model, since
            the inputs cause a part of it.
        paths: paths of the files, as they were given.
    """

    u: Array
    y: Array
    r: Array | None
    time: Array
    lengths: tuple[int, ...]
    files: tuple[tuple[str, int], ...]
    recorded: Recorded | None = None
    names: dict[str, str] = field(default_factory=dict)
    step: float = 1.0
    time_unit: str = "s"
    findings: tuple[Finding, ...] = ()
    header: tuple[str, ...] = ()
    means: Array | None = None
    repeated: tuple[Finding, ...] = ()
    lined: bool = False
    paths: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Return the messages of the findings."""
        return tuple(one.message for one in self.findings)

    @property
    def columns_option(self) -> str:
        """Return the option of `explore` that names the columns; empty where these are called u1, y1, .."""
        names = {role: name for role, name in self.names.items() if role != "time"}
        if all(is_called(role, name.lower()) for role, name in names.items()):
            return ""
        listed = [f"{role}={self._option(name)}" for role, name in names.items()]
        return f"--columns {shlex.quote(','.join(listed))} "

    def _option(self, name: str) -> str:
        """Return a name, or the number of its column where the name has marks of the option."""
        low = name.strip().lower()
        return str(self.header.index(low) + 1) if set(name) & set(',="') and low in self.header else name

    @property
    def parts(self) -> list[tuple[Array, Array]]:
        """Return inputs and outputs of each segment."""
        at = np.cumsum(self.lengths)[:-1]
        return list(zip(np.split(self.u, at), np.split(self.y, at), strict=True))

    def at(self, samples: NDArray[np.int64], lengths: tuple[int, ...]) -> Record:
        """Return the record at some of the samples, in segments of these lengths."""
        ends = np.cumsum([count for _, count in self.files])
        counts = np.bincount(np.searchsorted(ends, samples, side="right"), minlength=len(ends)).tolist()
        return replace(
            self,
            u=self.u[samples],
            r=None if self.r is None else self.r[samples],
            y=self.y[samples],
            time=self.time[samples],
            lengths=lengths,
            files=tuple((name, count) for (name, _), count in zip(self.files, counts, strict=True)),
            recorded=None if self.recorded is None else self.recorded.at(samples),
        )

    def without(self, samples: NDArray[np.int64]) -> Record:
        """Return the record without some samples, and without segments that become too short."""
        left = np.setdiff1d(np.arange(len(self.y)), samples)
        apart = (np.diff(left) > 1) | np.isin(left[1:], np.cumsum(self.lengths))
        runs = np.split(left, np.flatnonzero(apart) + 1)
        kept = [run for run in runs if len(run) >= SHORTEST] or [max(runs, key=len)]
        return self.at(np.concatenate(kept), tuple(map(len, kept)))


def argument(path: str) -> str:
    """Return a path as an argument of a command: one that begins with a dash is no option."""
    return f"./{path}" if path.startswith("-") else path


def file_of(files: Sequence[tuple[str, int]], at: int) -> str:
    """Return the file of a sample, empty where there is one alone; `files` are names and samples."""
    ends = np.cumsum([samples for _, samples in files])
    return files[int(np.searchsorted(ends, at, side="right"))][0] if len(files) > 1 else ""


def of_file(record: Record, at: int) -> str:
    """Return ` of NAME` for a sample where there are several files."""
    name = file_of(record.files, at)
    return f" of {name}" if name else ""


def rows_of(record: Record, runs: Sequence[tuple[int, int]]) -> list[tuple[str, int, int]]:
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


def places(units: Units, record: Record, samples: Sequence[int]) -> str:
    """Return when samples were taken, and in which file: the first few of many."""
    shown = [f"{record.time[at]:.10g} {units.time_unit}{of_file(record, at)}" for at in samples[:SHOWN]]
    return ", ".join(shown) + ", .." * (len(samples) > SHOWN)
