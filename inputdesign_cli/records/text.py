"""Tables as text: which encoding, what separates the fields, where the table begins."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest

import numpy as np

from inputdesign_cli.records.cells import (
    ERROR,
    column_of,
    decimal_of,
    is_missing,
    is_plain,
    is_value,
    joined_clocks,
    moments_column,
)
from inputdesign_cli.records.columns import is_called_time, named_columns
from inputdesign_cli.records.sheet import Column, Sheet, Source

Rows = list[tuple[int, list[str]]]
_COMMENTS = ("#", "%", "//")
# Encodings that charset-normalizer tries if a text is neither UTF-8 nor, by its bytes, Windows-1252.
_OTHERS = ["utf_16", "utf_32", "utf_16_le", "utf_16_be", "cp932", "gb18030", "big5", "euc_kr", "cp1251"]
_CONTROL = re.compile("[\x00-\x08\x0e-\x1b\ufffd]")
_LOOKED_AT = 200
# The most columns of a sheet in a workbook: a longer line is no row of a table.
_MOST_FIELDS = 16_384
# Separators of fields; None stands for blanks. The first of equally good ones is taken.
_SEPARATORS = ("\t", ";", "|", None, ",")
_SAID = {"tab": "\t", "\\t": "\t", "blank": None, " ": None}
_EXTRA = (
    "write a name in the header for each column; if commas are decimal marks, not the decimal point, "
    "separate the columns with semicolons, or say --sep and --decimal"
)


def decoded(source: Source, raw: bytes) -> str:
    """Return the text in a file: in UTF-8, -16 or -32, Windows-1252, or what charset-normalizer finds.

    Raises:
        DataError: `data-unreadable`; it is no text.
    """
    zeros = b"\x00" in raw[:4096].rstrip(b"\x00\x1a")
    for encoding in () if zeros else ("utf-8-sig", "cp1252"):
        try:
            text = raw.decode(encoding).rstrip("\x00\x1a")
            break
        except UnicodeDecodeError:
            continue
    else:
        from charset_normalizer import from_bytes

        found = from_bytes(raw[: 2**20], cp_isolation=_OTHERS).best()
        text = raw.decode(found.encoding if found else "utf-8", errors="replace")
    if first := _CONTROL.search(text):
        line = len(f"{text[: first.start()]}|".splitlines())
        what = f"is no clean text: line {line} has a character that no text has (code {ord(first[0])})"
        hint = "take the line out, or save the file as UTF-8; files of other kinds have their usual endings"
        raise source.unreadable(what, hint, line)
    return text


def table_in(source: Source, text: str) -> Sheet:
    """Read the table in a text. Raises `DataError`: see `sheet_of`."""
    said = source.given.separator
    separator = _SAID.get(said, said) if said else _separator_of(text)
    rows, passed = _rows_of(source, text, separator)
    filled = [i for i, (_, row) in enumerate(rows) if any(map(str.strip, row))]
    rows = rows[filled[0] : filled[-1] + 1] if filled else []
    head, names, body = _headed(rows, separator)
    if names and all(len(row) == len(names) + 1 and not row[-1].strip() for _, row in body):
        body = [(line, row[:-1]) for line, row in body]  # every row ends with a separator
    sheet = sheet_of(source, head, names, body, separator)
    between = [line for line in passed if body[0][0] < line < body[-1][0]]
    # Blank lines between most rows mean nothing.
    return replace(sheet, passed=tuple(between) if 2 * len(between) <= len(body) else ())


def sheet_of(
    source: Source, head: tuple[int, str], names: Sequence[str], body: Rows, separator: str | None = "\t"
) -> Sheet:
    """Return the sheet with these rows of cells.

    Raises:
        DataError: `data-unreadable`, `data-extra-field`; `data-not-a-number`, no column has the stated form
            of times.
    """
    if not body:
        raise source.unreadable("holds no rows of numbers", "write a header line and rows below it")
    width, given = len(names) or max(len(row) for _, row in body), source.given
    if width > _MOST_FIELDS:
        raise source.unreadable(f"has more than {_MOST_FIELDS} columns", "write one sample a line")
    filled = (row + [""] * (width - len(row)) for _, row in body)  # no row may be as long as the header
    cells, clocks = joined_clocks([*zip_longest(*filled, fillvalue="")][:width])
    every = [cell for column in cells for cell in column if cell.strip()]
    decimal = given.decimal or decimal_of(every, between_commas=separator == ",")
    columns = [column_of(column, decimal, stated=bool(given.decimal)) for column in cells]
    # Messages may quote a table of numbers, but nothing that may be secret.
    some = every[:: max(len(every) // 10**4, 1)]
    shown = not every or 2 * sum(map(is_value, some)) >= len(some)
    lines = np.array([line for line, _ in body])
    texts = [(separator or " ").join(row) for _, row in body]
    sheet = Sheet(source, tuple(names), tuple(columns), lines, head, texts, shown)
    long = next((i for i, (_, row) in enumerate(body) if len(row) > width), None)
    if long is not None:
        message = f"line {body[long][0]} has {len(body[long][1])} fields, and the header {width}"
        raise sheet.error("data-extra-field", message, _EXTRA, long)
    if given.time_format is not None:
        _read_times(sheet, columns, cells, given.time_format)
    if clocks:
        done = f"{' and '.join(map(sheet.name_of, clocks))} were joined"
        columns[clocks[0]] = columns[clocks[1]] = replace(columns[clocks[0]], done=(done,))
    return replace(sheet, columns=tuple(columns))


def _read_times(sheet: Sheet, columns: list[Column], cells: Sequence[Sequence[str]], form: str) -> None:
    """Replace columns by times in the form that the user states: the named column, or any that has it."""
    own = sheet.source.given.columns.get("time", "").strip().lower()
    likely = [
        i for i, one in enumerate(columns) if one.fault or one.dated or is_called_time(sheet.name_of(i))
    ]
    found = False
    for i in (named_columns(sheet, own) if own else []) or likely:
        texts = ["" if is_missing(cell) else cell.strip().removesuffix(".0") for cell in cells[i]]
        read = moments_column(texts, form)
        columns[i], found = read or columns[i], found or read is not None
    if not found:
        message = f"no column of {sheet.path.name} holds times in the form {form}"
        hint = "mind its marks and digits, name the column (--columns time=NAME), or leave --time-format out"
        raise sheet.error("data-not-a-number", message, hint, 0)


def _separator_of(text: str) -> str | None:
    """Return what stands between the fields: that by which most cells are values, then most rows alike."""
    used = [line for line in text.splitlines() if line.strip() and not line.strip().startswith(_COMMENTS)]
    sample = used[:_LOOKED_AT] + used[_LOOKED_AT:][-_LOOKED_AT:]

    def rank(mark: str | None) -> tuple[int, int]:
        quoted = mark is not None and '"' in text
        rows = [*csv.reader(sample, delimiter=mark or ",")] if quoted else [one.split(mark) for one in sample]
        values = sum(is_value(cell) for row in rows if len(row) > 1 for cell in row[:_LOOKED_AT])
        return values, max(Counter(map(len, rows)).values(), default=0)

    # Blanks may stand within fields that tabs separate.
    marks = [mark for mark in _SEPARATORS if mark or not all("\t" in line for line in sample)]
    try:
        best = max(marks, key=rank)
        return best if rank(best)[0] else next((m for m in "\t;" if used and m in used[0].strip()), ",")
    except csv.Error:  # a field beyond all bounds
        return ","


def _rows_of(source: Source, text: str, separator: str | None) -> tuple[Rows, list[int]]:
    """Return rows with their lines, and the lines passed over: blank ones and comments."""
    rows, passed = Rows(), list[int]()
    for line, row in _split(source, text, separator):
        blank = len(row) < 2 and not any(map(str.strip, row))
        if blank or (row[0].lstrip().startswith(_COMMENTS) and not ERROR.fullmatch(row[0])):
            passed.append(line)
        else:
            rows.append((line, row))
    return rows, passed


def _split(source: Source, text: str, separator: str | None) -> Rows:
    """Return every line or, where fields in quotes have several, its last one, and its fields."""
    lines = text.splitlines()
    if separator is None:
        return [(number, line.split()) for number, line in enumerate(lines, start=1)]
    reader, rows = csv.reader(lines, delimiter=separator, strict=True), Rows()
    try:
        for row in reader:
            rows.append((reader.line_num, row))
    except csv.Error as error:
        begun = rows[-1][0] + 1 if rows else 1
        what, hint = str(error), "keep one sample a line"
        if '"' in lines[begun - 1]:
            what, hint = "a quote that opens there is never closed", "close it, or take it out"
        raise source.unreadable(f"is no CSV file from line {begun} on: {what}", hint, begun) from None
    return rows


def _headed(rows: Rows, separator: str | None) -> tuple[tuple[int, str], list[str], Rows]:
    """Return line and text of the header, the names (empty if there are none), and the rows below.

    Loggers write other lines above the table. A row of units below the names joins them: `valve` over `%` is
    `valve (%)`.
    """
    if not rows:
        return (1, ""), [], []
    begin, units = _table_begins(rows)
    line, first = rows[begin]
    head, cells = (line, (separator or " ").join(first)), [" ".join(cell.split()) for cell in first]
    if any(map(is_plain, cells)) and all(is_plain(cell) or is_missing(cell) for cell in cells):
        return head, [], rows[begin:]
    if units:
        row = [cell.strip() for cell in rows[begin + 1][1]]
        cells = [f"{name} ({unit})" if unit else name for name, unit in zip(cells, row, strict=True)]
    return head, cells, rows[begin + 1 + units :]


def _table_begins(rows: Rows) -> tuple[int, bool]:
    """Return the row where the table begins, with names if it has any, and whether a row of units follows."""

    def of_values(row: Sequence[str]) -> bool:
        filled = [cell for cell in row if cell.strip()]
        return bool(filled) and len(filled) <= 2 * sum(map(is_value, filled))

    def of_words(at: int) -> bool:
        return at >= 0 and len(rows[at][1]) == width and not any(map(is_plain, rows[at][1]))

    sample = rows[:_LOOKED_AT] + rows[_LOOKED_AT:][-_LOOKED_AT:]
    widths = Counter(len(row) for _, row in sample if of_values(row))
    if not widths:
        return 0, False
    width = widths.most_common(1)[0][0]
    first = next(i for i, (_, row) in enumerate(rows) if len(row) == width and of_values(row))
    above = first - 1
    while above > 0 and len(rows[above][1]) < width and of_values(rows[above][1]):  # rows that lack a field
        above -= 1
    if not of_words(above):  # nothing above, or a header of another width
        return (first if first > 1 and any(len(row) != width for _, row in rows[:first]) else 0), False
    # Names stand above all columns; sheets fill other lines above a table with empty cells.
    plain = all(is_missing(cell) or is_plain(cell) for cell in rows[first][1])
    two = of_words(above - 1) and all(map(str.strip, rows[above - 1][1]))
    return above - two, two and plain
