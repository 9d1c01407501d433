"""Inputs and outputs with times of their own: one column of times counts, the other may be shifted."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.tasks.build.columns import time_unit_of
from inputdesign_cli.tasks.build.files import Sheet
from inputdesign_cli.tasks.build.files.naming import time_columns
from inputdesign_cli.questions.building.tables import column_named

# In steps of time: shifts below the first are none, and shifts that vary by less than the second are one.
_NONE, _CONSTANT = 0.01, 0.1


def shifted_times(sheet: Sheet, name: str) -> list[str]:
    """What is said of other columns of times that are those of column `name` and a constant.

    A constant longer than the record is none: the columns are of two clocks.
    """
    counted = column_named(sheet, name)
    there = counted.numbers[~np.isnan(counted.numbers)]
    step = float(np.median(np.diff(there))) if there.size > 1 else 0.0
    told = []
    for other in time_columns(sheet):
        column = column_named(sheet, other)
        alike = column.dated == counted.dated and time_unit_of(other) == time_unit_of(name)
        if column is counted or column.fault is not None or not alike or step <= 0.0:
            continue
        shifts = column.numbers - counted.numbers + (column.began - counted.began)
        shifts = shifts[~np.isnan(shifts)]
        shift = float(np.median(shifts)) if shifts.size else 0.0
        within = _NONE * step <= abs(shift) < np.ptp(there)
        if not within or np.any(np.abs(shifts - shift) > _CONSTANT * step):
            continue
        later = "later" if shift > 0.0 else "earlier"
        told.append(
            f"the times of {other} are {abs(shift):.6g} {later} than those of {name} in every row "
            f"({abs(shift) / step:.3g} samples): what was logged with {other} counts as if at the times of "
            f"{name}, so that delays are off by as much"
        )
    return told
