"""What a file holds and the model does not use."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from inputdesign_cli.finding import Finding, FindingKind, Severity

_NUMBERED = re.compile(r"[uy]\d+")
_WITH_UNIT = re.compile(r"(.*\S)\s*[(\[]([^)\]]*)[)\]]")
_SPELLINGS = {
    **dict.fromkeys(("celsius", "degcelsius", "\u2103", "c"), "degc"),
    **dict.fromkeys(("fahrenheit", "degfahrenheit", "\u2109", "f"), "degf"),
    **dict.fromkeys(("kelvin", "degk"), "k"),
    **dict.fromkeys(("percent", "pct"), "%"),
    **dict.fromkeys(("sec", "second", "seconds"), "s"),
    **dict.fromkeys(("minute", "minutes"), "min"),
    **dict.fromkeys(("hour", "hours"), "h"),
}

COLUMNS_UNUSED = FindingKind(
    "columns-unused",
    Severity.NOTE,
    "columns of channels that the plant does not have",
    "The file has columns called u3 or y2, and the plant has fewer channels. The effect of an input that is "
    "not modelled counts as noise.",
    "Add the channels to the plant, or ignore this.",
)
UNIT_NOT_CONVERTED = FindingKind(
    "unit-not-converted",
    Severity.NOTE,
    "a column has another unit than the spec",
    "The header of a column and `channels` state different units. Values are taken as they stand.",
    "Convert the column, or correct the unit in the spec.",
)
SHEETS_UNREAD = FindingKind(
    "sheets-unread",
    Severity.NOTE,
    "a workbook has further sheets",
    "Only the first sheet of a workbook is read unless one is named.",
    "Name the sheet: `log.xlsx#Data`.",
)


def columns_against_spec(
    header: Sequence[str],
    channels: Mapping[str, tuple[str, str]],
    inputs: int,
    outputs: int,
    columns: Mapping[str, str],
) -> list[Finding]:
    """Return findings for columns that the plant does not have, or that have another unit than the spec.

    Args:
        header: the names of all columns.
        channels: name and unit of u1, .. and y1, .. in the spec.
        columns: by channel, the column that the user names.
    """
    counts, found = {"u": inputs, "y": outputs}, []
    numbered = [name.strip().lower() for name in header if _NUMBERED.fullmatch(name.strip().lower())]
    unused = [one for one in numbered if int(one[1:]) > counts[one[0]] and one not in columns.values()]
    if unused:
        said = (
            f"Not used: {', '.join(unused)}. The plant of the spec has {inputs} inputs and {outputs} outputs."
        )
        found.append(COLUMNS_UNUSED.found(said, columns=unused))
    for channel, (_, stated) in channels.items():
        starts = [columns.get(channel, channel).strip().lower(), *channel[0] * (counts[channel[0]] == 1)]
        for one in map(str.strip, header):
            name, unit = name_and_unit(one)
            ours = name.lower().split(" ")[0] in starts or one.lower() in starts
            if ours and unit and stated and _plain(unit) != _plain(stated):
                said = (
                    f"{one} is in {unit}, and the spec counts {channel} in {stated}. Nothing was converted."
                )
                found.append(UNIT_NOT_CONVERTED.found(said, where=channel, found=unit, stated=stated))
    return found


def name_and_unit(header: str) -> tuple[str, str]:
    """Return the name and the unit of a column: `valve (%)` or `valve [%]`."""
    match = _WITH_UNIT.fullmatch(header.strip())
    return (match[1], match[2].strip()) if match else (header.strip(), "")


def _plain(unit: str) -> str:
    """One spelling for all spellings of a unit."""
    plain = re.sub(r"degrees?|\u00b0", "deg", re.sub(r"[\s._]+", "", unit.lower()))
    return _SPELLINGS.get(plain, plain)


def sheets_unread(file: str, others: Sequence[str]) -> list[Finding]:
    """Say which sheets of a workbook were not read."""
    if not others:
        return []
    said = f"Only the first sheet of {file} was read. Others are {', '.join(others)}."
    return [SHEETS_UNREAD.found(f"{said} Write '{file}#{others[0]}' for one.", sheets=list(others))]
