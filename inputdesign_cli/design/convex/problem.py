"""The one sentence that every convex design here is an instance of.

minimise an objective of the spectrum x, subject to x in the cone of spectra, M_s(x) = M0_s + sum_i x_i M_si
meeting every requirement of every scenario s, and the powers and the density of x within their limits.

A scenario is a plant that the true one might be. The nominal plant is the first, and most designs have no
other; what is said of information below is then said of one matrix.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
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
from inputdesign_cli.plant import common_grid, graded_grid, local_maxima
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spectrum import Basis, Functional

RequirementFactory = Callable[[Experiment], Requirement]
Goal = Literal["cost", "factor", "samples"]
Weight = float | tuple[float, ...]
# So many scenarios are enough for a next step: what serves the worst few serves most of the others.
FEW = 4


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


def weighty_ones(weights: NDArray[np.float64]) -> list[int]:
    """The scenarios whose weight Y_s of `weights` (S, k, k) is not zero."""
    return np.flatnonzero(np.any(weights, axis=(1, 2))).tolist()


@dataclass(frozen=True)
class Scenario:
    """A plant that the design must serve, in coordinates of its own, and what is required of it there."""

    experiment: Experiment
    requirements: tuple[Requirement, ...]
    side: tuple[Requirement, ...] = ()


@dataclass
class Seen:
    """The ratios (S,) that scenarios had at most, and K (S, k, k) with K M K^T = I there.

    Ratios fall as information grows: where M_s >= c times what it was, the ratio is at most 1 / sqrt(c) of
    what it was. Most of many scenarios need not be looked at again.
    """

    ratios: Array
    roots: NDArray[np.float64] | None = None

    @classmethod
    def none(cls, number: int) -> Seen:
        """Nothing is known yet."""
        return cls(np.full(number, np.inf))

    def most(self, informations: NDArray[np.float64]) -> Array:
        """(S,): the largest ratios that are possible with these M_s (S, k, k)."""
        if self.roots is None:
            return self.ratios.copy()
        share = np.linalg.eigvalsh(self.roots @ informations @ self.roots.swapaxes(1, 2))[:, 0]
        with np.errstate(divide="ignore"):
            return np.where(share > 0.0, self.ratios / np.sqrt(np.maximum(share, 0.0)), np.inf)

    def note(self, number: int, information: Array, ratio: float) -> None:
        """What a scenario was found to have, at most."""
        if self.roots is None:
            self.roots = np.broadcast_to(
                np.eye(len(information)), (self.ratios.size, *information.shape)
            ).copy()
        try:
            self.roots[number] = np.linalg.inv(np.linalg.cholesky(information))
            self.ratios[number] = ratio
        except np.linalg.LinAlgError:
            self.ratios[number] = np.inf


@dataclass(frozen=True)
class Asked:
    """One requirement of all, of the scenario with this number; `side` as in `Problem`."""

    scenario: int
    requirement: Requirement
    side: bool


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

    `requirements` are made for the coordinates of `experiment`, that of the nominal plant. `side`
    requirements (goal "factor") must be met by M(x) itself. `others` are the scenarios besides, of the same
    structure and length: each M_s meets the requirements of its own. A spectrum causes other powers at each
    of them: limits name theirs, and the cost is that of the nominal plant, or with `mean_cost` the mean over
    all.

    A density limit stands beside a limit on the power of the excitation (`design.limits.implied_power`). With
    `floors_fixed` (goal "factor") lower limits do not scale: the least multiple of the upper limits for which
    they can be met. `finer` is a problem of the same experiment on the same or a larger basis, of whose
    integrals those of this basis are the head.
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
    mean_cost: bool = False
    finer: Problem | None = field(default=None, repr=False)
    _before: list[Problem] = field(default_factory=list, init=False, repr=False)

    @cached_property
    def scenarios(self) -> tuple[Scenario, ...]:
        """All S plants, the nominal one first."""
        return (Scenario(self.experiment, self.requirements, self.side), *self.others)

    @cached_property
    def asked(self) -> tuple[Asked, ...]:
        """All requirements, scenario by scenario, side ones after the others of theirs."""
        return tuple(
            Asked(number, requirement, side)
            for number, scenario in enumerate(self.scenarios)
            for side, listed in ((False, scenario.requirements), (True, scenario.side))
            for requirement in listed
        )

    def with_requirements(self, of: Callable[[Scenario], tuple[Requirement, ...]]) -> Problem:
        """The same problem with other requirements at every scenario, and no side ones."""
        others = tuple(replace(one, requirements=of(one), side=()) for one in self.others)
        return replace(self, requirements=of(self.scenarios[0]), side=(), others=others)

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
        _ = grown.information_maps, grown.grid
        for key in self._powers:
            grown.power(*key)
        if self.mean_cost and self.others:
            _ = grown._mean_price
        grown._before.clear()
        grown._products.update(self._products)
        grown._grids.update(self._grids)
        if self.others:
            vars(grown)["_seen"] = self._seen
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
        return any(asked.requirement.definite for asked in self.asked)

    @cached_property
    def information_maps(self) -> NDArray[np.float64]:
        """(size, S, k, k): M_si, the information of each basis function at each scenario."""
        if self.finer is not None:
            return self.finer.information_maps[: self.basis.size]
        basis = self.basis.beyond(self._before[0].basis.size) if self._before else self.basis
        found = np.empty((basis.size, len(self.scenarios), *2 * (self.experiment.size,)))
        for number, scenario in enumerate(self.scenarios):
            at = scenario.experiment
            found[:, number] = basis.integrals(
                at.information_density, at.singularities, at.information_factor
            )
        return np.concatenate([*(before.information_maps for before in self._before), found])

    @property
    def information_map(self) -> NDArray[np.float64]:
        """(size, k, k): those of the nominal plant."""
        return self.information_maps[:, 0]

    @cached_property
    def baselines(self) -> NDArray[np.float64]:
        """(S, k, k): M0_s, what is known of each scenario without excitation."""
        return np.array([scenario.experiment.baseline_information for scenario in self.scenarios])

    @property
    def baseline_information(self) -> Array:
        """(k, k): M0 of the nominal plant."""
        return self.experiment.baseline_information

    def informations(self, x: Array) -> NDArray[np.float64]:
        """(S, k, k): M_s(x)."""
        return self.baselines + self.excited(x)

    def information(self, x: Array) -> Array:
        """(k, k): M(x) of the nominal plant."""
        return self.baseline_information + np.tensordot(x, self.information_map, axes=1)

    def excited(self, x: Array) -> NDArray[np.float64]:
        """(S, k, k): sum_i x_i M_si."""
        return np.tensordot(x, self.information_maps, axes=1)

    @cached_property
    def fixed_information(self) -> NDArray[np.float64]:
        """(S, k, k): the part of M' that neither x nor s scales."""
        if self.goal == "cost":
            return self.baselines
        if self.goal == "samples":
            return np.array([scenario.experiment.prior_information for scenario in self.scenarios])
        return np.zeros_like(self.baselines)

    @cached_property
    def scaled_information(self) -> NDArray[np.float64]:
        """(S, k, k): the part of M' in proportion to s."""
        if self.goal == "cost":
            return np.zeros_like(self.baselines)
        if self.goal == "samples":
            return np.array([scenario.experiment.noise_information for scenario in self.scenarios])
        return self.baselines

    @cached_property
    def price(self) -> Functional:
        """What x is measured by: the cost, or without one the sum of all powers over their upper limits."""
        if self.goal == "cost":
            if self.mean_cost and self.others:
                return self._mean_price
            parts = [self.power(kind, channel) * weight for kind, channel, weight in weights_of(self.cost)]
        else:
            caps = [limit for limit in self.limits if limit.upper]
            parts = [self._limited(limit) * (1.0 / limit.bound) for limit in caps]
        total = parts[0]
        for part in parts[1:]:
            total = total + part
        return total

    @cached_property
    def _mean_price(self) -> Functional:
        """The mean of the cost over all plants."""
        weights, plants = weights_of(self.cost), [scenario.experiment for scenario in self.scenarios]
        last: list[tuple[Array, NDArray]] = []

        def density(w: Array) -> NDArray:
            if not last or last[0][0] is not w:
                total = sum(plant.cost_density(weights, w) for plant in plants)
                last[:] = [(w, np.asarray(total / len(plants)))]
            return last[0][1]

        def vector(basis: Basis) -> Array:
            each = (
                basis.integrals(partial(plant.cost_density, weights), plant.singularities) for plant in plants
            )
            return np.asarray(sum(each) / len(plants))

        if self.finer is not None:
            return Functional(self.finer._mean_price.vector[: self.basis.size], density)
        if self._before:
            known = self._before[0]._mean_price.vector
            return Functional(np.concatenate([known, vector(self.basis.beyond(known.size))]), density)
        return Functional(vector(self.basis), density)

    def power(self, kind: PowerKind, channel: int | None = None, scenario: int = 0) -> Functional:
        """The power of input, output or excitation (of one channel) as a functional of the spectrum."""
        known = self._powers.get((kind, channel, scenario))
        if known is not None:
            return known
        # Without this problem inside, which would keep the arrays of each that has grown beyond it.
        experiment = self.scenarios[scenario].experiment

        def density(w: Array) -> Array:
            return experiment.power_density(kind, w, channel)

        if self.finer is not None:
            vector = self.finer.power(kind, channel, scenario).vector[: self.basis.size]
        elif self._before:
            vector = self._before[0].power(kind, channel, scenario).vector
            more = self.basis.beyond(vector.size).integrals(density, experiment.singularities)
            vector = np.concatenate([vector, more])
        else:
            vector = self.basis.integrals(density, experiment.singularities)
        self._powers[kind, channel, scenario] = Functional(vector, density)
        return self._powers[kind, channel, scenario]

    @cached_property
    def _powers(self) -> dict[tuple[PowerKind, int | None, int], Functional]:
        return {}

    def _limited(self, limit: PowerLimit) -> Functional:
        return self.power(limit.kind, limit.channel, limit.scenario)

    @cached_property
    def limit_functionals(self) -> tuple[Functional, ...]:
        """The limited powers, one a limit."""
        return tuple(self._limited(limit) for limit in self.limits)

    def value(self, weights: NDArray[np.float64]) -> Functional:
        """sum_s tr(Y_s (M_s(x) - M0_s)) for fixed Y = `weights` (S, k, k) as a functional of the spectrum."""
        weighty = weighty_ones(weights)
        grid = self.grid_of(weighty)
        known: list[NDArray] = []

        def density(w: Array) -> NDArray:
            if w is grid and known:  # asked for again with every share that limits keep of a price
                return known[0]
            parts = (self._worth(number, weights[number], w, on_grid=w is grid) for number in weighty)
            total = sum(parts, self._worthless(w))
            if w is grid:
                known.append(total)
            return total

        vector = np.tensordot(self.information_maps[:, weighty], weights[weighty], axes=3)
        return Functional(vector, density)

    def _worthless(self, w: Array) -> NDArray:
        r = self.experiment.inputs
        return np.zeros((np.size(w), *(() if r == 1 else (r, r))))

    def _worth(self, scenario: int, weight: Array, w: Array, *, on_grid: bool) -> NDArray:
        """The density of tr(Y M_s) at frequencies `w`; the gradients on a grid are kept."""
        experiment = self.scenarios[scenario].experiment
        if not on_grid:
            return experiment.value_density(weight, w)
        known = self._products.get(scenario)
        if known is None or known[0] is not w:
            known = self._products[scenario] = (w, experiment.products(w))
        return experiment.valued(known[1], weight)

    @cached_property
    def _products(self) -> dict[int, tuple[Array, WeightedProducts]]:
        """The gradients of scenarios on the grid that they were last asked for at."""
        return {}

    def density_at(self, place: DensityPlace) -> Functional:
        """v^* Phi v at one frequency as a functional; it has no density over frequency."""
        vector = self.basis.directed(place.frequency, place.direction)
        return Functional(vector, self._worthless, concentrated=True)

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
        """Frequencies that see every resonance of the nominal plant's densities, over the band."""
        if self._before:
            return self._before[0].grid
        return graded_grid(self.experiment.singularities, *self.experiment.band)

    def grid_of(self, scenarios: Sequence[int]) -> Array:
        """The same for the densities of these scenarios together."""
        others = frozenset(scenarios) - {0}
        if not others:
            return self.grid
        if others not in self._grids:
            plants = [self.scenarios[number].experiment.singularities for number in (0, *sorted(others))]
            self._grids[others] = common_grid(plants, *self.experiment.band)
        return self._grids[others]

    @cached_property
    def _grids(self) -> dict[frozenset[int], Array]:
        return {}

    def violations(
        self,
        informations: NDArray[np.float64],
        *,
        above: float = -np.inf,
        side: bool = False,
        few: int | None = None,
    ) -> list[tuple[int, Violation]]:
        """All local maxima of all requirements' ratios, each with the index of its requirement in `asked`.

        Args:
            side: look at the side requirements, not at the others.
            few: so many scenarios with violations are enough; those that were worst before are first.
        """
        if not self.others:
            return list(self._violated(0, informations[0], above, side))
        found, bad = list[tuple[int, Violation]](), 0
        for number in self._by_most(informations, above, side):
            own = list(self._violated(number, informations[number], above, side))
            found += own
            bad += bool(own)
            if few is not None and bad >= few:
                break
        return found

    def largest(self, informations: NDArray[np.float64], *, default: float) -> float:
        """The largest ratio of the requirements, side ones left out; the default without any."""
        found: list[float] = []
        for number in self._by_most(informations, -np.inf, False) if self.others else [0]:
            if found and self._seen[0].ratios[number] <= max(found):
                break  # the next ones are no larger
            found += [v.ratio for _, v in self._violated(number, informations[number], -np.inf, False)]
        return max(found, default=default)

    def _by_most(self, informations: NDArray[np.float64], above: float, side: bool) -> list[int]:
        """The scenarios whose ratios may exceed `above`, those that may have the largest first."""
        seen = self._seen[int(side)]
        for number in np.flatnonzero(seen.most(informations) > above).tolist():
            asked = [self.asked[index] for index in self._asked_of[number]]
            most = [a.requirement.most(informations[number]) for a in asked if a.side == side]
            seen.note(number, informations[number], max(most, default=0.0))
        now = seen.most(informations)
        return [n for n in np.argsort(-now, kind="stable").tolist() if now[n] > above]

    def _violated(
        self, number: int, information: Array, above: float, side: bool
    ) -> Iterator[tuple[int, Violation]]:
        """Those of one scenario."""
        for index in self._asked_of[number]:
            if self.asked[index].side == side:
                for violation in self.asked[index].requirement.violations(information, above=above):
                    yield index, violation

    @cached_property
    def _seen(self) -> tuple[Seen, Seen]:
        """What is known of the ratios of requirements, and of side ones."""
        return Seen.none(len(self.scenarios)), Seen.none(len(self.scenarios))

    @cached_property
    def _asked_of(self) -> list[list[int]]:
        """The numbers of its requirements for each scenario."""
        return [
            [index for index, asked in enumerate(self.asked) if asked.scenario == number]
            for number in range(len(self.scenarios))
        ]

    def requirement(self, index: int) -> Requirement:
        """By the index that `violations` gives."""
        return self.asked[index].requirement

    def worst_ratio(self, informations: NDArray[np.float64]) -> Violation:
        """The worst violation of all requirements, criteria left out."""
        found = [
            violation
            for asked in self.asked
            if not isinstance(asked.requirement, Criterion)
            for violation in asked.requirement.violations(informations[asked.scenario])
        ]
        return worst(found)
