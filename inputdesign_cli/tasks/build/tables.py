"""Data files that a spec names: columns of numbers, read with diagnostics that name the line."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError, Diagnostic, Location
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.header import build_units

Array = NDArray[np.float64]
_MOST_BYTES = 100 * 2**20


def read_columns(path: Path, wanted: dict[str, str], *, key: str) -> dict[str, Array]:
    """The wanted columns of a CSV file with a header line: role -> (n,).

    Args:
        wanted: role -> its header, or how that begins; `frequency` also finds `frequency_rad_per_s`.
        key: the key of the spec that names the file, for diagnostics.

    Raises:
        DataError: `data-unreadable`, `data-missing-column` or `data-not-a-number`.
    """
    rows = _rows(path, key)
    header = [name.strip().lower() for name in rows[0][1]]
    found = {role: _named(header, start.lower()) for role, start in wanted.items()}
    wrong = [
        _unclear(path, key, rows[0][1], what, [wanted[role] for role in roles])
        for what, roles in (
            ("no column", [role for role, at in found.items() if not at]),
            ("several columns", [role for role, at in found.items() if len(at) > 1]),
        )
        if roles
    ]
    if wrong:
        raise DataError(wrong)
    return {
        role: np.array([_number(path, key, line, row, at, header[at]) for line, row in rows[1:]])
        for role, (at,) in found.items()
    }


def _named(header: list[str], start: str) -> list[int]:
    """The columns of this name, otherwise those whose names begin with it: u1 is not u10."""
    exact = [i for i, name in enumerate(header) if name == start]
    return exact or [
        i
        for i, name in enumerate(header)
        if name.startswith(start) and not (start[-1].isdigit() and name[len(start)].isdigit())
    ]


def _unclear(path: Path, key: str, header: list[str], what: str, names: list[str]) -> Diagnostic:
    hint = f"name one column {' and one '.join(names)}"
    if names == ["frequency"]:
        hint += ", such as frequency_rad_per_s"
    if len(header) == 1 and any(mark in header[0] for mark in ";\t|"):
        hint = "separate the columns with commas, and write numbers with a decimal point"
    return Diagnostic(
        "data-missing-column",
        f"{path.name} has {what} for {', '.join(names)} (its header is: {', '.join(header)})",
        hint,
        key,
        Location(str(path), 1, 1, ",".join(header)),
    )


def has_column(path: Path, start: str, *, key: str) -> bool:
    """Whether some header of a CSV file begins like this.

    Raises:
        DataError: `data-unreadable`.
    """
    return any(name.strip().lower().startswith(start) for name in _rows(path, key)[0][1])


def _rows(path: Path, key: str) -> list[tuple[int, list[str]]]:
    """The rows that are not empty with their line numbers, at least a header and one row."""
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise _unreadable(path, key, "is larger than 100 MiB", "keep to what the design needs")
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = [
                (number, row) for number, row in enumerate(csv.reader(file), 1) if any(map(str.strip, row))
            ]
    except FileNotFoundError:
        hint = "paths are relative to the folder of the spec" if key else "check the name and the folder"
        raise _unreadable(path, key, "does not exist", hint) from None
    except IsADirectoryError:
        raise _unreadable(path, key, "is a folder", "name a CSV file") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise _unreadable(path, key, f"cannot be read ({error})", "name a CSV file in UTF-8") from None
    if len(rows) < 2:
        raise _unreadable(path, key, "holds no rows of numbers", "write a header line and rows below it")
    return rows


def _number(path: Path, key: str, line: int, row: list[str], column: int, name: str) -> float:
    text = row[column].strip() if column < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise DataError.because(
            "data-not-a-number",
            f"{text!r} in column {name} is not a finite number"
            if text
            else f"a number is missing in column {name}",
            "write plain numbers with a decimal point, one row a line",
            key,
            Location(str(path), line, 1, ",".join(row)),
        )
    return value


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
