"""The delays of every input, for each order of the plant, by quick output-error estimates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.explore.late import far_answers, late_answers
from inputdesign_cli.explore.loops import acts_late
from inputdesign_cli.explore.regression import LONG, SharedDenominator, best_delays, numerators
from inputdesign_cli.identification.late_inputs import behind

_MOST_DELAY = 150
# Where an answer comes later, delays are looked for until then and a share of it more.
_BEYOND = 5
# A delay of this share of the longest that is tried is at the limit. So far longer ones are tried.
_NEAR_LIMIT, _FURTHEST = 0.85, 400


@dataclass(frozen=True)
class Delays:
    """Output-error estimates of one output, each with the delays that suit it.

    Attributes:
        quick: by order.
        least, most: what delays were looked at, of each input from the one to the other.
        told: whether answers beyond the usual delays are, not only taken by some order for its own.
    """

    quick: dict[int, SharedDenominator]
    least: tuple[int, ...]
    most: int
    told: bool

    @property
    def latest(self) -> int:
        """The longest of all orders."""
        return max(max(found.delays) for found in self.quick.values())


def delays_of(
    first: Parts, clean: Parts, highest: int, judging: int, *, feedback: bool, known: bool
) -> Delays:
    """Of plants of orders up to the highest.

    Args:
        first: the records u (n, r), y (n, 1) that estimate.
        clean: the same, or where prediction errors count, with white noise.
        judging: samples of the longest record that judges.
        feedback: whether u(t) may answer y(t).
        known: whether inputs are known before those.
    """
    longest, inputs = max(len(y) for _, y in first), first[0][0].shape[1]
    usual = max(min(_MOST_DELAY, longest // LONG), 1)
    least = _least_delays(first, clean, usual) if feedback else (0,) * inputs
    told = late_answers(first, usual)
    most = _beyond(usual, told)
    quick = _quick(clean, highest, most, tuple(map(max, least, told)), least)
    if clean is first and not any(told):
        # What judges must be longer than the delay, too; than one that is told only where inputs before it
        # are unknown.
        furthest = 2 * min(longest, judging) // 3
        told = far_answers(first, list(quick.values()), most, 2 * longest // 3 if known else furthest)
        if any(told):
            quick, most = _far(first, highest, most, told)
        else:
            quick, most = _beyond_limit(clean, quick, most, min(furthest, _FURTHEST), least)
    return Delays(quick, least, most, any(told))


def criterion(found: SharedDenominator, samples: int) -> float:
    """BIC of an estimate, over the samples."""
    price = float(np.log(samples)) / samples
    return float(np.log(max(found.loss, 1e-300))) + 2 * found.F.size * price


def _beyond(most: int, later: Sequence[int]) -> int:
    """The delay up to which to look where answers come so late."""
    return max(most, *(lag + lag // _BEYOND for lag in later))


def _quick(
    clean: Parts, highest: int, most: int, delays: tuple[int, ...], least: tuple[int, ...]
) -> dict[int, SharedDenominator]:
    """The output-error estimates of all orders, each with the delays that suit it."""
    quick = dict[int, SharedDenominator]()
    for n in range(1, highest + 1):
        quick[n] = best_delays(clean, n, max(n, 2), most, delays, least)
        delays = quick[n].delays
    return quick


def _far(
    first: Parts, highest: int, most: int, later: tuple[int, ...]
) -> tuple[dict[int, SharedDenominator], int]:
    """The same from what comes after inputs that are answered so late, and the longest delay looked at."""
    spare = max(most, _beyond(0, later) - max(later))
    shifts = np.maximum(np.array(later) - spare, 0)
    begun = tuple(map(int, np.maximum(np.array(later) - shifts, 0)))
    found = _quick(behind(first, shifts, int(np.max(shifts))), highest, 2 * spare, begun, (0,) * len(later))
    settled = {n: replace(one, delays=tuple(map(int, one.delays + shifts))) for n, one in found.items()}
    return settled, int(np.max(shifts)) + 2 * spare


def _beyond_limit(
    clean: Parts, quick: dict[int, SharedDenominator], most: int, furthest: int, least: tuple[int, ...]
) -> tuple[dict[int, SharedDenominator], int]:
    """The same with longer delays, while some are at the limit of those that were tried, if BIC says so.

    High orders turn the phase as a longer delay does, as far as delays can be tried.
    """
    samples, longer = sum(len(y) for _, y in clean), most

    def best(found: Mapping[int, SharedDenominator]) -> float:
        return min(criterion(one, samples) for one in found.values())

    while longer < furthest and max(max(f.delays) for f in quick.values()) >= _NEAR_LIMIT * most:
        longer = min(2 * longer, furthest)
        tried = _quick(clean, max(quick), longer, (1,) * len(least), least)
        if best(tried) < best(quick):
            quick, most = tried, longer
    return quick, most


def _least_delays(parts: Parts, clean: Parts, most: int) -> tuple[int, ...]:
    """Of each input in a loop the shortest delay to look for, `clean` being the records with white noise."""
    one = (1,) * parts[0][0].shape[1]
    found = best_delays(clean, 1, 2, most, one, one)
    return tuple(int(late) for late in acts_late(parts, numerators(clean, found, 2).sum(axis=1)))
