"""Whether a record lives on its start from rest, where its design is of spectra, which have no start."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.accuracy import Requirement
from inputdesign_cli.identification import information_begun_anywhere
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.tasks.record import worst_ratio

# Errors that grow by less than this, relative, are not told.
_MATTERS = 0.2


def start_notes(
    experiment: Experiment, record: Array, step: float, requirements: Sequence[Requirement]
) -> list[str]:
    """A note on a record (n, r) whose errors grow where its start is not known; none for others.

    Args:
        step: time between samples in the unit of the experiment's frequencies.
        requirements: what the errors are measured by.
    """
    growth = _growth(experiment, record, step, requirements)
    if growth <= 1.0 + _MATTERS:
        return []
    errors = (
        f"its errors would be {growth:.3g} times as large"
        if np.isfinite(growth)
        else "it would not determine all parameters"
    )
    return [
        "the record relies on its start from rest, which spectra and the bounds on them do not know: begun "
        f"in an unknown state about unknown levels {errors}; keep the plant at rest before the record "
        "begins, and take inputs and outputs from their levels there"
    ]


def _growth(experiment: Experiment, record: Array, step: float, requirements: Sequence[Requirement]) -> float:
    """How many times as large the errors of the record would be, infinite where one has no bound."""
    plant = FiniteRecord(experiment, len(record), step)
    u, y = plant.signals("input", record), plant.signals("output", record)
    anywhere = experiment.whiten_matrix(information_begun_anywhere(experiment.model, u, y, step))
    error = worst_ratio(requirements)
    try:
        at_rest = error(plant.information(record))
        free = error(plant.known + anywhere)
    except np.linalg.LinAlgError:
        return np.inf
    return free / at_rest if at_rest > 0.0 else 1.0
