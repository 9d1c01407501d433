"""From a spectrum to the record to be applied: several candidates, the best by its own information."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.signal.achieved import input_and_output, record_information
from inputdesign_cli.signal.draw import Drawer
from inputdesign_cli.signal.dress import Bounds, Dresser
from inputdesign_cli.signal.recipe import LEVELLED, Method, Recipe
from inputdesign_cli.signal.settle import first_level, least_level, level_of_power
from inputdesign_cli.signal.within import compressed
from inputdesign_cli.spectrum import FirBasis, LinesBasis

# A record meets the accuracy when its ratio exceeds one by no more than rounding.
_MET = 1.0 + 1e-9
# A record that costs more than the design by this share is worth more draws.
_LITTLE = 0.05


@dataclass(frozen=True)
class Record:
    """The samples (n,) of the excitation, what made them, and the worst r_u / r_adm that they buy.

    `extra_power` is what their powers cost beyond the design, relative to it; `met` whether they do what
    was asked of them.
    """

    samples: Array
    method: Method
    worst_ratio: float
    factor_residual: float | None = None
    extra_power: float = 0.0
    met: bool = True


@dataclass(frozen=True)
class Demand:
    """What a record is judged by.

    `worst_ratio` maps an information matrix to the largest r_u / r_adm (or another figure, to be small).
    With `meets` the level of the record is the lowest at which that is at most one; without, the record
    has the power of the design. `cost` weighs powers, to rank records that meet the demand, and
    `designed` is what the design costs in the same weights.
    """

    worst_ratio: Callable[[Array], float]
    meets: bool = False
    cost: Mapping[PowerKind, float] = field(default_factory=lambda: {"excitation": 1.0})
    designed: float | None = None


def realise(
    experiment: Experiment,
    basis: FirBasis | LinesBasis,
    x: Array,
    demand: Demand,
    recipe: Recipe,
    *,
    samples: int,
    bounds: Bounds | None = None,
) -> Record:
    """The best of several records of the spectrum, each from its own stream of the recipe's seed.

    Filtered noise needs a spectral factor. Where that cannot be had to 1e-8 (a spectrum with deep
    zeros) a multisine is made instead, which needs none; `Record.method` says so.
    """
    drawer = Drawer(basis, x, recipe, samples)
    chooser = _Chooser(Dresser(experiment, recipe, bounds or Bounds()), drawer, demand)
    streams = np.random.SeedSequence(recipe.seed).spawn(max(recipe.candidates, recipe.most_candidates))
    best: Record | None = None
    for number, stream in enumerate(streams):
        if best is not None and number >= recipe.candidates and chooser.settles(best):
            break
        best = min(
            (r for r in (best, chooser.candidate(np.random.default_rng(stream))) if r), key=chooser.rank
        )
    if best is None:
        raise ValueError("at least one candidate is needed")
    return best


@dataclass(frozen=True)
class _Chooser:
    dresser: Dresser
    drawer: Drawer
    demand: Demand

    def rank(self, record: Record) -> tuple[bool, float]:
        """Those that meet the demand by their cost, before the others by their ratio."""
        if not (self.demand.meets and record.met):
            return (self.demand.meets, record.worst_ratio)
        return (False, self._cost(record.samples))

    def settles(self, record: Record) -> bool:
        """Whether it is not worth looking on: little is left to gain, or limits stand in the way."""
        return not self.demand.meets or not self.dresser.plain or record.extra_power <= _LITTLE

    def candidate(self, rng: np.random.Generator) -> Record:
        values = self.drawer.values(rng, self._gains())
        values = values * np.sqrt(self.drawer.total / np.mean(values**2))
        samples, met = self._levelled(values)
        factor = self.drawer.factor
        return Record(
            samples,
            self.drawer.method,
            self._ratio(samples),
            None if factor is None else factor.residual,
            self._cost(samples) / (self.demand.designed or self.drawer.total) - 1.0,
            met,
        )

    def _gains(self) -> tuple[ComplexArray, ...]:
        recipe = self.drawer.recipe
        wanted = recipe.phases == "optimised" and self.drawer.method == "multisine" and recipe.hold == 1
        return self.dresser.gains(self.drawer.lines.frequencies) if wanted else ()

    def _levelled(self, values: Array) -> tuple[Array, bool]:
        """The record at its level, and whether it does what is asked."""
        dresser, recipe = self.dresser, self.dresser.recipe
        if recipe.level is not None:
            samples = dresser.dress(values, recipe.level / float(np.abs(values).max()))
            return samples, self._accepts(samples)
        if not self.demand.meets:
            if dresser.plain:
                return dresser.dress(values, 1.0), True
            return self._of_designed_power(values), True
        level = self._needed(values)
        if level is None:
            return np.repeat(values, recipe.hold), False
        samples = dresser.dress(values, level)
        if self._accepts(samples):
            return samples, True
        if not dresser.plain:
            values = self._lowered(values, level)
            found = first_level(lambda a: self._accepts(dresser.dress(values, a)), 0.98 * level)
            if found is not None:
                return dresser.dress(values, found), True
            level = self._nearest(values, level)
        return self._affordable(values, level), False

    def _of_designed_power(self, values: Array) -> Array:
        """The record of the power of the design, or of the most below that the limits allow."""
        dress, total = self.dresser.dress, self.drawer.total
        level = level_of_power(lambda a: float(np.mean(dress(values, a) ** 2)), total, 1.0)
        samples = dress(values, level)
        while np.mean(samples**2) > total * _MET:
            level *= 1.0 - 1e-3
            samples = dress(values, level)
        return samples

    def _needed(self, values: Array) -> float | None:
        """The level that the accuracy needs, were there no limits; None when no level is enough."""
        held = np.repeat(values, self.dresser.recipe.hold)
        experiment = self.dresser.experiment
        full = record_information(experiment, held)
        known = record_information(experiment, np.zeros(held.size))
        try:
            return least_level(lambda a: self.demand.worst_ratio(known + a**2 * (full - known)), 1.0)
        except np.linalg.LinAlgError:  # too short to excite every parameter
            return None

    def _lowered(self, values: Array, level: float) -> Array:
        """The values with their peak lowered towards what the limits leave, if that keeps their kind."""
        recipe, amplitude = self.dresser.recipe, self.dresser.amplitude
        fixed = recipe.method in LEVELLED or recipe.phases == "optimised" or recipe.ramp
        return values if amplitude is None or fixed else compressed(values, amplitude / level)

    def _accepts(self, samples: Array) -> bool:
        return self._ratio(samples) <= _MET and self._affords(samples)

    def _affords(self, samples: Array) -> bool:
        powers = self._powers(samples)
        return all(powers[kind] <= most * _MET for kind, most in self.dresser.bounds.powers)

    def _nearest(self, values: Array, level: float) -> float:
        """The level of the least ratio, where none is low enough."""
        levels = level * np.geomspace(0.5, 20.0, 16)
        return float(min(levels, key=lambda a: self._ratio(self.dresser.dress(values, a))))

    def _affordable(self, values: Array, level: float) -> Array:
        """The record at this level, or as much of it as the limits on the powers allow."""
        samples = self.dresser.dress(values, level)
        powers = self._powers(samples)
        share = min((most / powers[kind] for kind, most in self.dresser.bounds.powers), default=1.0)
        return samples if share >= 1.0 else self.dresser.dress(values, level * np.sqrt(share))

    def _ratio(self, samples: Array) -> float:
        try:
            return self.demand.worst_ratio(record_information(self.dresser.experiment, samples))
        except np.linalg.LinAlgError:
            return np.inf

    def _cost(self, samples: Array) -> float:
        powers = self._powers(samples)
        return float(sum(weight * powers[kind] for kind, weight in self.demand.cost.items()))

    def _powers(self, samples: Array) -> dict[PowerKind, float]:
        u, y = input_and_output(self.dresser.experiment, samples)
        means = (float(np.mean(signal**2)) for signal in (u, y, samples))
        return dict(zip(("input", "output", "excitation"), means, strict=True))
