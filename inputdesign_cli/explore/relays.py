"""Relays: whether an output tells when an input of two levels switches.

Between two jumps the input is in one state, and a phase of that state ends with the next jump. Of all phases
of a state that have lasted as long, that which ends now is any of them where someone else switches: its
output, before the jump, has any rank among theirs, as in a model of proportional hazards ([cox-1972]). A
relay ends the phase whose output is farthest on its way. No model of the plant is needed, and none of how
long phases last; where all end at once there is nothing to compare.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array

# Of fewer phases of a state nothing is told; neighbours in time are compared, so that slow drifts of both
# signals, which agree by chance, do not count.
_FEWEST, _NEIGHBOURS = 4, 15
# Each state by itself must tell as much, and so many of the phases must take the output to the other level.
_EACH, _CARRIED = 0.05, 0.8
# A pulse train: so many of its cycles last equally long, to a sample.
_CLOCKED = 0.95
# At this level the phase before tells how long one lasts. Then so much must be certain without what it tells,
# or all where the levels at which the input switches, in the median, deviate by more than this share of what
# lies between them: by less than that those of a relay with a fixed set point do.
_TOLD, _ALSO, _RESTING = 1e-3, 0.5, 0.2
# Values of the exponent of a bound of a probability.
_EXPONENTS = np.geomspace(0.05, 80.0, 33)
_ALIKE = 1e-9
Parts = Sequence[tuple[Array, Array]]


@dataclass(frozen=True)
class _Phase:
    """A stretch of one level of an input: y (n, p) of its record, where it begins, and how long it lasts.

    Attributes:
        before: how long the phase before lasted.
        ended: whether by a jump, not by the end of the record.
        on: the state.
    """

    y: Array
    start: int
    length: int
    before: int
    ended: bool
    on: bool

    @property
    def begins(self) -> Array:
        """(p,), the outputs about the jump that begins it."""
        return np.asarray(0.5 * (self.y[self.start - 1] + self.y[self.start]))

    @property
    def ending(self) -> Array:
        """(p,), the outputs about the jump that ends it."""
        end = self.start + self.length
        return np.asarray(0.5 * (self.y[end - 1] + self.y[end]))

    def after(self, samples: int) -> Array:
        """(p,), the outputs in the last of so many samples."""
        return np.asarray(self.y[self.start + samples - 1])


@dataclass(frozen=True)
class _Compared:
    """Scores (n,) of the outputs of phases that have lasted as long, of mean zero, and which of them end."""

    scores: Array
    ends: NDArray[np.bool_]


def told_by_levels(parts: Parts, j: int) -> float:
    """The probability that no output tells when input j switches, of records u (n, r), y (n, p).

    One where it has not two levels, or is a train of pulses of one period.
    """
    if any(len(np.unique(u[:, j])) > 2 for u, _ in parts):
        return 1.0
    phases = [phase for u, y in parts for phase in _phases(u[:, j], y)]
    states = [[phase for phase in phases if phase.on == on] for on in (True, False)]
    if min(sum(phase.ended for phase in state) for state in states) < _FEWEST or _is_clocked(states):
        return 1.0
    outputs = parts[0][1].shape[1]
    return min(1.0, outputs * min(_by_output(states, i) for i in range(outputs)))


def _phases(u: Array, y: Array) -> list[_Phase]:
    """Those of which it is known when they began, and how long the phase before lasted at least."""
    jumps = np.flatnonzero(np.diff(u)) + 1
    ends = [*jumps[1:].tolist(), len(u)]
    level = 0.5 * (float(np.min(u)) + float(np.max(u)))
    starts, last, found = jumps.tolist(), 0, []
    for start, end in zip(starts, ends[: len(starts)], strict=True):
        found.append(_Phase(y, start, end - start, start - last, end < len(u), bool(u[start] > level)))
        last = start
    return found


def _is_clocked(states: Sequence[Sequence[_Phase]]) -> bool:
    """Whether pulses begin, end or have their middle once in a fixed time: their width is what is set."""
    for state in states:
        lasts = np.array([phase.length for phase in state if phase.ended])
        before = np.array([phase.before for phase in state if phase.ended])
        middles = 0.5 * (before[1:] + before[:-1]) + lasts[:-1]
        for cycles in (lasts + before, before[1:] + lasts[:-1], middles):
            alike = (cycles[:, None] >= cycles) & (cycles[:, None] <= cycles + 1.0)
            if np.max(np.mean(alike, axis=0)) >= _CLOCKED:
                return True
    return False


def _by_output(states: Sequence[Sequence[_Phase]], i: int) -> float:
    """The probability of one output: itself, and its way since the jump, for a set point may move."""
    ways = [
        np.array([phase.after(phase.length)[i] - phase.begins[i] for phase in state if phase.ended])
        for state in states
    ]
    sign = float(np.sign(np.mean(ways[0]) - np.mean(ways[1])))
    if min(np.mean(sign * ways[0] > 0.0), np.mean(sign * ways[1] < 0.0)) < _CARRIED:
        return 1.0

    def itself(phase: _Phase, samples: int) -> float:
        return float(phase.after(samples)[i])

    def way(phase: _Phase, samples: int) -> float:
        return float(phase.after(samples)[i] - phase.begins[i])

    def chance(*, adjusted: bool, each: float = _EACH) -> float:
        found = []
        for covariate in (itself, way):
            on, off = (
                _compared(state, covariate, side, adjusted=adjusted)
                for state, side in zip(states, (sign, -sign), strict=True)
            )
            found.append(_bound([*on, *off]) if max(_bound(on), _bound(off)) <= each else 1.0)
        return min(1.0, 2.0 * min(found))

    if not any(map(_is_told, states)):
        return chance(adjusted=False)
    if not _rests(states, i):
        return chance(adjusted=True)
    return chance(adjusted=False) if chance(adjusted=True, each=1.0) < _ALSO else 1.0


def _rests(states: Sequence[Sequence[_Phase]], i: int) -> bool:
    """Whether an output is at the same two levels at most of the jumps."""
    levels = [np.array([one.ending[i] for one in state if one.ended]) for state in states]
    between = abs(float(np.median(levels[0]) - np.median(levels[1])))
    return all(np.median(np.abs(x - np.median(x))) <= _RESTING * between for x in levels)


def _is_told(state: Sequence[_Phase]) -> bool:
    """Whether the phase before tells how long phases of a state last.

    Such an input has a memory, as the plant has one of the input, and the two may go together in open loop.
    """
    ended = [phase for phase in state if phase.ended]
    x, z = np.log([[phase.length for phase in ended], [phase.before for phase in ended]])
    x, z = x - x.mean(), z - z.mean()
    left = float(x @ x) - float(x @ z) ** 2 / max(float(z @ z), 1e-300)
    freedom = len(ended) - 2
    statistic = freedom * (float(x @ x) - left) / max(left, 1e-12)
    return bool(scipy.special.fdtrc(1, freedom, statistic) < _TOLD)


def _compared(
    state: Sequence[_Phase], covariate: Callable[[_Phase, int], float], sign: float, *, adjusted: bool
) -> list[_Compared]:
    """Ranks of an output, times the sign, at each length of a phase that ended.

    Args:
        adjusted: leave out what the phase before tells.
    """
    values, known, ends = [], [], []
    for block in np.array_split(np.arange(len(state)), max(len(state) // _NEIGHBOURS, 1)):
        near = [state[k] for k in block]
        for length in sorted({phase.length for phase in near if phase.ended}):
            risk = [phase for phase in near if phase.length >= length + (not phase.ended)]
            ending = np.array([phase.length == length for phase in risk])
            if not np.all(ending):
                x = sign * np.array([covariate(phase, length) for phase in risk])
                z = np.log([phase.before for phase in risk])
                values.append(x - x.mean())
                known.append(z - z.mean())
                ends.append(ending)
    if not values:
        return []
    if adjusted:
        z = np.concatenate(known)
        slope = float(np.concatenate(values) @ z) / max(float(z @ z), 1e-300)
        values = [x - slope * own for x, own in zip(values, known, strict=True)]
    grain = _ALIKE * max(float(np.max(np.abs(x))) for x in values)
    found = []
    for x, ending in zip(values, ends, strict=True):
        ranks = scipy.stats.rankdata(np.round(x / max(grain, 1e-300)))
        found.append(_Compared(ranks / len(ranks) - 0.5 * (len(ranks) + 1) / len(ranks), ending))
    return found


def _bound(compared: Sequence[_Compared]) -> float:
    """The probability, at most, that scores of ends drawn by chance have so high a sum.

    That of [chernoff-1952]: from the mean of exp(t sum), of draws without replacement.
    """
    total = np.zeros(_EXPONENTS.size)
    for one in compared:
        scores, number = one.scores, int(np.sum(one.ends))
        if 2 * number > scores.size:  # those that go on, whose sum is the opposite one
            scores, number = -scores, scores.size - number
        total += _log_mean(scores, number) - _EXPONENTS * float(np.sum(one.scores[one.ends]))
    return float(np.exp(min(np.min(total), 0.0)))


def _log_mean(scores: Array, number: int) -> Array:
    """Of exp(t s), s the sum of so many of the scores (n,), over all that may be drawn: at every t."""
    top = float(np.max(scores))
    sums = np.zeros((number + 1, _EXPONENTS.size))  # elementary symmetric polynomials of the exponentials
    sums[0] = 1.0
    for score in scores.tolist():
        sums[1:] = sums[1:] + np.exp(_EXPONENTS * (score - top)) * sums[:-1]
    ways = (scipy.special.gammaln(k + 1.0) for k in (scores.size, number, scores.size - number))
    every, drawn, left = ways
    return np.asarray(
        np.log(np.maximum(sums[number], 1e-300)) + _EXPONENTS * number * top - (every - drawn - left)
    )
