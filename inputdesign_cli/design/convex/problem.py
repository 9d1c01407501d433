"""The general convex design problem, of which every design here is an instance.

minimise an objective of the spectrum x, subject to x in the cone of spectra, M_s(x) = M0_s + sum_i x_i M_si
meeting every requirement of every scenario s, and the powers and the density of x within their limits.

A scenario is a plant that the true one might be. The nominal plant is the first of S scenarios; in most
designs S is one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Requirement
from inputdesign_cli.arrays import Array
from inputdesign_cli.design.amplitude.polytope import Facet, LagPolytope
from inputdesign_cli.design.amplitude.windows import weighted
from inputdesign_cli.design.convex.demands import Demands, Scenario
from inputdesign_cli.design.convex.limits import (
    DensityBreach,
    DensityLimit,
    DensityPlace,
    Goal,
    Paid,
    PowerLimit,
    Weight,
    breach_ratio,
    breaches_at,
    weights_of,
)
from inputdesign_cli.information import (
    POWER_KINDS,
    Experiment,
    PowerKind,
    WeightedProducts,
    joint_information,
    mean_cost,
)
from inputdesign_cli.plant import common_grid, graded_grid, local_maxima
from inputdesign_cli.spectrum import Basis, Density, Functional, constant, kept_on_grid

_RIPPLE = 16  # points of the grid per lag


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
        """Return frequencies that resolve every resonance of the nominal plant's densities, over the band."""
        nominal = self.experiments[0]
        return graded_grid(nominal.singularities, *nominal.band)

    def grid_of(self, scenarios: Sequence[int]) -> Array:
        """Return one frequency grid that serves the densities of all these scenarios."""
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
            if w is grid and known:  # evaluated again for each share that `certify` tries
                return known[0]
            total = self.zero_density(w)
            for number in weighty:
                total = total + self._worth(number, weights[number], w, on_grid=w is grid)
            if w is grid:
                known.append(total)
            return total

        return density

    def zero_density(self, w: Array) -> NDArray:
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


@dataclass(frozen=True)
class Candidate:
    """A design: z (size,), s, M' (S, k, k) of every scenario, and the objective (the cost, or s).

    The spectrum is z / s; goals without s have s = 1.
    """

    z: Array
    s: float
    informations: NDArray[np.float64]
    objective: float


@dataclass(frozen=True)
class Problem:
    """A design problem, for one of three goals.

    "cost": the least cost; `cost` weighs the powers of input, output and excitation
    ([bombois-least-costly], (18)).

    "factor": the least s for which s M(x) meets the requirements, x within the limits: the best
    accuracy (s is the square of the ratio r_u / r_adm, or the inverse of a criterion). In
    (s x, s) this is linear again: z = s x, M' = s M0 + sum z_i M_i, limits times s.

    "samples": the least number of samples N within the limits; the experiment's own number must be
    one. In (N x, N) this is linear: M' = prior + N noise information + sum z_i M_i, limits times N.

    `requirements` are made for the coordinates of `experiment`, which has the nominal plant. `side`
    requirements (goal "factor") must be met by M(x) itself. `others` are the other scenarios, of the same
    structure and length: each M_s meets its own requirements. The powers of a spectrum depend on the plant:
    limits name theirs, and `paid` selects the cost at the nominal plant, the mean over all, or the cost at
    the dearest.

    An upper density limit comes with the limit on the power that it implies (`limits.implied_power`). With
    `floors_fixed` (goal "factor") lower limits do not scale: s is the least multiple of the upper limits
    for which they can be met. `finer` is a problem of the same experiment on the same or a larger basis; the
    integrals of this basis are the first ones of its integrals. `seen` are the demands of an earlier
    problem, reused if both have the same requirements and plants.
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
    others: tuple[Scenario, ...] = field(default=(), repr=False)
    paid: Paid = "nominal"
    polytope: LagPolytope | None = field(default=None, repr=False)
    finer: Problem | None = field(default=None, repr=False)
    seen: Demands | None = field(default=None, repr=False)
    # The problem on a part of this basis, and the one on another basis, if there is one.
    _smaller: list[Problem] = field(default_factory=list, init=False, repr=False)
    _on_other_basis: list[Problem] = field(default_factory=list, init=False, repr=False)

    @cached_property
    def demands(self) -> Demands:
        """Return the requirements at all S plants, the nominal one first."""
        if self._smaller:  # with the ratios found so far
            return self._smaller[0].demands
        asked = Scenario(self.experiment, self.requirements, self.side)
        if self.seen is not None and self.seen.are_of(asked, self.others):
            return self.seen
        return Demands((asked, *self.others))

    @cached_property
    def scenarios(self) -> tuple[Scenario, ...]:
        """Return all S plants, the nominal one first."""
        return self.demands.scenarios

    @cached_property
    def gradients(self) -> Gradients:
        """Return the gradients of all plants at frequencies."""
        if self._smaller:
            return self._smaller[0].gradients
        return Gradients(tuple(scenario.experiment for scenario in self.scenarios))

    def with_requirements(self, of: Callable[[Scenario], tuple[Requirement, ...]]) -> Problem:
        """Return the problem with other requirements at every scenario, and no side ones."""
        others = tuple(replace(one, requirements=of(one), side=()) for one in self.others)
        return replace(self, requirements=of(self.scenarios[0]), side=(), others=others)

    def on(self, basis: Basis) -> Problem:
        """Return the problem on another basis, for example one that has grown out of this one."""
        if basis is self.basis:
            return self
        if not self._on_other_basis or self._on_other_basis[0].basis is not basis:
            self._on_other_basis[:] = [replace(self, basis=basis, finer=None)]
        return self._on_other_basis[0]

    def grown(self, basis: Basis) -> Problem:
        """Return the problem on a basis that begins with this one, and keep the integrals computed so far."""
        grown = replace(self, basis=basis, finer=None)
        grown._smaller.append(self)
        _ = grown.demands, grown.gradients, grown.information_maps
        for key in self._powers:
            grown.power(*key)
        for plants in self._costs:
            grown._cost_of(plants)
        grown._smaller.clear()
        return grown

    def _along(self, known: Callable[[Problem], Array], integrals: Callable[[Basis], Array]) -> NDArray:
        """Return integrals of all basis functions, from a finer problem or by adding to known ones."""
        if self.finer is not None:
            return known(self.finer)[: self.basis.size]
        if self._smaller:
            before = known(self._smaller[0])
            return np.concatenate([before, integrals(self.basis.beyond(len(before)))])
        return integrals(self.basis)

    @cached_property
    def scaled(self) -> bool:
        """Return whether an unknown s multiplies limits and known information (goals other than cost)."""
        return self.goal != "cost"

    @cached_property
    def has_floors(self) -> bool:
        """Return whether some limit is a lower one."""
        powers = any(not limit.upper for limit in self.limits)
        return powers or any(not limit.upper for limit in self.densities)

    @cached_property
    def information_maps(self) -> NDArray[np.float64]:
        """Return M_si, the information of each basis function at each scenario, (size, S, k, k)."""
        experiments = [scenario.experiment for scenario in self.scenarios]
        return self._along(
            lambda problem: problem.information_maps,
            lambda basis: joint_information(experiments, basis.integrals),
        )

    @cached_property
    def information_map(self) -> NDArray[np.float64]:
        """Return the information maps (size, k, k) of the nominal plant."""
        return self.information_maps[:, 0]

    @cached_property
    def baselines(self) -> NDArray[np.float64]:
        """Return the information M0_s of each scenario without excitation, (S, k, k)."""
        return self.demands.noise_informations + self._priors

    @property
    def _priors(self) -> NDArray[np.float64]:
        return np.array([scenario.experiment.prior_information for scenario in self.scenarios])

    @cached_property
    def baseline_information(self) -> Array:
        """Return M0 of the nominal plant (k, k)."""
        return self.baselines[0]

    def informations(self, x: Array) -> NDArray[np.float64]:
        """Return the information matrices M_s(x), (S, k, k)."""
        return self.baselines + self.excited(x)

    def information(self, x: Array) -> Array:
        """Return M(x) of the nominal plant (k, k)."""
        return self.baseline_information + np.tensordot(x, self.information_map, axes=1)

    def candidate(self, z: Array, s: float) -> Candidate:
        """Return the candidate with these unknowns, whether or not it meets the requirements."""
        informations = self.fixed_information + np.tensordot(z, self.information_maps, axes=1)
        if not self.scaled:
            return Candidate(z, s, informations, self.cost_at(z))
        return Candidate(z, s, informations + s * self.scaled_information, s)

    def excited(self, x: Array) -> NDArray[np.float64]:
        """Return sum_i x_i M_si (S, k, k)."""
        return np.tensordot(x, self.information_maps, axes=1)

    @cached_property
    def fixed_information(self) -> NDArray[np.float64]:
        """Return the part of M' that neither x nor s scales, (S, k, k)."""
        if self.goal == "cost":
            return self.baselines
        if self.goal == "samples":
            return self._priors
        return np.zeros_like(self.baselines)

    @cached_property
    def scaled_information(self) -> NDArray[np.float64]:
        """Return the part of M' in proportion to s, (S, k, k)."""
        if self.goal == "cost":
            return np.zeros_like(self.baselines)
        if self.goal == "samples":
            return self.demands.noise_informations
        return self.baselines

    @cached_property
    def price(self) -> Functional:
        """Return the price of x: the mean of the costs, or for other goals the sum of powers over limits."""
        if self.goal == "cost":
            return self.costs[0] if len(self.costs) == 1 else self._cost_of(self.paying)
        parts = [self._limited(limit) * (1.0 / limit.bound) for limit in self.limits if limit.upper]
        return sum(parts[1:], start=parts[0])

    @cached_property
    def costs(self) -> tuple[Functional, ...]:
        """Return the costs of which the largest is the cost of a design (goal "cost")."""
        weights = weights_of(self.cost)
        if self.paid == "nominal" or not self._others_pay:
            parts = [self.power(kind, channel) * weight for kind, channel, weight in weights]
            return (sum(parts[1:], start=parts[0]),)
        if self.paid == "worst":
            return tuple(self._cost_of(range(number, number + 1)) for number in self.paying)
        return (self._cost_of(self.paying),)

    @property
    def _others_pay(self) -> bool:
        """Return whether there are other plants at which the cost may be another."""
        kinds = (kind for kind, _, _ in weights_of(self.cost))
        return bool(self.others) and any(self.experiment.depends_on_plant(kind) for kind in kinds)

    @property
    def paying(self) -> range:
        """Return the numbers of the scenarios whose powers are paid for."""
        return range(1 if self.paid == "nominal" else len(self.scenarios))

    def cost_at(self, x: Array) -> float:
        """Return the cost of a spectrum (goal "cost")."""
        return max([float(cost.vector @ x) for cost in self.costs])

    def _cost_of(self, scenarios: range) -> Functional:
        """Return the mean of the costs at these plants."""
        known = self._costs.get(scenarios)
        if known is not None:
            return known
        plants, weights = [self.scenarios[n].experiment for n in scenarios], weights_of(self.cost)
        before = self._smaller[0]._costs.get(scenarios) if self._smaller else None
        # Grown problems evaluate it on the grid of the problem before.
        density = kept_on_grid(lambda w: mean_cost(plants, weights, w)) if before is None else before.density
        near = np.concatenate([plant.singularities for plant in plants])
        vector = self._along(
            lambda problem: problem._cost_of(scenarios).vector, lambda basis: basis.integrals(density, near)
        )
        self._costs[scenarios] = Functional(vector, density)
        return self._costs[scenarios]

    @cached_property
    def _costs(self) -> dict[range, Functional]:
        return {}

    def power(self, kind: PowerKind, channel: int | None = None, scenario: int = 0) -> Functional:
        """Return the power of input, output or excitation (of one channel) as a functional."""
        # The density refers to the experiment only: with this problem it would keep all its arrays in memory.
        experiment = self.scenarios[scenario].experiment
        if kind == "input" and experiment.loop is None:
            kind = "excitation"  # the same signal
        known = self._powers.get((kind, channel, scenario))
        if known is not None:
            return known
        density: Density = partial(experiment.power_density, kind, channel=channel)
        if kind == "excitation":
            density = constant(density(np.zeros(1))[0])
        vector = self._along(
            lambda problem: problem.power(kind, channel, scenario).vector,
            lambda basis: basis.integrals(density, experiment.singularities),
        )
        self._powers[kind, channel, scenario] = Functional(vector, density)
        return self._powers[kind, channel, scenario]

    @cached_property
    def _powers(self) -> dict[tuple[PowerKind, int | None, int], Functional]:
        return {}

    def powers(self, x: Array, scenario: int = 0) -> dict[PowerKind, list[float]]:
        """Return the powers of input, output and excitation at a plant, one entry a channel."""
        found: dict[PowerKind, list[float]] = {}
        for kind in POWER_KINDS:
            channels = self.experiment.model.outputs if kind == "output" else self.experiment.inputs
            of_each = [self.power(kind, channel, scenario).vector @ x for channel in range(channels)]
            found[kind] = [max(float(one), 0.0) for one in of_each]  # rounding may make a zero negative
        return found

    def _limited(self, limit: PowerLimit) -> Functional:
        return self.power(limit.kind, limit.channel, limit.scenario)

    @cached_property
    def limit_functionals(self) -> tuple[Functional, ...]:
        """Return the limited powers, one a limit."""
        return tuple(self._limited(limit) for limit in self.limits)

    def value(self, weights: NDArray[np.float64]) -> Functional:
        """Return sum_s tr(Y_s (M_s(x) - M0_s)), Y = `weights` (S, k, k), as a functional of the spectrum."""
        weighty = weighty_ones(weights)
        vector = np.tensordot(self.information_maps[:, weighty], weights[weighty], axes=3)
        return Functional(vector, self.gradients.value_density(weights))

    def density_at(self, place: DensityPlace) -> Functional:
        """Return v^* Phi v at one frequency as a functional; it has no density over frequency."""
        vector = self.basis.directed(place.frequency, place.direction)
        return Functional(vector, self.gradients.zero_density, concentrated=True)

    def density_breaches(self, x: Array, s: float, *, above: float) -> list[DensityBreach]:
        """Return the local maxima beyond `above` of Phi over its limits, which s multiplies unless fixed."""
        found = []
        for index, limit in enumerate(self.densities):
            factor = self.bound_factor(limit.upper, s)

            def ratio(w: Array, limit: DensityLimit = limit, factor: float = factor) -> Array:
                return breach_ratio(limit, self.basis.density(x, w) / factor, w)

            grid = np.union1d(limit.grid, self._fine_grid)
            w, _ = local_maxima(ratio, grid, ratio(grid), above=above)
            found += breaches_at(limit, index, self.basis.density(x, w) / factor, w, above=above)
        return found

    def form(self, form: NDArray[np.float64]) -> Functional:
        """Return a quadratic form (m, r, r) of the lags of the excitation as a functional of the spectrum."""
        polytope = self.polytope
        assert polytope is not None

        def density(w: Array) -> Array:
            return self.experiment.squeezed(polytope.density_of(form, w))

        vector = np.tensordot(self._lag_maps, weighted(form), axes=3)
        return Functional(vector, density)

    @cached_property
    def _lag_maps(self) -> NDArray[np.float64]:
        """Return the autocovariances of each basis function, (size, m, r, r)."""
        assert self.polytope is not None
        found = self.basis.integrals(self.polytope.lag_densities, self.experiment.singularities)
        inputs = self.experiment.inputs
        return found.reshape(len(found), -1, inputs, inputs)

    def with_form_grid(self, grid: Array) -> Array:
        """Return the grid with frequencies dense enough for polynomials of this many lags."""
        assert self.polytope is not None
        if self._form_grids.get(grid.size) is None:
            ripples = np.linspace(grid[0], grid[-1], _RIPPLE * self.polytope.windows.length)
            self._form_grids[grid.size] = np.union1d(grid, ripples)
        return self._form_grids[grid.size]

    @cached_property
    def _form_grids(self) -> dict[int, Array]:
        return {}

    @property
    def amplitude_power(self) -> float:
        """Return the largest power of signals within the amplitude, of all channels together."""
        assert self.polytope is not None
        return float(np.max(np.sum(self.polytope.windows.letters**2, axis=1)))

    def amplitude_facet(self, z: Array) -> tuple[float, Facet]:
        """Return the gauge of the lags of a spectrum within the amplitude, and the facet that shows it."""
        assert self.polytope is not None
        return self.polytope.gauge(np.tensordot(z, self._lag_maps, axes=1))

    @cached_property
    def _fine_grid(self) -> Array:
        """Return an even grid, denser at the ends of the band: sixteen points per degree."""
        lo, hi = self.experiment.band
        even = np.linspace(0.0, 1.0, 16 * (self.basis.degree + 1))
        return lo + (hi - lo) * np.union1d(even, 0.5 - 0.5 * np.cos(np.pi * even))

    def bound_factor(self, upper: bool, s: float) -> float:
        """Return the factor of a limit: s where limits scale, else one."""
        return s if self.scaled and (upper or not self.floors_fixed) else 1.0
