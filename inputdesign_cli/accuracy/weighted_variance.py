"""A weighted variance over frequency: |W|^2 Lambda^* P Lambda <= max at every frequency of a band.

Lambda (k,) is the gradient of one entry of G, so that Lambda^* P Lambda is the variance of the complex
frequency response, to first order: the variance bounds of [jansson-hjalmarsson-2005].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.accuracy.cuts import Cut, MatrixCut, VarianceCut
from inputdesign_cli.accuracy.requirement import OverFrequency
from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant import ScalarTransfer

_REAL = 1e-12


@dataclass(frozen=True, kw_only=True)
class WeightedVariance(OverFrequency):
    """The requirement on the weighted variance of one entry of G.

    With `relative` it is the variance relative to the nominal G, |W / G|^2 Lambda^* P Lambda.
    """

    weight: ScalarTransfer
    limit: float
    relative: bool = False

    @property
    def name(self) -> str:
        """Return the name `weighted_variance`."""
        return "weighted_variance"

    @property
    def own_singularities(self) -> ComplexArray:
        """Return the singularities of the weight."""
        return self.weight.singularities

    def weight_at(self, w: ArrayLike) -> Array:
        """Return |W| / sqrt(max), or that over |G|."""
        size = np.abs(self.weight.at(w)) / np.sqrt(self.limit)
        return size / self.nominal_size(w) if self.relative else size

    def measure(self, half: NDArray[np.float64], w: Array) -> Array:
        """Return the weighted standard deviation over its limit."""
        return np.sqrt(np.einsum("nqi,nqi->n", half, half))

    def ratio_rows(self, half: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the rows themselves."""
        return half

    def cut(self, frequency: float | None) -> Cut:
        """Return the cut tr(V^T M^-1 V) <= 1 at this frequency."""
        rows = self.rows(np.array([frequency]))[0]
        if np.abs(rows[1]).max() <= _REAL * np.abs(rows[0]).max():  # a real gradient, at 0 and pi
            return MatrixCut(np.outer(rows[0], rows[0]), frequency)
        return VarianceCut(rows.T, frequency)
