"""A log without a spec: channels, sample time and unit are those that its columns tell."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.column_hints import columns_hint
from inputdesign_cli.tasks.build.columns import (
    counted_unit,
    reference_columns,
    time_unit_in,
    with_headers,
    without_times,
)
from inputdesign_cli.tasks.build.copies import check_different
from inputdesign_cli.tasks.build.data import Recorded, prepared, recorded_in
from inputdesign_cli.tasks.build.files import Sheet, read_sheet
from inputdesign_cli.tasks.build.preparation import SHORTEST, Preparation
from inputdesign_cli.tasks.build.signals import check_stated, signals_of, stated_step, typical_step
from inputdesign_cli.questions.building.tables import may_be_times, no_column
from inputdesign_cli.tasks.build.without import labels
from inputdesign_cli.tasks.build.written_apart import joined_rows

_CHANNELS = {
    "u": re.compile(r"(u|input)[ _]?(\d*)(?![a-z0-9]).*"),
    "y": re.compile(r"(y|output)[ _]?(\d*)(?![a-z0-9]).*"),
}
# Sample times differ by less than this share by rounding alone.
_ROUND = 1e-4


@dataclass(frozen=True)
class Log:
    """Records of one experiment, its segments one after the other.

    Attributes:
        u, y: (N, r), (N, p) as logged, without gaps.
        r: (N, r), the references of a loop; None where some file does not have them.
        time: (N,), counted from zero in a file that has none.
        lengths: the samples of each segment.
        files: the name of each file and its samples.
        names: of the columns, by channel.
        step, time_unit: the sample time.
        steps: what was done to the record, and what was seen in it.
        recorded: of the outputs.
        lined: whether lines were taken away from outputs.
    """

    u: Array
    y: Array
    time: Array
    lengths: tuple[int, ...]
    files: tuple[tuple[str, int], ...]
    names: dict[str, str]
    step: float
    time_unit: str
    steps: tuple[str, ...]
    recorded: Recorded
    lined: bool = False
    r: Array | None = None

    @property
    def parts(self) -> list[tuple[Array, Array]]:
        """The segments."""
        at = np.cumsum(self.lengths)[:-1]
        return list(zip(np.split(self.u, at), np.split(self.y, at), strict=True))

    def files_of(self, samples: NDArray[np.int64]) -> tuple[tuple[str, int], ...]:
        """The name of each file, and how many of these samples it has."""
        ends = np.cumsum([count for _, count in self.files])
        counts = np.bincount(np.searchsorted(ends, samples, side="right"), minlength=len(ends))
        return tuple((name, int(count)) for (name, _), count in zip(self.files, counts, strict=True))

    def without(self, samples: NDArray[np.int64]) -> Log:
        """The same without some samples, counted through all segments, and what is too short beside them."""
        left = np.setdiff1d(np.arange(len(self.y)), samples)
        apart = (np.diff(left) > 1) | np.isin(left[1:], np.cumsum(self.lengths))
        runs = np.split(left, np.flatnonzero(apart) + 1)
        kept = [run for run in runs if len(run) >= SHORTEST] or [max(runs, key=len)]
        rest = np.concatenate(kept)
        return replace(
            self,
            u=self.u[rest],
            r=None if self.r is None else self.r[rest],
            y=self.y[rest],
            time=self.time[rest],
            lengths=tuple(map(len, kept)),
            files=self.files_of(rest),
            recorded=self.recorded.at(rest),
        )


def read_log(path: Path, preparation: Preparation) -> Log:
    """The channels that `preparation.columns` names, or else u1, u2, .., y1, y2, .. of the header.

    Raises:
        DataError: the file cannot be read, or does not tell its inputs and outputs.
    """
    sheet = read_sheet(path, key="")
    columns = with_channels(sheet, preparation.columns)
    counts = {letter: _count(sheet, letter, columns) for letter in "uy"}
    given = with_headers(sheet, replace(preparation, columns=columns))
    references = _references(counts["u"], sheet, given.columns)
    signals, told = joined_rows(
        signals_of(sheet, counts["u"], counts["y"], given, references), resample=given.resample
    )
    unit = counted_unit(signals.sheet, signals.name, preparation, dated=signals.dated)
    unit = unit or time_unit_in(sheet, signals.name) or "s"
    stated = stated_step(sheet, preparation)
    if signals.name and not preparation.sample_time:
        step = typical_step(signals.time)
        if stated and abs(step - stated) > _ROUND * stated:
            told.append(
                f"{path.name} states the sample time {stated:g}, and its times advance by {step:g}: "
                "they count"
            )
    elif stated:
        step = stated
        check_stated(signals, step, resample=given.resample)
    else:
        step = 1.0
        unread = without_times(sheet, given.columns)
        none = "no times are read" if unread else "the file has no times"
        told.append(f"{none} and no --sample-time was given: the sample time is taken for 1")
        told += (
            []
            if unread
            else may_be_times(sheet, [column.strip().lower() for column in given.columns.values()])
        )
    if not np.isfinite(step):
        message = f"{path.name} has one time only, which tells no sample time"
        hint = "give it: --sample-time 0.5; or say which column holds the time (--columns)"
        raise DataError(sheet.error("data-not-uniform", message, hint, 0))
    segments, notes = prepared(signals, step, unit, given)
    inputs = np.concatenate([part.u for part in segments])
    return Log(
        inputs[:, : counts["u"]],
        np.concatenate([part.y for part in segments]),
        np.concatenate([part.time for part in segments]),
        tuple(len(part.y) for part in segments),
        ((path.name, sum(len(part.y) for part in segments)),),
        {channel: column for channel, column in given.columns.items() if channel != "time" or signals.name},
        step,
        unit,
        (*told, *notes),
        recorded_in(signals, step, segments, counts["u"]),
        any(part.lined for part in segments),
        inputs[:, counts["u"] :] if references else None,
    )


def _references(inputs: int, sheet: Sheet, columns: Mapping[str, str]) -> dict[str, str]:
    """The columns of the reference of a loop; those that nobody names count where they hold numbers alone."""
    found = reference_columns(inputs, sheet, columns)
    if set(found) & set(columns):
        return found
    own = [sheet.columns[sheet.header.index(name)] for name in found.values()]
    clean = all(column.fault is None and not np.isnan(column.numbers).any() for column in own)
    return found if clean else {}


def with_channels(sheet: Sheet, named: Mapping[str, str]) -> dict[str, str]:
    """The columns that are named, and by their names those of the inputs or outputs of which none is."""
    found = {
        channel: name
        for channel, name in channels_by_name(sheet).items()
        if not any(other.startswith(channel[0]) for other in named)
    }
    return {**found, **named}


def channels_by_name(sheet: Sheet) -> dict[str, str]:
    """Channels whose columns are called u, u1, input, .., y, y1, output, .."""
    found = {}
    for letter, pattern in _CHANNELS.items():
        for name in sheet.header:
            matched = pattern.fullmatch(name)
            if matched:
                found[f"{letter}{matched[2] or 1}"] = name
    return found


def _count(sheet: Sheet, letter: str, columns: Mapping[str, str]) -> int:
    """How many inputs or outputs; they are numbered from one on.

    Raises:
        DataError: there is none, or a number is left out.
    """
    named = [name for name in columns if name.startswith(letter)]
    wanted = {f"{letter}{i + 1}" for i in range(len(named))}
    if named and set(named) == wanted:
        return len(named)
    held = next((name for name in sheet.left_out if _CHANNELS[letter].fullmatch(name.lower())), None)
    if held is not None and not named:
        raise DataError(no_column(sheet, held, letter))
    what = "input" if letter == "u" else "output"
    header = sheet.contents or "it has no header"
    shown = f" ({header}; {len(sheet.columns)} columns)" if sheet.shown else ""
    message = f"which column of {sheet.path.name} is the {what}?{shown}"
    if named:
        listed = ", ".join(sorted(named))
        message = f"the {what}s are {listed}, but they are numbered {letter}1, {letter}2, .."
    missing = [channel for channel in _first_of(columns) if channel not in columns]
    kept = {channel: name for channel, name in columns.items() if channel in ("time", *_first_of(columns))}
    hint = columns_hint(sheet, kept, missing)
    raise DataError(sheet.error("data-missing-column", message, hint))


def _first_of(columns: Mapping[str, str]) -> list[str]:
    """The channels that so many named inputs and outputs are, one of each at least: u1, u2, y1."""
    counts = {letter: sum(name.startswith(letter) for name in columns) for letter in "uy"}
    return [f"{letter}{i + 1}" for letter in "uy" for i in range(max(counts[letter], 1))]


def read_logs(paths: Sequence[Path], preparation: Preparation) -> Log:
    """Several files of the same channels and sample time, one after the other.

    Raises:
        DataError: see `read_log`; the files differ, or hold the same samples.
    """
    logs = [read_log(path, preparation) for path in paths]
    first = logs[0]
    for path, log in zip(paths[1:], logs[1:], strict=True):
        alike = (log.u.shape[1], log.y.shape[1], log.time_unit) == (
            first.u.shape[1],
            first.y.shape[1],
            first.time_unit,
        )
        if not alike or abs(log.step - first.step) > 1e-3 * first.step:
            message = f"{path.name} has other channels or another sample time than {paths[0].name}"
            hint = "explore one experiment at a time, or say --columns and --sample-time"
            raise DataError.because("data-not-uniform", message, hint)
    references = [log.r for log in logs if log.r is not None]
    return Log(
        np.concatenate([log.u for log in logs]),
        np.concatenate([log.y for log in logs]),
        np.concatenate([log.time for log in logs]),
        tuple(length for log in logs for length in log.lengths),
        tuple((name, len(log.y)) for name, log in zip(labels(paths), logs, strict=True)),
        first.names,
        first.step,
        first.time_unit,
        (
            *check_different(paths, [log.recorded.values for log in logs]),
            *(
                f"{path.name}: {step}" if len(paths) > 1 else step
                for path, log in zip(paths, logs, strict=True)
                for step in log.steps
            ),
        ),
        Recorded.together([log.recorded for log in logs]),
        any(log.lined for log in logs),
        np.concatenate(references) if len(references) == len(logs) else None,
    )
