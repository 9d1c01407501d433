"""The information matrix exceeds a given one: P^-1 >= R.

This covers `information` itself, the standard deviation of a single parameter (R = e e^T / s^2) and
application-oriented accuracy, R = (chi2 gamma / 2) V'': then the confidence ellipsoid lies within the
set where the application's cost, to second order, is below 1 / gamma ([annergren-larsson-2016]).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy.cuts import MatrixCut
from inputdesign_cli.accuracy.requirement import OneCondition, inverse_factor
from inputdesign_cli.arrays import Array


@dataclass(frozen=True)
class InformationTarget(OneCondition):
    """M >= `target` (k, k, symmetric), in the coordinates of the experiment."""

    target: Array
    label: str = "information"

    @property
    def name(self) -> str:
        """`information`, `application` or `standard_deviation of` a parameter."""
        return self.label

    def ratio(self, information: Array) -> float:
        """sqrt of the largest eigenvalue of the target relative to M."""
        K = inverse_factor(information)
        return float(np.sqrt(max(np.linalg.eigvalsh(K @ self.target @ K.T)[-1], 0.0)))

    def cut(self, frequency: float | None) -> MatrixCut:
        """The requirement itself."""
        return MatrixCut(self.target)
