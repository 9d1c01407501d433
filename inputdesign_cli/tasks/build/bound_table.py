"""`accuracy.model_error.table`: r_adm over frequency from a CSV file."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.accuracy import Table
from inputdesign_cli.errors import DataError, Diagnostic
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.tables import read_columns

_KEY = "accuracy.model_error.table"


def read_bound(
    spec: Spec, name: str, band: tuple[float, float], *, unit: float, column: str = "r_adm"
) -> Table:
    """The column `frequency` and one of r_adm, over the whole `band`.

    Args:
        band: in the unit of the experiment.
        unit: rad per time unit times this are frequencies of the experiment.

    Raises:
        DataError: the file cannot be read, or does not bound the error on the whole band (`bad-table`).
    """
    path = spec.resolve_path(name)
    columns = read_columns(path, {"frequency": "frequency", column: column}, key=_KEY)
    frequency, value = columns["frequency"], columns[column]

    def refuse(message: str, hint: str) -> DataError:
        return DataError(Diagnostic("bad-table", f"{path.name}: {message}", hint, _KEY, spec.locate(_KEY)))

    if np.any(np.diff(frequency) <= 0) or frequency[0] < 0:
        raise refuse("the frequencies must be nonnegative and increase from row to row", "sort the rows")
    if np.any(value <= 0):
        row = int(np.argmax(value <= 0)) + 2
        raise refuse(
            f"{column} is {value[row - 2]:g} in row {row}: it must be positive",
            "leave frequencies that do not matter out, and restrict band",
        )
    scaled = frequency * unit
    lo, hi = band
    if scaled[0] > lo * (1 + 1e-9) or scaled[-1] < hi * (1 - 1e-9):
        per = f"rad/{spec.time_unit}"
        raise refuse(
            f"it covers {frequency[0]:g} to {frequency[-1]:g} {per}, but the band is "
            f"{lo / unit:g} to {hi / unit:g} {per}",
            "extend the table, or restrict accuracy.model_error.band",
        )
    return Table(scaled, value)
