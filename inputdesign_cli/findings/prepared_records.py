"""Findings on the preparation of a record when it was read, and on unused parts of its file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from inputdesign_cli.finding import NOTE, Finding, FindingKind, doubt, finding, note

TIMES_READ = note(
    "times-read",
    "Times were computed from columns of the file. Columns of dates and of times of day are joined. A "
    "decreasing time of day begins the next day.",
    "Nothing, if the times are right. Otherwise name their column: `--columns time=NAME`.",
)
TIMES_ASSUMED = note(
    "times-assumed",
    "The sample time is not known. Without times in the file or `--sample-time` it is set to 1.",
    "Give `--sample-time`, or name the column of times: `--columns time=NAME`.",
)
JITTER_EVENED = note(
    "jitter-evened-out",
    "Times were made uniform. Outputs are interpolated linearly; inputs are held, so the nearest sample "
    "counts. Steps may differ by 25 % of the sample time, with `--resample` by more. A step beyond 1.5 "
    "sample times (3 with `--resample`) is a gap.",
    "If only the written times jitter and the samples are regular, add `--columns time=none` and "
    "`--sample-time`.",
)
INPUTS_MOVE_BETWEEN = doubt(
    "inputs-move-between-samples",
    "Inputs change between resampled times. The model takes them as constant from one sample to the next, "
    "so the estimate is biased.",
    "Resample to a step over which inputs are held, or estimate at the steps of the file.",
)
COLUMNS_JOINED = note(
    "columns-joined",
    "Columns were written at different times. The times of the most frequent output are used. Inputs are "
    "held until written again. Other outputs are interpolated.",
    "Log all channels in one row, if the logger can.",
)
RECORD_CUT = note(
    "record-cut",
    "The record has segments. A segment ends at a gap, a step of more than 1.5 sample times (3 with "
    "`--resample`), or at an omitted row. Each has its own initial state and levels. Segments of fewer than "
    "ten samples are left out.",
    "Nothing, if the gaps are known. Otherwise find out why the logger lost samples.",
)
ROWS_LEFT_OUT = note(
    "rows-left-out",
    "Some rows of the file are not used. They have an empty cell or a spreadsheet error, or `--without` "
    "names them.",
    "Nothing. If values are known, fill the cells.",
)
LINES_PASSED_OVER = note(
    "lines-passed-over",
    "Lines between the rows hold no samples. In a file without times, a blank or commented-out row cuts the "
    "record.",
    "Remove the lines from the file if no sample is missing there.",
)
COLUMNS_UNUSED = note(
    "columns-unused",
    "The plant lacks the channels of some columns. A column is called u3 or y2, for instance, but the plant "
    "has fewer channels. The effect of an unmodelled input counts as noise.",
    "Add the channels to the plant, or ignore this.",
)
UNIT_NOT_CONVERTED = note(
    "unit-not-converted",
    "A column has another unit than the spec. Values are not converted.",
    "Convert the column, or correct the unit in the spec.",
)
SHEETS_UNREAD = note(
    "sheets-unread",
    "A workbook has further sheets. Only the first is read unless one is named.",
    "Name the sheet: `log.xlsx#Data`.",
)
TREND_REMOVED = note(
    "trend-removed",
    "A mean or a line was subtracted. With `--detrend` this applies to every signal, segment by segment.",
    "Nothing. The level and slope of every output are estimated together with the model.",
)

_NUMBERED = re.compile(r"[uy]\d+")
_WITH_UNIT = re.compile(r"(.*\S)\s*[(\[]([^)\]]*)[)\]]")
_SPELLINGS = {
    **dict.fromkeys(("celsius", "degcelsius", "\u2103", "c"), "degc"),
    **dict.fromkeys(("fahrenheit", "degfahrenheit", "\u2109", "f"), "degf"),
    **dict.fromkeys(("kelvin", "degk"), "k"),
    **dict.fromkeys(("percent", "pct"), "%"),
    **dict.fromkeys(("volt", "volts"), "v"),
    **dict.fromkeys(("amp", "amps", "ampere", "amperes"), "a"),
    **dict.fromkeys(("watt", "watts"), "w"),
    **dict.fromkeys(("meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("sec", "second", "seconds"), "s"),
    **dict.fromkeys(("minute", "minutes"), "min"),
    **dict.fromkeys(("hour", "hours"), "h"),
}


@finding(NOTE, "column-by-unit", "Name the right column with --columns if this is wrong.")
def columns_by_unit(kind: FindingKind, taken: Mapping[str, str]) -> list[Finding]:
    """A column was taken for a channel by its unit. Its name is not that of the channel in the spec.

    Args:
        taken: the column of each channel.
    """
    fact = ", ".join(f"{column} as {channel}" for channel, column in taken.items())
    return [kind.found(fact, where=", ".join(taken), columns=[*taken.values()])] if taken else []


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
        columns: the column of each channel.
    """
    counts = {"u": inputs, "y": outputs}
    numbered = [name.strip().lower() for name in header if _NUMBERED.fullmatch(name.strip().lower())]
    unused = [one for one in numbered if int(one[1:]) > counts[one[0]] and one not in columns.values()]
    fact = f"{', '.join(unused)}, and the plant of the spec has {inputs} inputs and {outputs} outputs"
    found = COLUMNS_UNUSED.when(unused, fact, columns=unused)
    for channel, (_, stated) in channels.items():
        starts = [columns.get(channel, channel).strip().lower(), *channel[0] * (counts[channel[0]] == 1)]
        for one in map(str.strip, header):
            name, unit = name_and_unit(one)
            ours = name.lower().split(" ")[0] in starts or one.lower() in starts
            if ours and unit and stated and plain_unit(unit) != plain_unit(stated):
                fact = f"{one} is in {unit}, and the spec counts {channel} in {stated}"
                found.append(UNIT_NOT_CONVERTED.found(fact, where=channel, found=unit, stated=stated))
    return found


def name_and_unit(header: str) -> tuple[str, str]:
    """Return the name and the unit of a column: `valve (%)` or `valve [%]`."""
    match = _WITH_UNIT.fullmatch(header.strip())
    return (match[1], match[2].strip()) if match else (header.strip(), "")


def plain_unit(unit: str) -> str:
    """Return one spelling for all spellings of a unit."""
    plain = re.sub(r"degrees?|\u00b0", "deg", re.sub(r"[\s._]+", "", unit.lower()))
    return _SPELLINGS.get(plain, plain)
