"""The one sentence that every convex design here is an instance of.

minimise an objective of the spectrum x, subject to x in the cone of spectra, M(x) = M0 + sum_i x_i M_i
meeting every requirement, and the powers and the density of x within their limits.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Criterion, Requirement, Violation, criterion_of, worst
from inputdesign_cli.design.convex.limits import (
    DensityBreach,
    DensityLimit,
    DensityPlace,
    PowerLimit,
    breach_ratio,
    breaches_at,
)
from inputdesign_cli.information import Experiment, PowerKind, WeightedProducts
from inputdesign_cli.plant import graded_grid, local_maxima
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spectrum import Basis, Functional

RequirementFactory = Callable[[Experiment], Requirement]
Goal = Literal["cost", "factor", "samples"]
Weight = float | tuple[float, ...]


def weights_of(cost: Mapping[PowerKind, Weight]) -> list[tuple[PowerKind, int | None, float]]:
    """The positive weights of a cost: kind, channel (None is the sum over the channels), weight."""
    listed: list[tuple[PowerKind, int | None, float]] = []
    for kind, weight in cost.items():
        if isinstance(weight, tuple):
            listed += [(kind, channel, w) for channel, w in enumerate(weight) if w > 0]
        elif weight > 0:
            listed.append((kind, None, weight))
    return listed


def weighted_sum(weights: Mapping[PowerKind, Weight], power: Mapping[PowerKind, Sequence[float]]) -> float:
    """What powers, by kind and channel, cost at these weights."""
    return sum(
        weight * (sum(power[kind]) if channel is None else power[kind][channel])
        for kind, channel, weight in weights_of(weights)
    )


@dataclass(frozen=True)
class Problem:
    """A design problem, for one of three goals.

    "cost": the least cost; `cost` weighs the powers of input, output and excitation
    ([bombois-least-costly], (18)).

    "factor": the least s such that s M(x) meets the requirements, x within the limits: the best
    accuracy (s is the square of the ratio r_u / r_adm, or the inverse of a criterion). In
    (s x, s) this is linear again: z = s x, M' = s M0 + sum z_i M_i, limits times s.

    "samples": the least number of samples N within the limits; the experiment's own number must be
    one. In (N x, N) this is linear: M' = prior + N noise information + sum z_i M_i, limits times N.

    `requirements` are made for the coordinates of `experiment`. `side` requirements (goal "factor")
    must be met by M(x) itself. A density limit stands beside a limit on the power of the excitation
    (`design.limits.implied_power`). With `floors_fixed` (goal "factor") lower limits do not scale: the
    least multiple of the upper limits for which they can be met. `finer` is a problem of the same
    experiment on the same or a larger basis, of whose integrals those of this basis are the head.
    """

    experiment: Experiment
    basis: Basis
    cost: Mapping[PowerKind, Weight]
    requirements: tuple[Requirement, ...]
    limits: tuple[PowerLimit, ...] = ()
    densities: tuple[DensityLimit, ...] = ()
    goal: Goal = "cost"
    side: tuple[Requirement, ...] = ()
    floors_fixed: bool = False
    finer: Problem | None = field(default=None, repr=False)
    _before: list[Problem] = field(default_factory=list, init=False, repr=False)

    @property
    def stated_criterion(self) -> Criterion | None:
        """The criterion that is to be maximised, if that is the goal."""
        return criterion_of(self.requirements)

    def on(self, basis: Basis) -> Problem:
        """The same problem on another basis, such as one that has grown out of this one."""
        return self if basis is self.basis else replace(self, basis=basis, finer=None)

    def grown(self, basis: Basis) -> Problem:
        """The same problem on a basis that begins with this one; what is known of this one is kept."""
        grown = replace(self, basis=basis, finer=None)
        grown._before.append(self)
        _ = grown.information_map, grown.grid, grown.grid_products
        grown._before.clear()
        return grown

    @property
    def scaled(self) -> bool:
        """Whether an unknown s multiplies limits and known information (goals other than cost)."""
        return self.goal != "cost"

    @property
    def has_floors(self) -> bool:
        """Whether some limit is a lower one."""
        powers = any(not limit.upper for limit in self.limits)
        return powers or any(not limit.upper for limit in self.densities)

    @property
    def needs_definite(self) -> bool:
        """Whether a singular information matrix is out of the question."""
        return any(requirement.definite for requirement in (*self.requirements, *self.side))

    @cached_property
    def information_map(self) -> NDArray[np.float64]:
        """(size, k, k): M_i, the information of each basis function."""
        if self.finer is not None:
            return self.finer.information_map[: self.basis.size]
        experiment = self.experiment
        basis = self.basis.beyond(self._before[0].basis.size) if self._before else self.basis
        found = basis.integrals(
            experiment.information_density, experiment.singularities, experiment.information_factor
        )
        return np.concatenate([*(before.information_map for before in self._before), found])

    @property
    def baseline_information(self) -> Array:
        """(k, k): M0, what is known without excitation."""
        return self.experiment.baseline_information

    def information(self, x: Array) -> Array:
        """(k, k): M(x)."""
        return self.baseline_information + self.excited_information(x)

    def excited_information(self, x: Array) -> Array:
        """(k, k): sum_i x_i M_i."""
        return np.tensordot(x, self.information_map, axes=1)

    @cached_property
    def fixed_information(self) -> Array:
        """(k, k): the part of M' that neither x nor s scales."""
        if self.goal == "cost":
            return self.baseline_information
        if self.goal == "samples":
            return self.experiment.prior_information
        return np.zeros_like(self.baseline_information)

    @cached_property
    def scaled_information(self) -> Array:
        """(k, k): the part of M' in proportion to s."""
        if self.goal == "cost":
            return np.zeros_like(self.baseline_information)
        return self.experiment.noise_information if self.goal == "samples" else self.baseline_information

    @cached_property
    def price(self) -> Functional:
        """What x is measured by: the cost, or without one the sum of all powers over their upper limits."""
        if self.goal == "cost":
            parts = [self.power(kind, channel) * weight for kind, channel, weight in weights_of(self.cost)]
        else:
            caps = [limit for limit in self.limits if limit.upper]
            parts = [self.power(limit.kind, limit.channel) * (1.0 / limit.bound) for limit in caps]
        total = parts[0]
        for part in parts[1:]:
            total = total + part
        return total

    def power(self, kind: PowerKind, channel: int | None = None) -> Functional:
        """The power of input, output or excitation (of one channel) as a functional of the spectrum."""
        known = self._powers.get((kind, channel))
        if known is not None:
            return known

        # Without this problem inside, which would keep the arrays of each that has grown beyond it.
        experiment = self.experiment

        def density(w: Array) -> Array:
            return experiment.power_density(kind, w, channel)

        if self.finer is not None:
            vector = self.finer.power(kind, channel).vector[: self.basis.size]
        else:
            vector = self.basis.integrals(density, experiment.singularities)
        self._powers[kind, channel] = Functional(vector, density)
        return self._powers[kind, channel]

    @cached_property
    def _powers(self) -> dict[tuple[PowerKind, int | None], Functional]:
        return {}

    @cached_property
    def limit_functionals(self) -> tuple[Functional, ...]:
        """The limited powers, one a limit."""
        return tuple(self.power(limit.kind, limit.channel) for limit in self.limits)

    def value(self, weight: Array) -> Functional:
        """tr(Y (M(x) - M0)) for a fixed Y = `weight` (k, k) as a functional of the spectrum."""
        known: dict[int, NDArray] = {}

        def density(w: Array) -> NDArray:
            if w is not self.grid:
                return self.experiment.value_density(weight, w)
            if not known:  # asked for again with every share that limits keep of a price
                known[0] = self.experiment.valued(self.grid_products, weight)
            return known[0]

        return Functional(np.tensordot(self.information_map, weight, axes=2), density)

    def density_at(self, place: DensityPlace) -> Functional:
        """v^* Phi v at one frequency as a functional; it has no density over frequency."""
        r = self.experiment.inputs
        vector = self.basis.directed(place.frequency, place.direction)
        shape = () if r == 1 else (r, r)
        return Functional(vector, lambda w: np.zeros((np.size(w), *shape)), concentrated=True)

    def density_breaches(self, x: Array, s: float, *, above: float) -> list[DensityBreach]:
        """Local maxima of Phi over its limits times s (or once, for fixed ones), if above `above`."""
        found = []
        for index, limit in enumerate(self.densities):
            factor = self.bound_factor(limit.upper, s)

            def ratio(w: Array, limit: DensityLimit = limit, factor: float = factor) -> Array:
                return breach_ratio(limit, self.basis.density(x, w) / factor, w)

            grid = np.union1d(limit.grid, self._fine_grid)
            w, _ = local_maxima(ratio, grid, ratio(grid), above=above)
            found += breaches_at(limit, index, self.basis.density(x, w) / factor, w, above=above)
        return found

    @cached_property
    def _fine_grid(self) -> Array:
        """Even, and denser at the ends of the band as polynomials oscillate: sixteen points a degree."""
        lo, hi = self.experiment.band
        even = np.linspace(0.0, 1.0, 16 * (self.basis.degree + 1))
        return lo + (hi - lo) * np.union1d(even, 0.5 - 0.5 * np.cos(np.pi * even))

    def bound_factor(self, upper: bool, s: float) -> float:
        """What a limit is multiplied by: s where limits scale, else one."""
        return s if self.scaled and (upper or not self.floors_fixed) else 1.0

    @cached_property
    def grid(self) -> Array:
        """Frequencies that see every resonance of the excitation's densities, over its band."""
        if self._before:
            return self._before[0].grid
        return graded_grid(self.experiment.singularities, *self.experiment.band)

    @cached_property
    def grid_products(self) -> WeightedProducts:
        """The gradients at the frequencies of `grid`."""
        return self._before[0].grid_products if self._before else self.experiment.products(self.grid)

    def violations(self, information: Array, *, above: float = -np.inf) -> list[tuple[int, Violation]]:
        """All local maxima of all requirements' ratios, each with the index of its requirement."""
        return [
            (index, violation)
            for index, requirement in enumerate(self.requirements)
            for violation in requirement.violations(information, above=above)
        ]

    def side_violations(self, information: Array, *, above: float = -np.inf) -> list[tuple[int, Violation]]:
        """The same for the side requirements; their indices follow those of the requirements."""
        first = len(self.requirements)
        return [
            (first + index, violation)
            for index, requirement in enumerate(self.side)
            for violation in requirement.violations(information, above=above)
        ]

    def requirement(self, index: int) -> Requirement:
        """By the index that `violations` and `side_violations` give."""
        return (*self.requirements, *self.side)[index]

    def worst_ratio(self, information: Array) -> Violation:
        """The worst violation of all requirements, criteria left out."""
        found = [
            violation
            for requirement in (*self.requirements, *self.side)
            if not isinstance(requirement, Criterion)
            for violation in requirement.violations(information)
        ]
        return worst(found)
