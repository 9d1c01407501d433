"""Columns by their names: those that begin with a word, and those that hold times."""

from __future__ import annotations

import re

import numpy as np

from inputdesign_cli.tasks.build.files.sheet import Array, Sheet

_TIME = re.compile(
    r"(sampling[ _]|elapsed[ _])?(time|time[ _]?stamp|date[ _]?time|zeit|zeitstempel|tiempo)(?![^\W_]).*"
)
# What clocks are called too, where nothing is called as times are; other things may be, so its numbers rise.
_CLOCK = re.compile(
    r"(uhrzeit|zeitpunkt|messzeit|datum|date|clock|hora|fecha|marca[ _]de[ _]tiempo)(?![^\W_]).*"
)
_OF_TIME = r"(s|secs?|seconds?|ms|us|min|mins|minutes?|h|hrs?|hours?|d|days?)\s*[)\]]?"
_UNIT_LAST = re.compile(rf".*[^a-z]{_OF_TIME}\s*")
# The letter alone may be a temperature as well: what follows is a unit of time, and its numbers rise.
_SHORT = re.compile(rf"t([ _]*[(\[]?\s*{_OF_TIME})?")
_MOSTLY = 0.9


def named_columns(sheet: Sheet, start: str) -> list[int]:
    """Where columns of this name are, else those that begin with it (u1 is not u10), or that of a number."""
    header = sheet.header
    exact = [i for i, name in enumerate(header) if name == start]
    if exact:
        return exact
    begun = [
        i
        for i, name in enumerate(header)
        if name.startswith(start) and not (start[-1:].isdigit() and name[len(start)].isdigit())
    ]
    if begun or not start.isdecimal():
        return begun
    number = int(start)
    return [number - 1] if 1 <= number <= len(sheet.columns) else []


def time_columns(sheet: Sheet) -> list[str]:
    """Names, in small letters, of columns that hold times by their names; the number of one without a name.

    If there is none, those that are called as clocks are and rise, or hold dates or times of day; at last
    those whose dates cannot be read: to do without them would be to guess.
    """
    header = sheet.header
    called = [
        (header[i] if i < len(header) and header[i] else str(i + 1), column)
        for i, column in enumerate(sheet.columns)
    ]
    found = [
        name
        for name, column in called
        if _TIME.fullmatch(name) or (_SHORT.fullmatch(name) and _mostly_rises(column.numbers))
    ]
    if found:
        return found
    clocks = [
        (name, column)
        for name, column in called
        if (_advances(column.numbers) if column.dated else _mostly_rises(column.numbers))
        and (column.dated or _CLOCK.fullmatch(name))
    ] or [(name, column) for name, column in called if column.undated]
    # Dates and times of day that were joined say the same.
    once = [name for i, (name, column) in enumerate(clocks) if column is not clocks[i - 1][1] or i == 0]
    dates = [name for name in once if name.startswith("dat")]
    return dates if dates or (len(once) > 1 and clocks[0][1].fault is None) else once


def called_times(name: str) -> bool:
    """Whether a name, in small letters, is one of times or of clocks."""
    return any(pattern.fullmatch(name) for pattern in (_TIME, _CLOCK, _SHORT))


def says_unit(name: str) -> bool:
    """Whether a name, in small letters, ends with a unit of time."""
    return _UNIT_LAST.fullmatch(name) is not None


def _advances(x: Array) -> bool:
    """Whether hardly any value is that of the row before; in which order the rows stand is told later."""
    steps = np.diff(x[~np.isnan(x)])
    return bool(np.mean(steps != 0.0) > _MOSTLY) if steps.size else False


def _mostly_rises(x: Array) -> bool:
    steps = np.diff(x[~np.isnan(x)])
    return bool(np.mean(steps > 0.0) > _MOSTLY) if steps.size else False
