"""Which column of a file is which channel, and in which unit."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.specification.models.units import SECONDS
from inputdesign_cli.tasks.build.files import Sheet
from inputdesign_cli.tasks.build.files.naming import named_columns, time_columns
from inputdesign_cli.tasks.build.preparation import Preparation

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
_SPELLINGS = {
    **dict.fromkeys(("celsius", "degcelsius", "\u2103", "c"), "degc"),
    **dict.fromkeys(("fahrenheit", "degfahrenheit", "\u2109", "f"), "degf"),
    **dict.fromkeys(("kelvin", "degk"), "k"),
    **dict.fromkeys(("percent", "pct"), "%"),
    **_UNITS,
}
NO_TIMES = "none"
_CHANNEL = re.compile(r"([uy])(\d+)(?![a-z0-9]).*")
_WITH_UNIT = re.compile(r"(.*\S)\s*[(\[]([^)\]]*)[)\]]")


def channel_columns(letter: str, count: int, sheet: Sheet, preparation: Preparation) -> dict[str, str]:
    """Channel -> how its column begins: u1, u2, ..; u or u1 for a single one; or what the user said.

    Raises:
        DataError: a single channel has a column of either name.
    """
    found = {}
    for name in (f"{letter}{i + 1}" for i in range(count)):
        either = [
            [header for header in sheet.header if re.match(rf"{start}(?![a-z0-9])", header)]
            for start in (letter, name)
        ]
        if count == 1 and name not in preparation.columns and all(either):
            listed = f": {', '.join([*either[0], *either[1]])}" if sheet.shown else ""
            message = f"{sheet.path.name} has several columns that may be {name}{listed}"
            hint = f"say which one counts: --columns {name}={either[0][0] if sheet.shown else 'NAME'}"
            raise DataError(sheet.error("data-missing-column", message, hint))
        plain = count == 1 and not any(header.startswith(name) for header in sheet.header)
        found[name] = preparation.columns.get(name, letter if plain else name)
    return found


def time_column(sheet: Sheet, preparation: Preparation) -> dict[str, str]:
    """`time` -> the name of its column, if there is one; `none` of the user says that there is none.

    Raises:
        DataError: there are several.
    """
    if without_times(sheet, preparation.columns):
        return {}
    if "time" in preparation.columns:
        return {"time": preparation.columns["time"]}
    claimed = {column.strip().lower() for column in preparation.columns.values()}
    timed = [name for name in time_columns(sheet) if name not in claimed]
    if len(timed) > 1:
        listed = f": {', '.join(timed)}" if sheet.shown else ""
        message = f"{sheet.path.name} has several columns of times{listed}"
        which = timed[0] if timed.count(timed[0]) == 1 else str(sheet.header.index(timed[0]) + 1)
        hint = f"say which one counts: --columns time={which if sheet.shown else 'NAME'}"
        raise DataError(sheet.error("data-missing-column", message, hint))
    return {"time": timed[0]} if timed else {}


def without_times(sheet: Sheet, columns: Mapping[str, str]) -> bool:
    """Whether the user says that no column holds the times: `time=none`, unless one is called so."""
    said = columns.get("time", "").strip().lower()
    return said == NO_TIMES and NO_TIMES not in sheet.header


def time_unit_of(name: str) -> str | None:
    """The unit in the name of a column of times: `time_ms`, `Time (sec)`."""
    words = re.findall(r"[a-z]+", name.lower())
    return _UNITS.get(words[-1]) if len(words) > 1 else None


def time_unit_in(sheet: Sheet, name: str) -> str | None:
    """The unit of times that a file states: in the name of their column, or beside its sample time.

    Raises:
        DataError: `data-wrong-unit`, it is none of ours.
    """
    said = sheet.pace.unit
    if time_unit_of(name) or not said:
        return time_unit_of(name)
    unit = _plain_time(said)
    if unit is None:
        message = f"{sheet.path.name} states its times in {said!r}, which is none of {', '.join(TIME_UNITS)}"
        raise DataError(sheet.error("data-wrong-unit", message, "say which it is: --time-unit s"))
    return unit


def counted_unit(sheet: Sheet, name: str, preparation: Preparation, *, dated: bool) -> str | None:
    """The unit of the times by the option, or of dates; None where neither says it.

    Args:
        name: of the column of times, if any.
        dated: whether it holds dates, which are counted in seconds.

    Raises:
        DataError: `data-wrong-unit`, the option contradicts what the file says.
    """
    said, own = preparation.time_unit, "s" if dated else time_unit_of(name) or _plain_time(sheet.pace.unit)
    if said is None:
        return "s" if dated else None
    if own is not None and own != said:
        holds = "holds dates, which are counted in s" if dated else f"states its times in {own}"
        message = f"{sheet.path.name} {holds}, and --time-unit says {said}"
        hint = "leave --time-unit out"
        if not dated:
            hint += f" or say {own}: it tells what the times are counted in; or write {said} into the file"
        raise DataError(sheet.error("data-wrong-unit", message, hint))
    return said


def _plain_time(unit: str | None) -> str | None:
    return None if unit is None else _UNITS.get(unit.strip().lower())


def with_names(sheet: Sheet, units: Units, preparation: Preparation) -> Preparation:
    """Columns that are called as the spec calls a channel are its columns, where nothing else says which."""
    named = {}
    for channel, (name, _) in units.channels.items():
        called = [plain for plain, _ in map(_split, sheet.names) if plain.lower() == name.lower()]
        taken = channel in preparation.columns or any(
            re.match(rf"{channel[0]}\d*(?![a-z0-9])", header) for header in sheet.header
        )
        if name and len(called) == 1 and not taken:
            named[channel] = next(header for header in sheet.names if _split(header)[0] == called[0])
    return replace(preparation, columns={**named, **preparation.columns}) if named else preparation


def with_headers(sheet: Sheet, preparation: Preparation) -> Preparation:
    """Columns that the user names by number, or by how they begin, by their whole names, which tell units."""
    whole = {}
    unread = without_times(sheet, preparation.columns)
    for channel, column in preparation.columns.items():
        at = [] if unread and channel == "time" else named_columns(sheet, column.strip().lower())
        name = sheet.names[at[0]].strip() if len(at) == 1 and sheet.names and sheet.shown else ""
        whole[channel] = name if sheet.header.count(name.lower()) == 1 else column
    return replace(preparation, columns=whole)


def _split(header: str) -> tuple[str, str]:
    """The name and the unit of a column: `valve (%)` or `valve [%]`."""
    match = _WITH_UNIT.fullmatch(header.strip())
    return (match[1], match[2].strip()) if match else (header.strip(), "")


def other_units(sheet: Sheet, units: Units, preparation: Preparation) -> list[str]:
    """Columns whose header states another unit than the spec does; nothing is converted."""
    told = []
    for channel, (_, unit) in units.channels.items():
        of_letter = units.inputs if channel[0] == "u" else units.outputs
        plain = [channel, *([channel[0]] if of_letter == 1 else [])]
        starts = [preparation.columns[channel].strip().lower()] if channel in preparation.columns else plain
        for header in sheet.names:
            name, found = _split(header)
            ours = name.lower().split(" ")[0] in starts or header.strip().lower() in starts
            if ours and unit and found and _plain_unit(found) != _plain_unit(unit):
                told.append(
                    f"{header.strip()} is in {found}, the spec counts {channel} in {unit}: not converted"
                )
    return told


def _plain_unit(unit: str) -> str:
    """One spelling of those that a unit has."""
    plain = re.sub(r"degrees?|\u00b0", "deg", re.sub(r"[\s._]+", "", unit.lower()))
    return _SPELLINGS.get(plain, plain)


def reference_columns(inputs: int, sheet: Sheet, columns: Mapping[str, str]) -> dict[str, str]:
    """`r1` -> the column of the reference that is added to an input, if all have one: r1, r2, .., r of one.

    Args:
        columns: by channel, those that the user names.

    Raises:
        DataError: only some are named.
    """
    channels = [f"r{i + 1}" for i in range(inputs)]
    found = {name: columns.get(name, name) for name in channels if name in columns or name in sheet.header}
    if inputs == 1 and not found and "r" in sheet.header:
        found = {"r1": "r"}
    if len(found) == inputs:
        return found
    named = [name for name in channels if name in columns]
    if named:
        missing = ", ".join(name for name in channels if name not in found)
        message = f"--columns names {', '.join(named)}, and {sheet.path.name} has no column for {missing}"
        hint = f"name the reference of every input, or none: --columns {missing.split(',')[0]}=NAME"
        raise DataError(sheet.error("data-missing-column", message, hint))
    return {}


def unused_columns(sheet: Sheet, units: Units, preparation: Preparation) -> list[str]:
    """Columns that are called as channels are, of which the plant has fewer."""
    counts = {"u": units.inputs, "y": units.outputs}
    found = [(name, _CHANNEL.fullmatch(name)) for name in sheet.header]
    extra = [
        name
        for name, match in found
        if match and int(match[2]) > counts[match[1]] and name not in preparation.columns.values()
    ]
    if not extra:
        return []
    verb = "is" if len(extra) == 1 else "are"
    return [
        f"{', '.join(extra)} {verb} not used: the plant of the spec has {units.inputs} inputs and "
        f"{units.outputs} outputs; what such an input causes counts as noise here"
    ]
