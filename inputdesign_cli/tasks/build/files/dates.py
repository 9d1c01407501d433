"""Dates and times as loggers write them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

# Points and slashes stand between day, month and year; which comes first, the dates themselves must tell.
_DAYS = (
    *("%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%d/%m/%y", "%d-%m-%Y", "%m/%d/%Y", "%m/%d/%y", "%m-%d-%Y"),
    *("%Y/%m/%d", "%Y.%m.%d", "%d-%b-%Y", "%d %b %Y"),
)
_TIMES = ("%H:%M:%S.%f", "%H:%M:%S,%f", "%H:%M:%S", "%H:%M", "%I:%M:%S %p", "%I:%M %p")
# How they all begin, those of ISO 8601 included.
_BEGIN = re.compile(r"\d{1,4}([/-]\d|\.\d{1,2}\.|[- ]\w{3}[- ]|:\d\d)|\d{8}[T ]\d|\d{4}-?W\d")
# What to write, for messages.
AS_DATES = (
    "write all of them in one way, the year first: 2024-03-12 10:15:00; or 12.03.2024 10:15:00, 03/12/2024 "
    "10:15 AM, 12-Mar-2024 10:15:00, where they tell day from month; or as seconds"
)
_CLOCK = re.compile(r"\d:\d\d")
# A year, a day and a month, in digits or in words of any language, in whatever order.
_DATE = re.compile(
    r"(?=.*(?<!\d)(19|20)\d\d(?!\d))(?=.*(?<!\d)\d{1,2}(?!\d))(?=.*[^\W\d_]{3}|(\D*\d+){3})"
    r"|\d{1,2}[./-]\s?[^\W\d_]{3,}\.?[./-]\s?\d\d(?!\d)"
)
# Of a column of dates hardly any cell is something else.
_MOSTLY, _DIFFERENT = 0.9, 3
# What a time of a day without a date is read as.
_MIDNIGHT = datetime(1900, 1, 1)
_YEAR_1970 = datetime(1970, 1, 1)


@dataclass(frozen=True)
class Moments:
    """Seconds (n,) since the first, and what that one is since 1970 or, of times of a day, since midnight.

    They are `unclear` where the dates can be read in two ways that differ.
    """

    seconds: NDArray[np.float64]
    began: float
    of_day: bool = False
    unclear: bool = False

    @classmethod
    def of(cls, moments: Sequence[datetime], *, of_day: bool = False) -> Moments:
        """Dates, or times of one day."""
        first = moments[0]
        since = _MIDNIGHT if of_day else _YEAR_1970.replace(tzinfo=UTC if first.tzinfo else None)
        seconds = np.array([(moment - first).total_seconds() for moment in moments])
        return cls(seconds, (first - since).total_seconds(), of_day)


def moments_of(cells: Sequence[str]) -> Moments | None:
    """Dates and times, or times of a day; None where some cell is neither.

    As ISO 8601 writes them, or with points, slashes or hyphens, day or month first.
    """
    texts = [cell.strip() for cell in cells]
    if not all(map(_BEGIN.match, texts)):
        return None
    iso = _iso(texts)
    if iso is not None:
        return iso
    of_day = _parsed(texts, _TIMES)
    if of_day is not None:
        return Moments.of(of_day, of_day=True)
    readings = (_parsed(texts, [f"{day} {time}".strip() for time in ("", *_TIMES)]) for day in _DAYS)
    found = [Moments.of(moments) for moments in readings if moments is not None]
    if not found:
        return None
    alike = all(np.array_equal(found[0].seconds, other.seconds) for other in found)
    return replace(found[0], unclear=not alike)


def seems_moment(text: str) -> bool:
    """Whether a text begins as dates and times do, or has a time of a day in it."""
    return _BEGIN.match(text) is not None or _CLOCK.search(text) is not None


def look_like_moments(cells: Sequence[str]) -> bool:
    """Whether most cells (n,) of a column have a date in them, or a time of a day, in whatever language."""
    found = {cell for cell in set(cells) if _DATE.match(cell.strip()) or _CLOCK.search(cell)}
    return len(found) >= _DIFFERENT and sum(cell in found for cell in cells) > _MOSTLY * len(cells)


def is_moment(text: str) -> bool:
    """Whether a text is a date or a time of a day."""
    return moments_of([text]) is not None


def _iso(texts: Sequence[str]) -> Moments | None:
    try:
        return Moments.of([datetime.fromisoformat(text) for text in texts])
    except (ValueError, TypeError, OverflowError):  # no dates, or some with and some without a time zone
        return None


def _parsed(texts: Sequence[str], formats: Sequence[str]) -> list[datetime] | None:
    """Of one order of day, month and year; fractions of a second may be left out in some cells."""
    found, last = [], formats[0]
    for text in texts:
        for form in dict.fromkeys((last, *formats)):
            try:
                found.append(datetime.strptime(text, form))
            except ValueError:
                continue
            last = form
            break
        else:
            return None
    return found
