"""Data files that a spec names: columns of numbers, read with diagnostics that name the line."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError, Diagnostic, Location
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.header import build_units

Array = NDArray[np.float64]
_MOST_BYTES = 100 * 2**20
# How the files of .xlsx and .ods, and of .xls begin.
_SHEETS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")


@dataclass(frozen=True)
class _File:
    """The rows of a CSV file that are not empty, with their line numbers; the key that names it."""

    path: Path
    key: str
    rows: list[tuple[int, list[str]]]

    @property
    def header(self) -> list[str]:
        """The names of the columns."""
        return [name.strip().lower() for name in self.rows[0][1]]

    @property
    def shown(self) -> bool:
        """Whether messages may show what the file holds: it is a table of numbers, and no secret."""
        cells = [cell for _, row in self.rows[1:] for cell in row if cell.strip()]
        return 2 * sum(map(_is_number, cells)) >= max(len(cells), 1)

    def error(self, code: str, message: str, hint: str, line: int, row: list[str]) -> Diagnostic:
        """A diagnostic that points at a line."""
        text = ",".join(row) if self.shown else ""
        return Diagnostic(code, message, hint, self.key, Location(str(self.path), line, 1, text))


def read_columns(path: Path, wanted: dict[str, str], *, key: str) -> dict[str, Array]:
    """The wanted columns of a CSV file with a header line: role -> (n,).

    Args:
        wanted: role -> its header, or how that begins; `frequency` also finds `frequency_rad_per_s`.
        key: the key of the spec that names the file, for diagnostics.

    Raises:
        DataError: `data-unreadable`, `data-missing-column`, `data-extra-field` or `data-not-a-number`.
    """
    file = _read(path, key)
    found = {role: _named(file.header, start.lower()) for role, start in wanted.items()}
    wrong = [
        _unclear(file, what, [wanted[role] for role in roles])
        for what, roles in (
            ("no column", [role for role, at in found.items() if not at]),
            ("several columns", [role for role, at in found.items() if len(at) > 1]),
        )
        if roles
    ]
    if wrong:
        raise DataError(wrong)
    for line, row in file.rows[1:]:
        if len(row) > len(file.header):
            message = f"line {line} has {len(row)} fields, and the header {len(file.header)}"
            hint = "separate the columns with commas, and write numbers with a decimal point: 1.5, not 1,5"
            raise DataError(file.error("data-extra-field", message, hint, line, row))
    return {
        role: np.array([_number(file, line, row, at, wanted[role]) for line, row in file.rows[1:]])
        for role, (at,) in found.items()
    }


def read_times(path: Path, name: str, unit: float) -> Array:
    """The column of exactly this name as times (n,): numbers, or dates and times as ISO 8601 writes them.

    Args:
        unit: how many seconds the unit of the numbers has; dates become such numbers, the first of them 0.

    Raises:
        DataError: `data-not-a-number`.
    """
    file = _read(path, "")
    column = file.header.index(name)
    cells = [row[column].strip() if column < len(row) else "" for _, row in file.rows[1:]]
    try:
        moments = [] if _is_number(cells[0]) else [datetime.fromisoformat(cell) for cell in cells]
        if moments:
            return np.array([(moment - moments[0]).total_seconds() / unit for moment in moments])
    except (ValueError, TypeError):  # no dates, or some with and some without a time zone
        pass
    return np.array([_number(file, line, row, column, name) for line, row in file.rows[1:]])


def read_header(path: Path, *, key: str) -> list[str]:
    """The names of the columns of a CSV file, in small letters.

    Raises:
        DataError: `data-unreadable`.
    """
    return _read(path, key).header


def _named(header: list[str], start: str) -> list[int]:
    """The columns of this name, otherwise those whose names begin with it: u1 is not u10."""
    exact = [i for i, name in enumerate(header) if name == start]
    return exact or [
        i
        for i, name in enumerate(header)
        if name.startswith(start) and not (start[-1].isdigit() and name[len(start)].isdigit())
    ]


def _unclear(file: _File, what: str, names: list[str]) -> Diagnostic:
    line, header = file.rows[0]
    hint = f"name one column {' and one '.join(names)}"
    if names == ["frequency"]:
        hint += ", such as frequency_rad_per_s"
    if len(header) == 1 and any(mark in header[0] for mark in ";\t|"):
        hint = "separate the columns with commas, and write numbers with a decimal point"
    message = f"{file.path.name} has {what} for {', '.join(names)}"
    if all(_is_number(name) for name in header):
        message = f"{file.path.name} has no header line: its first line holds numbers"
        hint = f"begin the file with a line that names its columns, such as {','.join(names)}"
    elif file.shown:
        message += f" (its header is: {', '.join(header)})"
    return file.error("data-missing-column", message, hint, line, header)


def has_column(path: Path, start: str, *, key: str) -> bool:
    """Whether some header of a CSV file begins like this.

    Raises:
        DataError: `data-unreadable`.
    """
    return any(name.startswith(start) for name in read_header(path, key=key))


def _read(path: Path, key: str) -> _File:
    """A file with at least a header and one row."""
    try:
        raw = read_regular(path, _MOST_BYTES + 1)
        if len(raw) > _MOST_BYTES:
            raise _unreadable(path, key, "is larger than 100 MiB", "keep to what the design needs")
        if raw.startswith(_SHEETS):
            hint = "save the sheet as CSV (comma separated values, UTF-8), and name that file"
            raise _unreadable(path, key, "is a spreadsheet, no CSV file", hint)
        reader = csv.reader(io.StringIO(raw.decode("utf-8-sig"), newline=""))
        rows = [(reader.line_num, row) for row in reader if any(map(str.strip, row))]
    except FileNotFoundError:
        hint = "paths are relative to the folder of the spec" if key else "check the name and the folder"
        raise _unreadable(path, key, "does not exist", hint) from None
    except IsADirectoryError:
        raise _unreadable(path, key, "is a folder", "name a CSV file") from None
    except UnicodeDecodeError:
        raise _unreadable(path, key, "is not UTF-8", "name a CSV file in UTF-8") from None
    except (OSError, ValueError, csv.Error) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise _unreadable(path, key, f"cannot be read: {reason}", "name a CSV file in UTF-8") from None
    if len(rows) < 2:
        raise _unreadable(path, key, "holds no rows of numbers", "write a header line and rows below it")
    return _File(path, key, rows)


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _number(file: _File, line: int, row: list[str], column: int, name: str) -> float:
    text = row[column].strip() if column < len(row) else ""
    if _is_number(text):
        return float(text)
    message = f"{repr(text) if file.shown else 'a value'} in column {name} is not a finite number"
    if not text:
        message = f"a number is missing in column {name}"
    hint = "write plain numbers with a decimal point, one row a line"
    raise DataError(file.error("data-not-a-number", message, hint, line, row))


def _unreadable(path: Path, key: str, what: str, hint: str) -> DataError:
    return DataError.because("data-unreadable", f"the file {path} {what}", hint, key)


def read_frequency_table(spec: Spec, name: str, columns: Sequence[str], key: str) -> dict[str, Array]:
    """Columns `frequency`, in the unit of the experiment, and `columns`, each (n,).

    Raises:
        DataError: the file cannot be read, or its frequencies do not rise from zero or more (`bad-table`).
    """
    wanted = {"frequency": "frequency", **{column: column for column in columns}}
    found = read_columns(spec.resolve_path(name), wanted, key=key)
    frequency = found["frequency"]
    if frequency.size < 2 or np.any(np.diff(frequency) <= 0) or frequency[0] < 0:
        message = "the frequencies must be nonnegative and increase from row to row"
        raise bad_table(spec, name, message, "sort the rows; there must be two at least", key)
    return found | {"frequency": frequency * build_units(spec).frequency}


def bad_table(spec: Spec, name: str, message: str, hint: str, key: str) -> DataError:
    """The error about a table that can be read but not used."""
    return DataError.because("bad-table", f"{spec.resolve_path(name).name}: {message}", hint, key)
