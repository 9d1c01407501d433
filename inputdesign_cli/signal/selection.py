"""The record to be applied: several candidates at the level each needs, the best by its own information."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import OutOfTimeError, seconds_left, time_is_over
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.signal.constraints import compressed, peak_ratio
from inputdesign_cli.signal.evaluation import MET, Evaluator, Target, first_level, last_level, level_of_power
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.limits import Bounds, Limiter

# Levels of the clipped records that are tried, in multiples of the largest level that needs no clipping.
_CLIPPED = (1.0, 1.4, 2.0, 3.0)
# A multiple of the level needed without limits; there all limits bind.
_FAR = 40.0
# The most changes of switching times that are tried in signals of two levels.
_SWITCHINGS = 600
# The most samples, over all candidates, that are drawn and compared together.
_AT_ONCE = 10_000
LONG = 2000
"""Samples beyond which a record takes seconds to make, so that searches for a better one try less."""
# Other phases hardly change the ratio of a record. More candidates are hopeless if the ratio is larger than
# this over enough samples, or if a few candidates miss by more than this multiple of their spread.
_HOPELESS, _SAMPLES, _TRIES, _SPREADS = 1.15, 100, 3, 2.0
# More candidates are tried while the best record costs more than this beyond the design, relative to it.
_EXTRA_COST = 0.05
_MOST_CHANGES = 3
_SHIFTED = 0.6  # the share of the changes that shift a switch; the others add or remove one
# After this number of tries, or a sixth of all, a search ends if its rate of gain would not be enough.
_STRETCH, _STRETCHES = 100, 6


def better_switching(
    values: Array,
    figure: Callable[[Array], float],
    rng: np.random.Generator,
    tries: int,
    enough: float | None = None,
) -> Array:
    """Return the best two-level signal (n, r) met from `values` on; out of time, the best so far.

    Args:
        figure: maps a signal of two levels to a number, to be small.
        enough: ends the search, as does a rate of gain that would not reach it. None: use all tries.
    """
    best, least = values, float(figure(values))
    stretch = max(min(_STRETCH, tries // _STRETCHES), 1)
    for left in range(tries, 0, -stretch):
        before = least
        for _ in range(min(left, stretch)):
            if time_is_over() or (enough is not None and least <= enough):
                return best
            tried = best
            for _ in range(rng.integers(1, _MOST_CHANGES + 1)):
                tried = _changed(tried, rng)
            reached = float(figure(tried))
            if reached < least:
                best, least = tried, reached
        if enough is not None and (before - least) * (left / stretch - 1.0) < least - enough:
            return best
    return best


def _changed(values: Array, rng: np.random.Generator) -> Array:
    """Return the signal with one switch of one input shifted, added or removed."""
    changed = values.copy()
    column = changed[:, rng.integers(changed.shape[1])]
    switches = 1 + np.flatnonzero(np.diff(np.sign(column)))
    chance = rng.random()
    if switches.size and chance < _SHIFTED:
        furthest = max(1, column.size // (2 * switches.size))
        at, by = int(rng.choice(switches)), int(rng.integers(1, furthest + 1))
        column[slice(at, at + by) if rng.random() < 0.5 else slice(max(at - by, 0), at)] *= -1.0
    elif switches.size and chance < 0.5 * (1.0 + _SHIFTED):
        column[int(rng.choice(switches)) :] *= -1.0
    else:
        column[int(rng.integers(column.size)) :] *= -1.0
    return changed


@dataclass(frozen=True)
class Record:
    """Holds the samples (n, r) of the excitation, their origin, and the worst r_u / r_adm that they reach.

    `extra_power` is the cost of their powers beyond the design, relative to it; `met` whether they meet
    the target; `factor_residual` the residual of the spectral factor, where one made them.
    """

    samples: Array
    method: str
    worst_ratio: float
    factor_residual: float | None = None
    extra_power: float = 0.0
    met: bool = True

    @property
    def power(self) -> float:
        """Return the mean square, of all inputs together."""
        return power_of(self.samples)


def best_record(
    generator: SignalGenerator,
    plant: FiniteRecord,
    target: Target,
    bounds: Bounds | None = None,
    *,
    first: bool = False,
    limiting: FiniteRecord | None = None,
) -> Record:
    """Return the best of several records of a designed spectrum, each from its own stream of the seed.

    Args:
        plant: the plant for records as long as the generator's.
        first: whether the first that meets the target is enough.
        limiting: the plants at which limits on single samples hold (default: all in `plant`).

    Raises:
        OutOfTimeError: the time limit passed before the first was made.
    """
    bounds, settings = bounds or Bounds(), generator.settings
    limiter = Limiter.of(limiting or plant, settings, bounds)
    candidates = _Candidates(generator, limiter, Evaluator(plant, target, bounds.powers))
    together = 1 if first else candidates.together
    number = max(min(together, settings.candidates), 1)
    best, missed = candidates.better(range(number), None)
    while number < max(settings.candidates, settings.most_candidates):
        if (first and best.met) or (number >= settings.candidates and candidates.suffices(best)):
            break
        if bounds.hard and candidates.free_level and not best.met and _hopeless(missed, len(best.samples)):
            break
        end = number + max(min(together, settings.candidates - number), 1)
        try:
            best, ratios = candidates.better(range(number, end), best)
        except OutOfTimeError:
            break
        number, missed = end, [*missed, *ratios]
    return best


def _hopeless(ratios: Sequence[float], samples: int) -> bool:
    """Return whether the worst ratios of candidates that all miss show that others will miss as well."""
    least, largest = min(ratios), max(ratios)
    if not np.isfinite(largest):
        return False
    far = samples >= _SAMPLES and least > _HOPELESS
    return far or (len(ratios) >= _TRIES and least - MET > _SPREADS * (largest - least))


def _stream(seed: int, number: int) -> np.random.Generator:
    """Return the generator of this candidate: the child that `SeedSequence.spawn` would make."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))


@dataclass(frozen=True)
class _Candidates:
    generator: SignalGenerator
    limiter: Limiter
    evaluator: Evaluator

    def rank(self, record: Record) -> tuple[bool, float]:
        """Rank records that meet the target by their cost, before all others by their ratio."""
        meets = self.evaluator.target.meets
        return (False, record.extra_power) if meets and record.met else (meets, record.worst_ratio)

    def suffices(self, record: Record) -> bool:
        """Return whether the search may end: little is left to gain, or limits stand in the way."""
        return not self.evaluator.target.meets or not self.limiter.plain or record.extra_power <= _EXTRA_COST

    @property
    def together(self) -> int:
        """Return how many candidates are compared at once: several where most of them can be left out."""
        return max(_AT_ONCE // self.generator.samples, 1) if self._free else 1

    def drawn(self, numbers: Sequence[int]) -> list[tuple[Array, np.random.Generator]]:
        """Return the values (m, r) of candidates with the power of the design, and their random numbers."""
        rngs = [_stream(self.generator.settings.seed, number) for number in numbers]
        found = []
        for values, rng in zip(self.generator.several(rngs), rngs, strict=True):
            power = power_of(values)
            if power > 0.0:  # a few samples may all be zeros of the sinusoids, and excite nothing
                values = values * np.sqrt(self.generator.spectrum.power / power)
            if self.generator.kind.slewed:
                values = self._switched(values, self._strongest, rng)
            found.append((values, rng))
        return found

    def better(self, numbers: Sequence[int], best: Record | None) -> tuple[Record, list[float]]:
        """Return the best of these candidates and the best so far, and the worst ratios of all tried.

        A candidate is left out where, at the cost of the best, it misses the target. The one with the least
        ratio there comes first: it leaves out most of the others.

        Raises:
            OutOfTimeError: the time limit has passed.
        """
        if best is None or self.generator.samples > LONG:  # short records take no time to speak of
            seconds_left()
        left, ratios = self.drawn(numbers), list[float]()
        while left:
            if self._free and (best is None or best.met):
                held = np.repeat([values for values, _ in left], self.limiter.settings.hold, axis=1)
                cost = self._designed * (1.0 if best is None else 1.0 + best.extra_power)
                least = self.evaluator.least_ratios(held, cost)
                order = np.argsort(least, kind="stable")
                left = [left[n] for n in order if best is None or not least[n] > MET]
            if left:
                other = self.record(*left.pop(0), switched=best is None)
                ratios.append(other.worst_ratio)
                best = other if best is None else min((best, other), key=self.rank)
        assert best is not None
        return best, ratios

    def record(self, values: Array, rng: np.random.Generator, *, switched: bool = False) -> Record:
        """Return the record of the values of a candidate at its level; `switched` is as in `_levelled`."""
        factor, evaluator = self.generator.factor, self.evaluator
        samples, met = self._levelled(values, rng, switched=switched)
        return Record(
            samples,
            self.generator.method,
            evaluator.ratio(samples),
            None if factor is None else factor.residual,
            evaluator.cost(samples) / self._designed - 1.0,
            met,
        )

    @property
    def _designed(self) -> float:
        """Return the cost of the design, or its power."""
        return self.evaluator.target.designed or self.generator.spectrum.power

    @cached_property
    def free_level(self) -> bool:
        """Return whether the level of a record is the one that it needs."""
        return self.evaluator.target.meets and self.limiter.settings.level is None

    @cached_property
    def _free(self) -> bool:
        """Return whether a record is its values at the level that it needs, and nothing else."""
        return self.free_level and self.limiter.plain

    @property
    def _strongest(self) -> float:
        """Return the highest level; where there is none, the level of the design."""
        return _FAR if np.isfinite(self.limiter.reach).all() else 1.0

    def _switched(self, values: Array, level: float, rng: np.random.Generator) -> Array:
        """Return the values (m, r) of two levels, switched at better times; repeated values stay so.

        Args:
            level: the level at which they are tried, where none is stated.
        """
        limiter, evaluator, settings = self.limiter, self.evaluator, self.limiter.settings
        if settings.level is not None:
            values, level = _of_peaks(values, settings.level), 1.0

        def figure(period: Array) -> float:
            return evaluator.figure(limiter.record(np.tile(period, (settings.periods, 1)), level))

        period = values[: len(values) // settings.periods]
        meets = evaluator.target.meets
        tries = _SWITCHINGS * LONG // max(len(values) * settings.hold, LONG) if meets else _SWITCHINGS
        better = better_switching(period, figure, rng, tries, 1.0 if meets else None)
        return np.tile(better, (settings.periods, 1))

    def _levelled(self, values: Array, rng: np.random.Generator, *, switched: bool) -> tuple[Array, bool]:
        """Return the record at its level, and whether it meets the target.

        Args:
            switched: whether two levels that miss it, as high as they may be, are switched at other times
                than the spectrum asks.
        """
        limiter, settings, evaluator = self.limiter, self.limiter.settings, self.evaluator
        if settings.level is not None:
            samples = limiter.record(_of_peaks(values, settings.level), 1.0)
            return samples, evaluator.figure(samples) <= 1.0
        if not evaluator.target.meets:
            record = self._at_levels(values)
            return (self._affordable(record, 1.0) if limiter.plain else self._best_within(values)), True
        held = np.repeat(values, settings.hold, axis=0)
        level = evaluator.needed_level(held)
        if level is None:
            return held, False
        record = self._at_levels(values)
        if evaluator.figure(record(level)) <= 1.0:
            return record(level), True
        kind = self.generator.kind
        if kind.few_levels and evaluator.ratio(record(_FAR * level)) > MET:
            # A higher level is always better, and the limits allow no higher one.
            if kind.switched and switched:
                values = self._switched(values, _FAR * level, rng)
                record = self._at_levels(values)
            if evaluator.figure(record(_FAR * level)) > 1.0:
                return self._affordable(record, _FAR * level), False
        if not limiter.plain:
            record = self._at_levels(self._lowered(values, level))
            level, met = first_level(lambda a: evaluator.figure(record(a)), 0.98 * level)
            if met:
                return record(level), True
        return self._affordable(record, level), False

    def _at_levels(self, values: Array) -> Callable[[float], Array]:
        """Return the record of the values (m, r) at each level; none is limited twice."""
        return cache(partial(self.limiter.record, values))

    def _best_within(self, values: Array) -> Array:
        """Return the most informative record between the highest that fits and one of the designed power.

        Clipping a record until it has that power may remove its weaker lines.
        """
        record = self._at_levels(values)
        strongest = self._of_designed_power(record)
        if self.generator.kind.of_levels:
            return strongest
        fit = self._fitting(values)
        tried = [strongest, *(self._affordable(record, share * fit) for share in _CLIPPED)]
        within = [samples for samples in tried if power_of(samples) <= power_of(strongest) * MET]
        return min(within, key=self.evaluator.ratio)

    def _fitting(self, values: Array) -> float:
        """Return the largest level at which the values need no change."""
        limiter = self.limiter
        return min(limiter.factor(values), 1.0 / max(peak_ratio(values, limiter.constraints), 1.0))

    def _of_designed_power(self, record: Callable[[float], Array]) -> Array:
        """Return the record of the power of the design, or of the most below that the limits allow."""
        power = self.generator.spectrum.power
        level = level_of_power(lambda a: power_of(record(a)), power, 1.0)
        while power_of(record(level)) > power * MET:
            level *= 1.0 - 1e-3
        return self._affordable(record, level)

    def _lowered(self, values: Array, level: float) -> Array:
        """Lower the peak of the values towards the limits, if that keeps their kind."""
        settings, reach = self.limiter.settings, float(self.limiter.reach[0])
        fixed = self.generator.kind.of_levels or settings.phases == "optimised" or settings.ramp
        # Phases of several inputs that give way one by one would spoil the cross-spectra.
        if np.isinf(reach) or fixed or values.shape[1] > 1:
            return values
        return compressed(values[:, 0], reach / level)[:, None]

    def _affordable(self, record: Callable[[float], Array], level: float) -> Array:
        """Return the record at this level, or as much of it as the limits on the powers allow."""
        share_of = self.evaluator.share
        share = share_of(record(level))
        if share >= 1.0:
            return record(level)
        if self.limiter.plain:
            return record(level * float(np.sqrt(share)))
        return record(last_level(lambda a: share_of(record(a)) >= 1.0, level))


def _of_peaks(values: Array, peaks: Array) -> Array:
    """Return the values (m, r), each input scaled to its peak (r,); one that is silent stays so."""
    largest = np.abs(values).max(axis=0)
    return values * (peaks / np.where(largest > 0.0, largest, 1.0))


def power_of(samples: Array) -> float:
    """Return the mean square, summed over the channels."""
    return float(np.sum(np.mean(samples**2, axis=0)))
