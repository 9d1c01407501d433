"""Inputs that are switched: whether the noise of an output makes them jump, or the output knows before.

A thermostat holds its input until the output passes a level, so that nothing but the time of its jumps
answers the noise. What is new in an output at and before a jump is compared with what is new there as long
after jumps of the same direction, since a model that is not quite right leaves a pattern between the jumps.
Where someone else switches the input nothing is left.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.busiest import busiest
from inputdesign_cli.explore.inputs import past, untold
from inputdesign_cli.identification.frequency_response import found_period

_LAGS = 20
# Of longer records the stretch in which the inputs move most is enough.
_MOST_SAMPLES = 4000
_CERTAIN, _LITTLE = 1e-4, 0.01
# A sample before a relay switches the noise has not made it do so: at this level that is seen as well.
_ALSO = 0.003
# A jump is at least this share of the largest one; fewer than so many tell nothing, and an input that jumps
# at a larger share of its samples is not held.
_JUMP, _FEWEST, _HELD = 0.25, 8, 1.0 / 3.0
# Times after a jump that lie within this part of an octave are alike; of fewer nothing is compared.
_ALIKE, _COMPARED = 4.0, 4
_SAME = 1e-6  # of sizes of jumps
# What is new is rounding where it is less than this share of the output.
_ROUNDING = 1e-6
# What is new in an input is nothing where it has less than this share of its power.
_FAINT = 1e-6
# A relay has so many levels at most.
_LEVELS = 4
Parts = Sequence[tuple[Array, Array]]


@dataclass(frozen=True)
class Early:
    """An output that moves so many `samples` before an input does, with the probability of that by chance."""

    input: int
    output: int
    samples: int
    probability: float


def switched_by(parts: Parts, j: int) -> float:
    """The probability that no output makes input j jump, of records u (n, r), y (n, p); one without any."""
    if not parts:
        return 1.0
    outputs = parts[0][1].shape[1]
    return min(1.0, outputs * min(_answers(parts, j, i).against for i in range(outputs)))


def early_answers(parts: Parts) -> list[Early]:
    """Outputs that know of moves of an input before these are logged, as their plant answers them.

    Of jumps it is asked whether what is new in an output goes their way; of all that is new in an input,
    whether it goes together with what was new in an output before. An input that moves at most samples may
    do so because of the noise of an output, which it sends back.
    """
    inputs, outputs = parts[0][0].shape[1], parts[0][1].shape[1]
    parts, found = busiest(parts, _MOST_SAMPLES), []
    held = [j for j in range(inputs) if _moving(parts, j) <= _HELD]
    for j in held:
        for i in range(outputs):
            tried = (_answers(parts, j, i), _foretold(parts, j, i))
            answers = min(tried, key=lambda one: one.ahead)
            probability = len(tried) * inputs * outputs * answers.ahead
            # What is said of one side shows a little on the other at other lags.
            if probability < min(_CERTAIN, _LITTLE * min(one.against for one in tried)):
                found.append(Early(j, i, answers.lead, probability))
    return found


@dataclass(frozen=True)
class _Answers:
    """Probabilities by which an output foretells jumps by chance.

    Attributes:
        at_once: as the noise of a relay does, see `_relayed`.
        along, opposed: (lags,), what is new in it so many samples before, from one on: to the side to which
            the plant answers a jump, and to the other one.
    """

    at_once: float
    along: Array
    opposed: Array

    @property
    def against(self) -> float:
        """Of jumps that the output makes."""
        return min(1.0, 2.0 * min(self.at_once, self.opposed.size * float(np.min(self.opposed))))

    @property
    def ahead(self) -> float:
        """Of an output that answers jumps to come."""
        return min(1.0, self.along.size * float(np.min(self.along)))

    @property
    def lead(self) -> int:
        """The samples by which it does so."""
        return 1 + int(np.flatnonzero(self.along.size * self.along < _CERTAIN)[-1])


def _answers(parts: Parts, j: int, i: int) -> _Answers:
    lags, long = _centred(parts, i)
    largest = max((float(np.max(np.abs(np.diff(u[:, j])))) for u, _ in long), default=0.0)
    held = [_Held.of(u[lags - 1 :, j], _JUMP * largest) for u, _ in long]
    jumps, samples = sum(one.jumps.size for one in held), sum(one.moves.size for one in held)
    if largest > 0.0 and _FEWEST <= jumps <= _HELD * samples:
        new = _new(long, lags, present=True)
        if np.std(np.concatenate(new)) > _ROUNDING * np.std(np.concatenate([y for _, y in long])):
            sign = _sign(long, lags, j)
            at_once = _relayed(held, _new(long, lags, present=False), sign)
            each = [_by_chance(sign * _surprises(held, new, k)) for k in range(1, lags + 1)]
            return _Answers(at_once, *(np.array(side) for side in zip(*each, strict=True)))
    return _Answers(1.0, np.ones(lags), np.ones(lags))


def _moving(parts: Parts, j: int) -> float:
    """The share of the samples at which an input is another than at the one before."""
    moves = np.concatenate([np.diff(u[:, j]) for u, _ in parts])
    return float(np.mean(moves != 0.0)) if moves.size else 0.0


def _foretold(parts: Parts, j: int, i: int) -> _Answers:
    """By what is new in input j, beyond the past of all inputs, and what was new in output i before.

    An input that repeats tells nothing: what a plant that is not linear adds comes again with it. Nor does
    one of few levels, which a relay may switch by rules that are not linear: of that its jumps tell.
    """
    lags, long = _centred(parts, i)
    nothing = _Answers(1.0, np.ones(lags), np.ones(lags))
    longest = max((u[:, j] for u, _ in long), key=len, default=np.zeros(0))
    if np.unique(longest).size <= _LEVELS or found_period(longest):
        return nothing
    # An input that answers the same sample of an output has its noise.
    new = _new(long, lags, present=False)
    moves = untold([past(u, lags) for u, _ in long], [u[lags:, j] for u, _ in long])
    power = float(np.mean(np.concatenate(moves) ** 2))
    spread = float(np.sqrt(np.mean(np.concatenate(new) ** 2)))
    if power <= _FAINT * np.var(longest) or spread <= _ROUNDING * np.std(long[0][1]):
        return nothing
    outputs = [y[lags:, 0] for _, y in long]
    # What an output does after a move, beyond the sample whose noise the move may have answered.
    after = sum(
        float(own[: len(own) - lag] @ (y[lag:] - y[1 : len(y) - lag + 1]))
        for own, y in zip(moves, outputs, strict=True)
        for lag in range(2, lags + 1)
    )
    t = np.zeros(lags + 1)
    for k in range(lags + 1):
        later = np.concatenate([own[k:] for own in moves])
        before = np.concatenate([own[: len(own) - k] for own in new])
        size = float(np.linalg.norm(later)) * spread
        t[k] = np.sign(after) * float(later @ before) / size if size else 0.0
    # An input that answers an output at once is moved by its noise, and moves back a sample later.
    found = _Answers(float(scipy.special.ndtr(t[0])), scipy.special.ndtr(-t[1:]), scipy.special.ndtr(t[1:]))
    return found if found.against > _ALSO else nothing


def _centred(parts: Parts, i: int) -> tuple[int, list[tuple[Array, Array]]]:
    """How many lags are looked at, and the inputs and output i of records that are long enough for them."""
    lags = max(min(_LAGS, sum(len(y) for _, y in parts) // (8 * (parts[0][0].shape[1] + 1))), 1)
    return lags, [
        (u - u.mean(axis=0), y[:, i : i + 1] - y[:, i].mean()) for u, y in parts if len(y) > 3 * lags
    ]


@dataclass(frozen=True)
class _Held:
    """An input between its jumps: its moves (n,), the samples at which it jumps, and the last before each."""

    moves: Array
    jumps: NDArray[np.int64]
    last: NDArray[np.int64]

    @classmethod
    def of(cls, u: Array, least: float) -> _Held:
        """Of samples (n + 1,) of an input whose jumps are larger than `least`."""
        moves = np.diff(u)
        jumps = np.abs(moves) > least
        at = np.where(jumps, np.arange(moves.size), -1)
        last = np.concatenate([[-1], np.maximum.accumulate(at)[:-1]])
        return cls(moves, np.flatnonzero(jumps), last)

    def like(self, sample: int) -> tuple[bool, int] | None:
        """The direction of the last jump, and how long ago that was; None before the first."""
        last = int(self.last[sample])
        if last < 0:
            return None
        return bool(self.moves[last] > 0.0), int(_ALIKE * np.log2(sample - last))


def _relayed(held: Sequence[_Held], new: Sequence[Array], sign: float) -> float:
    """The probability that noise does not make a relay switch, at the side to which it holds the plant.

    Noise carries the output past the level, and a sample before it had not done so. It is no larger there
    than elsewhere, while what a plant that acts at once does is as large as the jump. A relay has two
    levels.
    """
    moves = np.abs(np.concatenate([one.moves for one in held]))
    if np.ptp(moves[moves > 0.0]) > _SAME * np.max(moves):
        return 1.0
    now, before = (sign * _surprises(held, new, lag) for lag in (0, 1))
    if now.size < _FEWEST or abs(np.mean(now)) > np.std(np.concatenate(new)):
        return 1.0
    return _by_chance(now)[1] if _by_chance(before)[0] < _ALSO else 1.0


def _surprises(held: Sequence[_Held], new: Sequence[Array], lag: int) -> Array:
    """What is new in the output so many samples before jumps, in their direction, beyond what is usual."""
    usual = defaultdict[tuple[bool, int] | None, list[float]](list)
    for one, own in zip(held, new, strict=True):
        for sample, x in enumerate(own.tolist()):
            usual[one.like(sample)].append(x)
    sums = {place: (sum(alike), len(alike)) for place, alike in usual.items()}
    found = []
    for one, own in zip(held, new, strict=True):
        for jump in one.jumps.tolist():
            sample, place = jump - lag, one.like(max(jump - lag, 0))
            if sample <= one.last[jump] or place is None:
                continue
            total, number = sums[place]
            if number > _COMPARED:
                others = (total - own[sample]) / (number - 1)
                found.append(np.sign(one.moves[jump]) * (own[sample] - others))
    return np.array(found)


def _by_chance(x: Array) -> tuple[float, float]:
    """The probabilities that values (n,) of mean zero have a mean as high, and as low."""
    if x.size < _FEWEST or np.ptp(x) == 0.0:
        return 1.0, 1.0
    t = float(np.mean(x) / (np.std(x, ddof=1) / np.sqrt(x.size)))
    return float(scipy.special.stdtr(x.size - 1, -t)), float(scipy.special.stdtr(x.size - 1, t))


def _sign(parts: Parts, lags: int, j: int) -> float:
    """That of the gain from an input, by how it and the output go together in time."""
    return float(
        np.sign(sum(float(u[: len(u) - lag, j] @ y[lag:, 0]) for u, y in parts for lag in range(lags + 1)))
    )


def _new(parts: Parts, lags: int, *, present: bool) -> list[Array]:
    """What past inputs and outputs do not tell of an output: (n - lags,) of every part.

    Args:
        present: whether the inputs of the sample itself count as past.
    """
    rows = [
        np.column_stack([past(y, lags), past(u, lags), *([u[lags:]] if present else [])]) for u, y in parts
    ]
    return untold(rows, [y[lags:, 0] for _, y in parts])
