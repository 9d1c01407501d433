"""Compute the information of the noise alone, in a loop or for a plant predicted from past outputs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import ComplexArray
from inputdesign_cli.information.quadrature import Quadrature, Values, integrate


def told_by_noise(gradients: Values, singularities: ComplexArray) -> NDArray[np.float64]:
    """Return the information (S, k, k) of a sample of each of S plants without any excitation.

    Args:
        gradients: (n, S, k, p, p) at frequencies (n,): what white e of covariance I contributes.
        singularities: of all of them.
    """

    def sums(rule: Quadrature, values: NDArray) -> NDArray[np.float64]:
        weighted = np.moveaxis(values, 0, -1) * np.sqrt(rule.weights)
        flat = weighted.reshape(*weighted.shape[:2], -1)
        rows = np.concatenate([flat.real, flat.imag], axis=2)
        return np.asarray(rows @ rows.swapaxes(1, 2))

    # Sums of a few hundred nodes, added up, round less than one of them all.
    return integrate(gradients, sums, singularities, several=True)
