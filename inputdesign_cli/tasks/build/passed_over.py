"""Lines between the rows of a table that are no rows: what they mean for the record, told."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.tasks.build import rows
from inputdesign_cli.tasks.build.files import Sheet
from inputdesign_cli.tasks.build.files.layout import BLANK, COMMENT, COMMENTED, LEFT_OUT, SPACING

_WORDS = {
    BLANK: ("blank line", "blank lines"),
    COMMENTED: ("row that is commented out", "rows that are commented out"),
    COMMENT: ("comment", "comments"),
}


def passed_over(sheet: Sheet, *, timed: bool) -> tuple[NDArray[np.bool_], list[str]]:
    """Whether the record is cut before each row (n,), and a note for each kind of line.

    Where there are times, they tell what is missing. Blank lines between most rows are told and mean nothing.
    """
    apart = np.zeros(len(sheet.lines), dtype=bool)
    told = []
    begin, end = (int(sheet.lines[i]) for i in (0, -1)) if len(sheet.lines) else (0, 0)
    for kind, (one, several) in _WORDS.items():
        lines = [line for line, own in sheet.passed if own == kind and begin < line < end]
        if not lines:
            continue
        cuts = kind in LEFT_OUT and not timed
        if cuts:
            apart[np.searchsorted(sheet.lines, lines)] = True
        at = rows.told(lines, "line")
        what = f"{len(lines)} {one if len(lines) == 1 else several} between the numbers ({at})"
        if cuts:
            told.append(f"{what}: samples may be missing there, so the record is cut")
        elif kind == COMMENT and not timed:
            told.append(
                f"{what} passed over: the rows about {'it' if len(lines) == 1 else 'them'} are joined"
            )
        else:
            told.append(f"{what} passed over: the times tell whether samples are missing")
    if any(own == SPACING and begin < line < end for line, own in sheet.passed):
        told.append("blank lines stand between most rows: they were passed over")
    return apart, told
