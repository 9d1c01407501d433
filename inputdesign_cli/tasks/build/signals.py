"""The signals in the columns of a file: within the range of arithmetic, at times that increase."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, Location
from inputdesign_cli.tasks.build.column_hints import called, columns_option, rising
from inputdesign_cli.tasks.build.columns import (
    NO_TIMES,
    channel_columns,
    time_column,
    time_unit_in,
    time_unit_of,
    without_times,
)
from inputdesign_cli.tasks.build.epochs import since_epoch
from inputdesign_cli.tasks.build.extremes import check_range
from inputdesign_cli.tasks.build.files import Sheet
from inputdesign_cli.tasks.build.files.sheet import elsewhere
from inputdesign_cli.tasks.build.other_times import shifted_times
from inputdesign_cli.tasks.build.preparation import MOST_JITTER, Preparation
from inputdesign_cli.questions.building.tables import column_named, columns_of
from inputdesign_cli.tasks.build.without import left_out

# Steps of time differ from a round number by less than this share of it by rounding alone.
_ROUND = 1e-4
# Times farther apart than so many steps more are not there to be resampled.
_LONGER = 0.5
# So many stamps, apart from the first and the last, nearly all of as many rows, are too coarse, not doubled.
_FEWEST_STAMPS, _MOSTLY = 3, 0.9


@dataclass(frozen=True)
class Signals:
    """What stands in the columns of a file: u (n, m), y (n, p), NaN where a number is missing.

    Attributes:
        time: (n,), counted in sample times where the file has none; `name` is that of its column, if any.
        dated: whether the times stand as dates; they are counted in seconds then.
        inputs, outputs: what notes call the columns of u and y.
        without: (n,), rows that are to be left out.
        told: what was done to read them.
    """

    sheet: Sheet
    time: Array
    name: str
    dated: bool
    u: Array
    y: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    without: NDArray[np.bool_]
    told: tuple[str, ...] = ()


def signals_of(
    sheet: Sheet,
    inputs: int,
    outputs: int,
    preparation: Preparation,
    references: Mapping[str, str] | None = None,
) -> Signals:
    """The columns of so many channels; those of `references`, by their labels, follow the inputs.

    Raises:
        DataError: a column is missing, holds text or nothing, or leaves the range of arithmetic; the times
            do not increase.
    """
    wanted = {
        **channel_columns("u", inputs, sheet, preparation),
        **channel_columns("y", outputs, sheet, preparation),
        **(references or {}),
        **time_column(sheet, preparation),
    }
    untimed = {"time": NO_TIMES} if without_times(sheet, preparation.columns) else {}
    found = columns_of(sheet, wanted, untimed)
    for role, numbers in found.items():
        if np.isnan(numbers).all():
            message = f"the column {wanted[role]} holds no number"
            raise DataError(sheet.error("data-not-a-number", message, "is it another column?", 0))
    rows = np.arange(min(preparation.skip, len(sheet.lines)), len(sheet.lines))
    time = found.get("time", np.arange(len(sheet.lines), dtype=float))
    scale = 1.0 if "time" in found else preparation.sample_time or sheet.pace.sample_time or 1.0
    if preparation.span is not None:
        begin, end = preparation.span
        rows = rows[(time[rows] * scale >= begin) & (time[rows] * scale <= end)]
    if not rows.size:
        raise _nothing_left(sheet, preparation, time * scale)
    name = wanted.get("time", "")
    kept = replace(
        sheet, lines=sheet.lines[rows], texts=[sheet.texts[i] for i in rows.tolist()] if sheet.texts else ()
    )
    without = left_out(sheet, preparation.without)[rows]
    for role, numbers in found.items():
        own = np.where(without & (role != "time"), np.nan, numbers[rows])
        if not np.isnan(own).all():
            # Clocks count from long ago.
            check_range(kept, wanted[role], own - np.nanmin(own) if role == "time" else own)
    labels = tuple(references or {})
    driving = (*_labels("u", inputs), *labels)
    u = np.column_stack([found[name][rows] for name in (*(f"u{i + 1}" for i in range(inputs)), *labels)])
    y = np.column_stack([found[f"y{i + 1}"][rows] for i in range(outputs)])
    time, told, dated = time[rows], [], False
    if name:
        times = column_named(sheet, name)
        dated, told = times.dated, [times.told]
        if not (dated or preparation.time_unit or time_unit_in(sheet, name)):
            time, counted = since_epoch(time)
            dated = bool(counted)
            told += [f"{name} counts {counted}"] if counted else []
        _check_rising(kept, time, wanted, dated=dated)
        told += shifted_times(sheet, name)
    told.append(elsewhere(sheet.path, sheet.others).lstrip("; "))
    return Signals(
        kept, time, name, dated, u, y, driving, _labels("y", outputs), without, tuple(filter(None, told))
    )


def _nothing_left(sheet: Sheet, preparation: Preparation, time: Array) -> DataError:
    """The error about rows that options leave out altogether."""
    count, name = len(sheet.lines), sheet.path.name
    message = f"nothing is left of the {count} rows of {name}"
    hint = f"--skip {preparation.skip} leaves them all out"
    if preparation.skip < count and preparation.span is not None:
        there = time[~np.isnan(time)]
        skipped = f" after the first {preparation.skip} rows" if preparation.skip else ""
        hint = f"its times run from {there.min():.6g} to {there.max():.6g}: no row{skipped} lies within "
        hint += "--range {:g}:{:g}".format(*preparation.span)
    return DataError.because("data-unreadable", message, hint, sheet.key, Location(str(sheet.path), 1, 1, ""))


def _apart_of_stamps(time: Array) -> float:
    """How far rows are apart where each time (n,) stands about equally often and none falls; else zero."""
    stamps, counts = np.unique(time, return_counts=True)
    inner = counts[1:-1]
    if np.any(np.diff(time) < 0.0) or inner.size < _FEWEST_STAMPS:
        return 0.0
    usual = float(np.median(inner))
    alike = np.mean(np.abs(inner - usual) <= 1.0) > _MOSTLY and counts.max() <= 2.0 * usual
    return float(np.median(np.diff(stamps)) / inner.mean()) if usual > 1.0 and alike else 0.0


def _check_rising(sheet: Sheet, time: Array, columns: Mapping[str, str], *, dated: bool) -> None:
    """Every time (n,) is later than the one before.

    Args:
        columns: by channel.
        dated: whether the times stand as dates.

    Raises:
        DataError: `data-not-uniform`.
    """
    there = np.flatnonzero(~np.isnan(time))
    wrong = np.flatnonzero(np.diff(time[there]) <= 0.0)
    if wrong.size:
        before, row = there[wrong[0]], there[wrong[0] + 1]
        message = (
            f"the times of {sheet.path.name} do not increase: {time[before]:.10g} is followed by "
            f"{time[row]:.10g}"
        )
        hint = (
            "sort the rows, keep one of those with the same time, or write times with enough digits to differ"
        )
        apart = _apart_of_stamps(time[there])
        if apart:
            unit = "s" if dated else time_unit_of(columns["time"])
            option = columns_option(sheet, {**columns, "time": NO_TIMES}, [])
            hint = (
                "its times are too coarse, several rows each: write them with enough digits to differ; or, "
                f"if the rows are evenly spaced and none is missing, do without: {option} "
                f"--sample-time {apart:.6g}{f' --time-unit {unit}' if unit else ''}"
            )
        others = [called(sheet, at) for at in rising(sheet)]
        if others:
            hint += f"; or is the time in column {others[0]}, which rises? Then --columns time={others[0]}"
        raise DataError(sheet.error("data-not-uniform", message, hint, int(row)))


def stated_step(sheet: Sheet, preparation: Preparation) -> float | None:
    """The sample time that the user or the file itself states.

    Raises:
        DataError: `data-not-uniform`, that of the file is no length of time.
    """
    if preparation.sample_time:
        return preparation.sample_time
    stated, fault = sheet.pace.sample_time, sheet.pace.fault
    if not fault and (stated is None or 0.0 < stated < np.inf):
        return stated
    wrong = (
        f"no sample time: {fault}" if fault else f"the sample time {stated:g}, which is no positive number"
    )
    message = f"{sheet.path.name} states {wrong}"
    hint = "mend it in the file, or give the one that holds: --sample-time 0.5"
    raise DataError(sheet.error("data-not-uniform", message, hint))


def typical_step(time: Array) -> float:
    """The mean step of time, gaps apart, rounded where rounding alone may be the difference."""
    steps = np.diff(time[~np.isnan(time)])
    if not steps.size:
        return np.nan
    middle = float(np.median(steps))
    near = steps[np.abs(steps - middle) < 0.5 * abs(middle)]
    if middle <= 0.0 or not near.size:
        return np.nan
    mean = float(near.mean())
    for digits in range(1, 7):
        rounded = float(f"{mean:.{digits - 1}e}")
        if abs(rounded - mean) <= _ROUND * mean:
            return rounded
    return mean


def check_stated(signals: Signals, step: float, *, resample: bool) -> None:
    """The times of a file, where it has some, advance by the sample time that the user states.

    Args:
        resample: whether a longer one is asked for.

    Raises:
        DataError: `data-not-uniform`.
    """
    apart = typical_step(signals.time) if signals.name else step
    if apart - step > (_LONGER if resample else MOST_JITTER) * step or (
        step - apart > MOST_JITTER * step and not resample
    ):
        message = (
            f"the times of {signals.sheet.path.name}, in column {signals.name}, advance by {apart:.6g}, and "
            f"--sample-time says {step:.6g}"
        )
        hint = (
            "leave --sample-time out: the times tell it; or mind their unit (--time-unit); or, if that "
            "column does not count, add time=none to --columns"
        )
        raise DataError(signals.sheet.error("data-not-uniform", message, hint, 0))


def _labels(letter: str, count: int) -> tuple[str, ...]:
    """What notes call channels: u, or u1, u2, .. of several."""
    return (letter,) if count == 1 else tuple(f"{letter}{i + 1}" for i in range(count))
