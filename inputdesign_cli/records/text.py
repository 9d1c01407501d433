"""Tables as text: which encoding, what separates the fields, and where the table begins."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from inputdesign_cli.records.cells import (
    column_of,
    decimal_of,
    in_stated_form,
    is_comma,
    is_error,
    is_missing,
    is_number,
    is_plain,
    is_unit,
    is_value,
)
from inputdesign_cli.records.preparation import Preparation
from inputdesign_cli.records.sheet import Sheet, unreadable

Rows = list[tuple[int, list[str]]]
BLANK, COMMENT, COMMENTED = "blank", "a comment", "commented numbers"
_COMMENTS = ("#", "%", "//")
_MARKS = (
    *((codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"), (codecs.BOM_UTF16_LE, "utf-16")),
    *((codecs.BOM_UTF16_BE, "utf-16"), (codecs.BOM_UTF8, "utf-8-sig")),
)
# Asked of charset-normalizer where a text is neither UTF-8 nor, by its bytes, Windows-1252.
_OTHERS = ["utf_16_le", "utf_16_be", "cp932", "gb18030", "big5", "euc_kr", "euc_jp", "cp1251"]
# How archives, workbooks and arrays begin.
_BINARY = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"\x1f\x8b", b"BZh", b"\xfd7zXZ", b"\x93NUMPY")
_CONTROL = re.compile("[\x00-\x08\x0e-\x1b\ufffd]")
# Fewer bytes that are no ASCII are faults of a logger.
_HIGH, _FEW = bytes(range(128, 256)), 3
_LOOKED_AT = 200
# As many as a sheet of a workbook can have: a longer line is no row of a table.
_MOST_FIELDS = 16_384
# What may separate fields; None stands for blanks. Of equally good ones the first.
_SEPARATORS = ("\t", ";", "|", None, ",")
_EXTRA = (
    "write a name in the header for each column; if commas are decimal marks, not the decimal point, "
    "separate the columns with semicolons, or say --sep and --decimal"
)


def decoded(path: Path, key: str, raw: bytes) -> str:
    """Return the text in a file: in UTF-8, -16 or -32, Windows-1252, or what charset-normalizer finds.

    Raises:
        DataError: `data-unreadable`; it is no text.
    """
    marked = next((encoding for mark, encoding in _MARKS if raw.startswith(mark)), None)
    zeros = b"\x00" in raw[:4096].rstrip(b"\x00\x1a")
    for encoding in [marked] if marked else [] if zeros else ["utf-8", "cp1252"]:
        try:
            text = raw.decode(encoding).rstrip("\x00\x1a")
            break
        except UnicodeDecodeError:
            continue
    else:
        from charset_normalizer import from_bytes

        foreign = zeros or len(raw) - len(raw.translate(None, _HIGH)) > _FEW
        found = from_bytes(raw[: 2**20], cp_isolation=_OTHERS).best() if foreign and not marked else None
        text = raw.decode(found.encoding if found else marked or "utf-8", errors="replace")
    first = _CONTROL.search(text)
    if first is None:
        return text
    if raw.startswith(_BINARY) or len(_CONTROL.findall(text)) > max(_FEW, 0.01 * len(text)):
        hint = "unpack it, or save it as CSV; arrays have the ending .mat or .npz, tables .xlsx or .parquet"
        raise unreadable(path, key, "is no text", hint)
    line = len(f"{text[: first.start()]}|".splitlines())
    what = f"is no clean text: line {line} has a character that no text has (code {ord(first[0])})"
    raise unreadable(path, key, what, "take the line out, or save the file as UTF-8", line)


def read_text(path: Path, key: str, text: str, given: Preparation) -> Sheet:
    """Return the table in a text file.

    Raises:
        DataError: `data-unreadable`, `data-extra-field`.
    """
    said = {"tab": "\t", "\\t": "\t", "blank": None, " ": None}
    separator = said.get(given.separator, given.separator) if given.separator else _separator_of(text)
    rows, passed, comment = _rows_of(path, key, text, separator)
    filled = [i for i, (_, row) in enumerate(rows) if any(map(str.strip, row))]
    rows = rows[filled[0] : filled[-1] + 1] if filled else []
    head, names, body = _headed(rows[_table_begins(rows) :], comment, separator)
    if names and all(len(row) == len(names) + 1 and not row[-1].strip() for _, row in body):
        body = [(line, row[:-1]) for line, row in body]  # every row ends with a separator
    sheet = sheet_of(path, key, head, names, body, given, separator)
    # Blank lines between most rows mean nothing.
    between = [(line, kind) for line, kind in passed if body[0][0] < line < body[-1][0]]
    spaced = 2 * sum(kind == BLANK for _, kind in between) > len(body)
    return replace(sheet, passed=tuple(one for one in between if one[1] != BLANK or not spaced))


def sheet_of(
    path: Path,
    key: str,
    head: tuple[int, str],
    names: Sequence[str],
    body: Rows,
    given: Preparation,
    separator: str | None = "\t",
) -> Sheet:
    """Return the sheet with these rows of cells.

    Raises:
        DataError: `data-unreadable`, `data-extra-field`.
    """
    if not body:
        raise unreadable(path, key, "holds no rows of numbers", "write a header line and rows below it")
    width = len(names) or max(len(row) for _, row in body)
    cells = [[row[i] if i < len(row) else "" for _, row in body] for i in range(width)]
    every = [cell for column in cells for cell in column if cell.strip()]
    decimal, stated = (
        given.decimal or decimal_of(every, between_commas=separator == ","),
        bool(given.decimal),
    )
    columns = tuple(column_of(column, decimal, stated=stated) for column in cells)
    # Messages may show what is a table of numbers, and no secret.
    plain = (
        sum(map(is_value, every)) if len(every) < 10**4 else sum(is_number(c) or is_comma(c) for c in every)
    )
    shown = 2 * (plain + len(body) * sum(one.dated for one in columns)) >= max(len(every), 1)
    lines = np.array([line for line, _ in body])
    texts = [(separator or " ").join(row) for _, row in body]
    sheet = Sheet(path, key, tuple(names), columns, lines, head, texts, shown)
    long = next((i for i, (_, row) in enumerate(body) if len(row) > width), None)
    if long is not None:
        message = f"line {body[long][0]} has {len(body[long][1])} fields, and the header {width}"
        raise sheet.error("data-extra-field", message, _EXTRA, long)
    return in_stated_form(sheet, cells, given)


def _separator_of(text: str) -> str | None:
    """What stands between the fields: that by which most cells are values, then most rows alike."""
    used = [line for line in text.splitlines() if line.strip() and not line.strip().startswith(_COMMENTS)]
    sample = used[:_LOOKED_AT] + used[_LOOKED_AT:][-_LOOKED_AT:]

    def rank(mark: str | None) -> tuple[int, int]:
        rows = [line.split(mark) for line in sample]
        if mark is not None and '"' in text:
            rows = list(csv.reader(sample, delimiter=mark))
        values = sum(is_value(cell) for row in rows if len(row) > 1 for cell in row[:_LOOKED_AT])
        return values, max(Counter(map(len, rows)).values(), default=0)

    # Blanks may stand within fields that tabs separate.
    marks = [mark for mark in _SEPARATORS if mark or not all("\t" in line for line in sample)]
    try:
        best = max(marks, key=rank)
        return best if rank(best)[0] else next((m for m in "\t;" if used and m in used[0].strip()), ",")
    except csv.Error:  # a field beyond all bounds
        return ","


def _rows_of(
    path: Path, key: str, text: str, separator: str | None
) -> tuple[Rows, list[tuple[int, str]], str]:
    """Line numbers and fields of the rows, the other lines by kind, and the last comment above the rows."""
    rows: Rows = []
    passed: list[tuple[int, str]] = []
    comment = ""
    for line, row in _split(path, key, text, separator):
        if len(row) > _MOST_FIELDS:
            what = f"has a line of {len(row)} fields (line {line}), and at most {_MOST_FIELDS} are taken"
            raise unreadable(path, key, what, "write one sample a line", line)
        if len(row) < 2 and not any(map(str.strip, row)):
            passed.append((line, BLANK))
        elif row[0].lstrip().startswith(_COMMENTS) and not (len(row) > 1 and is_error(row[0])):
            bare = (separator or " ").join(row).lstrip("#%/ \t")
            cells = re.split(r"[;,\t ]+", bare) if len(row) == 1 else bare.split(separator)
            numbers = len(cells) > 1 and all(map(is_plain, filter(str.strip, cells)))
            passed.append((line, COMMENTED if numbers else COMMENT))
            comment = comment if rows else bare
        else:
            rows.append((line, row))
    return rows, passed, comment


def _split(path: Path, key: str, text: str, separator: str | None) -> Rows:
    """Every line or, where fields in quotes have several, its last one, and its fields."""
    lines, begun, rows = text.splitlines(), 1, []
    if separator is None:
        return [(number, line.split()) for number, line in enumerate(lines, start=1)]
    # Behind a quote that is never closed this is no separate row.
    reader = csv.reader(
        io.StringIO("\n".join([*lines, "\x00"]), newline=""), delimiter=separator, strict=True
    )
    try:
        for row in reader:
            rows.append((reader.line_num, row))
            begun = reader.line_num + 1
        if rows.pop()[1] == ["\x00"]:
            return rows
    except csv.Error as error:
        if "field larger" in str(error) and '"' not in lines[begun - 1]:
            what = f"is no table: line {begun} has a field of more than {csv.field_size_limit()} characters"
            raise unreadable(path, key, what, "keep one sample a line", begun) from None
    what = f"is no CSV file: a quote that opens in line {begun} is never closed"
    raise unreadable(path, key, what, "close it, or take it out; numbers need no quotes", begun)


def _table_begins(rows: Rows) -> int:
    """The row where the table begins, its names if it has any: loggers write other lines above it."""
    sample = rows[:_LOOKED_AT] + rows[_LOOKED_AT:][-_LOOKED_AT:]
    widths = Counter(len(row) for _, row in sample if _of_values(row))
    if not widths:
        return 0
    width = widths.most_common(1)[0][0]
    # Sheets fill every row up to the width of the table, with nothing.
    full = next((i for i, (_, row) in enumerate(sample) if len(row) == width and all(map(str.strip, row))), 0)
    if 0 < full < _LOOKED_AT and _of_words(rows[full][1], width):
        return full
    first = next(i for i, (_, row) in enumerate(rows) if len(row) == width and _of_values(row))
    names = [row for _, row in rows[max(first - 2, 0) : first] if _of_words(row, width)]
    if first < 2:
        return 0
    if not names or not _of_words(rows[first - 1][1], width):
        return first if any(len(row) != width for _, row in rows[:first]) else 0
    return first - 2 if len(names) == 2 and (first == 2 or all(map(is_unit, names[1]))) else first - 1


def _of_values(row: Sequence[str]) -> bool:
    filled = [cell for cell in row if cell.strip()]
    return bool(filled) and len(filled) <= 2 * sum(map(is_value, filled))


def _of_words(row: Sequence[str], width: int) -> bool:
    return len(row) == width and not any(map(is_plain, row))


def _headed(rows: Rows, comment: str, separator: str | None) -> tuple[tuple[int, str], list[str], Rows]:
    """Return line and text of the header, the names (empty if there are none), and the rows below.

    A row of units below the names joins them: `valve` over `%` is `valve (%)`.
    """
    if not rows:
        return (1, ""), [], []
    line, first = rows[0]
    head = (line, (separator or " ").join(first))
    cells = [" ".join(cell.split()) for cell in first]
    if any(map(is_plain, cells)) and all(is_plain(cell) or is_missing(cell) for cell in cells):
        named = [part.strip() for part in (comment.split(separator) if comment else [])]
        return head, named if len(named) == len(first) else [], rows
    units = [cell.strip() for cell in rows[1][1]] if len(rows) > 2 else []
    worded = any(units) and not any(is_missing(one) or is_value(one) for one in units if one)
    if worded and len(units) == len(cells) and all(is_missing(one) or is_plain(one) for one in rows[2][1]):
        return head, [f"{n} ({u})" if u else n for n, u in zip(cells, units, strict=True)], rows[2:]
    return head, cells, rows[1:]
