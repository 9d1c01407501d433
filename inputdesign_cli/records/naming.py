"""Columns by their names: times, inputs, outputs and references, and the units that names state."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.findings.record_columns import name_and_unit
from inputdesign_cli.records.sheet import Sheet
from inputdesign_cli.specification.models.units import SECONDS

TIME_UNITS = tuple(SECONDS)
_UNITS = {
    **{unit: unit for unit in TIME_UNITS},
    **dict.fromkeys(("sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("msec", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("usec", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("mins", "minute", "minutes"), "min"),
    **dict.fromkeys(("hr", "hrs", "hour", "hours"), "h"),
    **dict.fromkeys(("day", "days"), "d"),
}
_TIME = re.compile(
    r"(sampling[ _]|elapsed[ _])?(time|time[ _]?stamp|date[ _]?time|zeit|zeitstempel|tiempo)(?![^\W_]).*"
)
# What clocks are called too, where nothing is called as times are; other things may be, so its numbers rise.
_CLOCK = re.compile(
    r"(uhrzeit|zeitpunkt|messzeit|datum|date|clock|hora|fecha|marca[ _]de[ _]tiempo)(?![^\W_]).*"
)
# The letter alone may be a temperature as well: what follows is a unit of time, and its numbers rise.
_SHORT = re.compile(
    r"t([ _]*[(\[]?\s*(s|secs?|seconds?|ms|us|min|mins|minutes?|h|hrs?|hours?|d|days?)\s*[)\]]?)?"
)
_MOSTLY = 0.9
# Words that say whether a column holds the input, the output or the reference.
_ROLES = {
    **dict.fromkeys(("u", "input", "op", "mv"), "u"),
    **dict.fromkeys(("y", "output", "pv", "meas", "measured"), "y"),
    **dict.fromkeys(("sp", "setpoint", "ref", "reference"), "r"),
}
# What is named after a thing or a quantity is usually this; it is proposed, and never taken unasked.
_LIKELY = {
    **dict.fromkeys(("co", "out", "heater", "heating", "valve", "pump", "fan", "motor", "actuator"), "u"),
    **dict.fromkeys(("duty", "command", "cmd", "drive", "steam", "reflux"), "u"),
    **dict.fromkeys(("cv", "temperature", "temp", "level", "flow", "pressure", "speed", "position"), "y"),
    **dict.fromkeys(("sensor", "concentration", "response"), "y"),
    "w": "r",
}


def named_columns(sheet: Sheet, start: str) -> list[int]:
    """Return where columns of this name are, else of this beginning (u1 is not u10), else of this number."""
    header = sheet.header
    exact = [i for i, name in enumerate(header) if name == start]
    begun = exact or [
        i
        for i, name in enumerate(header)
        if name.startswith(start) and not (start[-1:].isdigit() and name[len(start)].isdigit())
    ]
    if begun or not start.isdecimal():
        return begun
    return [int(start) - 1] if 1 <= int(start) <= len(sheet.columns) else []


def time_columns(sheet: Sheet) -> list[str]:
    """Return the names, in small letters, of columns of times; the number of one without a name.

    If no name is one of times, columns that are called as clocks are and rise, or hold dates or times of day.
    At last columns whose dates cannot be read: to do without them would be to guess.
    """
    header = sheet.header
    called = [
        (header[i] if i < len(header) and header[i] else str(i + 1), column)
        for i, column in enumerate(sheet.columns)
    ]
    found = [
        name
        for name, column in called
        if _TIME.fullmatch(name) or (_SHORT.fullmatch(name) and _mostly(column.numbers, rises=True))
    ]
    if found:
        return found
    clocks = [
        (name, column)
        for name, column in called
        if _mostly(column.numbers, rises=not column.dated) and (column.dated or _CLOCK.fullmatch(name))
    ] or [(name, column) for name, column in called if column.undated]
    # Dates and times of day that were joined are the same column.
    once = [name for i, (name, column) in enumerate(clocks) if column is not clocks[i - 1][1] or i == 0]
    dates = [name for name in once if name.startswith("dat")]
    return dates if dates or (len(once) > 1 and clocks[0][1].fault is None) else once


def _mostly(x: Array, *, rises: bool) -> bool:
    """Whether numbers rise from row to row, or at least change."""
    steps = np.diff(x[~np.isnan(x)])
    return bool(np.mean(steps > 0.0 if rises else steps != 0.0) > _MOSTLY) if steps.size else False


def is_called_time(name: str) -> bool:
    """Return whether a name is one of times or of clocks."""
    return any(pattern.fullmatch(name.lower()) for pattern in (_TIME, _CLOCK, _SHORT))


def time_unit_of(name: str) -> str | None:
    """Return the unit in the name of a column of times: `time_ms`, `Time (sec)`."""
    words = re.findall(r"[a-z]+", name.lower())
    return _UNITS.get(words[-1]) if len(words) > 1 else None


def plain_time_unit(unit: str | None) -> str | None:
    """Return our spelling of a unit of time; None if it is none."""
    return None if unit is None else _UNITS.get(unit.strip().lower())


def roles_of(names: Sequence[str]) -> list[str]:
    """Return `u`, `y` or `r` (a reference) for each column whose name says it, or usually does; else nothing.

    The words of a name have to agree; `FIC101.OP` and `pv_2 (degC)` have one.
    """
    words = [re.split(r"[\W_\d]+", name_and_unit(name)[0].lower()) for name in names]
    sure, likely = (
        [{roles[one] for one in own if one in roles} for own in words] for roles in (_ROLES, _LIKELY)
    )
    found = [one if len(one) == 1 else other for one, other in zip(sure, likely, strict=True)]
    return [one.pop() if len(one) == 1 else "" for one in found]
