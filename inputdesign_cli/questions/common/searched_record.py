"""The best record of a few levels within an amplitude that a search finds, and its distance to the bound."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from inputdesign_cli.accuracy import criterion_of
from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import time_is_over
from inputdesign_cli.design.convex.designs import Design
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.signal.evaluation import MET
from inputdesign_cli.signal.flips import FlipSearch, PlantGoal, with_few_moves
from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.signal.lines import Lines
from inputdesign_cli.signal.prbs import shifted_sequences
from inputdesign_cli.signal.selection import Record
from inputdesign_cli.signal.settings import SignalSettings

# Starts: signs of random signals with the best spectrum, and PRBS of these registers and clocks. The best of
# them are improved, and then random changes of the best record are tried.
_DRAWN, _REGISTERS, _CLOCKS = 8, range(2, 12), (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
_IMPROVED, _CHANGES = 6, 1000
_FEW = 2048  # if there are no more records, all are tried
# The shortest length is found to this share of it; one length takes this share of the remaining time.
_FINE, _SHARE = 0.005, 0.25
_SHORTER = 0.6  # next length, as a share of the way from the bound to the shortest so far


def searches(design: Design, settings: SignalSettings) -> bool:
    """Return whether records are searched: of a few levels, as accurate or as short as an amplitude lets."""
    free = settings.periods == 1 and not settings.ramp and settings.level is None
    kind = kind_of(settings.method)
    of_levels = kind.few_levels and not kind.flat
    return free and of_levels and design.any_record is not None and not design.problem.side


@dataclass
class LevelSearch:
    """Searches records of a few levels for a design whose bound over all records is known.

    Args:
        plants: returns the plants, one for each scenario, for records of a length.
        cost: returns the cost of samples (n, r).
        amplitude: amplitude (r,) of the levels; None: the levels of the first record.
        allowed: says whether samples (n, r) keep to the limits beside the amplitude; None if there is none.
        most_moves: the largest number of changes of the inputs in a number of samples; None without a limit.
    """

    design: Design
    settings: SignalSettings
    plants: Callable[[int], Sequence[FiniteRecord]]
    cost: Callable[[Array], float]
    amplitude: Array | None = None
    allowed: Callable[[Array], bool] | None = None
    most_moves: Callable[[int], int | None] = lambda _: None

    def __post_init__(self) -> None:
        """Begin to count the time that the search may take."""
        self._rng, self._ends = np.random.default_rng(self.settings.seed), 0.0
        self._ends = time.monotonic() + self.settings.seconds

    def best(self, record: Array) -> Array:
        """Return the best record (n, r) that is found from a first one, no worse than that.

        It ends at `settings.tolerance` above the bound over all records, when time is over, or after a number
        of tries. The least cost is the cost at the lowest level that meets the accuracy.
        """
        bound, power = self.design.any_record, 1.0
        assert bound is not None
        if self.design.problem.goal == "cost":
            power = self.cost(record if self.amplitude is None else self.amplitude[None])
            power /= 1.0 + self.settings.tolerance
        enough = (1.0 + self.settings.tolerance) * float(np.sqrt(bound.bound / power))
        return self._improved(record, len(record) // self.settings.hold, enough, self._over)[0]

    def shortest(self, record: Array) -> Array:
        """Return the shortest record (n, r) that is found from one that meets the accuracy, at most as long.

        Lengths between that of the bound over all records and of the shortest record so far are tried.
        """
        bound, hold = self.design.any_record, self.settings.hold
        assert bound is not None
        low, high = int(bound.bound) // hold, len(record) // hold
        while high - low > max(_FINE * high, 1.0) and not self._over():
            tried = min(max(low + int(_SHORTER * (high - low)), low + 1), high - 1)
            ends = time.monotonic() + _SHARE * (self._ends - time.monotonic())

            def over(ends: float = ends) -> bool:
                return self._over() or time.monotonic() >= ends

            found, ratio = self._improved(record[: tried * hold], tried, 1.0, over)
            if ratio <= MET:
                record, high = found, tried
            else:
                low = tried
        return record

    def _over(self) -> bool:
        return time_is_over() or time.monotonic() >= self._ends

    def _improved(
        self, record: Array, values: int, enough: float, over: Callable[[], bool]
    ) -> tuple[Array, float]:
        """Return the best record (n, r) found from a first one and from other starts, and its ratio."""
        hold, returns = self.settings.hold, self.settings.returns
        letters, most = _levels(record[:-hold] if returns else record), self.most_moves(values * hold)
        if self.amplitude is not None:  # the first record is as low as its own length allows
            record = self.amplitude * np.sign(record)
            letters = self.amplitude * np.linspace(-1.0, 1.0, len(letters))[:, None]
        goals = [
            PlantGoal(plant, scenario.requirements)
            for plant, scenario in zip(self.plants(values * hold), self.design.problem.scenarios, strict=True)
        ]
        search = FlipSearch(goals, letters, values, hold, self.allowed, most_moves=most, returns=returns)
        own = _nearest(record[::hold], letters) if len(letters) == 2 else record[::hold]
        starts = [own, *(_nearest(start, letters) for start in self._starts(values))]
        if len(letters) ** own.size <= _FEW:  # then the best of all records is among the starts
            levels = np.array([*product(range(len(letters)), repeat=own.size)]).reshape(-1, *own.shape)
            starts += [*letters[levels, range(own.shape[1])]]
        if most is not None:
            starts = [with_few_moves(start, most - returns) for start in starts]
        if returns:
            starts = [np.append(start[:-1], 0.0 * start[:1], axis=0) for start in starts]
        starts = [start for start in starts if search.keeps(start)]
        return search.best(
            search.ranked(starts, _IMPROVED) or [own], self._rng, enough=enough, over=over, changes=_CHANGES
        )

    def _starts(self, values: int) -> Iterator[Array]:
        """Yield values (n, r): the record of the bound, pseudo-random sequences, noise of the spectrum."""
        bound = self.design.any_record
        assert bound is not None
        inputs = bound.best.shape[1]
        if len(bound.best) >= values:
            yield bound.best[:values]
        most = self.most_moves(values * self.settings.hold)
        slow = () if most is None else (-(-values // (most + 1)), max(values // (2 * most), 1))
        for clock in (*_CLOCKS, *slow):
            for bits in _REGISTERS:
                if clock <= values:
                    sequence = shifted_sequences(bits, -(-values // clock), inputs, self._rng)
                    yield np.repeat(sequence, clock, axis=0)[:values]
        lines = Lines(*bound.result.basis.lines(bound.result.x))
        turns = np.exp(1j * np.outer(np.arange(values), lines.frequencies))
        for _ in range(_DRAWN):
            phases = np.exp(2j * np.pi * self._rng.random((len(lines.powers), lines.inputs)))
            yield (turns @ np.einsum("lab,lb->la", lines.roots, phases)).real


def _levels(record: Array) -> Array:
    """Return the levels (levels, r) of a record (n, r): two for each input, or three with zero."""
    most = int(min(np.unique(column).size for column in record.T))
    ends = [record.min(axis=0), record.max(axis=0)]
    return np.array(ends if most < 3 else [ends[0], np.zeros(record.shape[1]), ends[1]])


def _nearest(values: Array, letters: Array) -> Array:
    """Return the sequence of levels (n, r) with the signs of some values."""
    return np.where(values >= 0.0, letters[-1], letters[0])


def distance_to_best(design: Design, record: Record, information: Array, cost: float) -> float | None:
    """Return how far a record of this information lies above the bound over all records, as a share.

    It is a share of errors, of the `cost`, or of samples where the experiment is as short as possible. None
    where no record was bounded.
    """
    bound, problem = design.any_record, design.problem
    if bound is None or problem.side:
        return None
    if problem.goal != "factor":
        return (cost if problem.goal == "cost" else len(record.samples)) / bound.bound - 1.0
    criterion, worst = criterion_of(problem.requirements), record.worst_ratio
    if criterion is not None:  # errors fall as the root of its level grows
        if len(problem.scenarios) > 1:
            return None
        worst = float(1.0 / np.sqrt(criterion.level(information)))
    return float(worst / np.sqrt(bound.bound) - 1.0)
