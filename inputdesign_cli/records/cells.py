"""What the cells of a table say: numbers, dates and times of day, or that there is no value."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.records.sheet import Column, Sheet

# What says that there is no value, with what sheets write in place of a number that they do not have.
ERROR = re.compile(
    r"\s*#(N/A|DIV/0!|VALUE!|REF!|NAME\?|NUM!|NULL!|SPILL!|CALC!|GETTING_DATA|#+)\s*", re.IGNORECASE
)
_MISSING = re.compile(rf"|nan|na|n/a|null|none|-|\?|{ERROR.pattern}", re.IGNORECASE)
_UNIT = re.compile(
    r"\W*([munk]?(s|v|a|w|hz|m|g|l|n|pa|bar)|sec|min|h|d|c|f|deg[cfk]?|celsius|kelvin|percent|pct|mpa|psi|cm|rpm|"
    r"rad|samples?)?\W*|.*[%°/²³^℃℉].*",
    re.IGNORECASE,
)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?", re.ASCII)
# Numbers with marks between thousands, or with a unit in the same cell.
_MARKED = re.compile(
    r"[-+\u2212]?\d([\d.,'\u2019_ \u00a0\u202f]*\d)?\.?[ \u00a0\u202f]?[^\W\d]{0,5}[ \u00a0\u202f]?[%°]?"
)
# Whole numbers below a million, where a point may stand between thousands.
_WHOLE = re.compile(r"[+-]?(0|[1-9]\d{0,2}(\.\d{3})?)", re.ASCII)
_THOUSAND = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
_SAY = "say which with --decimal , or --decimal .; or write decimal points and nothing between thousands"

# Points stand after a day; with slashes and hyphens the dates themselves must show what is the month.
_DAYS = (
    *("%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%d/%m/%y", "%d-%m-%Y", "%m/%d/%Y", "%m/%d/%y", "%m-%d-%Y"),
    *("%Y/%m/%d", "%Y.%m.%d", "%d-%b-%Y", "%d %b %Y"),
)
_CLOCKS = ("%H:%M:%S.%f", "%H:%M:%S", "%H:%M", "%I:%M:%S %p", "%I:%M %p")
_ISO = "ISO8601"
# Forms of one order of day, month and year, or of times of day: seconds and their parts may be left out.
_FORMS: dict[str, tuple[str, ...]] = {
    _ISO: (_ISO,),
    "": _CLOCKS,
    **{day: (*(f"{day} {clock}" for clock in _CLOCKS), day) for day in _DAYS},
}
_DATE = (
    r"\d{4}-\d\d-\d\d|\d{4}[./]\d\d?[./]\d\d?|\d\d?\.\d\d?\.(\d{4}|\d\d)|\d\d?/\d\d?/(\d{4}|\d\d)|"
    r"\d\d?-\d\d?-\d{4}|\d\d?[- ][A-Za-z]{3}[- ]\d{4}"
)
_CLOCK = r"\d\d?:\d\d(:\d\d([.,]\d{1,9})?)?(\s?[AaPp][Mm])?"
_MOMENT = re.compile(rf"({_CLOCK}|({_DATE})([T ]{_CLOCK})?)\s*(Z|[+-]\d\d:?\d\d)?")
_ZONE = re.compile(r"\d\s*(Z|[+-]\d\d:?\d\d)$")
_COMMA_SECONDS = re.compile(r"(:\d\d),(\d+)$")
# What dates and times of any language and order have in them.
_LIKE = re.compile(
    r".*\d:\d\d.*|(?=.*(?<!\d)(19|20)\d\d(?!\d))(?=.*(?<!\d)\d{1,2}(?!\d))(?=.*[^\W\d_]{3}|(\D*\d+){3}).*"
    r"|\d{1,2}[./-]\s?[^\W\d_]{3,}\.?[./-]\s?\d\d(?!\d).*|\d{1,4}[./-]\d{1,2}[./-]\d.*"
)
# YYYYMMDD alone or before HHMM, HHMMSS or milliseconds more.
_DIGITS = re.compile(r"(19[7-9]|20\d)\d(0[1-9]|1[0-2])(0[1-9]|[12]\d|3[01])(\d{4}|\d{6}|\d{9})?")
_A_DAY, _HALF_A_DAY = 86_400.0, 43_200.0
_MOSTLY, _DIFFERENT = 0.9, 3
SAY_TIME = (
    "say how they are written, as in --time-format '%d.%m.%Y %H:%M:%S', or write the year first: 2024-03-12 "
    "10:15:00"
)


def is_missing(cell: str) -> bool:
    """Return whether a cell says that there is no value, or holds an error of a spreadsheet."""
    return _MISSING.fullmatch(cell.strip()) is not None


def is_unit(cell: str) -> bool:
    """Return whether a cell is a unit, or says that there is none."""
    return is_missing(cell) or _UNIT.fullmatch(cell.strip()) is not None


def is_plain(cell: str) -> bool:
    """Return whether a cell is a number, with a decimal point or comma, or a date."""
    return _is_number(cell.strip()) or _is_comma(cell) or _MOMENT.fullmatch(cell.strip()) is not None


def is_value(cell: str) -> bool:
    """Return whether a cell is a number, a date, or a number with marks or a unit that its column refuses."""
    return is_plain(cell) or _MARKED.fullmatch(cell.strip()) is not None


def _is_number(cell: str) -> bool:
    return _NUMBER.fullmatch(cell) is not None and math.isfinite(float(cell))


def _is_comma(cell: str) -> bool:
    return _COMMA.fullmatch(cell.strip("% ")) is not None


def decimal_of(cells: Sequence[str], *, between_commas: bool) -> str:
    """Return the decimal mark of numbers in cells: a comma where some have one, and none has a point.

    Args:
        between_commas: whether fields are separated by commas, and 1,234 in quotes may be a thousand.
    """
    bare = [cell.strip("% ") for cell in cells]
    commas = [cell for cell in bare if _COMMA.fullmatch(cell)]
    if not commas or (between_commas and all(map(_THOUSAND.fullmatch, commas))):
        return "."
    return "." if any("." in cell and _is_number(cell) for cell in bare) else ","


def column_of(cells: Sequence[str], decimal: str = ".", *, stated: bool = False) -> Column:
    """Return the numbers, or the dates and times, that cells hold.

    Args:
        decimal: the decimal mark; `stated`: the user says so.
    """
    import pandas

    texts = [cell.strip().replace("\u2212", "-") for cell in cells]
    if all(text.endswith("%") or is_missing(text) for text in texts):
        texts = [text.rstrip("% ") for text in texts]
    plain = [text.replace(",", ".") if decimal == "," and _is_comma(text) else text for text in texts]
    numbers = np.array(pandas.to_numeric(pandas.Series(plain, dtype=object), errors="coerce"), dtype=float)
    numbers[~np.isfinite(numbers)] = np.nan
    row = next((int(i) for i in np.flatnonzero(np.isnan(numbers)) if not is_missing(plain[i])), None)
    pointed = [i for i, text in enumerate(texts) if "." in text and _is_number(text)]
    say = _SAY
    if decimal == "," and stated and pointed:
        wrong, row = "has a point, and --decimal says that commas are the decimal marks", pointed[0]
    elif row is None and not stated and (decimal == "," or pointed) and _like_thousands(plain):
        wrong = "may have a mark between thousands, or three decimals"
        row = next(i for i, text in enumerate(plain) if "." in text)
    elif row is None:
        return Column(numbers)
    elif _is_comma(texts[row]) and stated:
        wrong = "has a comma, and --decimal says that points are the decimal marks"
        say = "write nothing between thousands; or are the commas decimal marks (--decimal ,)?"
    elif _is_comma(texts[row]):
        wrong = "has a comma, which may be a decimal mark or stand between thousands"
    else:
        dates = moments_column(["" if is_missing(text) else text for text in texts])
        return dates or Column(numbers, (row, texts[row]))
    return Column(numbers, (row, texts[row]), wrong, say)


def _like_thousands(texts: Sequence[str]) -> bool:
    """Return whether points may stand between thousands, as in 1.250: others, like 808, have no decimals."""
    there = [text for text in texts if not is_missing(text)]
    hundreds = any("." not in text and len(text.lstrip("+-")) == 3 for text in there)
    return hundreds and any("." in text for text in there) and all(map(_WHOLE.fullmatch, there))


def moments_column(cells: Sequence[str], form: str | None = None) -> Column | None:
    """Return the column of times that cells hold, NaN in empty ones; None if they are no dates or times.

    Args:
        form: how they are written; None: ISO 8601, or day, month and year in an order that is clear.
    """
    there = [i for i, cell in enumerate(cells) if cell]
    if not there:
        return None
    texts = np.array([_COMMA_SECONDS.sub(r"\1.\2", cells[i]) for i in there], dtype=object)
    known = _FORMS if form is None and _MOMENT.fullmatch(texts[0]) else {}
    orders: dict[str, tuple[str, ...]] = {form: (form,)} if form else {}
    for order, forms in known.items():
        if not np.isnat(_read(texts[:1], forms)[0]):
            orders[order] = forms
    every = {order: _read(texts, forms) for order, forms in orders.items()}
    whole = {one: found for one, found in every.items() if not np.isnat(found).any()}
    if whole:
        (order, moments), *others = whole.items()
        if any(not np.array_equal(moments - moments[0], found - found[0]) for _, found in others):
            return _unread(cells, there[0], "may have the day or the month first")
        numbers = np.full(len(cells), np.nan)
        numbers[there] = (moments - moments[0]) / np.timedelta64(1, "s")
        of_day = order != _ISO and not re.search("%[djDFxcyYGUWu]", order)
        since = moments[0].astype("datetime64[D]") if of_day else np.datetime64(0, "s")
        began = float((moments[0] - since) / np.timedelta64(1, "s"))
        return Column(numbers, dated=True, began=began, of_day=of_day)
    alike = {text for text in texts if _LIKE.fullmatch(text)}
    many = len(alike) >= _DIFFERENT and sum(text in alike for text in texts) > _MOSTLY * len(texts)
    if not many and (form is not None or not orders):
        return None
    at = int(np.argmax(np.all([np.isnat(found) for found in every.values()], axis=0))) if every else 0
    wrong = "is no date or time as those above are" if at else "is no date or time that can be read"
    return _unread(cells, there[at], wrong)


def _unread(cells: Sequence[str], row: int, wrong: str) -> Column:
    return Column(np.full(len(cells), np.nan), (row, cells[row]), wrong, SAY_TIME, undated=True)


def _read(texts: NDArray[np.object_], forms: Sequence[str]) -> NDArray[np.datetime64]:
    """Return moments (n,), in UTC if all have a zone, by the first form that fits; NaT where none does."""
    import pandas

    zoned = np.array([_ZONE.search(text[10:]) is not None for text in texts])
    found = np.full(len(texts), np.datetime64("NaT", "ns"))
    for form in forms:
        left = np.isnat(found)
        if left.any():
            with contextlib.suppress(ValueError, TypeError, OverflowError):
                read = pandas.to_datetime(pandas.Series(texts[left]), format=form, utc=True, errors="coerce")
                found[left] = read.dt.tz_localize(None).to_numpy()
    return np.where(zoned == zoned[0], found, np.datetime64("NaT"))


def with_days(sheet: Sheet) -> Sheet:
    """Return the sheet with days to its times of day.

    A column of dates and one of times of day become one moment. Where there are no dates, times of day that
    fall by more than half a day belong to the next day.
    """
    columns = list(sheet.columns)
    days = [column.numbers[~np.isnan(column.numbers)] / _A_DAY for column in columns]
    whole = [bool(np.all(np.abs(each - np.round(each)) < 1e-6)) for each in days]
    dates = [i for i, one in enumerate(columns) if one.dated and not one.of_day and whole[i]]
    clocks = [i for i, column in enumerate(columns) if column.of_day]
    for i in clocks:
        clock = columns[i]
        if len(dates) == len(clocks) == 1:
            moments = columns[dates[0]].numbers + (clock.numbers + clock.began) % _A_DAY
            first = float(next(iter(moments[~np.isnan(moments)]), 0.0))
            done = f"{' and '.join(sheet.name_of(j) for j in sorted((dates[0], i)))} were joined"
            began = columns[dates[0]].began + first
            columns[dates[0]] = columns[i] = Column(moments - first, dated=True, began=began, done=(done,))
            continue
        there = np.flatnonzero(~np.isnan(clock.numbers))
        falls = np.diff(clock.numbers[there]) < -_HALF_A_DAY
        numbers = clock.numbers.copy()
        numbers[there[1:]] += _A_DAY * np.cumsum(falls)
        done = f"{sheet.name_of(i)} passes midnight {int(falls.sum())} times: a day was added each time"
        columns[i] = replace(clock, numbers=numbers, done=(done,) if np.any(falls) else ())
    return replace(sheet, columns=tuple(columns))


def is_date_in_digits(x: Array) -> bool:
    """Return whether most numbers (n,) are dates in digits, as 20240312 or 20240312105959."""
    near = x[(x >= 1.97e7) & (x < 2.1e16)]
    found = [_DIGITS.fullmatch(f"{value:.0f}") for value in np.floor(near)]
    return sum(one is not None for one in found) > _MOSTLY * x.size
