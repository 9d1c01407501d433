"""Times of a day: joined with the dates beside them, or counted on past midnight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.tasks.build import rows
from inputdesign_cli.tasks.build.files.sheet import Column, Sheet

_DAY = 86_400.0
# Of times to the millisecond.
_WHOLE = 1e-6


def with_days(sheet: Sheet) -> Sheet:
    """A sheet whose times of a day say the day too.

    Where one column has dates alone and one times of a day alone, both become what they say together. Else
    times of a day that fall by more than half a day are those of the next one.
    """
    dates = [i for i, column in enumerate(sheet.columns) if _of_days(column)]
    clocks = [i for i, column in enumerate(sheet.columns) if column.clock is not None]
    columns = list(sheet.columns)
    if len(dates) == len(clocks) == 1:
        both = sorted((dates[0], clocks[0]))
        together = _joined(columns[dates[0]], columns[clocks[0]], [_called(sheet, i) for i in both])
        for i in both:
            columns[i] = together
    else:
        for i in clocks:
            columns[i] = _past_midnight(columns[i], _called(sheet, i), sheet)
    return replace(sheet, columns=tuple(columns))


def _of_days(column: Column) -> bool:
    """Whether a column has dates without times of a day."""
    days = column.numbers[~np.isnan(column.numbers)] / _DAY
    return column.dated and column.clock is None and bool(np.all(np.abs(days - np.round(days)) < _WHOLE))


def _joined(dates: Column, clock: Column, names: Sequence[str]) -> Column:
    moments = dates.numbers + (clock.numbers + (clock.clock or 0.0)) % _DAY
    there = np.flatnonzero(~np.isnan(moments))
    numbers = moments - moments[there[0]] if there.size else moments
    began = dates.began + float(moments[there[0]]) if there.size else 0.0
    told = f"{' and '.join(names)} were joined: dates and times of day"
    told = "; ".join(filter(None, (told, dates.told, clock.told)))
    return Column(numbers, dated=True, began=began, told=told)


def _past_midnight(clock: Column, name: str, sheet: Sheet) -> Column:
    there = np.flatnonzero(~np.isnan(clock.numbers))
    falls = np.diff(clock.numbers[there]) < -0.5 * _DAY
    if not np.any(falls):
        return clock
    numbers = clock.numbers.copy()
    numbers[there[1:]] += _DAY * np.cumsum(falls)
    at = rows.told(sheet.lines[there[1:][falls]])
    told = f"{name} passes midnight (before {at}): a day was added"
    return replace(clock, numbers=numbers, told="; ".join(filter(None, (clock.told, told))))


def _called(sheet: Sheet, i: int) -> str:
    """The name of a column, or its number."""
    name = sheet.names[i].strip() if i < len(sheet.names) and sheet.shown else ""
    return name or f"column {i + 1}"
