"""The contents of the cells of a table: numbers, dates, times of day, or no value."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np

from inputdesign_cli.records.sheet import Column

# Cells without a value, among them the errors that spreadsheets write in place of a number.
ERROR = re.compile(
    r"\s*#(N/A|DIV/0!|VALUE!|REF!|NAME\?|NUM!|NULL!|SPILL!|CALC!|GETTING_DATA|#+)\s*", re.IGNORECASE
)
_MISSING = re.compile(rf"|nan|na|n/a|null|none|-|\?|{ERROR.pattern}", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?", re.ASCII)
# Numbers with marks between thousands, or with a unit in the same cell.
_MARKED = re.compile(r"[-+\u2212]?([\d.,'\u2019_ \u00a0\u202f]*\d)\.?\s?[^\W\d]{0,5}\s?[%°]?")
# Whole numbers below a million, where a mark may stand between thousands.
_WHOLE = re.compile(r"[+-]?(0|[1-9]\d{0,2}(\.\d{3})?)", re.ASCII)
_THOUSAND = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
_SAY = "say which with --decimal , or --decimal .; or write decimal points and nothing between thousands"

# The year first, or points behind a day. With slashes and hyphens the dates must show which is the month.
_DAYS = (
    *("%Y-%m-%d", "%Y/%m/%d", "%Y.%m.%d", "%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%m/%d/%Y"),
    *("%d/%m/%y", "%m/%d/%y", "%d-%m-%Y", "%m-%d-%Y", "%d-%b-%Y", "%d %b %Y"),
)
_MOMENT = re.compile(
    r"(?P<day>\d{4}([-./])\d\d?\2\d\d?|\d\d?([-./])\d\d?\3(?:\d{4}|\d\d)|\d\d?[- ][A-Za-z]{3}[- ]\d{4})?[T ]?"
    r"(?P<clock>(?P<hour>[01]?\d|2[0-3]):(?P<minute>[0-5]\d)(?::(?P<second>[0-5]\d(?:[.,]\d{1,9})?))?"
    r"(?:\s?(?P<half>[AaPp])[Mm])?)?\s*(?P<zone>Z|[+-]\d\d:?\d\d)?",
    re.ASCII,
)
_A_DAY = 86_400.0
SAY_TIME = (
    "say how they are written, as in --time-format '%d.%m.%Y %H:%M:%S', or write the year first: 2024-03-12 "
    "10:15:00"
)


def is_missing(cell: str) -> bool:
    """Return whether a cell says that there is no value, or holds an error of a spreadsheet."""
    return _MISSING.fullmatch(cell.strip()) is not None


def is_plain(cell: str) -> bool:
    """Return whether a cell is a number, with a decimal point or comma, or a date."""
    bare = cell.strip()
    return _is_number(bare) or _COMMA.fullmatch(bare) is not None or _parts(bare) is not None


def is_value(cell: str) -> bool:
    """Return whether a cell is a number, a date, or a number with marks or a unit that its column refuses."""
    return is_plain(cell) or _MARKED.fullmatch(cell.strip()) is not None


def _is_number(cell: str) -> bool:
    return _NUMBER.fullmatch(cell) is not None and math.isfinite(float(cell))


def decimal_of(cells: Sequence[str], *, between_commas: bool) -> str:
    """Return the decimal mark of numbers in cells: a comma where some have one, and none has a point.

    Args:
        between_commas: whether fields are separated by commas, and 1,234 in quotes may be a thousand.
    """
    bare = [cell.strip() for cell in cells]
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
    commas = [_COMMA.fullmatch(text) is not None for text in texts]
    points = ["." in text and _is_number(text) for text in texts]
    plain = texts
    if decimal == ",":
        plain = [text.replace(",", ".") if own else text for text, own in zip(texts, commas, strict=True)]
    numbers = np.array(pandas.to_numeric(pandas.Series(plain, dtype=object), errors="coerce"), dtype=float)
    numbers[~np.isfinite(numbers)] = np.nan
    others, wrong = commas if decimal == "." else points, "has another decimal mark than --decimal says"
    if not stated:
        wrong = "may have a decimal mark, or a mark between thousands"
        others = _like_thousands(plain) if not any(others) else others
    if any(others):
        row = others.index(True)
        return Column(numbers, (row, texts[row]), wrong, _SAY)
    odd = [i for i in np.flatnonzero(np.isnan(numbers)).tolist() if not is_missing(texts[i])]
    if not odd:
        return Column(numbers)
    dates = moments_column(["" if is_missing(text) else text for text in texts])
    return dates or Column(numbers, (odd[0], texts[odd[0]]))


def _like_thousands(texts: Sequence[str]) -> list[bool]:
    """Return which numbers may be thousands, as 1.250 beside 808; none if some number has other decimals."""
    there = [text for text in texts if not is_missing(text)]
    hundreds = any("." not in text and len(text.lstrip("+-")) == 3 for text in there)
    whole = hundreds and all(map(_WHOLE.fullmatch, there))
    return [whole and "." in text for text in texts]


def _parts(cell: str) -> dict[str, str] | None:
    """Return the parts of a date or time: `day`, `hour` and so on, empty where there is none."""
    found = _MOMENT.fullmatch(cell)
    parts = found.groupdict("") if found else {}
    return parts if parts.get("day") or parts.get("clock") else None


def joined_clocks(cells: Sequence[Sequence[str]]) -> tuple[list[Sequence[str]], list[int]]:
    """Return columns of cells, the only one of dates joined with the only one of times of day.

    Both then hold dates and times. The numbers (from zero) say which two columns these are, if any.
    """
    first = [_parts(next((x.strip() for x in column if not is_missing(x)), "")) or {} for column in cells]
    days = [i for i, parts in enumerate(first) if parts.get("day") and not parts["clock"]]
    clocks = [i for i, parts in enumerate(first) if parts.get("clock") and not parts["day"]]
    if len(days) != 1 or len(clocks) != 1:
        return list(cells), []
    pairs = [*zip(cells[days[0]], cells[clocks[0]], strict=True)]
    both = ["" if is_missing(x) or is_missing(y) else f"{x.strip()} {y.strip()}" for x, y in pairs]
    found = sorted([*days, *clocks])
    return [both if i in found else column for i, column in enumerate(cells)], found


def moments_column(cells: Sequence[str], form: str | None = None) -> Column | None:
    """Return the column of times that cells hold, NaN in empty ones; None if they are no dates or times.

    Args:
        form: how they are written; None: ISO 8601, or day, month and year in an order that is clear.
    """
    import pandas

    there, numbers = [i for i, cell in enumerate(cells) if cell], np.full(len(cells), np.nan)
    texts = [cells[i] for i in there]
    if form is not None:
        read = pandas.to_datetime(pandas.Series(texts, dtype=object), format=form, errors="coerce", utc=True)
        if not there or read.isna().any():
            return None
        numbers[there] = (read - read[0]).dt.total_seconds()
        return Column(numbers, dated=True)
    parts = [_parts(text) or {} for text in texts]
    if not parts or not parts[0]:
        return None
    kinds = [[bool(one.get(key)) for key in ("day", "zone")] for one in parts]
    fits = np.array([bool(one) and kind == kinds[0] for one, kind in zip(parts, kinds, strict=True)])
    seconds, done = np.array([_seconds(one) if one else np.nan for one in parts]), tuple[str, ...]()
    if kinds[0][0]:
        days = pandas.Series([one.get("day") for one in parts], dtype=object)
        known = [
            one for one in _DAYS if pandas.notna(pandas.to_datetime(days[0], format=one, errors="coerce"))
        ]
        read = [pandas.to_datetime(days, format=one, errors="coerce") for one in known or _DAYS[:1]]
        best = max(read, key=lambda one: one.notna().sum())
        fits &= best.notna().to_numpy()
        seconds += (best - best[0]).dt.total_seconds().to_numpy()
        others = [(one - one[0] - (best - best[0])) for one in read if one.notna().all()]
        if fits.all() and any(one.abs().max() > pandas.Timedelta(0) for one in others):
            return _unread(cells, there[0], "may have the day or the month first")
    else:
        falls = np.cumsum(np.diff(seconds, prepend=seconds[0]) < -0.5 * _A_DAY)
        seconds += _A_DAY * falls
        done = (f"passes midnight {falls[-1]} times: a day was added each time",) * bool(falls[-1])
    if not fits.all():
        at = int(np.argmin(fits))
        return _unread(cells, there[at], f"is no date or time{' as those above are' if at else ''}")
    numbers[there] = seconds - seconds[0]
    return Column(numbers, dated=True, done=done)


def _seconds(parts: Mapping[str, str]) -> float:
    """Return the seconds of a time of day since midnight, in UTC if it has a zone."""
    hour, minute = int(parts["hour"] or 0), int(parts["minute"] or 0)
    if parts["half"]:
        hour = hour % 12 + 12 * (parts["half"] in "Pp")
    zone = parts["zone"].replace(":", "").replace("Z", "+0000") or "+0000"
    ahead = int(f"{zone[0]}1") * (60 * int(zone[1:3]) + int(zone[3:]))
    return 3600.0 * hour + 60.0 * (minute - ahead) + float(parts["second"].replace(",", ".") or 0.0)


def _unread(cells: Sequence[str], row: int, wrong: str) -> Column:
    return Column(np.full(len(cells), np.nan), (row, cells[row]), wrong, SAY_TIME, dated=True)
