"""Dates and times of day in the cells of a table."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from inputdesign_cli.records.sheet import Column

# The year first, or points behind a day; with slashes and hyphens the dates must show what is the month.
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


def _parts(cell: str) -> dict[str, str] | None:
    """Return the parts of a date or time: `day`, `hour` and so on, empty where there is none."""
    found = _MOMENT.fullmatch(cell)
    parts = found.groupdict("") if found else {}
    return parts if parts.get("day") or parts.get("clock") else None


def is_moment(cell: str) -> bool:
    """Return whether a cell is a date, a time of day, or both."""
    return _parts(cell) is not None


def joined_clocks(cells: Sequence[Sequence[str]]) -> tuple[list[Sequence[str]], list[int]]:
    """Return columns of cells where the only one of dates and the only one of times of day hold both.

    The numbers are those of these two columns; there are none if nothing was joined.
    """
    first = [_parts(next((cell.strip() for cell in column if cell.strip()), "")) or {} for column in cells]
    days = [i for i, parts in enumerate(first) if parts.get("day") and not parts["clock"]]
    clocks = [i for i, parts in enumerate(first) if parts.get("clock") and not parts["day"]]
    if len(days) != 1 or len(clocks) != 1:
        return list(cells), []
    pair = zip(cells[days[0]], cells[clocks[0]], strict=True)
    both = [f"{day.strip()} {clock.strip()}" if day.strip() and clock.strip() else "" for day, clock in pair]
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
