"""Tables over frequency that a spec names: an admissible error, a density, a bound on one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.errors import DataError, Diagnostic
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.header import build_units
from inputdesign_cli.tasks.build.tables import read_columns


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
    return DataError(Diagnostic("bad-table", f"{spec.resolve_path(name).name}: {message}", hint, key))
