"""Single cells of a table, and columns of them: numbers, dates, and what says that there is no value."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from numbers import Real

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.records.columns import is_called_time, named_columns
from inputdesign_cli.records.moments import is_moment, moments_column
from inputdesign_cli.records.preparation import Preparation
from inputdesign_cli.records.sheet import Column, Sheet

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
