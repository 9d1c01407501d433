"""Data files that a spec names: columns of numbers, read with diagnostics that name the line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.specification import Spec

_LARGEST = 1e40  # number in a data file, as elsewhere in a spec


def read_columns(path: Path, wanted: Mapping[str, str], *, key: str) -> dict[str, Array]:
    """Return columns (n,) of a data file without gaps, by role; `wanted` has the beginnings of their headers.

    Raises `DataError`: `data-unreadable`, `data-missing-column`, `data-extra-field` or `data-not-a-number`.
    """
    from inputdesign_cli.records import read_sheet
    from inputdesign_cli.records.columns import columns_of

    sheet = read_sheet(path, key=key)
    found = columns_of(sheet, wanted)
    for role, numbers in found.items():
        missing = np.flatnonzero(np.isnan(numbers))
        if missing.size:
            message = f"a number is missing in column {wanted[role]}"
            hint = "write plain numbers with a decimal point, one row a line"
            raise sheet.error("data-not-a-number", message, hint, int(missing[0]))
    return found


def read_samples(
    path: Path, wanted: Mapping[str, str], *, key: str, units: Units | None = None
) -> dict[str, Array]:
    """Return the columns of a signal, in which no sample and no row may be missing.

    Raises `DataError`: see `read_columns`; `beyond-precision`; `data-not-uniform`, times are not of `units`.
    """
    from inputdesign_cli.records import read_sheet
    from inputdesign_cli.records.signals import check_range, check_sampled

    sheet = read_sheet(path, key=key)
    for line in sheet.passed:
        message = f"line {line} of {path.name} is blank or commented out: is a sample missing there?"
        row = int(np.searchsorted(sheet.lines, line)) - 1
        raise sheet.error("data-not-a-number", message, "take the line out of the file", row)
    found = read_columns(path, wanted, key=key)
    for role, numbers in found.items():
        check_range(sheet, wanted[role], numbers)
    if units is not None:
        check_sampled(sheet, units.sample_time, units.time_unit)
    return found


def has_column(path: Path, start: str, *, key: str) -> bool:
    """Return whether some header of a data file begins like this; `DataError` (`data-unreadable`)."""
    from inputdesign_cli.records import read_sheet

    return any(name.startswith(start) for name in read_sheet(path, key=key).header)


def read_frequency_table(
    spec: Spec, name: str, columns: Sequence[str], key: str, *, least: int = 2
) -> dict[str, Array]:
    """Return `columns`, and `frequency` in the unit of the experiment, of `least` rows or more.

    Raises `DataError`: the file cannot be read, or its frequencies do not rise from zero (`bad-table`).
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
        beyond = (size > _LARGEST) | ((size < 1.0 / _LARGEST) & (size > 0.0))
        hint = f"numbers other than zero lie between {1.0 / _LARGEST:g} and {_LARGEST:g}"
        check_rows(spec, name, column, values, beyond, "it is out of range", hint, key)
    return found | {"frequency": frequency * build_units(spec).frequency}


def check_rows(
    spec: Spec, name: str, column: str, values: Array, wrong: NDArray[np.bool_], why: str, hint: str, key: str
) -> None:
    """Raise `DataError` (`bad-table`) at the first row (of n) where a value is `wrong`, and say why."""
    for row in np.flatnonzero(wrong)[:1]:
        raise bad_table(spec, name, f"{column} is {values[row]:g} in row {row + 2}: {why}", hint, key)


def bad_table(spec: Spec, name: str, message: str, hint: str, key: str) -> DataError:
    """Return the error about a table that can be read but not used."""
    return DataError.because("bad-table", f"{spec.resolve_path(name).name}: {message}", hint, key)
