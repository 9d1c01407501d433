"""Search the record of a few levels that gives the least worst ratio, by its own finite information matrix.

The gradient of a soft maximum of the ratios improves a start: the most profitable values change at once. Then
short runs change one by one, two by two, and at last after random changes. Each change is an update of the
information matrix. The search is deterministic for a generator as long as time does not end it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.accuracy import Requirement
from inputdesign_cli.arrays import Array
from inputdesign_cli.information import FiniteRecord

_RUNS = (1, 2, 3, 5, 8)
_CLIMBS, _SHARE = 150, 0.1  # steps of the climb; the largest share of values that one step changes
# Sharpness of the soft maximum, at the start and the end of the climb, and for single changes.
_SOFT, _SHARP = 20.0, 120.0
_SHARPNESSES = (60.0, 200.0, 1000.0)
_TRIED, _PAIRED = 40, 12  # the most promising changes are tried alone, and in pairs
_BETTER = 1.0 - 1e-7
_NEAR = 0.7  # local maxima above this share of the largest ratio count while single values change
_KICKS = 3
_STALE = 20  # changes in a row that lower a soft maximum, but not the largest ratio


@dataclass(frozen=True)
class PlantGoal:
    """A plant, and what its model has to meet; ratios are of M in the coordinates of its experiment."""

    plant: FiniteRecord
    requirements: Sequence[Requirement]

    def worst(self, information: Array, below: float = np.inf) -> float:
        """Return the largest ratio, infinite for a singular M; polished over frequency if under `below`."""
        try:
            least = max(r.least(information) for r in self.requirements)
            return least if least >= below else max(r.worst(information).ratio for r in self.requirements)
        except np.linalg.LinAlgError:
            return np.inf

    def places(self, information: Array) -> list[tuple[Requirement, Array]]:
        """Return each requirement with the frequencies at which it is close to the worst."""
        found = [(r, r.violations(information)) for r in self.requirements]
        least = _NEAR * max((v.ratio for _, some in found for v in some), default=0.0)
        return [
            (r, np.array([0.0 if v.frequency is None else v.frequency for v in some if v.ratio >= least]))
            for r, some in found
        ]

    @cached_property
    def everywhere(self) -> list[tuple[Requirement, Array]]:
        """Return each requirement with frequencies over all of its band."""
        return [(r, getattr(r, "grid", np.zeros(1))) for r in self.requirements]


def _squares(places: list[tuple[Requirement, Array]], information: Array) -> Array:
    return np.concatenate([r.ratios(information, w) ** 2 for r, w in places if w.size])


@dataclass(frozen=True)
class _Held:
    """The gradient of the prediction of one plant, linear in values that are held for `hold` samples."""

    goal: PlantGoal
    values: int
    hold: int

    @cached_property
    def pulses(self) -> NDArray[np.float64]:
        """Return psi for a first value of one at each input, (r, samples, k p)."""
        samples, inputs = self.values * self.hold, self.goal.plant.experiment.inputs
        answers = []
        for channel in range(inputs):
            pulse = np.zeros((samples, inputs))
            pulse[: self.hold, channel] = 1.0
            answers.append(self.goal.plant.gradient(pulse).reshape(samples, -1))
        return np.array(answers)

    @cached_property
    def size(self) -> int:
        """Return the number of parameters k."""
        return self.goal.plant.experiment.size

    @cached_property
    def known(self) -> Array:
        """Return M0 (k, k)."""
        return self.goal.plant.known

    @cached_property
    def _transforms(self) -> tuple[int, NDArray[np.complex128]]:
        length = scipy.fft.next_fast_len(2 * self.values * self.hold, real=True)
        return length, scipy.fft.rfft(self.pulses, length, axis=1)

    def of(self, values: Array) -> Array:
        """Return psi (samples, k p) of values (n, r)."""
        length, pulses = self._transforms
        spaced = np.zeros((self.values * self.hold, values.shape[1]))
        spaced[:: self.hold] = values
        lines = scipy.fft.rfft(spaced, length, axis=0)
        return scipy.fft.irfft(np.einsum("wr,rwk->wk", lines, pulses), length, axis=0)[: len(spaced)]

    def adjoint(self, weights: Array) -> Array:
        """Return the transpose of `of`, applied to weights (samples, k p), (n, r)."""
        length, pulses = self._transforms
        lines = scipy.fft.rfft(weights, length, axis=0)
        back = scipy.fft.irfft(np.einsum("wk,rwk->wr", lines, pulses.conj()), length, axis=0)
        return back[: self.values * self.hold : self.hold]

    def changed(self, channel: int, first: int, steps: Array) -> Array:
        """Return the change of psi when values from `first` on change by `steps`, (samples, k p)."""
        samples = self.values * self.hold
        change = np.zeros((samples, self.pulses.shape[2]))
        for place, step in enumerate(steps, first):
            start = place * self.hold
            change[start:] += step * self.pulses[channel, : samples - start]
        return change

    def products(self, left: Array, right: Array) -> Array:
        """Return sum over samples and outputs of psi psi^T, (k, k)."""
        shape = (len(left), self.size, -1)
        a, b = left.reshape(shape), right.reshape(shape)
        return np.einsum("tip,tjp->ij", a, b) if a.shape[2] > 1 else left.T @ right

    def weighed(self, psi: Array, weight: Array) -> Array:
        """Return Y psi for every sample and output, (samples, k p)."""
        shaped = psi.reshape(len(psi), self.size, -1)
        return np.einsum("ij,tjp->tip", weight, shaped).reshape(psi.shape)

    def slopes(self, weight: Array) -> Array:
        """Return tr(Y psi_a psi_b^T) of pulses that are a number of values apart, (longest run, r)."""
        found = []
        for apart in range(min(max(_RUNS), self.values)):
            shift = apart * self.hold
            found.append(
                [
                    float(np.sum(self.weighed(one[: len(one) - shift], weight) * one[shift:]))
                    for one in self.pulses
                ]
            )
        return np.array(found)


@dataclass
class _Point:
    """A record of the search: its values (n, r), psi and M at each plant, and its worst ratio."""

    values: Array
    psis: list[Array]
    informations: list[Array]
    ratio: float


@dataclass(frozen=True)
class _Soft:
    """The soft maximum of the squared ratios at some places of every plant."""

    places: Sequence[list[tuple[Requirement, Array]]]
    sharpness: float

    def __call__(self, informations: Sequence[Array]) -> float:
        """Return it at these information matrices; infinite where one is singular."""
        try:
            found = [_squares(there, M) for there, M in zip(self.places, informations, strict=True)]
        except np.linalg.LinAlgError:
            return np.inf
        squares = np.concatenate(found)
        top = float(squares.max())
        return top * (
            1.0 + float(np.log(np.sum(np.exp(self.sharpness * (squares / top - 1.0))))) / self.sharpness
        )


Change = tuple[int, int, Array]


def _apart(one: Change, other: Change) -> bool:
    """Return whether two changes concern different values."""
    return one[0] != other[0] or one[1] + len(one[2]) <= other[1] or other[1] + len(other[2]) <= one[1]


class FlipSearch:
    """Searches records of `values` values from `letters` (levels,), each held for `hold` samples.

    Args:
        goals: the plants; the worst of them counts.
        letters: the levels of each input, (levels, r), the same number for every input.
        allowed: returns whether a record (samples, r) keeps to all other limits.
        most_moves: the largest number of changes of the inputs, from rest.
        returns: whether the last value is zero.
    """

    def __init__(
        self,
        goals: Sequence[PlantGoal],
        letters: Array,
        values: int,
        hold: int = 1,
        allowed: Callable[[Array], bool] | None = None,
        *,
        most_moves: int | None = None,
        returns: bool = False,
    ) -> None:
        self._held = [_Held(goal, values, hold) for goal in goals]
        self._hardest = list(range(len(goals)))  # the plants, the latest that excluded a record first
        self._letters, self._hold, self._allowed = letters, hold, allowed
        self._most_moves, self._returns = most_moves, returns

    def best(
        self,
        starts: Iterable[Array],
        rng: np.random.Generator,
        *,
        enough: float,
        over: Callable[[], bool],
        changes: int = 40,
    ) -> tuple[Array, float]:
        """Return the best record (samples, r) and its ratio.

        Args:
            starts: values (n, r), each improved on its own; the best is improved on.
            enough: ends the search once a ratio is as small.
            over: returns whether time is over; it is called between changes.
            changes: the number of random changes of the best record that are tried at last.
        """
        best: _Point | None = None
        for start in starts:
            point = self._descended(self._climbed(self._at(start), over), over, enough)
            if best is None or point.ratio < best.ratio:
                best = point
            if over() or best.ratio <= enough:
                break
        assert best is not None
        for _ in range(changes):
            if over() or best.ratio <= enough:
                break
            kicked = self._kicked(best.values, rng)
            if not self.keeps(kicked):
                continue
            point = self._descended(self._at(kicked), over, enough)
            if point.ratio < best.ratio:
                best = point
        return np.repeat(best.values, self._hold, axis=0), best.ratio

    def ranked(self, starts: Iterable[Array], most: int) -> list[Array]:
        """Return the best `most` of values (n, r), the one with the least worst ratio first."""
        kept: list[tuple[float, Array]] = []
        for values in starts:
            ratio = self._at(values, kept[-1][0] if len(kept) >= most else np.inf).ratio
            kept = sorted([*kept, (ratio, values)], key=lambda one: one[0])[:most]
        return [values for _, values in kept]

    def keeps(self, values: Array) -> bool:
        """Return whether values (n, r) keep to the limits beside their levels."""
        if self._most_moves is not None and moves_of(values) > self._most_moves:
            return False
        return self._allowed is None or self._allowed(np.repeat(values, self._hold, axis=0))

    def _at(self, values: Array, below: float = np.inf) -> _Point:
        psis = [held.of(values) for held in self._held]
        informations = [
            held.known + held.products(psi, psi) for held, psi in zip(self._held, psis, strict=True)
        ]
        return _Point(values, psis, informations, self._worst(informations, below))

    def _worst(self, informations: Sequence[Array], below: float) -> float:
        """Return the largest ratio, or if it is not under `below`, any ratio that is not."""
        largest = 0.0
        for place, number in enumerate(self._hardest):
            largest = max(largest, self._held[number].goal.worst(informations[number], below))
            if largest >= below:
                self._hardest.insert(0, self._hardest.pop(place))
                break
        return largest

    def _weights(self, point: _Point, places: Sequence, sharpness: float) -> list[Array]:
        """Return minus the slopes in M of the soft maximum of the squared ratios at every plant, (k, k)."""
        squares = [_squares(there, M) for there, M in zip(places, point.informations, strict=True)]
        top = max(float(one.max()) for one in squares)
        shares = [np.exp(sharpness * (one / top - 1.0)) for one in squares]
        total = sum(float(one.sum()) for one in shares)
        found = []
        for there, M, share in zip(places, point.informations, shares, strict=True):
            ends = np.cumsum([w.size for _, w in there])[:-1]
            each = zip(there, np.split(share / total, ends), strict=True)
            found.append(np.sum([r.slope(M, w, part) for (r, w), part in each if w.size], axis=0))
        return found

    def _gradient(self, point: _Point, weights: Sequence[Array]) -> Array:
        """Return half the slope in the values of tr(Y M), (n, r)."""
        each = zip(self._held, point.psis, weights, strict=True)
        return np.sum([held.adjoint(held.weighed(psi, Y)) for held, psi, Y in each], axis=0)

    def _climbed(self, start: _Point, over: Callable[[], bool]) -> _Point:
        """Change the most profitable values together, ever fewer of them."""
        best = point = start
        if not np.isfinite(start.ratio):
            return start
        places = [held.goal.everywhere for held in self._held]
        for step in range(_CLIMBS):
            if over():
                break
            sharpness = _SOFT + (_SHARP - _SOFT) * step / _CLIMBS
            gradient = self._gradient(point, self._weights(point, places, sharpness))
            wanted = self._letters[
                np.argmax(gradient[:, None] * self._letters, axis=1), range(gradient.shape[1])
            ]
            if self._returns:
                wanted[-1] = 0.0
            gain = (wanted - point.values) * gradient
            most = max(1, int(_SHARE * (1.0 - step / _CLIMBS) * gain.size))
            order = np.argsort(-gain, axis=None)[:most]
            order = order[gain.ravel()[order] > 0.0]
            if not order.size:
                break
            values = point.values.copy()
            values.ravel()[order] = wanted.ravel()[order]
            point = self._at(values, best.ratio)
            if not np.isfinite(point.ratio):  # it has no gradient
                break
            if point.ratio < best.ratio and self.keeps(values):
                best = point
        return best

    def _descended(self, point: _Point, over: Callable[[], bool], enough: float) -> _Point:
        """Change runs one by one, and two by two, to lower ever sharper soft maxima of the ratios."""
        best = point
        for sharpness in _SHARPNESSES if np.isfinite(point.ratio) else ():
            # Each point has a soft maximum at frequencies of its own, so that the search may go in a circle.
            stale = 0
            while stale < _STALE and not over() and best.ratio > enough:
                places = [h.goal.places(M) for h, M in zip(self._held, point.informations, strict=True)]
                soft = _Soft(places, sharpness)
                changes = self._changes(point, self._weights(point, places, sharpness))
                better = self._first_better(point, [[c] for c in changes[:_TRIED]], soft, best.ratio)
                if better is None:
                    pairs = [list(pair) for pair in combinations(changes[:_PAIRED], 2) if _apart(*pair)]
                    better = self._first_better(point, pairs, soft, best.ratio)
                if better is None:
                    break
                point, stale = better, stale + 1
                if point.ratio < _BETTER * best.ratio:
                    best, stale = point, 0
        return best

    def _changes(self, point: _Point, weights: Sequence[Array]) -> list[tuple[int, int, Array]]:
        """Return changes of runs, (channel, first value, steps), the most promising first."""
        gradient = self._gradient(point, weights)
        apart = np.sum([h.slopes(Y) for h, Y in zip(self._held, weights, strict=True)], axis=0)
        found: list[tuple[float, int, int, Array]] = []
        spare = np.inf if self._most_moves is None else self._most_moves - moves_of(point.values)
        for channel in range(point.values.shape[1]):
            column, levels = point.values[:, channel], self._letters[:, channel]
            options = (
                [-2.0 * column] if len(levels) == 2 and levels.sum() == 0.0 else [v - column for v in levels]
            )
            for steps in options:
                along = 2.0 * steps * gradient[:, channel]
                for run in _RUNS:
                    if run > len(column):
                        break
                    ahead = np.lib.stride_tricks.sliding_window_view(steps, run)
                    gain = np.lib.stride_tricks.sliding_window_view(along, run).sum(axis=1)
                    toeplitz = scipy.linalg.toeplitz(apart[:run, channel])
                    gain = gain + np.einsum("ni,ij,nj->n", ahead, toeplitz, ahead)
                    if np.isfinite(spare):
                        gain[_more_moves(column, ahead) > spare] = -np.inf
                    if self._returns:
                        gain[-1] = -np.inf
                    for first in np.argsort(-gain)[:_TRIED]:
                        if np.any(ahead[first]) and np.isfinite(gain[first]):
                            found.append((float(gain[first]), channel, int(first), ahead[first]))
        found.sort(key=lambda one: -one[0])
        return [one[1:] for one in found]

    def _first_better(
        self, point: _Point, tried: list[list[Change]], soft: _Soft, below: float
    ) -> _Point | None:
        """Return the first of some changes, each of several runs, that lowers the soft maximum.

        Its ratio is exact if it is under `below`.
        """
        least = soft(point.informations)
        for changes in tried:
            psis, informations = [], []
            for held, psi, M in zip(self._held, point.psis, point.informations, strict=True):
                step = np.sum([held.changed(*change) for change in changes], axis=0)
                cross = held.products(step, psi)
                psis.append(psi + step)
                informations.append(M + cross + cross.T + held.products(step, step))
            if soft(informations) >= _BETTER * least:
                continue
            values = point.values.copy()
            for channel, first, steps in changes:
                values[first : first + len(steps), channel] += steps
            if self.keeps(values):
                return _Point(values, psis, informations, self._worst(informations, below))
        return None

    def _kicked(self, values: Array, rng: np.random.Generator) -> Array:
        """Return the values with a few runs changed at random."""
        changed = values.copy()
        for _ in range(_KICKS):
            channel, run = int(rng.integers(values.shape[1])), int(rng.choice(_RUNS))
            first = int(rng.integers(max(1, len(values) - run + 1)))
            levels = self._letters[:, channel]
            if len(levels) == 2:
                changed[first : first + run, channel] = levels.sum() - changed[first : first + run, channel]
            else:
                changed[first : first + run, channel] = rng.choice(levels)
        if self._returns:
            changed[-1] = 0.0
        return changed


def moves_of(values: Array) -> int:
    """Return the number of changes of all inputs from one value (n, r) to the next, the first from rest."""
    return int(np.count_nonzero(np.diff(values, axis=0, prepend=0.0)))


def _more_moves(column: Array, steps: Array) -> Array:
    """Return how many moves a column (n,) gains by steps (n - run + 1, run) at each place, as integers."""
    run = steps.shape[1]
    window = np.lib.stride_tricks.sliding_window_view(column, run)
    before, after = np.append(0.0, column)[: len(window)], np.append(column, np.nan)[run:][: len(window)]

    def count(values: Array) -> Array:
        edges = (values[:, 0] != before).astype(int) + ((values[:, -1] != after) & ~np.isnan(after))
        return edges + np.count_nonzero(np.diff(values, axis=1), axis=1)

    return count(window + steps) - count(window)


def with_few_moves(values: Array, most: int) -> Array:
    """Return values (n, r) whose shortest runs have joined the run before, until `most` moves are left."""
    for shortest in range(1, len(values) + 1):
        if moves_of(values) <= most:
            break
        columns = []
        for column in values.T:
            starts = np.append(0, 1 + np.flatnonzero(np.diff(column)))
            kept = starts[(np.diff(starts, append=len(column)) > shortest) | (starts == 0)]
            columns.append(column[kept][np.searchsorted(kept, np.arange(len(column)), side="right") - 1])
        values = np.stack(columns, axis=1)
    return values
