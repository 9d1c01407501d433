"""Which columns to name: an option that can be pasted, made of what the file holds."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from inputdesign_cli.tasks.build.files import Sheet
from inputdesign_cli.tasks.build.files.frames import EXCEL
from inputdesign_cli.tasks.build.files.naming import named_columns, time_columns
from inputdesign_cli.tasks.build.files.tags import likely_roles, roles_of

_UNNAMED = "NAME"
# What separates entries of the option, or quotes it.
_SEPARATORS = frozenset(',="')
_CHANNEL = re.compile(r"[uy]\d+|time", re.ASCII)


def columns_hint(sheet: Sheet, named: Mapping[str, str], wanted: Sequence[str]) -> str:
    """How to say which columns count, and what to do first where too few of them hold numbers."""
    taken = _taken(sheet, named)
    free = _free(sheet, taken)
    told = "name them, or give their numbers, such as "
    if len(free) < len(wanted) and sheet.shown and sheet.names:
        long = _spread(sheet, free)
        if long:
            return f"{long}; then name the columns: {columns_option(sheet, named, wanted, [])}"
        switches = [i for i, column in enumerate(sheet.columns) if len(column.words) == 2 and i not in taken]
        if switches:
            on, off = sheet.columns[switches[0]].words
            told = f"write 0 and 1 for {on} and {off} in column {called(sheet, switches[0])}, then "
            told += "name the columns: "
            return told + columns_option(sheet, named, wanted, sorted({*free, *switches}))
    if sheet.shown and not _by_name(sheet, wanted, free):
        told = "name them, or give their numbers; which is which the names do not tell, an example is "
    return told + columns_option(sheet, named, wanted)


def _by_name(sheet: Sheet, wanted: Sequence[str], free: Sequence[int]) -> bool:
    """Whether names tell which of the columns that are free are inputs and outputs, as many as wanted."""
    likely = likely_roles(sheet.names or [""] * len(sheet.columns))
    return all(
        sum(likely[i] == letter for i in free) >= sum(channel.startswith(letter) for channel in wanted)
        for letter in "uy"
    )


def columns_option(
    sheet: Sheet, named: Mapping[str, str], wanted: Sequence[str], free: Sequence[int] | None = None
) -> str:
    """`--columns "time=1,u1=2,y1=3"`: what is named already, the times, and columns of numbers for `wanted`.

    Those that are called as inputs or outputs are come first. Of channels that share a column one keeps it.

    Args:
        named: columns by channel; others than u, y and time only say what is taken.
        wanted: channels without a column.
        free: where columns for them are; None: those of numbers that are not taken.
    """
    again = _sharing(sheet, named)
    kept = {channel: column for channel, column in named.items() if channel not in again}
    taken = _taken(sheet, kept)
    times = [] if "time" in kept else _times(sheet, taken)[:1]
    free = _free(sheet, taken) if free is None else free
    missing = [channel for channel in (*again, *wanted) if channel != "time"]
    chosen = _chosen(sheet, sorted(missing), free) if sheet.shown else {}
    found = {
        **({"time": called(sheet, times[0])} if times else {}),
        **{c: _plain(sheet, column) for c, column in kept.items() if _CHANNEL.fullmatch(c)},
        **dict.fromkeys(missing, _UNNAMED),
        **{channel: called(sheet, at) for channel, at in chosen.items()},
    }
    in_order = sorted(found, key=lambda channel: (channel != "time", channel))
    return f'--columns "{",".join(f"{channel}={found[channel]}" for channel in in_order)}"'


def _plain(sheet: Sheet, column: str) -> str:
    """A column as the user calls it, or by its number where an option cannot hold its name."""
    at = named_columns(sheet, column.strip().lower()) if _SEPARATORS & set(column) else []
    return called(sheet, at[0]) if at else column


def _chosen(sheet: Sheet, channels: Sequence[str], free: Sequence[int]) -> dict[str, int]:
    """A column for each channel while there are some: those that are called so, else the next other ones.

    What is usually one, as valves are inputs, comes before what may be anything.
    """
    names = sheet.names or [""] * len(sheet.columns)
    likely = likely_roles(names)
    left, found = list(free), {}
    for roles in (roles_of(names), likely, None):
        for channel in channels:
            letter = channel[0]
            fit = left if roles is None else [i for i in left if roles[i] == letter]
            if channel in found or not fit:
                continue
            found[channel] = min(
                fit, key=lambda i: ("", *"uyr").index(likely[i] if likely[i] != letter else "")
            )
            left.remove(found[channel])
    return found


def _sharing(sheet: Sheet, named: Mapping[str, str]) -> list[str]:
    """Channels whose column another one has too, which keeps it as its name suits better, or stands first."""
    roles = roles_of(sheet.names or [""] * len(sheet.columns))
    timed = _times(sheet, ())
    places = {channel: named_columns(sheet, column.strip().lower()) for channel, column in named.items()}

    def rank(channel: str) -> tuple[bool, bool]:
        suits = [roles[at] == channel[0] or (channel == "time" and at in timed) for at in places[channel]]
        return bool(_CHANNEL.fullmatch(channel)), not all(suits)

    taken: set[int] = set()
    again = []
    for channel in sorted(named, key=rank):
        if len(places[channel]) == 1 and taken & set(places[channel]):
            again.append(channel)
        taken |= set(places[channel])
    return again


def _taken(sheet: Sheet, named: Mapping[str, str]) -> set[int]:
    return {at for column in named.values() for at in named_columns(sheet, column.strip().lower())}


def _free(sheet: Sheet, taken: Collection[int]) -> list[int]:
    """Where columns of numbers are that are not taken, and hold no times."""
    times = _times(sheet, taken)[:1]
    return [
        i
        for i, column in enumerate(sheet.columns)
        if i not in taken and i not in times and column.fault is None and not np.isnan(column.numbers).all()
    ]


def _spread(sheet: Sheet, free: Sequence[int]) -> str:
    """What to do with a table that has the name of a signal in each row, beside its time and its value."""
    times = _times(sheet, ())
    tags = [i for i, column in enumerate(sheet.columns) if 2 <= len(column.words) <= len(column.numbers) // 2]
    if not (times and tags and free) or _rises(sheet.columns[times[0]].numbers):
        return ""
    index, tag, value = (sheet.names[i].strip() for i in (times[0], tags[0], free[0]))
    read = "read_excel" if sheet.path.suffix.lower() in EXCEL else "read_csv"
    how = ', sep=None, engine="python"' if read == "read_csv" else ""
    return (
        f"each row holds the value of one signal, which column {tag} names: spread the table into a column "
        f'for each, as pandas does: {read}("{sheet.path.name}"{how}).pivot(index="{index}", columns="{tag}", '
        f'values="{value}").to_csv("wide.csv")'
    )


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
