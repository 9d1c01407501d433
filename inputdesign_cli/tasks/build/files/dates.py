"""Dates and times as loggers write them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

# Points and slashes stand between day, month and year; which comes first, the dates themselves must tell.
_DAYS = (
    *("%d.%m.%Y", "%d.%m.%y", "%d/%m/%Y", "%d/%m/%y", "%d-%m-%Y", "%m/%d/%Y", "%m/%d/%y", "%m-%d-%Y"),
    *("%Y/%m/%d", "%Y.%m.%d", "%d-%b-%Y", "%d %b %Y"),
)
_TIMES = ("%H:%M:%S.%f", "%H:%M:%S,%f", "%H:%M:%S", "%H:%M", "%I:%M:%S %p", "%I:%M %p")
# How they all begin, those of ISO 8601 included.
_BEGIN = re.compile(r"\d{1,4}([/-]\d|\.\d{1,2}\.|[- ]\w{3}[- ]|:\d\d)|\d{8}T|\d{4}-?W\d")
# What to write, for messages.
AS_DATES = (
    "write all of them in one way, the year first: 2024-03-12 10:15:00; or 12.03.2024 10:15:00, 03/12/2024 "
    "10:15 AM, 12-Mar-2024 10:15:00, where they tell day from month; or as seconds"
)
_CLOCK = re.compile(r"\d:\d\d")
# What a time of a day without a date is read as.
_MIDNIGHT = datetime(1900, 1, 1)


@dataclass(frozen=True)
class Moments:
    """Seconds (n,) since the first; None where dates can be read in two ways that differ.

    Of times of a day without a date, `clock` is what the first counts from midnight.
    """

    seconds: NDArray[np.float64] | None
    clock: float | None = None


def moments_of(cells: Sequence[str]) -> Moments | None:
    """Dates and times, or times of a day; None where some cell is neither.

    As ISO 8601 writes them, or with points, slashes or hyphens, day or month first.
    """
    texts = [cell.strip() for cell in cells]
    if not all(map(_BEGIN.match, texts)):
        return None
    iso = _iso(texts)
    if iso is not None:
        return Moments(iso)
    of_day = _parsed(texts, _TIMES)
    if of_day is not None:
        return Moments(_since_first(of_day), (of_day[0] - _MIDNIGHT).total_seconds())
    found: list[NDArray[np.float64]] = []
    for day in _DAYS:
        moments = _parsed(texts, [f"{day} {time}".strip() for time in ("", *_TIMES)])
        seconds = _since_first(moments or [])
        if moments is not None and not any(np.array_equal(seconds, other) for other in found):
            found.append(seconds)
    return Moments(found[0] if len(found) == 1 else None) if found else None


def seems_moment(text: str) -> bool:
    """Whether a text begins as dates and times do, or has a time of a day in it."""
    return _BEGIN.match(text) is not None or _CLOCK.search(text) is not None


def is_moment(text: str) -> bool:
    """Whether a text is a date or a time of a day."""
    return moments_of([text]) is not None


def _iso(texts: Sequence[str]) -> NDArray[np.float64] | None:
    try:
        return _since_first([datetime.fromisoformat(text) for text in texts])
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


def _since_first(moments: Iterable[datetime]) -> NDArray[np.float64]:
    every = list(moments)
    return np.array([(moment - every[0]).total_seconds() for moment in every])
