"""A weighted variance of a plant with several channels or in continuous time, entry by entry."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.accuracy.continuous_weight import weight_singularities
from inputdesign_cli.accuracy.model_error_mimo import entry_grid, entry_rows
from inputdesign_cli.accuracy.weighted_variance import WeightedVariance
from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.plant.polynomial import Array, ComplexArray


@dataclass(frozen=True)
class EntryVariance(WeightedVariance):
    """The requirement for entry (`output`, `input`), counted from zero; a weight in s in continuous time."""

    experiment: ChannelExperiment  # type: ignore[assignment]
    output: int = 0
    input: int = 0

    @property
    def own_singularities(self) -> ComplexArray:
        return weight_singularities(self.weight)

    @cached_property
    def grid(self) -> Array:
        """Frequencies that see every resonance of the entry, of the weight and of the noise filter."""
        return entry_grid(
            self.experiment, self.output, self.input, self.own_singularities, self.band, self.knots
        )

    def rows(self, w: ArrayLike) -> NDArray[np.float64]:
        """(n, 2, k): |W| / sqrt(max) times the real and imaginary parts of Lambda_ij."""
        size = np.abs(self.weight.at(w)) / np.sqrt(self.limit)
        if self.relative:
            size = size / np.abs(self.experiment.model.plant_at(w)[:, self.output, self.input])
        return entry_rows(self.experiment, w, self.output, self.input) * size[:, None, None]
