"""A variance integrated over frequency stays below a limit."""

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy.cuts import VarianceCut
from inputdesign_cli.accuracy.requirement import OneCondition, inverse_factor
from inputdesign_cli.arrays import Array


@dataclass(frozen=True)
class IntegratedVariance(OneCondition):
    """tr(V^T P V) <= 1, V = `directions` (k, q), in the coordinates of the experiment."""

    directions: Array

    @property
    def name(self) -> str:
        return "integrated_variance"

    def ratio(self, information: Array) -> float:
        """The root of tr(V^T M^-1 V)."""
        return float(np.linalg.norm(inverse_factor(information) @ self.directions))

    def cut(self, frequency: float | None) -> VarianceCut:
        """The requirement itself."""
        return VarianceCut(self.directions)
