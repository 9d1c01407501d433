"""Tables as text: which encoding, what separates the fields, where the table begins, what its cells say."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from numbers import Real
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.records.columns import is_called_time, named_columns
from inputdesign_cli.records.moments import is_moment, moments_column
from inputdesign_cli.records.preparation import Preparation
from inputdesign_cli.records.sheet import Column, Sheet, unreadable

# What says that there is no value, with what sheets write in place of a number that they do not have.
_ERROR = re.compile(
    r"#(N/A|DIV/0!|VALUE!|REF!|NAME\?|NUM!|NULL!|SPILL!|CALC!|GETTING_DATA|#+)", re.IGNORECASE
)
_MISSING = re.compile(rf"|nan|na|n/a|null|none|-|\?|{_ERROR.pattern}", re.IGNORECASE)
_UNIT = re.compile(
    r"\W*([munk]?(s|v|a|w|hz|m|g|l|n|pa|bar)|sec|min|h|d|c|f|deg[cfk]?|celsius|kelvin|percent|pct|mpa|psi|cm|rpm|"
    r"rad|samples?)?\W*|.*[%°/²³^℃℉].*",
    re.IGNORECASE,
)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?", re.ASCII)
# Numbers with marks between thousands, or with a unit in the same cell.
_MARKED = re.compile(
    r"[-+\u2212]?\d([\d.,'\u2019_ \u00a0\u202f]*\d)?\.?[ \u00a0\u202f]?[^\W\d]{0,5}[ \u00a0\u202f]?[%°]?"
)
# Whole numbers below a million, where a point may stand between thousands.
_WHOLE = re.compile(r"[+-]?(0|[1-9]\d{0,2}(\.\d{3})?)", re.ASCII)
_THOUSAND = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
_SAY = "say which with --decimal , or --decimal .; or write decimal points and nothing between thousands"


def is_number(cell: str) -> bool:
    """Return whether a cell is a finite number with a decimal point."""
    return _NUMBER.fullmatch(cell.strip()) is not None and bool(np.isfinite(float(cell)))


def is_comma(cell: str) -> bool:
    """Return whether a cell is a number with a comma in it."""
    return _COMMA.fullmatch(cell.strip("% ")) is not None


def is_missing(cell: str) -> bool:
    """Return whether a cell says that there is no value, or holds an error of a spreadsheet."""
    return _MISSING.fullmatch(cell.strip()) is not None


def is_error(cell: str) -> bool:
    """Return whether a cell holds an error of a spreadsheet, for example #N/A."""
    return _ERROR.fullmatch(cell.strip()) is not None


def is_unit(cell: str) -> bool:
    """Return whether a cell is a unit, or says that there is none."""
    return is_missing(cell) or _UNIT.fullmatch(cell.strip()) is not None


def is_plain(cell: str) -> bool:
    """Return whether a cell is a number, with a decimal point or comma, or a date."""
    return is_number(cell) or is_comma(cell) or is_moment(cell.strip())


def is_value(cell: str) -> bool:
    """Return whether a cell is a number, a date, or a number with marks or a unit that its column refuses."""
    return is_plain(cell) or _MARKED.fullmatch(cell.strip()) is not None


def decimal_of(cells: Sequence[str], *, between_commas: bool) -> str:
    """Return the decimal mark of numbers in cells: a comma where some have one, and none has a point.

    Args:
        between_commas: whether fields are separated by commas, and 1,234 in quotes may be a thousand.
    """
    bare = [cell.strip("% ") for cell in cells]
    commas = [cell for cell in bare if is_comma(cell)]
    if not commas or (between_commas and all(map(_THOUSAND.fullmatch, commas))):
        return "."
    return "." if any("." in cell and is_number(cell) for cell in bare) else ","


def column_of(cells: Sequence[str], decimal: str = ".", *, stated: bool = False) -> Column:
    """Return the numbers, or the dates and times, that cells hold.

    Args:
        decimal: the decimal mark; `stated`: the user says so.
    """
    import pandas

    texts = [cell.strip().replace("\u2212", "-") for cell in cells]
    if all(text.endswith("%") or is_missing(text) for text in texts):
        texts = [text.rstrip("% ") for text in texts]
    plain = [text.replace(",", ".") if decimal == "," and is_comma(text) else text for text in texts]
    numbers = pandas.to_numeric(pandas.Series(plain, dtype=object), errors="coerce").to_numpy(
        dtype=float, copy=True
    )
    numbers[~np.isfinite(numbers)] = np.nan
    row = next((int(i) for i in np.flatnonzero(np.isnan(numbers)) if not is_missing(plain[i])), None)
    pointed = [i for i, text in enumerate(texts) if "." in text and is_number(text)]
    if decimal == "," and stated and pointed:
        wrong, row = "has a point, and --decimal says that commas are the decimal marks", pointed[0]
    elif row is None and not stated and (decimal == "," or pointed) and _like_thousands(plain):
        wrong = "may have a mark between thousands, or three decimals"
        row = next(i for i, text in enumerate(plain) if "." in text)
    elif row is None:
        return Column(numbers)
    elif is_comma(texts[row]):
        wrong = "has a comma, which may be a decimal mark or stand between thousands"
    else:
        dates = moments_column(["" if is_missing(text) else text for text in texts])
        return dates or Column(numbers, (row, texts[row]))
    return Column(numbers, (row, texts[row]), wrong, _SAY)


def _like_thousands(texts: Sequence[str]) -> bool:
    """Return whether points may stand between thousands, as in 1.250: others, like 808, have no decimals."""
    there = [text for text in texts if not is_missing(text)]
    hundreds = any("." not in text and len(text.lstrip("+-")) == 3 for text in there)
    return hundreds and any("." in text for text in there) and all(map(_WHOLE.fullmatch, there))


def in_stated_form(sheet: Sheet, cells: Sequence[Sequence[str]], given: Preparation) -> Sheet:
    """Return the sheet with times read in the form that the user states: of the named column, or of any.

    Raises:
        DataError: `data-not-a-number`, no column holds times in this form.
    """
    if given.time_format is None:
        return sheet
    own = given.columns.get("time", "").strip().lower()
    named = named_columns(sheet, own) if own else []
    likely = named or [
        i
        for i, column in enumerate(sheet.columns)
        if column.fault is not None or column.dated or is_called_time(sheet.name_of(i))
    ]
    columns = dict(enumerate(sheet.columns))
    read = {}
    for i in likely:
        texts = ["" if is_missing(cell) else cell.strip().removesuffix(".0") for cell in cells[i]]
        found = moments_column(texts, given.time_format)
        if found is not None and found.dated:
            read[i] = found
    if read:
        return replace(sheet, columns=tuple((columns | read).values()))
    message = f"no column of {sheet.path.name} holds times in the form {given.time_format}"
    hint = "mind its marks and digits, name the column (--columns time=NAME), or leave --time-format out"
    raise sheet.error("data-not-a-number", message, hint, 0)


def written_out(values: NDArray) -> list[str]:
    """Return numbers, dates, lengths of time or text as cells of text, numbers with a decimal point."""
    if values.dtype.kind == "m":
        values = values / np.timedelta64(1, "s")
    if values.dtype.kind in "fiub":
        return [repr(value) for value in values.astype(float).tolist()]
    return [_cell(value) for value in values]


def _cell(value: object) -> str:
    if value is None or str(value) in ("nan", "NaT", "<NA>"):
        return ""
    return repr(float(value)) if isinstance(value, Real) else " ".join(str(value).replace('"', " ").split())


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
_SAID = {"tab": "\t", "\\t": "\t", "blank": None, " ": None}
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
    separator = _SAID.get(given.separator, given.separator) if given.separator else _separator_of(text)
    rows, passed, comment = _rows_of(path, key, text, separator)
    filled = [i for i, (_, row) in enumerate(rows) if any(map(str.strip, row))]
    rows = rows[filled[0] : filled[-1] + 1] if filled else []
    head, names, body = _headed(rows, comment, separator)
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
    decimal = given.decimal or decimal_of(every, between_commas=separator == ",")
    columns = tuple(column_of(column, decimal, stated=bool(given.decimal)) for column in cells)
    # Messages may show what is a table of numbers, and no secret.
    some = every[:: max(len(every) // 10**4, 1)]
    dates = sum(one.dated for one in columns) / width
    shown = not every or sum(map(is_value, some)) / len(some) + dates >= 0.5
    lines = np.array([line for line, _ in body])
    texts = [(separator or " ").join(row) for _, row in body]
    sheet = Sheet(path, key, tuple(names), columns, lines, head, texts, shown)
    long = next((i for i, (_, row) in enumerate(body) if len(row) > width), None)
    if long is not None:
        message = f"line {body[long][0]} has {len(body[long][1])} fields, and the header {width}"
        raise sheet.error("data-extra-field", message, _EXTRA, long)
    return in_stated_form(sheet, cells, given)


def _separator_of(text: str) -> str | None:
    """Return what stands between the fields: that by which most cells are values, then most rows alike."""
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
    """Return line numbers and fields of the rows, the other lines by kind, and the last comment above."""
    rows, passed, comment = Rows(), list[tuple[int, str]](), ""
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
    """Return every line or, where fields in quotes have several, its last one, and its fields."""
    lines, begun, rows = text.splitlines(), 1, Rows()
    if separator is None:
        return [(number, line.split()) for number, line in enumerate(lines, start=1)]
    # Behind a quote that is never closed this is no separate row.
    ended = io.StringIO("\n".join([*lines, "\x00"]), newline="")
    reader = csv.reader(ended, delimiter=separator, strict=True)
    what, hint = (
        "a quote that opens there is never closed",
        "close it, or take it out; numbers need no quotes",
    )
    try:
        for row in reader:
            rows.append((reader.line_num, row))
            begun = reader.line_num + 1
        if rows.pop()[1] == ["\x00"]:
            return rows
    except csv.Error as error:
        what, hint = (what, hint) if '"' in lines[begun - 1] else (str(error), "keep one sample a line")
    raise unreadable(path, key, f"is no CSV file from line {begun} on: {what}", hint, begun)


def _headed(rows: Rows, comment: str, separator: str | None) -> tuple[tuple[int, str], list[str], Rows]:
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
        named = [part.strip() for part in (comment.split(separator) if comment else [])]
        return head, named if len(named) == len(first) else [], rows[begin:]
    if units:
        row = [cell.strip() for cell in rows[begin + 1][1]]
        cells = [f"{name} ({unit})" if unit else name for name, unit in zip(cells, row, strict=True)]
    return head, cells, rows[begin + 1 + units :]


def _table_begins(rows: Rows) -> tuple[int, bool]:
    """Return the row where the table begins, its names if it has any, and whether a row of units follows."""

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
    if not of_words(first - 1):  # nothing above, or a header of another width
        return (first if first > 1 and any(len(row) != width for _, row in rows[:first]) else 0), False
    # Sheets fill every row up to the width of the table with nothing: names are there for all columns.
    above, below = (all(map(str.strip, rows[at][1])) for at in (first - 2, first - 1))
    two = of_words(first - 2) and above
    two = two and (first == 2 or not below or all(map(is_unit, rows[first - 1][1])))
    plain = all(is_missing(cell) or is_plain(cell) for cell in rows[first][1])
    return first - 1 - two, two and plain and any(map(str.strip, rows[first - 1][1]))
