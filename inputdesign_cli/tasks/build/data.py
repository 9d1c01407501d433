"""Recorded experiments: u and y from CSV files, their columns, units and times checked, outliers named."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from inputdesign_cli.errors import DataError, Diagnostic, Location, SpecError, bad_spec
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.units import Units
from inputdesign_cli.tasks.build.tables import read_columns, read_header, read_times

_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0, "d": 86400.0}
# What a column of times is called, with or without a unit: time_s, t (ms), timestamp.
_TIMES = re.compile(r"(time|t|timestamp)(?:[_ ]?[(\[]?([a-z]*)[)\]]?)?")
# Times may jitter by this share of the sample time.
_JITTER = 1e-3
# Farther from the median than this many (robust) standard deviations: most likely not of this experiment.
_OUTLYING = 8.0
_SHOWN = 5


@dataclass(frozen=True)
class Deviations:
    """What is taken away from signals: a known `operating_point` by channel (`u1`, `y1`), or the means."""

    operating_point: Mapping[str, float] = field(default_factory=dict)
    remove_means: bool = False


@dataclass(frozen=True)
class Data:
    """u (samples, r) and y (samples, p) of experiments one after the other, and what to know of them.

    Attributes:
        r: (samples, r), the reference of a loop; None where some file does not have it.
        lengths: the samples of each experiment.
    """

    u: Array
    y: Array
    r: Array | None
    lengths: tuple[int, ...]
    notes: tuple[str, ...]


def read_data(paths: Sequence[Path], units: Units, deviations: Deviations) -> Data:
    """The columns u1, u2, .., y1, y2, .. of all channels of the plant and, if there is one, time.

    The only input may be called u, the only output y.

    Raises:
        SpecError: `unknown-channel`, the operating point is that of a channel that the plant does not have.
        DataError: a file cannot be read, lacks a column, holds text or gaps, or is sampled otherwise than
            the spec says.
    """
    channels = [f"u{i + 1}" for i in range(units.inputs)] + [f"y{i + 1}" for i in range(units.outputs)]
    for name in deviations.operating_point:
        if name not in channels:
            raise bad_spec(
                "unknown-channel",
                f"the operating point names {name}, but the plant has no such channel",
                hint=f"its channels are {', '.join(channels)}: write --operating-point {channels[0]}=1.5",
            )
    parts = [_read(path, units, deviations, named=len(paths) > 1) for path in paths]
    references = [r for _, _, r, _ in parts if r is not None]
    return Data(
        np.concatenate([u for u, _, _, _ in parts]),
        np.concatenate([y for _, y, _, _ in parts]),
        np.concatenate(references) if len(references) == len(parts) else None,
        tuple(len(y) for _, y, _, _ in parts),
        tuple(note for _, _, _, notes in parts for note in notes),
    )


def _read(
    path: Path, units: Units, deviations: Deviations, *, named: bool
) -> tuple[Array, Array, Array | None, list[str]]:
    """u, y, the reference of a loop and notes of one file, which the notes name if asked to."""
    header = read_header(path, key="")
    channels = {"u": _names("u", units.inputs, header), "y": _names("y", units.outputs, header)}
    wanted = {name: column for names in channels.values() for name, column in names.items()}
    timed = _timed(header)
    if timed:
        _check_unit(path, units, *timed)
    references = _references(units, header)
    columns = read_columns(path, {**wanted, **{name: name for name in references}}, key="")
    if timed:
        _check_times(path, units, read_times(path, timed[0], _UNITS[units.time_unit]))
    notes = []
    for name in wanted:
        x = columns[name]
        notes += _outliers(name, x)
        level = deviations.operating_point.get(name if name[1:] else f"{name}1", 0.0)
        columns[name] = x - (x.mean() if deviations.remove_means else level)
    u, y = (np.stack([columns[name] for name in names], axis=1) for names in channels.values())
    r = np.stack([columns[name] for name in references], axis=1) if references else None
    return u, y, r, [f"{path.name}: {note}" for note in notes] if named else notes


def _references(units: Units, header: Sequence[str]) -> Sequence[str]:
    """The columns of the reference of a loop, if the file has them all: r1, r2, ..; r or r1 of one."""
    if not units.closed_loop:
        return []
    if units.inputs == 1:
        return [name for name in ("r1", "r") if name in header][:1]
    return list(units.excitations) if set(units.excitations) <= set(header) else []


@contextmanager
def blaming_columns(path: Path) -> Iterator[None]:
    """Lays what an estimator says against the signals at the columns of the file that they came from.

    Raises:
        DataError: in place of the estimator's `SpecError`.
    """
    try:
        yield
    except SpecError as error:
        header = read_header(path, key="")

        def placed(diagnostic: Diagnostic) -> Diagnostic:
            named = [name for name in header if name.startswith(diagnostic.key or "u")]
            before = header[: header.index(named[0])] if named else []
            column = 1 + sum(len(name) + 1 for name in before)
            return replace(diagnostic, location=Location(str(path), 1, column, ",".join(header)))

        raise DataError([placed(diagnostic) for diagnostic in error.diagnostics]) from error


def _names(letter: str, channels: int, header: list[str]) -> dict[str, str]:
    """How the channels are called, and how their columns begin: u1, u2, ..; u or u1 for one channel."""
    if channels == 1:
        numbered = f"{letter}1"
        return {letter: numbered if any(name.startswith(numbered) for name in header) else letter}
    return {f"{letter}{i + 1}": f"{letter}{i + 1}" for i in range(channels)}


def _timed(header: Sequence[str]) -> tuple[str, str] | None:
    """The column of times and its unit, which may be empty; `time` before the other names."""
    found = [(name, *match.groups()) for name in header if (match := _TIMES.fullmatch(name))]
    named = [one for one in found if not one[2] or one[2] in _UNITS or one[1] == "time"]
    named.sort(key=lambda one: ("time", "t", "timestamp").index(one[1]))
    return (named[0][0], named[0][2] or "") if named else None


def _check_unit(path: Path, units: Units, name: str, unit: str) -> None:
    if unit in _UNITS and unit != units.time_unit:
        raise DataError.because(
            "data-wrong-unit",
            f"the times are in {unit}, but the spec counts in {units.time_unit}",
            f"set time_unit: {unit} (and sample_time in it), or convert the column",
            "time_unit",
            Location(str(path), 1, 1, name),
        )


def _check_times(path: Path, units: Units, time: Array) -> None:
    steps = np.diff(time)
    off = np.abs(steps - units.sample_time) > _JITTER * units.sample_time
    if not np.any(off):
        return
    row = int(np.argmax(off))
    typical = float(np.median(steps))
    if abs(typical - units.sample_time) > _JITTER * units.sample_time:
        message = f"the data are sampled every {typical:.6g} {units.time_unit}"
        hint = f"if that is right, set sample_time: {typical:.6g} and design anew"
    else:
        message = (
            f"the time advances by {steps[row]:.6g} {units.time_unit} here ({int(off.sum())} such places)"
        )
        hint = "fill the gap, or use a part of the record without gaps"
    raise DataError.because(
        "data-not-uniform",
        f"{message}, but sample_time is {units.sample_time:g} {units.time_unit}",
        hint,
        "sample_time",
        Location(str(path), row + 3, 1, f"{time[row + 1]:.10g}"),
    )


def _outliers(name: str, x: Array) -> list[str]:
    middle = np.median(x)
    spread = 1.4826 * np.median(np.abs(x - middle))
    if spread <= 0.0:
        return []
    found = np.flatnonzero(np.abs(x - middle) > _OUTLYING * spread)
    if not found.size:
        return []
    rows = ", ".join(str(row + 2) for row in found[:_SHOWN]) + (", .." if found.size > _SHOWN else "")
    return [
        f"{name} has {found.size} outlying value{'s' * (found.size > 1)} (row {rows}): look at the record"
    ]
