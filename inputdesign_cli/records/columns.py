"""Which column of a file is which channel; where that is not clear, an option that can be pasted."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.findings.places import is_called
from inputdesign_cli.findings.prepared_records import name_and_unit, plain_unit
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.records.sheet import Column, Sheet
from inputdesign_cli.specification.models.units import SECONDS

NO_TIMES = "none"
_CHANNELS = {
    "u": re.compile(r"(u|input)[ _]?(\d*)(?![a-z0-9]).*"),
    "y": re.compile(r"(y|output)[ _]?(\d*)(?![a-z0-9]).*"),
}
# What separates entries of the option, or quotes it.
_SEPARATORS = frozenset(',="')
TIME_UNITS = tuple(SECONDS)
_SPELLINGS = {
    "s": "sec secs second seconds",
    "ms": "msec millisecond milliseconds",
    "us": "usec microsecond microseconds",
    "min": "mins minute minutes",
    "h": "hr hrs hour hours",
    "d": "day days",
}
_UNITS = {one: unit for unit in TIME_UNITS for one in (unit, *_SPELLINGS.get(unit, "").split())}
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
# Words that make it likely that a column holds the input, the output or the reference: first those of control
# systems, which decide. They are proposed, and never taken unasked.
_WHOLE = 5  # letters of a word that may begin another one
_WORDS: tuple[dict[str, str], ...] = (
    {
        "u": "op mv co out cmd command u input",
        "y": "pv meas measured y output",
        "r": "sp sv setpoint ref r w",
    },
    {
        "u": "heater heating valve pump fan motor actuator duty drive steam",
        "y": "cv temperature temp level flow pressure speed position sensor response",
        "r": "reference",
    },
)


def named_columns(sheet: Sheet, start: str) -> list[int]:
    """Return the columns with this name, else with this beginning (u1 is not u10), else with this number."""
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
    """Return the names in small letters of the columns of times, or the number of a nameless one.

    If no name is one of times, columns that are called as clocks are and rise, or hold dates or times of day.
    At last columns whose dates cannot be read: to do without them would be to guess.
    """
    header, surely, likely, unread = sheet.header, [], [], []
    for i, column in enumerate(sheet.columns):
        name = (header[i] if i < len(header) else "") or str(i + 1)
        rises = column.mostly(rises=True)
        if _TIME.fullmatch(name) or (rises and _SHORT.fullmatch(name)):
            surely.append((name, column))
        if column.mostly(rises=False) if column.dated else rises and _CLOCK.fullmatch(name):
            likely.append((name, column))
        if column.undated:
            unread.append((name, column))
    found = surely or likely or unread
    # Dates and times of day that were joined are the same column.
    once = [name for i, (name, column) in enumerate(found) if i == 0 or column is not found[i - 1][1]]
    return [name for name in once if name.startswith("dat")] or once


def is_called_time(name: str) -> bool:
    """Return whether a name is one of times or of clocks."""
    return any(pattern.fullmatch(name.lower()) for pattern in (_TIME, _CLOCK, _SHORT))


def time_unit_in(sheet: Sheet, name: str, *, dated: bool) -> str | None:
    """Return the unit of times that a file states: by its column (`time_ms`, `Time (sec)`) or elsewhere.

    Dates are counted in seconds.
    """
    words = re.findall(r"[a-z]+", name.lower())
    own = _UNITS.get(words[-1]) if len(words) > 1 else None
    return "s" if dated else own or _UNITS.get((sheet.time_unit or "").strip().lower())


def columns_of(sheet: Sheet, wanted: Mapping[str, str]) -> dict[str, Array]:
    """Return the wanted columns: role -> (n,), NaN where a cell is empty.

    Args:
        wanted: role -> its header, or how that begins; `frequency` also finds `frequency_rad_per_s`.

    Raises:
        DataError: `data-missing-column` or `data-not-a-number`.
    """
    found = {role: named_columns(sheet, start.strip().lower()) for role, start in wanted.items()}
    for what, missing in (
        ("no column", [role for role, at in found.items() if not at]),
        ("several columns", [role for role, at in found.items() if len(at) > 1]),
    ):
        if missing:
            raise _unclear(sheet, what, missing, wanted)
    for role, (at,) in found.items():
        column, same = sheet.columns[at], [other for other in found if found[other] == [at]]
        if len(same) > 1:
            message = f"{' and '.join(same)} are the same column of {sheet.path.name}: {sheet.name_of(at)}"
            rest = {other: name for other, name in wanted.items() if other not in same[1:]}
            hint = f"name another one for one of them: {columns_option(sheet, rest, same[1:])}"
            raise sheet.error("data-missing-column", message, hint)
        if column.fault is not None:
            row, text = column.fault
            message = f"{text!r} in column {wanted[role]} {column.wrong}"
            raise sheet.error("data-not-a-number", message, column.hint, row)
    return {role: sheet.columns[at].numbers for role, (at,) in found.items()}


def _unclear(sheet: Sheet, what: str, missing: Sequence[str], wanted: Mapping[str, str]) -> DataError:
    """Return the error about roles of which there is no column, or several."""
    starts = [wanted[role] for role in missing]
    names = [
        start if role.startswith(start) else f"{start} ({role})"
        for role, start in zip(missing, starts, strict=True)
    ]
    hint = "name a column frequency, or frequency_rad_per_s"
    if starts != ["frequency"]:
        hint = f"name one column {' and one '.join(starts)}"
        kept = {role: name for role, name in wanted.items() if role not in missing}
        hint += "" if sheet.source.key else f", or say which it is: {columns_option(sheet, kept, missing)}"
    message = f"{sheet.path.name} has {what} for {', '.join(names)} ({_contents(sheet)})"
    return sheet.error("data-missing-column", message, hint)


def _contents(sheet: Sheet) -> str:
    """Return the header of a file for messages."""
    header = f"its header is: {', '.join(map(str.strip, sheet.names))}" if sheet.names else "it has no header"
    return f"{header}; {len(sheet.columns)} columns"


def column_named(sheet: Sheet, name: str) -> Column:
    """Return the first column of a name, or that of a number."""
    return sheet.columns[named_columns(sheet, name.strip().lower())[0]]


def with_channels(sheet: Sheet, named: Mapping[str, str]) -> dict[str, str]:
    """Return the columns that are named and, of inputs or outputs if none is named, those called u, y1, ..

    Raises:
        DataError: `data-missing-column`, several may be the same one.
    """
    found: dict[str, str] = {}
    for letter, pattern in _CHANNELS.items():
        every: dict[str, list[str]] = {}
        for name in sheet.header:
            matched = pattern.fullmatch(name)
            if matched and not any(other.startswith(letter) for other in named):
                every.setdefault(f"{letter}{matched[2] or 1}", []).append(name)
        for role, names in every.items():
            plain = (role,) if f"{letter}2" in every else (role, letter)
            exact = [name for name in names if name in plain] or names
            if len(exact) > 1:
                message = f"{sheet.path.name} has several columns that may be {role}: {', '.join(exact)}"
                hint = f"say which one counts: --columns {role}={exact[0]}"
                raise sheet.error("data-missing-column", message, hint)
            found[role] = exact[0]
    return {**found, **named}


def roles_of(sheet: Sheet, named: Mapping[str, str], units: Units | None = None) -> dict[str, str]:
    """Return role -> column: of the channels of a plant, or of the columns that a log calls u, y1, r, ..

    Args:
        named: the columns that the user names, by role.

    Raises:
        DataError: `data-missing-column`, it is not clear which column has a role.
    """
    named = {**({} if units is None else _by_channels(sheet, units, named)), **named}
    columns = _whole(sheet, with_channels(sheet, named))
    counts = (
        [_count(letter, sheet, columns) for letter in "uy"]
        if units is None
        else [units.inputs, units.outputs]
    )
    wanted = [role for letter, n in zip("uy", counts, strict=True) for role in _of(letter, n)]
    found = {role: columns.get(role, role) for role in wanted}
    loop = units is not None and units.closed_loop
    unit = units.channels.get("u1", ("", ""))[1] if units is not None and loop else ""
    references = _references(sheet, columns, counts[0], unit) if units is None or loop else {}
    unasked = units is None and not references.keys() & columns.keys()
    own = [column_named(sheet, name) for name in references.values()] if unasked else []
    usable = all(one.fault is None and not np.isnan(one.numbers).any() for one in own)
    return found | (references if usable else {}) | _time(sheet, columns)


def _by_channels(sheet: Sheet, units: Units, typed: Mapping[str, str]) -> dict[str, str]:
    """Return the columns that have the names of the spec's channels, or else alone their units.

    Where the spec names a channel, a column with its unit must have a word of that name.

    Args:
        typed: columns that the user names, which are taken for nothing else.
    """
    parts = {header: name_and_unit(header) for header in sheet.names}
    headers = {header: (name.lower(), plain_unit(unit)) for header, (name, unit) in parts.items()}
    asked = {
        channel: (name.lower(), plain_unit(unit))
        for channel, (name, unit) in units.channels.items()
        if channel not in typed and not any(is_called(channel, header) for header in sheet.header)
    }
    taken = {at for name in typed.values() for at in named_columns(sheet, name.strip().lower())}
    headers = {name: own for i, (name, own) in enumerate(headers.items()) if i not in taken}
    found: dict[str, str] = {}
    for channel, (name, _) in asked.items():
        same = [header for header, own in headers.items() if name and own[0] == name]
        found |= {channel: same[0]} if len(same) == 1 else {}
    for channel, (name, unit) in asked.items():
        left = [header for header in headers if header not in found.values() and _role(header) != "r"]
        alike = [header for header in left if unit and headers[header][1] == unit]
        if words := set(name.split()):
            alike = [header for header in alike if words & set(headers[header][0].split())]
        if channel not in found and len(alike) == 1:
            found[channel] = alike[0]
    return found


def _of(letter: str, count: int) -> list[str]:
    return [f"{letter}{i + 1}" for i in range(count)]


def _time(sheet: Sheet, columns: Mapping[str, str]) -> dict[str, str]:
    """Return `time` with its column; empty if there is none or the user says `time=none`."""
    if "time" in columns:
        return {} if without_times(sheet, columns) else {"time": columns["time"]}
    claimed = {column.strip().lower() for column in columns.values()}
    timed = [name for name in time_columns(sheet) if name not in claimed]
    if len(timed) > 1:
        which = timed[0] if timed.count(timed[0]) == 1 else str(sheet.header.index(timed[0]) + 1)
        message = f"{sheet.path.name} has several columns of times: {', '.join(timed)}"
        hint = f"say which one counts: --columns time={which}"
        raise sheet.error("data-missing-column", message, hint)
    return {"time": timed[0]} if timed else {}


def without_times(sheet: Sheet, columns: Mapping[str, str]) -> bool:
    """Return whether the user says that no column holds the times: `time=none`, unless one is called so."""
    return columns.get("time", "").strip().lower() == NO_TIMES and NO_TIMES not in sheet.header


def _references(sheet: Sheet, columns: Mapping[str, str], inputs: int, unit: str) -> dict[str, str]:
    """Return `r1` -> the column of the reference that is added to an input, if every input has one.

    Args:
        unit: of the input of a loop: a column that is called as references are is r if it has this unit.
            The set point of a controller has that of the output.
    """
    channels = _of("r", inputs)
    found = {name: columns.get(name, name) for name in channels if name in columns or name in sheet.header}
    if inputs == 1 and not found and "r" in sheet.header:
        found = {"r1": "r"}
    if inputs == 1 and not found and unit:
        asked = [name for name in sheet.names if _role(name) == "r"]
        alike = [name for name in asked if plain_unit(name_and_unit(name)[1]) == plain_unit(unit)]
        found = {"r1": alike[0]} if len(asked) == len(alike) == 1 else {}
    named = [name for name in channels if name in columns]
    if named and len(found) < inputs:
        missing = next(name for name in channels if name not in found)
        message = f"--columns names {', '.join(named)}, and {sheet.path.name} has no column for {missing}"
        hint = f"name the reference of every input, or none: --columns {missing}=NAME"
        raise sheet.error("data-missing-column", message, hint)
    return found if len(found) == inputs else {}


def _whole(sheet: Sheet, columns: Mapping[str, str]) -> dict[str, str]:
    """Return named columns by their whole names, which state units."""
    whole = {}
    for channel, column in columns.items():
        unread = channel == "time" and without_times(sheet, columns)
        at = [] if unread else named_columns(sheet, column.strip().lower())
        name = sheet.names[at[0]].strip() if len(at) == 1 and sheet.names else ""
        whole[channel] = name if sheet.header.count(name.lower()) == 1 else column
    return whole


def _count(letter: str, sheet: Sheet, columns: Mapping[str, str]) -> int:
    """Return how many inputs or outputs are named; their numbers must run from one."""
    named = [name for name in columns if name.startswith(letter)]
    if named and set(named) == set(_of(letter, len(named))):
        return len(named)
    what = "input" if letter == "u" else "output"
    message = f"which column of {sheet.path.name} is the {what}? ({_contents(sheet)})"
    if named:
        listed = ", ".join(sorted(named))
        message = f"the {what}s are {listed}, but they are numbered {letter}1, {letter}2, .."
    first = [role for x in "uy" for role in _of(x, max(sum(name[0] == x for name in columns), 1))]
    kept = {channel: name for channel, name in columns.items() if channel in ("time", *first)}
    missing = [channel for channel in first if channel not in columns]
    option = columns_option(sheet, kept, missing, references=True)
    hint = f"name them, or give their numbers, for example {option}"
    raise sheet.error("data-missing-column", message, hint)


def columns_option(
    sheet: Sheet, named: Mapping[str, str], wanted: Sequence[str], *, references: bool = False
) -> str:
    """Return `--columns "time=1,u1=2,y1=3"`: what is named, the times, and columns of numbers for `wanted`.

    Columns that are called as inputs or outputs are come first.

    Args:
        references: whether columns that are called as references are go along, one for each input.
    """
    taken = {at for column in named.values() for at in named_columns(sheet, column.strip().lower())}
    timed = time_columns(sheet)
    times = [i for i, name in enumerate(sheet.header) if name in timed] or rising(sheet)
    times = [] if "time" in named else [i for i in times if i not in taken][:1]
    roles = {
        i: _role(sheet.name_of(i))
        for i, column in enumerate(sheet.columns)
        if i not in (*taken, *times) and column.fault is None and not np.isnan(column.numbers).all()
    }
    found = {"time": called(sheet, times[0])} if times else {}
    found |= {channel: name for channel, name in named.items() if channel[0] in "uyt"}
    left = sorted(set(wanted) - found.keys() - {"time"})
    for surely in (True, False):
        for channel in (one for one in left if one not in found):
            fit = [i for i, role in roles.items() if role == channel[0] or not surely]
            if fit:
                best = min(fit, key=lambda i: roles[i] != "")
                found[channel] = called(sheet, best)
                del roles[best]
    asked = [i for i, role in roles.items() if role == "r"]
    if references and len(asked) == sum(channel[0] == "u" for channel in found):
        found |= {f"r{n}": called(sheet, i) for n, i in enumerate(asked, start=1)}
    found |= {channel: "NAME" for channel in left if channel not in found}
    in_order = sorted(found, key=lambda channel: (channel != "time", channel))
    return f'--columns "{",".join(f"{channel}={found[channel]}" for channel in in_order)}"'


def _role(name: str) -> str:
    """Return `u`, `y` or `r` (a reference) where the words of a name agree, as in `FIC101.OP`."""
    words = set(re.split(r"[\W_\d]+", name_and_unit(name)[0].lower()))
    for roles in _WORDS:
        found = [role for role, own in roles.items() if any(_begins(word, own) for word in words)]
        if found:
            return found[0] if len(found) == 1 else ""
    return ""


def _begins(word: str, known: str) -> bool:
    """Return whether a word is one of those known, or begins with a long one, as "outputdata" does."""
    return any(word == one or (len(one) >= _WHOLE and word.startswith(one)) for one in known.split())


def called(sheet: Sheet, at: int) -> str:
    """Return a column's name for options: its own if it names no other column, else its number."""
    name = sheet.names[at].strip() if at < len(sheet.names) else ""
    plain = bool(name) and not _SEPARATORS & set(name) and named_columns(sheet, name.lower()) == [at]
    return name if plain else str(at + 1)


def rising(sheet: Sheet) -> list[int]:
    """Return the columns whose numbers rise from row to row, as times do."""
    numbers = [column.numbers[~np.isnan(column.numbers)] for column in sheet.columns]
    return [i for i, x in enumerate(numbers) if x.size > 1 and np.all(np.diff(x) > 0.0)]
