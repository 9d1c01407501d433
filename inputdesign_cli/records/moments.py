"""Dates and times as loggers write them, by pandas; where their order is not clear they are refused."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.records.sheet import Column, Sheet

# Points stand after a day; with slashes and hyphens the dates themselves must show what is the month.
_DAYS = (
    *("%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%d/%m/%y", "%d-%m-%Y", "%m/%d/%Y", "%m/%d/%y", "%m-%d-%Y"),
    *("%Y/%m/%d", "%Y.%m.%d", "%d-%b-%Y", "%d %b %Y"),
)
_CLOCKS = ("%H:%M:%S.%f", "%H:%M:%S", "%H:%M", "%I:%M:%S %p", "%I:%M %p")
_PARTS = {
    "%d": r"\d\d?",
    "%m": r"\d\d?",
    "%Y": r"\d{4}",
    "%y": r"\d\d",
    "%b": r"[A-Za-z]{3}",
    "%H": r"\d\d?",
    "%I": r"\d\d?",
    "%M": r"\d\d",
    "%S": r"\d\d",
    "%f": r"\d{1,9}",
    "%p": "[AaPp][Mm]",
    ".": r"\.",
}
_ISO_FORM, _ISO = "ISO8601", r"\d{4}-\d\d-\d\d([T ]\d\d(:?\d\d(:?\d\d(\.\d{1,9})?)?)?)?\s*(Z|[+-]\d\d:?\d\d)?"
_FORMS = {
    _ISO_FORM: re.compile(_ISO),
    **{
        form: re.compile(re.sub(r"%\w|\.", lambda part: _PARTS[part[0]], form))
        for form in (*_CLOCKS, *(f"{day} {clock}".strip() for day in _DAYS for clock in ("", *_CLOCKS)))
    },
}
_ANY = re.compile("|".join(f"({pattern.pattern})" for pattern in _FORMS.values()))
_ZONE = re.compile(r"\d\s*(Z|[+-]\d\d:?\d\d)$")
_MINUTES, _SECONDS, _FRACTION = map(re.compile, (r"(\d:\d\d)$", r"(:\d\d:\d\d)(?![.\d])", r":\d\d\.\d+"))
_COMMA = re.compile(r"(:\d\d),(\d+)$")
# What dates and times of any language and order have in them.
_LIKE = re.compile(
    r".*\d:\d\d.*|(?=.*(?<!\d)(19|20)\d\d(?!\d))(?=.*(?<!\d)\d{1,2}(?!\d))(?=.*[^\W\d_]{3}|(\D*\d+){3}).*"
    r"|\d{1,2}[./-]\s?[^\W\d_]{3,}\.?[./-]\s?\d\d(?!\d).*|\d{1,4}[./-]\d{1,2}[./-]\d.*"
)
# YYYYMMDD alone or before HHMM, HHMMSS or milliseconds more.
_DIGITS = re.compile(r"(19[7-9]|20\d)\d(0[1-9]|1[0-2])(0[1-9]|[12]\d|3[01])(\d{4}|\d{6}|\d{9})?")
_DAY, _HALF = 86_400.0, 43_200.0
_MOSTLY, _DIFFERENT = 0.9, 3
SAY = (
    "say how they are written, as in --time-format '%d.%m.%Y %H:%M:%S', or write the year first: 2024-03-12 "
    "10:15:00"
)


def moments_column(cells: Sequence[str], form: str | None = None) -> Column | None:
    """Return the column of times that cells hold, NaN in empty ones; None if they are no dates or times.

    Args:
        form: how they are written; None: ISO 8601, or day, month and year in an order that is clear.
    """
    there = [i for i, cell in enumerate(cells) if cell]
    if not there:
        return None
    texts = _even([cells[i] for i in there])
    forms = [form] if form else [one for one, pattern in _FORMS.items() if pattern.fullmatch(texts[0])]
    every = {one: _read(texts, one) for one in forms}
    whole = {one: found for one, found in every.items() if not np.isnat(found).any()}
    if whole:
        (one, first), *others = whole.items()
        if any(not np.array_equal(first - first[0], found - found[0]) for _, found in others):
            return _unread(cells, there[0], "may have the day or the month first")
        numbers = np.full(len(cells), np.nan)
        numbers[there] = (first - first[0]) / np.timedelta64(1, "s")
        of_day = one != _ISO_FORM and not re.search("%[djDFxcyYGUWu]", one)
        since = first[0].astype("datetime64[D]") if of_day else np.datetime64(0, "s")
        began = float((first[0] - since) / np.timedelta64(1, "s"))
        return Column(numbers, dated=True, began=began, of_day=of_day)
    alike = {text for text in texts if _LIKE.fullmatch(text)}
    many = len(alike) >= _DIFFERENT and sum(text in alike for text in texts) > _MOSTLY * len(texts)
    if not many and (form is not None or not forms):
        return None
    at = int(np.argmax(np.all([np.isnat(found) for found in every.values()], axis=0))) if every else 0
    wrong = "is no date or time as those above are" if at else "is no date or time that can be read"
    return _unread(cells, there[at], wrong)


def _unread(cells: Sequence[str], row: int, wrong: str) -> Column:
    return Column(np.full(len(cells), np.nan), (row, cells[row]), wrong, SAY, undated=True)


def _even(texts: Sequence[str]) -> list[str]:
    """Return texts with seconds, and with parts of a second after a point, in all of them if any has some."""
    plain = [_COMMA.sub(r"\1.\2", text) for text in texts]
    if all(map(_FORMS[_ISO_FORM].fullmatch, plain)):
        return plain
    if any(map(_SECONDS.search, plain)):
        plain = [text if _SECONDS.search(text) else _MINUTES.sub(r"\1:00", text) for text in plain]
    if any(map(_FRACTION.search, plain)):
        plain = [text if _FRACTION.search(text) else _SECONDS.sub(r"\1.0", text) for text in plain]
    return plain


def _read(texts: Sequence[str], form: str) -> NDArray[np.datetime64]:
    """Return moments (n,), in UTC if all have a zone, not a time where a text is none."""
    import pandas

    zoned = [form == _ISO_FORM and _ZONE.search(text[10:]) is not None for text in texts]
    try:
        found = pandas.to_datetime(pandas.Series(texts, dtype=object), format=form, utc=True, errors="coerce")
        moments = np.asarray(found.dt.tz_localize(None).to_numpy())
    except (ValueError, TypeError, OverflowError):
        return np.full(len(texts), np.datetime64("NaT"))
    return np.where(np.array(zoned) == zoned[0], moments, np.datetime64("NaT"))


def with_days(sheet: Sheet) -> Sheet:
    """Return the sheet with days to its times of day.

    A column of dates and one of times of day become one moment. Where there are no dates, times of day that
    fall by more than half a day belong to the next day.
    """
    columns = list(sheet.columns)
    dates = [i for i, column in enumerate(columns) if _of_dates(column)]
    clocks = [i for i, column in enumerate(columns) if column.of_day]
    if len(dates) == len(clocks) == 1:
        (date,), (clock,) = dates, clocks
        names = " and ".join(sheet.name_of(i) for i in sorted((date, clock)))
        columns[date] = columns[clock] = _joined(columns[date], columns[clock], names)
    else:
        for i in clocks:
            columns[i] = _past_midnight(columns[i], sheet.name_of(i))
    return replace(sheet, columns=tuple(columns))


def _of_dates(column: Column) -> bool:
    days = column.numbers[~np.isnan(column.numbers)] / _DAY
    return column.dated and not column.of_day and bool(np.all(np.abs(days - np.round(days)) < 1e-6))


def _joined(dates: Column, clock: Column, names: str) -> Column:
    moments = dates.numbers + (clock.numbers + clock.began) % _DAY
    there = moments[~np.isnan(moments)]
    first = float(there[0]) if there.size else 0.0
    done = (*dates.done, *clock.done, f"{names} were joined: dates and times of day")
    return Column(moments - first, dated=True, began=dates.began + first, done=done)


def _past_midnight(clock: Column, name: str) -> Column:
    there = np.flatnonzero(~np.isnan(clock.numbers))
    falls = np.diff(clock.numbers[there]) < -_HALF
    if not np.any(falls):
        return clock
    numbers = clock.numbers.copy()
    numbers[there[1:]] += _DAY * np.cumsum(falls)
    done = f"{name} passes midnight {int(falls.sum())} times: a day was added each time"
    return replace(clock, numbers=numbers, done=(*clock.done, done))


def is_moment(text: str) -> bool:
    """Return whether a text is a date or a time of day."""
    return _ANY.fullmatch(_COMMA.sub(r"\1.\2", text)) is not None


def form_of_digits(x: Array) -> tuple[str, str]:
    """Return form and kind of dates or times of day in digits, as 20240312 or 105959; else nothing."""
    near = x[(x >= 1.97e7) & (x < 2.1e16)]
    found = [_DIGITS.fullmatch(f"{value:.0f}") for value in np.floor(near)]
    if sum(one is not None for one in found) > _MOSTLY * x.size:
        return "%Y%m%d%H%M%S", "date"
    low, mid, high, steps = x % 100, x // 100 % 100, x // 10_000, np.diff(x)
    if x.size < 3 or x.min() < 0 or x.max() < 100 or np.any((low >= 60) | (mid >= 60) | (high >= 24)):
        return "", ""
    sixties = 3600 * high + 60 * mid + low  # of a clock steps are even only so
    even = np.ptp(np.diff(sixties)) < 0.1 * abs(np.median(steps)) <= 0.1 * np.ptp(steps)
    return ("%H%M%S", "time of day") if even else ("", "")
