"""What requirements at every frequency of a band have in common: a grid that sees everything, and peaks."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.accuracy.requirement import Requirement, Violation, inverse_factor, worst
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import graded_grid, local_maxima, logarithmic_distance
from inputdesign_cli.plant.polynomial import Array, ComplexArray, join_roots

# The search comes this near to frequency zero, in shares of the band, where a flat maximum at zero is meant.
_BESIDE_ZERO, _ROUNDING = 1e-6, 1e-12


def worst_violation(requirement: Requirement, information: Array) -> Violation:
    """The largest of the violations, for reports: one beside frequency zero is told to be there.

    Args:
        information: M (k, k) in the coordinates of the experiment.
    """
    found = worst(requirement.violations(information))
    if found.frequency is None or not isinstance(requirement, OverFrequency):
        return found
    lo, hi = requirement.band
    if lo > 0.0 or found.frequency > _BESIDE_ZERO * hi:
        return found
    at_zero = float(requirement.ratios(information, np.zeros(1))[0])
    return Violation(found.ratio, 0.0) if at_zero >= found.ratio * (1.0 - _ROUNDING) else found


class OverFrequency:
    """A requirement whose ratio at w depends on M through T(w) M^-1 T(w)^T, T = `rows` (q, k).

    Subclasses give `rows` and `measure`, and the points of the frequency plane near which they change
    fast (`own_singularities`) or have a kink (`knots`).
    """

    experiment: Experiment
    band: tuple[float, float]
    knots: Array = np.zeros(0)

    @property
    def own_singularities(self) -> ComplexArray:
        """Beyond those of the plant and its loop."""
        return np.zeros(0, dtype=complex)

    def rows(self, w: ArrayLike) -> NDArray[np.float64]:
        """(n, q, k): T(w)."""
        raise NotImplementedError

    def measure(self, half: NDArray[np.float64], w: Array) -> Array:
        """The ratio (n,) from half = T K^T (n, q, k), K^T K = M^-1."""
        raise NotImplementedError

    @cached_property
    def grid(self) -> Array:
        """Frequencies that see every resonance of G, of the requirement and of the loop."""
        model = self.experiment.model
        plant = logarithmic_distance(join_roots([model.poles, model.zeros]))
        singular = np.concatenate([plant, self.experiment.singularities, self.own_singularities])
        return graded_grid(singular, *self.band, knots=self.knots)

    @cached_property
    def _grid_rows(self) -> NDArray[np.float64]:
        return self.rows(self.grid)

    def ratios(self, information: Array, frequencies: Array) -> Array:
        """The ratio (n,) at given frequencies."""
        return self.measure(self.rows(frequencies) @ inverse_factor(information).T, frequencies)

    def violations(self, information: Array, *, above: float = -np.inf) -> list[Violation]:
        """Local maxima of the ratio over the band, polished between the grid points."""
        turn = inverse_factor(information).T
        on_grid = self.measure(self._grid_rows @ turn, self.grid)
        w, ratio = local_maxima(
            lambda w: self.measure(self.rows(w) @ turn, w), self.grid, on_grid, above=above
        )
        return [Violation(float(r), float(at)) for at, r in zip(w, ratio, strict=True)]
