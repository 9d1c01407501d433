"""Which columns to name: an option that can be pasted, made of what the file holds."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from inputdesign_cli.tasks.build.files import Sheet
from inputdesign_cli.tasks.build.tables import named_columns, time_columns

_UNNAMED = "NAME"
# What separates entries of the option, or quotes it.
_SEPARATORS = frozenset(',="')


def columns_option(sheet: Sheet, named: Mapping[str, str], wanted: Sequence[str]) -> str:
    """`--columns "time=1,u1=2,y1=3"`: what is named already, the times, and the next columns for `wanted`.

    Args:
        named: columns by channel.
        wanted: channels without a column.
    """
    taken = {at for column in named.values() for at in named_columns(sheet, column.strip().lower())}
    times = [] if "time" in named else _times(sheet, taken)[:1]
    left = [i for i in range(len(sheet.columns)) if i not in taken and i not in times]
    found = {**({"time": called(sheet, times[0])} if times else {}), **named}
    for number, channel in enumerate(wanted):
        found[channel] = called(sheet, left[number]) if number < len(left) and sheet.shown else _UNNAMED
    in_order = sorted(found, key=lambda channel: (channel != "time", channel))
    return f'--columns "{",".join(f"{channel}={found[channel]}" for channel in in_order)}"'


def rising(sheet: Sheet) -> list[int]:
    """Where columns are whose numbers rise from row to row, as times do."""
    return [i for i, column in enumerate(sheet.columns) if _rises(column.numbers)]


def _times(sheet: Sheet, taken: Collection[int]) -> list[int]:
    """Where the times may be, by the name of a column or, without one, by numbers that rise."""
    timed = time_columns(sheet)
    by_name = [i for i, name in enumerate(sheet.header) if name in timed]
    return [i for i in by_name or rising(sheet) if i not in taken]


def _rises(numbers: np.ndarray) -> bool:
    there = numbers[~np.isnan(numbers)]
    return there.size > 1 and bool(np.all(np.diff(there) > 0.0))


def called(sheet: Sheet, at: int) -> str:
    """How an option calls a column: by its name where that names no other one, else by its number."""
    name = sheet.names[at].strip() if at < len(sheet.names) and sheet.shown else ""
    plain = bool(name) and not _SEPARATORS & set(name) and named_columns(sheet, name.lower()) == [at]
    return name if plain else str(at + 1)
