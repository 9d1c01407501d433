"""The density over frequency of weighted information, from the gradients of all scenarios' plants."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.information import Experiment, WeightedProducts
from inputdesign_cli.plant import common_grid, graded_grid


def weighty_ones(weights: NDArray[np.float64]) -> list[int]:
    """Return the scenarios whose weight Y_s of `weights` (S, k, k) is not zero."""
    return np.flatnonzero(np.any(weights, axis=(1, 2))).tolist()


@dataclass(frozen=True)
class Gradients:
    """Holds the gradients of all plants, the nominal one first, for the last grid requested."""

    experiments: tuple[Experiment, ...]
    _grids: dict[frozenset[int], Array] = field(default_factory=dict, init=False, repr=False)
    _products: dict[int, tuple[Array, WeightedProducts]] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def grid(self) -> Array:
        """Return a grid on the band that resolves every resonance of the nominal plant's densities."""
        nominal = self.experiments[0]
        return graded_grid(nominal.singularities, *nominal.band)

    def grid_of(self, scenarios: Sequence[int]) -> Array:
        """Return the common frequency grid for the densities of these scenarios together."""
        others = frozenset(scenarios) - {0}
        if not others:
            return self.grid
        if others not in self._grids:
            plants = [self.experiments[number].singularities for number in (0, *sorted(others))]
            self._grids[others] = common_grid(plants, *self.experiments[0].band)
        return self._grids[others]

    def value_density(self, weights: NDArray[np.float64]) -> Callable[[Array], NDArray]:
        """Return the density of sum_s tr(Y_s M_s) over frequency, for fixed Y = `weights` (S, k, k)."""
        weighty = weighty_ones(weights)
        grid = self.grid_of(weighty)
        known: list[NDArray] = []

        def density(w: Array) -> NDArray:
            if w is grid and known:  # asked for again with every share that limits keep of a price
                return known[0]
            parts = (self._worth(number, weights[number], w, on_grid=w is grid) for number in weighty)
            total = sum(parts, self.worthless(w))
            if w is grid:
                known.append(total)
            return total

        return density

    def worthless(self, w: Array) -> NDArray:
        """Return zero at every frequency of `w` (n,): (n,), or (n, r, r) for several inputs."""
        r = self.experiments[0].inputs
        return np.zeros((np.size(w), *(() if r == 1 else (r, r))))

    def _worth(self, scenario: int, weight: Array, w: Array, *, on_grid: bool) -> NDArray:
        """Return the density of tr(Y M_s) at frequencies `w`; the gradients on a grid are kept."""
        experiment = self.experiments[scenario]
        if not on_grid:
            return experiment.value_density(weight, w)
        known = self._products.get(scenario)
        if known is None or known[0] is not w:
            known = self._products[scenario] = (w, experiment.products(w))
        return experiment.valued(known[1], weight)
