"""A weight in s, for what is required of a plant in continuous time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.plant import Rational, logarithmic_distance
from inputdesign_cli.plant.polynomial import Array, ComplexArray, join_roots


@dataclass(frozen=True)
class ContinuousWeight:
    """W(s) = numerator / denominator, coefficients in descending powers of s."""

    numerator: Array
    denominator: Array

    def at(self, w: ArrayLike) -> ComplexArray:
        """W at frequencies `w` in rad per time unit."""
        s = 1j * np.asarray(w, dtype=float)
        return np.asarray(np.polyval(self.numerator, s) / np.polyval(self.denominator, s), dtype=complex)


def weight_singularities(weight: Rational | ContinuousWeight) -> ComplexArray:
    """Poles and zeros as points frequency + j damping."""
    if isinstance(weight, ContinuousWeight):
        roots = np.concatenate([np.roots(weight.numerator), np.roots(weight.denominator)])
        return np.asarray(np.abs(roots.imag) + 1j * np.abs(roots.real))
    return logarithmic_distance(join_roots([weight.poles, weight.zeros]))
