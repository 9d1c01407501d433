"""Which column of a file is which channel; where that is not clear, an option that can be pasted."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.findings.prepared_records import name_and_unit, plain_unit
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.records.cells import SAY_TIME
from inputdesign_cli.records.sheet import Column, Sheet
from inputdesign_cli.specification.models.units import SECONDS

NO_TIMES = "none"
_CHANNELS = {
    "u": re.compile(r"(u|input)[ _]?(\d*)(?![a-z0-9]).*"),
    "y": re.compile(r"(y|output)[ _]?(\d*)(?![a-z0-9]).*"),
}
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
# Other quantities may have these names: the numbers of the column must rise, or it must hold dates.
_CLOCK = re.compile(
    r"(uhrzeit|zeitpunkt|messzeit|datum|date|clock|hora|fecha|marca[ _]de[ _]tiempo)(?![^\W_]).*"
)
# The letter alone may be a temperature: only a unit of time may follow, and the numbers must rise.
_SHORT = re.compile(rf"t([ _]*[(\[]?\s*({'|'.join(_UNITS)})\s*[)\]]?)?")
# Words in the names of inputs and outputs. Such columns are proposed, and never taken unasked.
_WORDS = {
    "u": "op mv co out cmd u input heater heating valve pump fan motor",
    "y": "pv y output temperature temp level flow pressure speed position sensor",
}


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


def column_named(sheet: Sheet, name: str) -> Column:
    """Return the first column of a name, or that of a number."""
    return sheet.columns[named_columns(sheet, name.strip().lower())[0]]


def time_columns(sheet: Sheet) -> list[str]:
    """Return the names in small letters of the columns of times, or the number of a nameless one.

    If no column is called a time: columns that are called a clock and rise, or hold dates or times of day.
    """
    header, surely, likely = sheet.header, dict[str, Column](), dict[str, Column]()
    for i, column in enumerate(sheet.columns):
        name = (header[i] if i < len(header) else "") or str(i + 1)
        rises = column.mostly(rises=True)
        dates = column.dated and (column.fault is not None or column.mostly(rises=False))
        if any(column is other for other in (*surely.values(), *likely.values())):
            continue  # dates and times of day that were joined
        if _TIME.fullmatch(name) or (rises and _SHORT.fullmatch(name)):
            surely[str(i + 1) if name in surely else name] = column
        elif dates or (rises and _CLOCK.fullmatch(name)):
            likely[str(i + 1) if name in likely else name] = column
    return [*(surely or likely)]


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
            raise sheet.error("data-missing-column", message, "name another one for one of them: --columns")
        if column.fault is not None:
            row, text = column.fault
            message = f"{text!r} in column {wanted[role]} {column.wrong}"
            hint = f"{column.hint}; {SAY_TIME}" if role == "time" and not column.dated else column.hint
            raise sheet.error("data-not-a-number", message, hint, row)
    return {role: sheet.columns[at].numbers for role, (at,) in found.items()}


def _unclear(sheet: Sheet, what: str, missing: Sequence[str], wanted: Mapping[str, str]) -> DataError:
    """Return the error about roles of which there is no column, or several."""
    starts = {role: wanted[role] for role in missing}
    names = [start if role.startswith(start) else f"{start} ({role})" for role, start in starts.items()]
    hint = "name a column frequency, or frequency_rad_per_s"
    if [*starts.values()] != ["frequency"]:
        hint = f"name one column {' and one '.join(starts.values())}"
        kept = {role: name for role, name in wanted.items() if role not in missing}
        hint += "" if sheet.source.key else f", or say which it is: {columns_option(sheet, kept, missing)}"
    message = f"{sheet.path.name} has {what} for {', '.join(names)} ({_contents(sheet)})"
    return sheet.error("data-missing-column", message, hint)


def _contents(sheet: Sheet) -> str:
    """Return the header of a file for messages."""
    header = f"its header is: {', '.join(map(str.strip, sheet.names))}" if sheet.names else "it has no header"
    return f"{header}; {len(sheet.columns)} columns"


def roles_of(sheet: Sheet, named: Mapping[str, str], units: Units | None = None) -> dict[str, str]:
    """Return role -> column: of the channels of a plant, or of the columns that a log calls u, y1, r, ..

    Args:
        named: the columns that the user names, by role.

    Raises:
        DataError: `data-missing-column`, it is not clear which column has a role.
    """
    if units is None:
        counts = {letter: _count(letter, sheet, named) for letter in "uy"}
    else:
        counts = {"u": units.inputs, "y": units.outputs}
    typed = {role: _whole_name(sheet, role, name) for role, name in named.items()}
    found: dict[str, str] = {}
    for letter, count in counts.items():
        for role in _roles(letter, count):
            taken = [*typed.values(), *found.values()]
            found[role] = typed.get(role) or _likely(sheet, role, taken, units, single=count == 1)
    references = units is None or units.closed_loop
    found |= _references(sheet, typed, counts["u"]) if references else {}
    return found | _time(sheet, typed, [*found.values()])


def _roles(letter: str, count: int) -> list[str]:
    return [f"{letter}{i + 1}" for i in range(count)]


def _whole_name(sheet: Sheet, role: str, column: str) -> str:
    """Return the whole name of a column that the user names, which states its unit."""
    unread = role == "time" and without_times(sheet, {role: column})
    at = [] if unread else named_columns(sheet, column.strip().lower())
    name = sheet.names[at[0]].strip() if len(at) == 1 and sheet.names else ""
    return name if sheet.header.count(name.lower()) == 1 else column


def _numbered(sheet: Sheet, letter: str) -> dict[str, list[str]]:
    """Return the headers that begin with `u1`, `input 2` and so on, by role; `u` is the first one."""
    found: dict[str, list[str]] = {}
    for name in sheet.header:
        if matched := _CHANNELS[letter].fullmatch(name):
            found.setdefault(f"{letter}{matched[2] or 1}", []).append(name)
    return found


def _likely(sheet: Sheet, role: str, taken: Sequence[str], units: Units | None, *, single: bool) -> str:
    """Return the column that is named by a role or its channel, or is the only one with its unit.

    Where the channel has a name, a column of its unit must have a word of that name. If no column fits, it
    is the role itself.
    """
    called_so = _numbered(sheet, role[0]).get(role, [])
    exact = [name for name in called_so if name in ((role, role[0]) if single else (role,))] or called_so
    if len(exact) > 1:
        message = f"{sheet.path.name} has several columns that may be {role}: {', '.join(exact)}"
        hint = f"say which one counts: --columns {role}={exact[0]}"
        raise sheet.error("data-missing-column", message, hint)
    if exact or units is None:
        return exact[0] if exact else role
    own, unit = units.channels.get(role, ("", ""))
    others = {name.lower() for channel, (name, _) in units.channels.items() if channel != role}
    free = {name: name_and_unit(name) for name in sheet.names if name not in taken}
    words, named = set(own.lower().split()), [x for x, part in free.items() if part[0].lower() == own.lower()]
    alike = [
        name
        for name, (plain, stated) in free.items()
        if unit
        and plain_unit(stated) == plain_unit(unit)
        and plain.lower() not in others
        and (not words or words & set(plain.lower().split()))
    ]
    return next((found[0] for found in (named if own else [], alike) if len(found) == 1), role)


def _time(sheet: Sheet, typed: Mapping[str, str], taken: Sequence[str]) -> dict[str, str]:
    """Return `time` with its column; empty if there is none or the user says `time=none`."""
    if "time" in typed:
        return {} if without_times(sheet, typed) else {"time": typed["time"]}
    claimed = {column.strip().lower() for column in (*taken, *typed.values())}
    timed = [name for name in time_columns(sheet) if name not in claimed]
    if len(timed) > 1:
        message = f"{sheet.path.name} has several columns of times: {', '.join(timed)}"
        hint = f"say which one counts: --columns time={timed[0]}"
        raise sheet.error("data-missing-column", message, hint)
    return {"time": timed[0]} if timed else {}


def without_times(sheet: Sheet, columns: Mapping[str, str]) -> bool:
    """Return whether the user says that no column holds the times: `time=none`, unless one is called so."""
    return columns.get("time", "").strip().lower() == NO_TIMES and NO_TIMES not in sheet.header


def _references(sheet: Sheet, typed: Mapping[str, str], inputs: int) -> dict[str, str]:
    """Return `r1` -> the column of the reference that is added to an input, if every input has one.

    A column that the user does not name counts if it has a number in every row.
    """
    channels = _roles("r", inputs)
    named = {role: typed[role] for role in channels if role in typed}
    found = {role: role for role in channels if role in sheet.header} | named
    found = found or ({"r1": "r"} if inputs == 1 and "r" in sheet.header else {})
    if named and len(found) < inputs:
        missing = next(role for role in channels if role not in found)
        message = f"--columns names {', '.join(named)}, and {sheet.path.name} has no column for {missing}"
        hint = f"name the reference of every input, or none: --columns {missing}=NAME"
        raise sheet.error("data-missing-column", message, hint)
    own = [] if named else [column_named(sheet, name) for name in found.values()]
    usable = all(one.fault is None and not np.isnan(one.numbers).any() for one in own)
    return found if usable and len(found) == inputs else {}


def _count(letter: str, sheet: Sheet, named: Mapping[str, str]) -> int:
    """Return how many inputs or outputs the user or the header names; their numbers must run from one."""
    roles = {role for role in named if role[0] == letter} or _numbered(sheet, letter).keys()
    if roles and roles == {*_roles(letter, len(roles))}:
        return len(roles)
    what = "input" if letter == "u" else "output"
    message = f"which column of {sheet.path.name} is the {what}? ({_contents(sheet)})"
    if roles:
        listed = ", ".join(sorted(roles))
        message = f"the {what}s are {listed}, but they are numbered {letter}1, {letter}2, .."
    wanted = [role for x in "uy" for role in _roles(x, max(sum(role[0] == x for role in named), 1))]
    hint = f"name them, or give their numbers, for example {columns_option(sheet, named, wanted)}"
    raise sheet.error("data-missing-column", message, hint)


def columns_option(sheet: Sheet, named: Mapping[str, str], wanted: Sequence[str]) -> str:
    """Return `--columns "time=1,u1=2,y1=3"`: the times, what is named, and likely columns for `wanted`."""
    found = {role: name for role, name in named.items() if role in ("time", *wanted)}
    taken = {at for column in found.values() for at in named_columns(sheet, column.strip().lower())}
    free = [i for i, column in enumerate(sheet.columns) if i not in taken and column.fault is None]
    timed = time_columns(sheet)
    rising = [i for i in free if sheet.columns[i].mostly(rises=True) or sheet.name_of(i).lower() in timed]
    if rising and "time" not in found:
        found["time"] = str(rising[0] + 1)
    free = [i for i in free if i not in rising[:1] and not sheet.columns[i].dated]
    words = [set(re.split(r"[\W_\d]+", sheet.name_of(i).lower())) for i in range(len(sheet.columns))]
    for role in sorted(set(wanted) - found.keys()):
        own, other = (
            set(_WORDS.get(letter, "").split()) for letter in (role[0], "y" if role[0] == "u" else "u")
        )
        strange = [(not words[i] & own, bool(words[i] & other), i) for i in free]
        likely = [i for *_, i in sorted(strange)]
        found[role] = str(likely[0] + 1) if likely else "NAME"
        free = [i for i in free if i not in likely[:1]]
    in_order = sorted(found, key=lambda role: (role != "time", role))
    return f'--columns "{",".join(f"{role}={found[role]}" for role in in_order)}"'
