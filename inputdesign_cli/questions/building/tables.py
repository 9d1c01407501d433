"""Data files that a spec names: columns of numbers, read with diagnostics that name the line."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError, Diagnostic
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.column_hints import columns_option
from inputdesign_cli.tasks.build.extremes import check_range
from inputdesign_cli.tasks.build.files import Sheet, read_sheet
from inputdesign_cli.tasks.build.files.dates import AS_DATES
from inputdesign_cli.tasks.build.files.layout import BLANK, LEFT_OUT
from inputdesign_cli.tasks.build.files.naming import named_columns, time_columns
from inputdesign_cli.tasks.build.files.sheet import Column
from inputdesign_cli.questions.building.header import build_units

Array = NDArray[np.float64]

_MOSTLY, _EVENLY = 0.9, 0.01
_LARGEST = 1e40  # as of other numbers in a spec


def read_columns(path: Path, wanted: Mapping[str, str], *, key: str) -> dict[str, Array]:
    """The wanted columns of a data file: role -> (n,), without gaps.

    Args:
        wanted: role -> its header, or how that begins; `frequency` also finds `frequency_rad_per_s`.
        key: the key of the spec that names the file, for diagnostics.

    Raises:
        DataError: `data-unreadable`, `data-missing-column`, `data-extra-field` or `data-not-a-number`.
    """
    sheet = read_sheet(path, key=key)
    found = columns_of(sheet, wanted)
    for role, numbers in found.items():
        missing = np.flatnonzero(np.isnan(numbers))
        if missing.size:
            message = f"a number is missing in column {wanted[role]}"
            hint = "write plain numbers with a decimal point, one row a line"
            raise DataError(sheet.error("data-not-a-number", message, hint, int(missing[0])))
    return found


def read_samples(path: Path, wanted: Mapping[str, str], *, key: str) -> dict[str, Array]:
    """The same of a signal, in which no sample may be missing, not even between its rows.

    Raises:
        DataError: see `read_columns`; `data-not-a-number`, a blank line, or a row commented out, in between;
            `beyond-precision`.
    """
    sheet = read_sheet(path, key=key)
    for line, kind in sheet.passed:
        if kind in LEFT_OUT:
            what = "is blank" if kind == BLANK else "is commented out"
            message = f"line {line} of {path.name} {what}: is a sample missing between the rows about it?"
            row = int(np.searchsorted(sheet.lines, line)) - 1
            raise DataError(sheet.error("data-not-a-number", message, "take the line out of the file", row))
    found = read_columns(path, wanted, key=key)
    for role, numbers in found.items():
        check_range(sheet, wanted[role], numbers)
    return found


def columns_of(
    sheet: Sheet, wanted: Mapping[str, str], said: Mapping[str, str] | None = None
) -> dict[str, Array]:
    """The wanted columns, see `read_columns`; NaN where a cell is empty.

    Args:
        said: what the user says besides, by role, for hints.

    Raises:
        DataError: `data-missing-column` or `data-not-a-number`.
    """
    found = {role: named_columns(sheet, start.strip().lower()) for role, start in wanted.items()}
    wrong = [
        _unclear(sheet, what, {role: wanted[role] for role in roles})
        for what, roles in (
            ("no column", [role for role, at in found.items() if not at]),
            ("several columns", [role for role, at in found.items() if len(at) > 1]),
        )
        if roles
    ]
    if wrong:
        raise DataError(wrong)
    for (at,) in found.values():
        same = [other for other in found if found[other] == [at]]
        if len(same) > 1:
            message = f"{' and '.join(same)} are the same column of {sheet.path.name}"
            if sheet.shown and sheet.names:
                message += f": {sheet.names[at].strip()}"
            hint = (
                f"name another one for one of them: {columns_option(sheet, {**wanted, **(said or {})}, [])}"
            )
            raise DataError(sheet.error("data-missing-column", message, hint))
    for role, (at,) in found.items():
        fault = sheet.columns[at].fault
        if fault is not None:
            row, text = fault
            shown = repr(text) if sheet.shown else "a value"
            message = f"{shown} in column {wanted[role]} {sheet.columns[at].wrong}"
            raise DataError(sheet.error("data-not-a-number", message, sheet.columns[at].hint, row))
    return {role: sheet.columns[at].numbers for role, (at,) in found.items()}


def may_be_times(sheet: Sheet, taken: Collection[str]) -> list[str]:
    """What is said of columns not taken that may be times: they rise by even steps, or hold dates or text."""
    texts: dict[str, str] = {}
    told = []
    for i, column in enumerate(sheet.columns):
        name = sheet.names[i].strip() if i < len(sheet.names) else ""
        steps = np.diff(column.numbers[~np.isnan(column.numbers)])
        middle = float(np.median(steps)) if steps.size > 1 else 0.0
        even = middle > 0.0 and bool(np.mean(np.abs(steps - middle) < _EVENLY * middle) > _MOSTLY)
        called = name or f"column {i + 1}"
        if name.lower() in taken or str(i + 1) in taken:
            continue
        if column.fault is not None:
            texts |= {called: "text"} if column.words else {}
            continue
        if column.dated or even:
            what = "holds dates or times of day" if column.dated else "rises by even steps"
            told.append(f"{called} {what}: if it holds the times, add time={name or i + 1} to --columns")
    others = {**texts, **sheet.left_out}
    return [*told, *(f"{name} is not used: it holds {what}" for name, what in others.items())]


def column_named(sheet: Sheet, name: str) -> Column:
    """The first column of a name, or that of a number."""
    return sheet.columns[named_columns(sheet, name.strip().lower())[0]]


def read_header(path: Path, *, key: str) -> list[str]:
    """The names of the columns of a data file, in small letters.

    Raises:
        DataError: `data-unreadable`.
    """
    return read_sheet(path, key=key).header


def _unclear(sheet: Sheet, what: str, wanted: Mapping[str, str]) -> Diagnostic:
    """The error about columns, by role, of which there is none or several."""
    names = list(wanted.values())
    asked = {start.strip().lower(): role for role, start in wanted.items()}
    held = next((name for name in sheet.left_out if name.lower() in asked), None)
    if held is not None:
        return no_column(sheet, held, asked[held.lower()])
    hint = f"name one column {' and one '.join(names)}"
    said = [role for role, start in wanted.items() if not role.startswith(start)]
    if not sheet.key:
        times = time_columns(sheet)
        others = [name.strip() for name in sheet.names if name.strip().lower() not in times]
        called = others if sheet.shown and len(others) == len(names) and not said else ["NAME"] * len(names)
        channels = [role if role in said else start for role, start in wanted.items()]
        columns = ",".join(f"{channel}={column}" for channel, column in zip(channels, called, strict=True))
        quoted = f'"{columns}"' if " " in columns else columns
        hint += f", or say which it is: --columns {quoted} (or its number)"
        if said:
            hint = f"write --columns {quoted} with a name as it stands in the file, or with its number"
    if names == ["frequency"]:
        hint += ", such as frequency_rad_per_s"
    told = [f"{start} ({role})" if role in said else start for role, start in wanted.items()]
    message = f"{sheet.path.name} has {what} for {', '.join(told)}"
    if not sheet.names:
        message = f"{sheet.path.name} has no header that names {', '.join(told)}"
        message += f" (it has {len(sheet.columns)} columns)"
    elif sheet.shown:
        message += f" ({sheet.contents})"
    return sheet.error("data-missing-column", message, hint)


def no_column(sheet: Sheet, name: str, role: str) -> Diagnostic:
    """The error about what a file holds under a name, and what is no column of numbers."""
    message = f"{name} in {sheet.path.name} holds {sheet.left_out[name]}: "
    message += "times are numbers or dates" if role == "time" else "a signal is a column of real numbers"
    hint = "save it as an array of numbers, a sample in each row and a channel in each column"
    if role == "time":
        hint = AS_DATES
    return sheet.error("data-missing-column", message, hint)


def has_column(path: Path, start: str, *, key: str) -> bool:
    """Whether some header of a data file begins like this.

    Raises:
        DataError: `data-unreadable`.
    """
    return any(name.startswith(start) for name in read_header(path, key=key))


def read_frequency_table(
    spec: Spec, name: str, columns: Sequence[str], key: str, *, least: int = 2
) -> dict[str, Array]:
    """Columns `frequency`, in the unit of the experiment, and `columns`, each (n,), of `least` rows or more.

    Raises:
        DataError: the file cannot be read, or its frequencies do not rise from zero or more (`bad-table`).
    """
    wanted = {"frequency": "frequency", **{column: column for column in columns}}
    found = read_columns(spec.resolve_path(name), wanted, key=key)
    frequency = found["frequency"]
    if frequency.size < least or np.any(np.diff(frequency) <= 0) or frequency[0] < 0:
        message = "the frequencies must be nonnegative and increase from row to row"
        hint = f"sort the rows; there must be {'one' if least == 1 else 'two'} at least"
        raise bad_table(spec, name, message, hint, key)
    for column, values in found.items():
        size = np.abs(values)
        beyond = np.flatnonzero((size > _LARGEST) | ((size < 1.0 / _LARGEST) & (size > 0.0)))
        if beyond.size:
            message = f"{column} is {values[beyond[0]]:g} in row {beyond[0] + 2}"
            hint = f"numbers other than zero lie between {1.0 / _LARGEST:g} and {_LARGEST:g}"
            raise bad_table(spec, name, message, hint, key)
    return found | {"frequency": frequency * build_units(spec).frequency}


def bad_table(spec: Spec, name: str, message: str, hint: str, key: str) -> DataError:
    """The error about a table that can be read but not used."""
    return DataError.because("bad-table", f"{spec.resolve_path(name).name}: {message}", hint, key)
