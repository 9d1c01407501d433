"""What was done to a record when it was read, and what of its file was not used."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, doubt, listed, note
from inputdesign_cli.outcome.shares import per_cent

TIMES_READ = note(
    "times-read",
    "Times were computed from columns of the file. Columns of dates and of times of day are joined. A "
    "decreasing time of day begins the next day. Counts since 1970 are recognised by their size.",
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
    "counts. Steps may differ by 25 % of the sample time, with `--resample` by more.",
    "Nothing. Less jitter would give a more accurate estimate.",
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
    "held until written again and then averaged. Other outputs are interpolated.",
    "Log all channels in one row, if the logger can.",
)
RECORD_CUT = note(
    "record-cut",
    "The record has segments. A segment ends at a step longer than 1.5 sample times, or at an omitted row. "
    "Each has its own initial state and levels. Segments of fewer than ten samples are left out.",
    "Nothing, if the gaps are known. Otherwise find out why the logger lost samples.",
)
ROWS_LEFT_OUT = note(
    "rows-left-out",
    "Some rows of the file are not used. They have an empty cell or a spreadsheet error, or `--without` "
    "names them.",
    "Fill the cells if the values are known.",
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
    **dict.fromkeys(("sec", "second", "seconds"), "s"),
    **dict.fromkeys(("minute", "minutes"), "min"),
    **dict.fromkeys(("hour", "hours"), "h"),
}


def times_assumed(why: str, likely: Sequence[str]) -> Finding:
    """Say that the sample time was taken for 1, and which columns are likely to hold times."""
    hint = f" Perhaps times stand in {', '.join(likely)}." if likely else ""
    said = f"{why} and there is no --sample-time: the sample time is taken for 1.{hint}"
    return TIMES_ASSUMED.found(said, columns=list(likely))


def times_disagree(stated: float, step: float) -> Finding:
    """Say that a file states another sample time than its times have."""
    said = f"The file states the sample time {stated:g}, and its times advance by {step:g}: the times count."
    return TIMES_READ.found(said, stated=stated, step=step)


def jitter_evened(step: float, unit: str, largest: float, moved: int) -> Iterator[Finding]:
    """Say that times were made even, and after how many of them an input moves before the next one.

    Args:
        largest: the share of `step` by which steps differ from it.
    """
    said = f"Steps of time differ from {step:.6g} {unit} by up to {per_cent(largest, 2)}."
    done = "They were made even: outputs by interpolation, inputs from the nearest sample."
    yield JITTER_EVENED.found(f"{said} {done}", step=step, largest=largest)
    if moved:
        said = f"Inputs move between {moved} of the even times, where the model takes them as held."
        yield INPUTS_MOVE_BETWEEN.found(said, instants=moved)


def columns_joined(counts: Mapping[str, int], rows: int, moved: int, kept: int) -> Finding:
    """Say that columns of different times were joined.

    Args:
        counts: rows with a value, by column, of all `rows`.
        moved: times between which inputs move, of the `kept` ones.
    """
    each = ", ".join(f"{name} in {count}" for name, count in counts.items())
    said = (
        f"Columns were written at different times ({each} of {rows} rows). They were joined at {kept} times."
    )
    said += f" Inputs move between {moved} of these times: their means count." if moved else ""
    return COLUMNS_JOINED.found(said, counts=dict(counts), rows=rows, moved=moved, kept=kept)


def record_cut(
    lengths: Sequence[int],
    gaps: NDArray[np.int64],
    missing: NDArray[np.int64],
    without: NDArray[np.int64],
    short: NDArray[np.int64],
) -> Iterator[Finding]:
    """Say where a record was cut and which rows do not count.

    Args:
        lengths: of the segments.
        gaps: rows before which the time has a gap.
        missing: rows without a number.
        without: rows that the user leaves out.
        short: rows of segments that are too short.
    """
    if without.size:
        said = f"{listed(without).capitalize()} left out, as --without says."
        yield ROWS_LEFT_OUT.found(said, rows=len(without))
    if missing.size:
        said = f"A number is missing in {listed(missing)}: {len(missing)} left out."
        yield ROWS_LEFT_OUT.found(said, rows=len(missing))
    count = len(lengths)
    if count == 1 and not (gaps.size or short.size):
        return
    said = (
        f"The time has {len(gaps)} gap{'s' * (len(gaps) > 1)}, before {listed(gaps)}. " if gaps.size else ""
    )
    each = f"The record has {count} segments, each with a start of its own."
    said += each if count > 1 else "One segment is used."
    said += f" {len(short)} samples of shorter ones are left out ({listed(short)})." if short.size else ""
    yield RECORD_CUT.found(said, segments=count, gaps=len(gaps), samples_left_out=len(short))


def lines_passed_over(what: str, lines: Sequence[int]) -> Finding:
    """Say that lines between rows of numbers cut a record without times."""
    said = f"{listed(lines, 'line').capitalize()} between the numbers: {what}; samples may be missing there, "
    return LINES_PASSED_OVER.found(f"{said}so the record is cut.", lines=len(lines))


def columns_against_spec(
    header: Sequence[str],
    channels: Mapping[str, tuple[str, str]],
    inputs: int,
    outputs: int,
    columns: Mapping[str, str],
) -> Iterator[Finding]:
    """Yield findings for columns that the plant does not have, or that have another unit than the spec.

    Args:
        header: the names of all columns.
        channels: name and unit of u1, .. and y1, .. in the spec.
        columns: by channel, the column that the user names.
    """
    counts = {"u": inputs, "y": outputs}
    numbered = [name.strip().lower() for name in header if _NUMBERED.fullmatch(name.strip().lower())]
    unused = [one for one in numbered if int(one[1:]) > counts[one[0]] and one not in columns.values()]
    if unused:
        has = f"The plant of the spec has {inputs} inputs and {outputs} outputs."
        yield COLUMNS_UNUSED.found(f"Not used: {', '.join(unused)}. {has}", columns=unused)
    for channel, (_, stated) in channels.items():
        starts = [columns.get(channel, channel).strip().lower(), *channel[0] * (counts[channel[0]] == 1)]
        for one in map(str.strip, header):
            name, unit = name_and_unit(one)
            ours = name.lower().split(" ")[0] in starts or one.lower() in starts
            if ours and unit and stated and _plain(unit) != _plain(stated):
                said = f"{one} is in {unit}, and the spec counts {channel} in {stated}. "
                said += "Nothing was converted."
                yield UNIT_NOT_CONVERTED.found(said, where=channel, found=unit, stated=stated)


def name_and_unit(header: str) -> tuple[str, str]:
    """Return the name and the unit of a column: `valve (%)` or `valve [%]`."""
    match = _WITH_UNIT.fullmatch(header.strip())
    return (match[1], match[2].strip()) if match else (header.strip(), "")


def _plain(unit: str) -> str:
    """Return one spelling for all spellings of a unit."""
    plain = re.sub(r"degrees?|\u00b0", "deg", re.sub(r"[\s._]+", "", unit.lower()))
    return _SPELLINGS.get(plain, plain)


def sheets_unread(file: str, others: Sequence[str]) -> list[Finding]:
    """Say which sheets of a workbook were not read."""
    if not others:
        return []
    said = f"Only the first sheet of {file} was read. Others are {', '.join(others)}."
    return [SHEETS_UNREAD.found(f"{said} Write '{file}#{others[0]}' for one.", sheets=list(others))]


def trend_removed(name: str, away: Array, *, line: bool) -> Finding:
    """Say what was taken away from a signal: `away` (n,)."""
    first, last = float(away[0]), float(away[-1])
    what = f"a line from {first:.6g} to {last:.6g}" if line else f"the mean {first:.6g}"
    said = f"Taken away from {name}: {what}."
    return TREND_REMOVED.found(said, where=name, first=first, last=last, line=line)
