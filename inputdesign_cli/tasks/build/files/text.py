"""Tables as text: commas, semicolons, tabs or blanks between fields, decimal points or commas.

What separates the fields, whether there is a header and how decimals are written is seen from the text; the
rules are those of docs/identification.md.
"""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files.sheet import Column, Sheet, unreadable

_COMMENTS = ("#", "%", "//")
_MISSING = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "?"})
_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?|[+-]?\d+")
_LOOKED_AT = 200

Rows = list[tuple[int, list[str]]]


def read_text(path: Path, key: str, text: str) -> Sheet:
    """The table in a text file.

    Raises:
        DataError: `data-unreadable`, `data-extra-field`.
    """
    lines = text.splitlines()
    comment, first = _leading_comment(lines)
    separator = _separator(lines[first : first + _LOOKED_AT])
    rows = _rows(text, separator)
    decimal = _decimal_commas(rows, separator)
    if decimal:
        rows = [(line, [cell.replace(",", ".") for cell in row]) for line, row in rows]
    head, names, body = _headed(rows, comment, separator)
    if not body:
        raise unreadable(path, key, "holds no rows of numbers", "write a header line and rows below it")
    width = len(names) or max(len(row) for _, row in body)
    columns = tuple(_column([row[i] if i < len(row) else "" for _, row in body]) for i in range(width))
    mark = separator or " "
    sheet = Sheet(
        path,
        key,
        tuple(names),
        columns,
        np.array([line for line, _ in body]),
        head,
        [mark.join(row) for _, row in body],
        _of_numbers(body),
    )
    long = next((i for i, (_, row) in enumerate(body) if len(row) > width), None)
    if long is not None:
        message = f"line {body[long][0]} has {len(body[long][1])} fields, and the header {width}"
        hint = (
            "write a name in the header for each column, and numbers with a decimal point: 1.5, not 1,5; or "
            "separate the columns with semicolons"
        )
        raise DataError(sheet.error("data-extra-field", message, hint, long))
    return sheet


def _leading_comment(lines: Sequence[str]) -> tuple[str, int]:
    """The last comment above the table, where it may be the header, and the number of the line after it."""
    comment = ""
    for number, line in enumerate(lines):
        stripped = line.strip()
        if not stripped:
            continue
        if not stripped.startswith(_COMMENTS):
            return comment, number
        comment = stripped.lstrip("#%/ \t")
    return comment, len(lines)


def _separator(lines: Sequence[str]) -> str | None:
    """What stands between the fields; None for blanks."""
    used = [line for line in lines if line.strip() and not line.strip().startswith(_COMMENTS)]
    for mark in "\t;":
        if used and mark in used[0].strip():
            return mark
    numbers = used[1].split() if len(used) > 1 else []
    blanks = len(numbers) > 1 and all(map(_is_number, numbers)) and "," not in used[0]
    return None if blanks else ","


def _rows(text: str, separator: str | None) -> Rows:
    """Line numbers and fields of what is neither empty nor a comment."""
    if separator is None:
        found = [(number, line.split()) for number, line in enumerate(text.splitlines(), start=1)]
    else:
        reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
        found = [(reader.line_num, row) for row in reader]
    return [
        (line, row)
        for line, row in found
        if any(map(str.strip, row)) and not row[0].lstrip().startswith(_COMMENTS)
    ]


def _decimal_commas(rows: Rows, separator: str | None) -> bool:
    """Whether numbers are written 1,5: some cell is, and none has a decimal point."""
    if separator == ",":
        return False
    cells = [cell.strip() for _, row in rows[1 : _LOOKED_AT + 1] for cell in row]
    numbers = [cell for cell in cells if _COMMA.fullmatch(cell)]
    return any("," in cell for cell in numbers) and not any(_is_number(c) and "." in c for c in cells)


def _headed(rows: Rows, comment: str, separator: str | None) -> tuple[tuple[int, str], list[str], Rows]:
    """Line and text of the header, the names (none where there are none), and the rows below.

    A row of units below the names joins them: `valve` over `%` is `valve (%)`.
    """
    if not rows:
        return (1, ""), [], []
    line, first = rows[0]
    text = (separator or " ").join(first)
    cells = [cell.strip() for cell in first]
    if any(_is_number(cell) for cell in cells) and all(_known(cell) for cell in cells):
        named = [part.strip() for part in (comment.split(separator) if comment else [])]
        return (line, text), named if len(named) == len(first) else [], rows
    units = [cell.strip() for cell in rows[1][1]] if len(rows) > 2 else []
    wordy = bool(units) and len(units) == len(cells) and not any(_known(unit) for unit in units)
    if wordy and all(_is_number(cell) for cell in rows[2][1]):
        return (line, text), [f"{n} ({u})" for n, u in zip(cells, units, strict=True)], rows[2:]
    return (line, text), cells, rows[1:]


def _column(cells: list[str]) -> Column:
    try:
        numbers = np.array(cells, dtype=float)
    except ValueError:
        numbers = np.array([float(cell) if _is_number(cell) else np.nan for cell in cells])
    unclear = np.flatnonzero(~np.isfinite(numbers))
    numbers[unclear] = np.nan
    fault = next(((int(i), cells[i].strip()) for i in unclear if not _missing(cells[i])), None)
    seconds = None if fault is None else _seconds(cells)
    return Column(numbers, fault) if seconds is None else Column(seconds, dated=True)


def _seconds(cells: list[str]) -> NDArray[np.float64] | None:
    """Dates and times as ISO 8601 writes them, as seconds since the first; None where some cell is none."""
    try:
        moments = [datetime.fromisoformat(cell.strip()) for cell in cells]
        return np.array([(moment - moments[0]).total_seconds() for moment in moments])
    except (ValueError, TypeError):  # some are no dates, or some with and some without a time zone
        return None


def _of_numbers(rows: Rows) -> bool:
    cells = [cell for _, row in rows for cell in row if cell.strip()]
    return 2 * sum(map(_is_number, cells)) >= max(len(cells), 1)


def _known(text: str) -> bool:
    return _is_number(text) or _missing(text)


def _missing(text: str) -> bool:
    return text.strip().lower() in _MISSING


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
