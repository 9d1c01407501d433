"""Single cells of a table: numbers, numbers with a unit beside them, and what says that there is none."""

from __future__ import annotations

import math
import re

from inputdesign_cli.specification.yaml.scalars import plain_number

_MISSING = frozenset({"", "nan", "na", "n/a", "null", "none", "-", "?"})
# What sheets write in place of a number that they do not have.
_ERRORS = re.compile(
    r"#(?:N/A|DIV/0!|VALUE!|REF!|NAME\?|NUM!|NULL!|SPILL!|CALC!|GETTING_DATA|#+)", re.IGNORECASE
)
_UNITS = frozenset(
    re.findall(
        r"\w+",
        "s sec ms us min h d v mv kv a ma w kw hz khz k c f degc degf degk celsius kelvin percent pct pa kpa "
        "mpa bar mbar psi m mm cm um n nm kg g rpm rad deg l ml sample samples",
    )
)
_SYMBOLS = re.compile(r"[%°/²³^℃℉]")
_MEASURED = re.compile(r"([-+]?[\d.,]+(?:[eE][-+]?\d+)?)\s*([^\W\d_][^\s,;|]*|[%°℃℉][^\s,;|]*)", re.ASCII)
# The minus sign of Unicode before a number or in its exponent, not between two words or numbers.
_MINUS = re.compile(r"(?:(?<![\w.])|(?<=\d[eE]))\u2212(?=[.,]?\d)", re.ASCII)
# What programs in Fortran write in place of 1.0e+00.
_FORTRAN = re.compile(r"(?<![\w.])([-+]?(?:\d+[.,]\d*|[.,]\d+))[dD]([-+]?\d{1,3})(?![\w.])", re.ASCII)


def in_plain_signs(text: str) -> str:
    """A text whose numbers such as 1.0D+00 have the exponents, and negative ones the sign, of all others."""
    text = _MINUS.sub("-", text) if "\u2212" in text else text
    return _FORTRAN.sub(r"\1e\2", text) if "D" in text or "d" in text else text


def measured(cell: str) -> tuple[str, str] | None:
    """The number and the unit of a cell that holds both, such as `1.0 V` or `5%`; None of others."""
    found = _MEASURED.fullmatch(cell.strip())
    if found is None or not is_number(found[1].replace(",", ".")) or not is_unit(found[2]):
        return None
    return found[1], found[2]


def is_unit(cell: str) -> bool:
    """Whether a cell is a unit, or says that there is none."""
    bare = cell.strip().strip("()[]").lower()
    return bare in _MISSING or bare in _UNITS or _SYMBOLS.search(bare) is not None


def is_known(text: str) -> bool:
    """Whether a cell is a number, or says that there is none."""
    return is_number(text) or is_missing(text)


def is_missing(text: str) -> bool:
    """Whether a cell says that there is no number."""
    bare = text.strip()
    return bare.lower() in _MISSING or is_error(bare)


def is_error(text: str) -> bool:
    """Whether a cell is an error of a sheet, such as #N/A, in place of a number."""
    return _ERRORS.fullmatch(text.strip()) is not None


def is_number(text: str) -> bool:
    """Whether a text is a finite number."""
    try:
        return math.isfinite(plain_number(text))
    except ValueError:
        return False
