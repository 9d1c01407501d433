"""Dates that stand as one number, 20240312101500, or as two: 20240312 beside the time of day 101500."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.tasks.build.files.dates import AS_DATES
from inputdesign_cli.tasks.build.files.naming import called_times, says_unit
from inputdesign_cli.tasks.build.files.sheet import Array, Column, Sheet

_DAY, _MINUTE = 86_400.0, 60.0
# Years of dates. Counts since 1970 that a clock may show now lie outside their ranges in all units.
_YEARS = (1970, 2099)
# Of a column of dates hardly any number is something else.
_MOSTLY, _FEWEST = 0.9, 3
# Smaller numbers may be seconds from the beginning as well as times of day.
_HOURS = 100
# Steps of even times differ by less than this share, but for gaps, which are rare.
_EVEN, _RARE = 0.1, 0.1
_MOST = 1e18  # of what integers hold
_YYYYMMDD = "YYYYMMDD"
_HHMM = re.compile(r"(h?hmm(ss)?|hms)(?![^\W_]).*")


@dataclass(frozen=True)
class _Form:
    """How dates are written: what of a number counts days, and how many of the others are in a second."""

    name: str
    after_day: int
    a_second: int = 1
    minutes: bool = False

    @property
    def range(self) -> tuple[float, float]:
        first, last = (1e4 * year * self.after_day for year in (_YEARS[0], _YEARS[1] + 1))
        return first, last

    def seconds(self, whole: NDArray[np.int64], part: Array) -> Array:
        """Seconds (n,) since 1970, NaN where numbers (n,), in whole ones and the rest, are no dates."""
        day, clock = np.divmod(whole, self.after_day)
        if self.minutes:
            clock, part = 100 * clock, np.where(part == 0.0, part, np.nan)
        clock, fine = np.divmod(clock, self.a_second)
        return _days(day) * _DAY + _of_day(clock) + (fine + part) / self.a_second


_FORMS = (
    _Form("YYYYMMDDHHMMSS", 10**6),
    _Form("YYYYMMDDHHMM", 10**4, minutes=True),
    _Form("YYYYMMDDHHMMSS and milliseconds", 10**9, 1000),
)


def of_numbers(numbers: NDArray) -> Column | None:
    """The column of dates that numbers (n,) are, if nearly all of them are dates."""
    form = _form_of(numbers)
    if form is None:
        return None
    if numbers.dtype.kind in "iu":
        return _column(form, numbers, numbers.astype(np.int64), np.zeros(numbers.size), None)
    near = np.where(np.abs(numbers) < _MOST, numbers, 0.0)
    whole = np.floor(near)
    return _column(form, numbers, whole.astype(np.int64), near - whole, None)


def of_cells(cells: Sequence[str], numbers: Array) -> Column | None:
    """The same of numbers as they are written, of which floats may lose parts of a second."""
    form = _form_of(numbers)
    if form is None:
        return None
    near = np.abs(numbers) < _MOST
    exact = [Decimal(cell) if is_near else Decimal(0) for cell, is_near in zip(cells, near, strict=True)]
    whole = np.array([int(value) for value in exact], dtype=np.int64)
    return _column(form, numbers, whole, np.array([float(value % 1) for value in exact]), cells)


def _form_of(numbers: NDArray) -> _Form | None:
    """How the number in the middle may be written as a date."""
    there = numbers[np.isfinite(numbers)]
    middle = float(np.median(there)) if there.size and there.dtype.kind in "iuf" else 0.0
    return next((form for form in _FORMS if form.range[0] <= middle < form.range[1]), None)


def _column(
    form: _Form, numbers: NDArray, whole: NDArray[np.int64], part: Array, cells: Sequence[str] | None
) -> Column | None:
    first, end = form.range
    inside = (whole >= first) & (whole < end)
    moments = np.where(inside, form.seconds(np.where(inside, whole, int(first)), part), np.nan)
    if not _mostly(moments, numbers):
        return None
    return _faulty(moments, numbers, form.name, cells) or _dated(moments, form.name)


def _mostly(found: Array, numbers: NDArray) -> bool:
    """Whether of the numbers (n,) that are there all but a few are found to be something."""
    there, right = int(np.sum(~np.isnan(numbers))), int(np.sum(~np.isnan(found)))
    return 0 < there == right or (right >= _FEWEST and right > _MOSTLY * there)


def _faulty(found: Array, numbers: NDArray, form: str, cells: Sequence[str] | None = None) -> Column | None:
    """The column in which a number is not what the others are found to be; None where all are."""
    wrong = np.flatnonzero(np.isnan(found) & ~np.isnan(numbers))
    if not wrong.size:
        return None
    at = int(wrong[0])
    fault = (at, cells[at].strip() if cells else f"{numbers[at]:.17g}")
    what = f"is no date or time as the other numbers of its column are ({form})"
    return Column(np.asarray(numbers, dtype=float), fault, wrong=what, hint=AS_DATES, undated=True)


def _dated(moments: Array, written: str) -> Column:
    first = float(moments[~np.isnan(moments)][0])
    begun = datetime.fromtimestamp(first, UTC)
    shown = f"{begun:%Y-%m-%d}" if written == _YYYYMMDD else f"{begun:%Y-%m-%d %H:%M:%S}"
    told = f"dates are written as {written} (the first is {shown})"
    return Column(moments - first, dated=True, began=first, told=told)


def _days(numbers: NDArray[np.int64]) -> Array:
    """Days since 1970 of YYYYMMDD; NaN where there is no such day."""
    year, rest = np.divmod(numbers, 10_000)
    month, day = np.divmod(rest, 100)
    right = (year >= _YEARS[0]) & (year <= _YEARS[1]) & (month >= 1) & (month <= 12) & (day >= 1)
    months = np.where(right, 12 * (year - 1970) + month - 1, 0).astype("datetime64[M]")
    days = months.astype("datetime64[D]") + np.where(right, day - 1, 0)
    right &= days.astype("datetime64[M]") == months
    return np.where(right, days.astype(np.int64), np.nan)


def _of_day(clock: NDArray[np.int64]) -> Array:
    """Seconds of the day of HHMMSS; NaN where there is no such time."""
    hour, rest = np.divmod(clock, 10_000)
    minute, second = np.divmod(rest, 100)
    right = (clock >= 0) & (hour < 24) & (minute < 60) & (second < 60)
    return np.where(right, 3600.0 * hour + 60.0 * minute + second, np.nan)


def with_numeric_dates(sheet: Sheet) -> Sheet:
    """A sheet whose columns of days, YYYYMMDD, and of times of day, HHMMSS or HHMM, are dates and times.

    Times of day count as such beside days, or where they are even as times of day and not as numbers.
    """
    columns = list(sheet.columns)
    days = [i for i, column in enumerate(columns) if _is_days(column)]
    if len(days) == 1:
        at = days[0]
        clocks = [i for i in range(len(columns)) if i != at and _is_beside(sheet, at, i)]
        written = [i for i, column in enumerate(columns) if column.clock is not None]
        alone = not any(column.dated for column in columns) and _names_times(sheet, at)
        if len(written) == 1 or len(clocks) == 1 or (alone and _rises(columns[at].numbers)):
            numbers, found = columns[at].numbers, _days_of(columns[at])
            columns[at] = _faulty(found, numbers, _YYYYMMDD) or _dated(found, _YYYYMMDD)
        if len(clocks) == 1 and not written:
            columns[clocks[0]] = _clock(columns[clocks[0]])
    elif not any(column.dated for column in columns) and not sheet.pace.unit:
        for i, column in enumerate(columns):
            if _names_times(sheet, i) and _is_clock(column) and _even_as_clock(column):
                columns[i] = _clock(column)
    return replace(sheet, columns=tuple(columns))


def _names_times(sheet: Sheet, i: int) -> bool:
    """Whether a column is called as times are, without a unit that says that it counts them."""
    return i < len(sheet.header) and called_times(sheet.header[i]) and not says_unit(sheet.header[i])


def _whole(column: Column) -> NDArray[np.int64]:
    return np.floor(np.nan_to_num(column.numbers)).astype(np.int64)


def _plain(column: Column, most: float) -> bool:
    """Whether a column holds numbers of zero to `most`, and no faults."""
    there = column.numbers[~np.isnan(column.numbers)]
    plain = column.fault is None and not column.dated and there.size > 0
    return plain and bool(there.min() >= 0.0 and there.max() <= most)


def _days_of(column: Column) -> Array:
    whole = _whole(column)
    return np.where(column.numbers == whole, _days(whole) * _DAY, np.nan)


def _is_days(column: Column) -> bool:
    """Whether nearly all numbers are days, none before the one above it."""
    if not _plain(column, 1e8):
        return False
    days = _days_of(column)
    return _mostly(days, column.numbers) and bool(np.all(np.diff(days[~np.isnan(days)]) >= 0.0))


def _is_beside(sheet: Sheet, day: int, i: int) -> bool:
    """Whether column i holds the times of day of the days in column `day`: by name, or next to it."""
    column = sheet.columns[i]
    if not _is_clock(column):
        return False
    if sheet.names:
        return _names_times(sheet, i) or _HHMM.fullmatch(sheet.header[i]) is not None
    return abs(i - day) == 1 and _rises(column.numbers)


def _rises(numbers: Array) -> bool:
    steps = np.diff(numbers[~np.isnan(numbers)])
    return bool(np.mean(steps > 0.0) > _MOSTLY) if steps.size else False


def _is_minutes(column: Column) -> bool:
    """Whether times of day are HHMM: whole numbers, none of which has an hour beyond 23."""
    there = column.numbers[~np.isnan(column.numbers)]
    return bool(there.max() < 2400.0 and np.all(there == np.floor(there)))


def _seconds(column: Column) -> Array:
    """Seconds of the day (n,), NaN where a number is missing or no time of day."""
    whole = _whole(column)
    return _of_day(100 * whole if _is_minutes(column) else whole) + column.numbers - whole


def _is_clock(column: Column) -> bool:
    """Whether nearly all numbers are times of day, of which some have hours, or minutes and seconds."""
    if not _plain(column, 1e6) or np.nanmax(column.numbers) < _HOURS:
        return False
    return _mostly(_seconds(column), column.numbers)


def _even_as_clock(column: Column) -> bool:
    """Whether steps of time are even for times of day, and uneven wherever a minute or an hour is full."""
    seconds, there = _seconds(column), ~np.isnan(column.numbers)
    if np.isnan(seconds[there]).any():
        return False
    clock = np.diff(seconds[there])
    clock = np.where(clock < -0.5 * _DAY, clock + _DAY, clock)
    uneven, uneven_clock = _uneven(np.diff(column.numbers[there])), _uneven(clock)
    return uneven > 0 and 2 * uneven_clock <= uneven and uneven_clock <= _RARE * clock.size


def _uneven(steps: Array) -> int:
    """How many steps of time are not the one in the middle; all of them, where that is none."""
    middle = float(np.median(steps)) if steps.size else 0.0
    return int(np.sum(np.abs(steps - middle) > _EVEN * middle)) if middle > 0.0 else steps.size


def _clock(column: Column) -> Column:
    seconds = _seconds(column)
    form = "HHMM" if _is_minutes(column) else "HHMMSS"
    faulty = _faulty(seconds, column.numbers, form)
    if faulty is not None:
        return faulty
    first = float(seconds[~np.isnan(seconds)][0])
    hour, minute = divmod(int(first / _MINUTE), 60)
    told = f"times of day are written as {form} (the first is {hour:02d}:{minute:02d}"
    told += ")" if form == "HHMM" else f":{first % _MINUTE:02.0f})"
    return Column(seconds - first, dated=True, began=first, clock=first, told=told)
