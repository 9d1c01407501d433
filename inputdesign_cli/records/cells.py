"""What the cells of a table say: numbers, or that there is no value."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from inputdesign_cli.records.moments import is_moment, moments_column
from inputdesign_cli.records.sheet import Column

# What says that there is no value, with what sheets write in place of a number that they do not have.
ERROR = re.compile(
    r"\s*#(N/A|DIV/0!|VALUE!|REF!|NAME\?|NUM!|NULL!|SPILL!|CALC!|GETTING_DATA|#+)\s*", re.IGNORECASE
)
_MISSING = re.compile(rf"|nan|na|n/a|null|none|-|\?|{ERROR.pattern}", re.IGNORECASE)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?", re.ASCII)
# Numbers with marks between thousands, or with a unit in the same cell.
_MARKED = re.compile(r"[-+\u2212]?([\d.,'\u2019_ \u00a0\u202f]*\d)\.?\s?[^\W\d]{0,5}\s?[%°]?")
# Whole numbers below a million, where a mark may stand between thousands.
_WHOLE = re.compile(r"[+-]?(0|[1-9]\d{0,2}(\.\d{3})?)", re.ASCII)
_THOUSAND = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
_SAY = "say which with --decimal , or --decimal .; or write decimal points and nothing between thousands"


def is_missing(cell: str) -> bool:
    """Return whether a cell says that there is no value, or holds an error of a spreadsheet."""
    return _MISSING.fullmatch(cell.strip()) is not None


def is_plain(cell: str) -> bool:
    """Return whether a cell is a number, with a decimal point or comma, or a date."""
    bare = cell.strip()
    return _is_number(bare) or _COMMA.fullmatch(bare) is not None or is_moment(bare)


def is_value(cell: str) -> bool:
    """Return whether a cell is a number, a date, or a number with marks or a unit that its column refuses."""
    return is_plain(cell) or _MARKED.fullmatch(cell.strip()) is not None


def _is_number(cell: str) -> bool:
    return _NUMBER.fullmatch(cell) is not None and math.isfinite(float(cell))


def decimal_of(cells: Sequence[str], *, between_commas: bool) -> str:
    """Return the decimal mark of numbers in cells: a comma where some have one, and none has a point.

    Args:
        between_commas: whether fields are separated by commas, and 1,234 in quotes may be a thousand.
    """
    bare = [cell.strip() for cell in cells]
    commas = [cell for cell in bare if _COMMA.fullmatch(cell)]
    if not commas or (between_commas and all(map(_THOUSAND.fullmatch, commas))):
        return "."
    return "." if any("." in cell and _is_number(cell) for cell in bare) else ","


def column_of(cells: Sequence[str], decimal: str = ".", *, stated: bool = False) -> Column:
    """Return the numbers, or the dates and times, that cells hold.

    Args:
        decimal: the decimal mark; `stated`: the user says so.
    """
    import pandas

    texts = [cell.strip().replace("\u2212", "-") for cell in cells]
    commas = [_COMMA.fullmatch(text) is not None for text in texts]
    points = ["." in text and _is_number(text) for text in texts]
    plain = texts
    if decimal == ",":
        plain = [text.replace(",", ".") if own else text for text, own in zip(texts, commas, strict=True)]
    numbers = np.array(pandas.to_numeric(pandas.Series(plain, dtype=object), errors="coerce"), dtype=float)
    numbers[~np.isfinite(numbers)] = np.nan
    others, wrong = commas if decimal == "." else points, "has another decimal mark than --decimal says"
    if not stated:
        wrong = "may have a decimal mark, or a mark between thousands"
        others = _like_thousands(plain) if not any(others) else others
    if any(others):
        row = others.index(True)
        return Column(numbers, (row, texts[row]), wrong, _SAY)
    odd = [i for i in np.flatnonzero(np.isnan(numbers)).tolist() if not is_missing(texts[i])]
    if not odd:
        return Column(numbers)
    dates = moments_column(["" if is_missing(text) else text for text in texts])
    return dates or Column(numbers, (odd[0], texts[odd[0]]))


def _like_thousands(texts: Sequence[str]) -> list[bool]:
    """Return which numbers may be thousands, as 1.250 beside 808; none if some number has other decimals."""
    there = [text for text in texts if not is_missing(text)]
    hundreds = any("." not in text and len(text.lstrip("+-")) == 3 for text in there)
    whole = hundreds and all(map(_WHOLE.fullmatch, there))
    return [whole and "." in text for text in texts]
