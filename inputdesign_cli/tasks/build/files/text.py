"""Tables as text: commas, semicolons, tabs or blanks between fields, decimal points or commas.

What separates the fields, where the table begins, whether it has a header and how decimals and dates are
written is seen from the text; the rules are those of docs/identification.md.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.files import numeric_dates
from inputdesign_cli.tasks.build.files.cells import in_plain_signs, is_missing, is_number, measured
from inputdesign_cli.tasks.build.files.dates import AS_DATES, look_like_moments, moments_of, seems_moment
from inputdesign_cli.tasks.build.files.layout import (
    COMMENTS,
    LongFieldError,
    OpenQuoteError,
    Rows,
    between_thousands,
    decimal_commas,
    headed,
    is_comma,
    rows_of,
    separator_of,
    table_begins,
    with_point,
    within,
    without_thousands,
)
from inputdesign_cli.tasks.build.files.sheet import Column, Sheet, unreadable

FORMULA = "="
_AS_DATES = f"{AS_DATES}; where the column holds no times that count, add time=none to --columns"
# As many as a sheet of a workbook can have: a longer line is no row of a table.
_MOST_FIELDS = 16_384


def read_text(path: Path, key: str, text: str, separated_by: str | None = None) -> Sheet:
    """The table in a text file.

    Args:
        separated_by: what stands between fields; None: as the text says.

    Raises:
        DataError: `data-unreadable`, `data-extra-field`.
    """
    text = in_plain_signs(text)
    lines = text.splitlines()
    _check_widths(path, key, lines)
    comment, first = _leading_comment(lines)
    separator = separated_by or separator_of(lines[first:])
    try:
        rows, passed = rows_of(text, separator)
    except OpenQuoteError as error:
        hint = "close it, or take it out; numbers need no quotes"
        raise unreadable(path, key, f"is no CSV file: {error}", hint, error.line) from None
    except LongFieldError as error:
        hint = "keep one sample a line, its numbers separated by commas, semicolons, tabs or blanks"
        raise unreadable(path, key, f"is no table: {error}", hint, error.line) from None
    rows = rows[table_begins(rows, separator) :]
    written = dict(rows)
    if decimal_commas(rows, separator):
        rows = [(line, [with_point(cell) for cell in row]) for line, row in rows]
    head, names, body = headed(rows, comment, separator)
    if not body:
        raise unreadable(path, key, "holds no rows of numbers", "write a header line and rows below it")
    body, between = within(body, passed, separator)
    if names and all(len(row) == len(names) + 1 and not row[-1].strip() for _, row in body):
        body = [(line, row[:-1]) for line, row in body]  # every row ends with a separator
    width = len(names) or max(len(row) for _, row in body)
    points = separator != "," or any("." in cell and is_number(cell) for _, row in body for cell in row)
    columns = tuple(
        column_of([row[i] if i < len(row) else "" for _, row in body], points=points) for i in range(width)
    )
    mark = separator or " "
    sheet = Sheet(
        path,
        key,
        tuple(names),
        columns,
        np.array([line for line, _ in body]),
        head,
        [mark.join(written.get(line, row)) for line, row in body],
        _of_numbers(body, columns),
        passed=between,
    )
    long = next((i for i, (_, row) in enumerate(body) if len(row) > width), None)
    if long is not None:
        message = f"line {body[long][0]} has {len(body[long][1])} fields, and the header {width}"
        hint = (
            "write a name in the header for each column, and numbers with a decimal point and nothing "
            "between thousands: 1234.5, not 1234,5 or 1,234.5; or separate the columns with semicolons"
        )
        raise DataError(sheet.error("data-extra-field", message, hint, long))
    return sheet


def _check_widths(path: Path, key: str, lines: Sequence[str]) -> None:
    """Raise `DataError` (`data-unreadable`) where a line has more fields than any table."""
    for number, line in enumerate(lines, start=1):
        if len(line) < 2 * _MOST_FIELDS:  # a character and a mark for each
            continue
        fields = max(len(line.split()), *(line.count(mark) + 1 for mark in "\t;|,"))
        if fields > _MOST_FIELDS:
            what = f"has a line of {fields} fields (line {number}), and at most {_MOST_FIELDS} are taken"
            hint = "write one sample a line, or keep the columns that are needed"
            raise unreadable(path, key, what, hint, number)


def _leading_comment(lines: Sequence[str]) -> tuple[str, int]:
    """The last comment above the table, where it may be the header, and the number of the line after it."""
    comment = ""
    for number, line in enumerate(lines):
        stripped = line.strip()
        if not stripped:
            continue
        if not stripped.startswith(COMMENTS):
            return comment, number
        comment = stripped.lstrip("#%/ \t")
    return comment, len(lines)


def column_of(cells: list[str], *, points: bool = True) -> Column:
    """The numbers, or the dates and times, that cells say.

    Args:
        points: whether some cell of the table has a decimal point.
    """
    cells = _without_percent(cells)
    try:
        text = "".join(cells)
        if "_" in text or not text.isascii():  # what float takes, and is_number does not
            raise ValueError
        numbers = np.array(cells, dtype=float)
    except ValueError:
        numbers = np.array([float(cell) if is_number(cell) else np.nan for cell in cells])
    unclear = np.flatnonzero(~np.isfinite(numbers))
    numbers[unclear] = np.nan
    fault = next(((int(i), cells[i].strip()) for i in unclear if not is_missing(cells[i])), None)
    if fault is not None and is_comma(fault[1]):
        wrong = "has a comma, and other cells have decimal points"
        if not points:
            wrong = "has a comma, which may be a decimal mark or stand between thousands"
        hint = (
            f"if it is a decimal mark, write {fault[1].replace(',', '.')}, else {fault[1].replace(',', '')}: "
            "between thousands nothing stands"
        )
        return Column(numbers, fault, wrong=wrong, hint=hint)
    if fault is not None and fault[1].startswith(FORMULA):
        wrong = "is a formula, of which the file holds no value"
        hint = "open the file in a spreadsheet program and save it: that writes the values"
        return Column(numbers, fault, wrong=wrong, hint=hint)
    both = measured(fault[1]) if fault is not None else None
    if both is not None:
        wrong = "has a unit beside its number"
        hint = f"write {both[0]} alone, and the unit into the header, as in 'name ({both[1]})'"
        return Column(numbers, fault, wrong=wrong, hint=hint)
    plain = without_thousands(fault[1]) if fault is not None else None
    if plain is not None:
        wrong = f"is not a finite number: it has a mark between thousands (without: {plain})"
        return Column(numbers, fault, wrong=wrong)
    thousand = between_thousands(cells) if fault is None else None
    if thousand is not None:
        wrong = "may have a mark between thousands, or three decimals: other cells have none"
        return Column(numbers, (thousand, cells[thousand].strip()), wrong=wrong)
    if fault is None:
        return numeric_dates.of_cells(cells, numbers) or Column(numbers)
    written = {cell.strip() for cell in cells if not is_missing(cell)} if np.isnan(numbers).all() else set()
    return _of_dates(cells, Column(numbers, fault, words=tuple(sorted(written))))


def _without_percent(cells: list[str]) -> list[str]:
    """The numbers of a column in per cent, where every one has the sign; else the cells as they are."""
    if not any("%" in cell for cell in cells):
        return cells
    found = [("", "%") if is_missing(cell) else measured(cell) for cell in cells]
    plain = [both[0] for both in found if both is not None and both[1] == "%"]
    return plain if len(plain) == len(cells) else cells


def _of_dates(cells: list[str], otherwise: Column) -> Column:
    """The same where cells are dates or times, or look like them; empty ones are missing."""
    there = [i for i, cell in enumerate(cells) if not is_missing(cell)]
    written = [cells[i].strip() for i in there]
    moments = moments_of(written)
    if moments is not None and not moments.unclear:
        seconds = np.full(len(cells), np.nan)
        seconds[there] = moments.seconds
        clock = moments.began if moments.of_day else None
        return Column(seconds, dated=True, began=moments.began, clock=clock)
    if moments is not None:
        fault, wrong = (there[0], written[0]), "may have the day or the month first"
        return Column(otherwise.numbers, fault, wrong=wrong, hint=_AS_DATES, undated=True)
    alike = look_like_moments(cells)
    if is_number(written[0]) or not (alike or seems_moment(written[0])):
        return otherwise
    # All cells up to one are dates of one kind, and with it they are not.
    at = bisect_left(range(len(written)), 1, key=lambda i: moments_of(written[: i + 1]) is None)
    wrong = "is no date or time as those above are" if at else "is no date or time that can be read"
    fault, undated = (there[at], written[at]), at > 0 or alike
    words = () if undated else otherwise.words
    return Column(otherwise.numbers, fault, wrong=wrong, hint=_AS_DATES, undated=undated, words=words)


def _of_numbers(rows: Rows, columns: Sequence[Column]) -> bool:
    """Whether half of what the rows hold are numbers or dates: then messages may show it."""
    cells = [cell for _, row in rows for cell in row if cell.strip()]
    dates = len(rows) * sum(column.dated for column in columns)
    numbers = sum(is_number(cell) or measured(cell) is not None for cell in cells)
    return 2 * (numbers + dates) >= max(len(cells), 1)
