"""The record to be applied: several candidates at the level each needs, the best by its own information."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from inputdesign_cli.information import PowerKind
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal.constraints import compressed
from inputdesign_cli.signal.level_search import first_level, last_level, least_level, level_of_power
from inputdesign_cli.signal.limiter import Limiter
from inputdesign_cli.signal.settings import LEVELLED, Method

# A record meets the accuracy when its ratio exceeds one by no more than rounding.
_MET = 1.0 + 1e-9
# Times the level that would do without limits: there they all bite.
_FAR = 40.0
# A record that costs more than the design by this share is worth more draws.
_LITTLE = 0.05


@dataclass(frozen=True)
class Record:
    """The samples (n,) or (n, r) of the excitation, what made them, and the worst r_u / r_adm that they buy.

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
class Target:
    """What a record is judged by.

    `worst_ratio` maps an information matrix to the largest r_u / r_adm (or another figure, to be small).
    With `meets` the level of the record is the lowest at which that is at most one; without, the record
    has the power of the design. `cost` weighs powers (of all channels together, or one weight a channel),
    to rank records that meet the demand, and `designed` is what the design costs in the same weights.
    """

    worst_ratio: Callable[[Array], float]
    meets: bool = False
    cost: Mapping[PowerKind, float | tuple[float, ...]] = field(default_factory=lambda: {"excitation": 1.0})
    designed: float | None = None


@dataclass(frozen=True)
class Evaluator:
    """The plant on which records are tried.

    `information` maps samples to their matrix (k, k), and `powers` to mean squares by channel, kind by
    kind; `limits` are the largest of these: kind, channel (None is the sum over the channels), bound.
    """

    information: Callable[[Array], Array]
    powers: Callable[[Array], Mapping[PowerKind, Array]]
    limits: tuple[tuple[PowerKind, int | None, float], ...] = ()


@dataclass(frozen=True)
class Candidates:
    """What candidates are drawn from: `draw` makes the values of one (m,) or (m, r), at any level.

    `total` is the power of the design, of all channels together.
    """

    draw: Callable[[np.random.Generator], Array]
    method: Method
    total: float
    factor_residual: float | None = None


def best_record(shape: Candidates, limiter: Limiter, bench: Evaluator, demand: Target) -> Record:
    """The best of several records, each from its own stream of the recipe's seed."""
    chooser, recipe = _Chooser(shape, limiter, bench, demand), limiter.recipe
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
    shape: Candidates
    limiter: Limiter
    bench: Evaluator
    demand: Target

    def rank(self, record: Record) -> tuple[bool, float]:
        """Those that meet the demand by their cost, before the others by their ratio."""
        if not (self.demand.meets and record.met):
            return (self.demand.meets, record.worst_ratio)
        return (False, self._cost(record.samples))

    def settles(self, record: Record) -> bool:
        """Whether it is not worth looking on: little is left to gain, or limits stand in the way."""
        return not self.demand.meets or not self.limiter.plain or record.extra_power <= _LITTLE

    def candidate(self, rng: np.random.Generator) -> Record:
        shape = self.shape
        values = shape.draw(rng)
        values = values * np.sqrt(shape.total / _power(values))
        samples, met = self._levelled(values)
        return Record(
            samples,
            shape.method,
            self._ratio(samples),
            shape.factor_residual,
            self._cost(samples) / (self.demand.designed or shape.total) - 1.0,
            met,
        )

    def _levelled(self, values: Array) -> tuple[Array, bool]:
        """The record at its level, and whether it does what is asked."""
        limiter, recipe = self.limiter, self.limiter.recipe
        if recipe.level is not None:
            peaks = np.abs(values).max(axis=0)
            samples = limiter.dress(values * (recipe.level / np.where(peaks > 0.0, peaks, 1.0)), 1.0)
            return samples, self._accepts(samples)
        if not self.demand.meets:
            if limiter.plain:
                return self._affordable(values, 1.0), True
            return self._of_designed_power(values), True
        level = self._needed(values)
        if level is None:
            return np.repeat(values, recipe.hold, axis=0), False
        samples = limiter.dress(values, level)
        if self._accepts(samples):
            return samples, True
        if recipe.method in LEVELLED and self._ratio(limiter.dress(values, _FAR * level)) > _MET:
            # More of the same levels is always better, and there is no more.
            return self._affordable(values, _FAR * level), False
        if not limiter.plain:
            values = self._lowered(values, level)
            level, met = first_level(lambda a: self._figure(limiter.dress(values, a)), 0.98 * level)
            if met:
                return limiter.dress(values, level), True
        return self._affordable(values, level), False

    def _of_designed_power(self, values: Array) -> Array:
        """The record of the power of the design, or of the most below that the limits allow."""
        dress, total = self.limiter.dress, self.shape.total
        level = level_of_power(lambda a: _power(dress(values, a)), total, 1.0)
        samples = dress(values, level)
        while _power(samples) > total * _MET:
            level *= 1.0 - 1e-3
            samples = dress(values, level)
        return self._affordable(values, level)

    def _needed(self, values: Array) -> float | None:
        """The level that the accuracy needs, were there no limits; None when no level is enough."""
        held = np.repeat(values, self.limiter.recipe.hold, axis=0)
        full = self.bench.information(held)
        known = self.bench.information(np.zeros_like(held))
        try:
            return least_level(lambda a: self.demand.worst_ratio(known + a**2 * (full - known)), 1.0)
        except np.linalg.LinAlgError:  # too short to excite every parameter
            return None

    def _lowered(self, values: Array, level: float) -> Array:
        """The values with their peak lowered towards what the limits leave, if that keeps their kind."""
        recipe, reach = self.limiter.recipe, self.limiter.rooms[0].reach
        fixed = recipe.method in LEVELLED or recipe.phases == "optimised" or recipe.ramp
        # Phases of one input that give way by themselves would spoil the cross-spectra.
        alone = values.ndim == 1
        return compressed(values, reach / level) if reach is not None and alone and not fixed else values

    def _accepts(self, samples: Array) -> bool:
        return self._figure(samples) <= 1.0

    def _figure(self, samples: Array) -> float:
        """At most one for a record that does what is asked; infinite beyond the limits on the powers."""
        return self._ratio(samples) / _MET if self._share(samples) >= 1.0 / _MET else np.inf

    def _share(self, samples: Array) -> float:
        """The largest factor on its powers that the limits leave to the record."""
        if not self.bench.limits:
            return np.inf
        powers = self.bench.powers(samples)
        spent = [
            (most, float(powers[kind].sum() if channel is None else powers[kind][channel]))
            for kind, channel, most in self.bench.limits
        ]
        return min((most / power for most, power in spent if power > 0.0), default=np.inf)

    def _affordable(self, values: Array, level: float) -> Array:
        """The record at this level, or as much of it as the limits on the powers allow."""
        dress = self.limiter.dress
        samples = dress(values, level)
        share = self._share(samples)
        if share >= 1.0 or self.limiter.plain:
            return samples if share >= 1.0 else dress(values, level * np.sqrt(share))
        return dress(values, last_level(lambda a: self._share(dress(values, a)) >= 1.0, level))

    def _ratio(self, samples: Array) -> float:
        try:
            return self.demand.worst_ratio(self.bench.information(samples))
        except np.linalg.LinAlgError:
            return np.inf

    def _cost(self, samples: Array) -> float:
        powers = self.bench.powers(samples)
        return float(
            sum(np.sum(np.asarray(weight) * powers[kind]) for kind, weight in self.demand.cost.items())
        )


def _power(samples: Array) -> float:
    """The mean square, summed over the channels."""
    return float(np.sum(np.mean(samples**2, axis=0)))
