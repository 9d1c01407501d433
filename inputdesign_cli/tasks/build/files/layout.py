"""How a text is laid out as a table: what separates the fields, and where the table begins."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from inputdesign_cli.tasks.build.files.cells import (
    is_error,
    is_known,
    is_missing,
    is_number,
    is_unit,
    measured,
)
from inputdesign_cli.tasks.build.files.dates import is_moment

Rows = list[tuple[int, list[str]]]
Passed = tuple[tuple[int, str], ...]
"""Lines that are no rows, and what they are."""

BLANK, SPACING, EMPTY = "blank", "spacing", "empty cells"
COMMENT, COMMENTED = "comment", "commented numbers"
# Between rows without times nobody knows how many samples are missing there.
LEFT_OUT = (BLANK, COMMENTED)

COMMENTS = ("#", "%", "//")
_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?|[+-]?\d+", re.ASCII)
# Numbers with marks between thousands, or in the digits of any script.
_MARKED = re.compile(r"[-+\u2212]?\d[\d.,'\u2019_\s]*")
# Numbers below a million in whole numbers, with a mark between thousands, and those that have one.
_WHOLE = re.compile(r"[+-]?(0|[1-9]\d{0,2}(\.\d{3})?)", re.ASCII)
# Numbers with one mark between all thousands, and another before decimals, if there are any.
_GROUPED = re.compile(r"([+-]?\d{1,3}([.,'\u2019 \u00a0\u202f])\d{3}(?:\2\d{3})*)((?!\2)[.,]\d+)?", re.ASCII)
_THOUSAND = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
_LOOKED_AT = 200
# What may separate fields; None stands for blanks. Of equally good ones the first.
_SEPARATORS = ("\t", ";", "|", None, ",")


class OpenQuoteError(ValueError):
    """A quote that is opened in `line` and never closed."""

    def __init__(self, line: int) -> None:
        super().__init__(f"a quote that opens in line {line} is never closed")
        self.line = line


class LongFieldError(ValueError):
    """A field of `line` that is longer than any number or name."""

    def __init__(self, line: int) -> None:
        most = csv.field_size_limit()
        super().__init__(f"line {line} has a field of more than {most} characters, which is no number")
        self.line = line


def separator_of(lines: Sequence[str]) -> str | None:
    """What stands between the fields: that by which most cells are numbers, then most rows alike."""
    used = [line for line in lines if line.strip() and not line.strip().startswith(COMMENTS)]
    sample = used[:_LOOKED_AT] + used[_LOOKED_AT:][-_LOOKED_AT:]

    def rank(mark: str | None) -> tuple[int, int]:
        rows = [_fields(line, mark) for line in sample]
        numbers = sum(_tells(cell) for row in rows if len(row) > 1 for cell in row)
        return numbers, max(Counter(map(len, rows)).values(), default=0)

    best = max(_SEPARATORS, key=rank)
    return best if rank(best)[0] else next((m for m in "\t;" if used and m in used[0].strip()), ",")


def _fields(line: str, mark: str | None) -> list[str]:
    """The fields of a line, the marks in quotes left alone."""
    if mark is None or '"' not in line:
        return line.split(mark)
    try:
        return next(csv.reader([line], delimiter=mark))
    except csv.Error:  # a field beyond all bounds
        return line.split(mark)


def _tells(cell: str) -> bool:
    """Whether a cell is a number, with its unit or without, or a date."""
    return is_plain(cell) or measured(cell) is not None


def rows_of(text: str, separator: str | None) -> tuple[Rows, Passed]:
    """Line numbers and fields of what is neither empty nor a comment, and the other lines.

    Raises:
        OpenQuoteError: the end of the text, or of a line, stands inside quotes that nothing closes.
        LongFieldError: a field is longer than any number or name.
    """
    if separator is None:
        found = [(number, line.split()) for number, line in enumerate(text.splitlines(), start=1)]
    else:
        found = list(_quoted(text, separator))
    rows: Rows = []
    passed: list[tuple[int, str]] = []
    for line, row in found:
        if not any(map(str.strip, row)):
            passed.append((line, EMPTY if len(row) > 1 else BLANK))
        elif row[0].lstrip().startswith(COMMENTS) and not _is_gap(row):
            passed.append((line, _comment(row, separator)))
        else:
            rows.append((line, row))
    return rows, tuple(passed)


def _is_gap(row: Sequence[str]) -> bool:
    """Whether a row begins with an error of a sheet, and holds numbers or nothing else."""
    return len(row) > 1 and is_error(row[0]) and all(is_plain(cell) or is_missing(cell) for cell in row[1:])


def _comment(row: Sequence[str], separator: str | None) -> str:
    """Whether a row that begins as comments do holds samples, or errors of a sheet in place of them."""
    first = row[0].strip()
    if is_error(first):
        return COMMENTED
    bare = [first.lstrip("#%/").strip(), *row[1:]]
    if separator is not None and any(is_plain(cell) for cell in bare[1:]):
        return COMMENTED
    cells = re.split(r"[;,\t ]+", bare[0]) if len(bare) == 1 else [cell for cell in bare if cell.strip()]
    return COMMENTED if len(cells) > 1 and all(is_plain(cell) for cell in cells) else COMMENT


def within(body: Rows, passed: Passed, separator: str | None) -> tuple[Rows, Passed]:
    """Rows with those of empty cells between them, samples that are missing, and what else stands between.

    Blank lines between most rows are `SPACING`, which means nothing.
    """
    ends = [i for i, (_, row) in enumerate(body) if _of_numbers(row)]
    if not ends:
        return body, ()
    first, last = body[ends[0]][0], body[ends[-1]][0]
    between = [(line, kind) for line, kind in passed if first < line < last]
    empty = [(line, [""] * len(body[ends[0]][1])) for line, kind in between if kind == EMPTY]
    lines = np.array([line for line, _ in body])
    blank = np.array([line for line, kind in between if kind == BLANK])
    if 2 * np.unique(np.searchsorted(lines, blank)).size > ends[-1] - ends[0]:
        between = [(line, SPACING if kind == BLANK else kind) for line, kind in between]
    return sorted([*body, *empty], key=lambda row: row[0]), tuple(p for p in between if p[1] != EMPTY)


def _quoted(text: str, separator: str) -> Rows:
    """The rows of text with quotes, which may hold separators and ends of lines."""
    # Outside quotes this is a row of its own; inside it would be part of the last field.
    end = "\x00"
    reader = csv.reader(io.StringIO(f"{text}\n{end}", newline=""), delimiter=separator)
    lines = text.splitlines(keepends=True)
    rows, begun = [], 1
    try:
        for row in reader:
            if reader.line_num > begun and not _closed(lines[begun - 1 : reader.line_num], separator):
                raise OpenQuoteError(begun)
            rows.append((reader.line_num, row))
            begun = reader.line_num + 1
    except csv.Error:  # a field grew beyond all bounds
        quoted = '"' in lines[begun - 1] and len(lines[begun - 1]) < csv.field_size_limit()
        raise (OpenQuoteError if quoted else LongFieldError)(begun) from None
    if rows.pop()[1] != [end]:
        raise OpenQuoteError(begun)
    return rows


def _closed(lines: Sequence[str], separator: str) -> bool:
    """Whether quotes in these lines close where a field ends, as those of a field of several lines do."""
    try:
        return sum(1 for _ in csv.reader(lines, delimiter=separator, strict=True)) == 1
    except csv.Error:
        return False


def table_begins(rows: Rows, separator: str | None) -> int:
    """The row where the table begins, its names if it has any: loggers write other lines above it."""
    sample = rows[:_LOOKED_AT] + rows[_LOOKED_AT:][-_LOOKED_AT:]
    widths = Counter(len(row) for _, row in sample if _of_numbers(row))
    if not widths:
        return 0
    width = widths.most_common(1)[0][0]
    # Sheets fill every row up to the width of the table, with nothing.
    full = next((i for i, (_, row) in enumerate(sample) if len(row) == width and all(map(str.strip, row))), 0)
    if 0 < full < _LOOKED_AT and _of_words(rows[full][1], width):
        return full
    first = next(i for i, (_, row) in enumerate(rows) if len(row) == width and _of_numbers(row))
    if first < 2:
        return 0
    names = [row for _, row in rows[first - 2 : first] if _of_words(row, width)]
    if not names or not _of_words(rows[first - 1][1], width):
        return first if any(len(row) != width for _, row in rows[:first]) else 0
    both = len(names) == 2 and (first == 2 or all(map(is_unit, names[1])))
    return first - 2 if both else first - 1


def _of_numbers(row: Sequence[str]) -> bool:
    filled = [cell for cell in row if cell.strip()]
    plain = sum(map(_tells, filled))
    if not plain:  # not to be passed over: the reader of its columns says what is wrong with them
        return bool(filled) and all(map(_is_marked, filled))
    return len(filled) <= 2 * plain


def _is_marked(cell: str) -> bool:
    return _MARKED.fullmatch(cell.strip()) is not None


def _of_words(row: Sequence[str], width: int) -> bool:
    return len(row) == width and not any(is_plain(cell) for cell in row)


def decimal_commas(rows: Rows, separator: str | None) -> bool:
    """Whether numbers are written 1,5: some cell is, and none has a decimal point.

    Between commas they stand in quotes, where 1,234 may be a thousand: then some cannot be.
    """
    looked_at = rows[1:] if separator == "," else rows[1 : _LOOKED_AT + 1]
    cells = [cell.strip("% ") for _, row in looked_at for cell in row]
    commas = [cell for cell in cells if is_comma(cell)]
    if separator == "," and all(map(_THOUSAND.fullmatch, commas)):
        return False
    return bool(commas) and not any("." in cell and is_number(cell) for cell in cells)


def headed(rows: Rows, comment: str, separator: str | None) -> tuple[tuple[int, str], list[str], Rows]:
    """Line and text of the header, the names (none where there are none), and the rows below.

    A row of units below the names joins them: `valve` over `%` is `valve (%)`.
    """
    if not rows:
        return (1, ""), [], []
    line, first = rows[0]
    text = (separator or " ").join(first)
    cells = [" ".join(cell.split()) for cell in first]
    if any(map(is_number, cells)) and all(is_known(cell) or is_moment(cell) for cell in cells):
        named = [part.strip() for part in (comment.split(separator) if comment else [])]
        return (line, text), named if len(named) == len(first) else [], rows
    units = [cell.strip() for cell in rows[1][1]] if len(rows) > 2 else []
    wordy = (
        bool(units)
        and len(units) == len(cells)
        and not any(is_known(unit) or _is_marked(unit) for unit in units if unit)
    )
    if wordy and any(units) and all(is_known(cell) or is_moment(cell) for cell in rows[2][1]):
        named = [f"{n} ({u})" if u else n for n, u in zip(cells, units, strict=True)]
        return (line, text), named, rows[2:]
    return (line, text), cells, rows[1:]


def between_thousands(cells: Sequence[str]) -> int | None:
    """The first of numbers, such as 1.250, whose point may stand between thousands; None where none may.

    Others, such as 808, have no decimals, and none has one, two or more than three.
    """
    written = [cell.strip() for cell in cells if not is_missing(cell)]
    if not all(map(_WHOLE.fullmatch, written)):
        return None
    hundreds = any("." not in cell and len(cell.lstrip("+-")) == 3 for cell in written)
    return next((i for i, cell in enumerate(cells) if "." in cell), None) if hundreds else None


def with_point(cell: str) -> str:
    """A cell that is a number with a decimal comma (and perhaps in %), with a point; others as they are."""
    return cell.replace(",", ".") if _COMMA.fullmatch(cell.strip("% ")) else cell


def without_thousands(text: str) -> str | None:
    """A number that has marks between thousands, such as 1.250,50 or 1'250.5, without; None of others."""
    found = _GROUPED.fullmatch(text)
    return None if found is None else re.sub(r"[^-+\d]", "", found[1]) + (found[3] or "")


def is_comma(cell: str) -> bool:
    """Whether a cell is a number with a comma for its decimal mark, or for one between thousands."""
    return "," in cell and _COMMA.fullmatch(cell) is not None


def is_plain(cell: str) -> bool:
    """Whether a cell is a number, with a decimal point or comma, or a date."""
    text = cell.strip()
    return is_number(text) or _COMMA.fullmatch(text) is not None or is_moment(text)
