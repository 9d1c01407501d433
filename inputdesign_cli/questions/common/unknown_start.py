"""Whether a record lives on its start from rest, where its design is of spectra, which have no start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import Requirement
from inputdesign_cli.arrays import Array
from inputdesign_cli.identification import information_begun_anywhere
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.questions.common.record import worst_ratio

# Errors that grow by less than this, relative, are not told.
_MATTERS = 0.2


@dataclass(frozen=True)
class BegunAnywhere:
    """A record that begins in an unknown state about unknown levels, beside the same from rest.

    Attributes:
        growth: how many times as large its errors are; infinite where one has no bound.
    """

    growth: float

    @property
    def matters(self) -> bool:
        """Whether the record relies on its start from rest."""
        return self.growth > 1.0 + _MATTERS

    @property
    def entry(self) -> dict[str, Json]:
        """Part of `signal` of `result.json`; a growth without end is None."""
        if not self.matters:
            return {}
        return {"begun_anywhere": self.growth if np.isfinite(self.growth) else None}

    @property
    def notes(self) -> list[str]:
        """What to say of a record that relies on its start."""
        if not self.matters:
            return []
        errors = (
            f"its errors would be {self.growth:.3g} times as large"
            if np.isfinite(self.growth)
            else "it would not determine all parameters"
        )
        return [
            "the record relies on its start from rest, which spectra and the bounds on them do not know: "
            f"begun in an unknown state about unknown levels {errors}; keep the plant at rest before the "
            "record begins, and take inputs and outputs from their levels there"
        ]


def begun_anywhere(
    experiment: Experiment, record: Array, step: float, requirements: Sequence[Requirement]
) -> BegunAnywhere:
    """How much larger errors of a record (n, r) are where its start is not known.

    Args:
        step: time between samples in the unit of the experiment's frequencies.
        requirements: what the errors are measured by.
    """
    plant = FiniteRecord(experiment, len(record), step)
    u, y = plant.signals("input", record), plant.signals("output", record)
    anywhere = experiment.whiten_matrix(information_begun_anywhere(experiment.model, u, y, step))
    error = worst_ratio(requirements)
    try:
        at_rest = error(plant.information(record))
        free = error(plant.known + anywhere)
    except np.linalg.LinAlgError:
        return BegunAnywhere(np.inf)
    return BegunAnywhere(free / at_rest if at_rest > 0.0 else 1.0)
