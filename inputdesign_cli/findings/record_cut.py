"""A record is cut where samples are missing; rows are left out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.finding import Finding, FindingKind, Severity, listed

RECORD_CUT = FindingKind(
    "record-cut",
    Severity.NOTE,
    "the record has segments",
    "A segment ends at a step of time longer than 1.5 sample times and at a row that is left out. Without "
    "times it ends at a blank line. One model is estimated of all segments. Each has a start and levels of "
    "its own. Segments of fewer than ten samples are left out.",
    "Nothing, if the gaps are known. Otherwise see why the logger lost samples.",
)
ROWS_LEFT_OUT = FindingKind(
    "rows-left-out",
    Severity.NOTE,
    "rows of the file are not used",
    "Rows with an empty cell, with an error of a spreadsheet, or named by `--without` do not count.",
    "Fill the cells if the values are known.",
)
LINES_PASSED_OVER = FindingKind(
    "lines-passed-over",
    Severity.NOTE,
    "lines between the rows hold no samples",
    "Blank lines and comments between rows of numbers hold no samples. With times, the times show whether "
    "samples are missing. Without times a blank line, or a row that is commented out, cuts the record.",
    "Take the lines out of the file if no sample is missing there.",
)


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
    if len(lengths) == 1 and not (gaps.size or short.size):
        return
    where = (
        f"The time has {len(gaps)} gap{'s' * (len(gaps) > 1)}, before {listed(gaps)}. " if gaps.size else ""
    )
    count = len(lengths)
    each = (
        f"The record has {count} segments, each with a start of its own."
        if count > 1
        else "One segment is used."
    )
    rest = f" {len(short)} samples of shorter ones are left out ({listed(short)})." if short.size else ""
    yield RECORD_CUT.found(
        f"{where}{each}{rest}", segments=count, gaps=len(gaps), samples_left_out=len(short)
    )


def lines_passed_over(what: str, lines: Sequence[int], *, cuts: bool, timed: bool) -> Finding:
    """Say what lines between rows of numbers mean for the record.

    Args:
        what: what the lines are.
        cuts: whether the record is cut there.
        timed: whether the file has times.
    """
    follows = "the rows before and after follow each other"
    if cuts:
        follows = "samples may be missing there, so the record is cut"
    elif timed:
        follows = "the times show whether samples are missing"
    said = f"{listed(lines, 'line').capitalize()} between the numbers: {what}; {follows}."
    return LINES_PASSED_OVER.found(said, lines=len(lines), cuts=cuts)
