"""The table of a spectrum under `spectrum.given`, read and checked."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.errors import DataError, Diagnostic
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.spectrum import GivenTable
from inputdesign_cli.tasks.build.tables import Array, read_columns

_KEY = "spectrum.given.file"


def read_spectrum_table(spec: Spec, given: GivenTable, names: Sequence[str]) -> dict[str, Array]:
    """Columns `frequency` (rad per time unit) and `names`, each (n,).

    Raises:
        DataError: the file cannot be read, or its frequencies make no table (`bad-table`).
    """
    path = spec.resolve_path(given.file)
    columns = read_columns(path, {"frequency": "frequency", **{name: name for name in names}}, key=_KEY)
    frequency = columns["frequency"]
    if frequency.size < 2 or np.any(np.diff(frequency) <= 0) or frequency[0] < 0:
        message = "the frequencies must be nonnegative and increase from row to row"
        raise bad_table(spec, given, message, "sort the rows")
    if frequency[-1] > spec.nyquist * (1 + 1e-4):
        message = f"it reaches {frequency[-1]:g} rad/{spec.time_unit}, beyond the Nyquist frequency"
        raise bad_table(spec, given, message, "frequencies end at pi/sample_time")
    return columns


def bad_table(spec: Spec, given: GivenTable, message: str, hint: str) -> DataError:
    """The diagnostic about a table that cannot be a spectrum."""
    name = spec.resolve_path(given.file).name
    return DataError(Diagnostic("bad-table", f"{name}: {message}", hint, _KEY, spec.locate(_KEY)))
