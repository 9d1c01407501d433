"""Compare a record with its plan: where in the plan the record begins, and how well it follows.

Loggers begin late or early and lose samples, actuators clip, sensors round. Most of a record is in step with
its plan nevertheless; a record of another experiment is not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array

LIKE = 0.9
"""From this correlation on a record follows its plan; below it there is a finding."""
UNLIKE = 0.5
"""Below it does not, unless samples are lost or shifted and the rest follows to 0.6."""
_SPLICED = 0.6
# How sure the scale of the plan must be, in standard deviations, since slow signals are alike by chance;
# surer where the best places of samples were looked for.
_MOVES, _PLACED = 1.8, 5.0
# Coefficients of the regression that whitens the difference of record and plan, and its rounds.
_COLOUR, _ROUNDS = 2, 3
# The most samples lost or written twice; each time must explain more than this number of others.
_SLIPS, _PAYS = 5, 5.0
# Another start explains so much more of the correlation.
_BETTER = 0.02
# A scale is off by more than this, by this number of its standard deviations, and explains most of the error.
_OFF, _SURE = 0.02, 3.0
# An actuator that clips does so in samples beyond this share of half their range.
_CLIPPED, _FEW = 0.95, 2
# A channel is at rest in plans smaller than this share of the strongest; moved by half of that it is not.
_AT_REST, _MOVED = 0.02, 0.5
# By how much rounding to five digits lowers the correlation of a copy.
_COPY = 1e-10
# Orders of more channels are not tried.
_MOST = 6


@dataclass(frozen=True)
class Match:
    """The relation of a record to a plan.

    Attributes:
        begins: the sample of the plan that the record begins with.
        likeness: the correlation of the channel that follows least, from -1 to 1, as recorded; `spliced`:
            with samples that are shifted, lost or written twice put in their places.
        channel: its number from 1.
        scale: at which the channel was applied whose scale is farthest off; `off`: that it is not one.
        exchanged: for each channel of the plan the channel of the record, numbers from 1, that follows it,
            where these are others than its own; None else.
        follows: whether it may be the record of the plan.
    """

    begins: int
    likeness: float
    spliced: float
    channel: int
    scale: float
    off: bool
    exchanged: tuple[int, ...] | None
    follows: bool


def matched(plan: Array, applied: Array, rows: NDArray[np.int64], strongest: float) -> Match:
    """Compare a record with its plan, both about the level that was planned.

    Args:
        plan: (n, r); `applied`: (m, r), whose `rows` (m,) are counted from its first.
        strongest: the largest root mean square of all plans, beside which a plan may be at rest.
    """
    begins = _begins(plan, applied, rows)
    due = plan[begins + rows]
    shares = [_followed(due[:, j], applied[:, j], strongest) for j in range(plan.shape[1])]
    least = int(np.argmin(shares))
    spliced = shares[least]
    follows = spliced >= LIKE or (spliced >= UNLIKE and _moves(due[:, least], applied[:, least]) >= _MOVES)
    if spliced < LIKE:
        value, placed = _in_step(plan[:, least], applied[:, least], begins + rows)
        spliced = max(spliced, value)
        follows = follows or (value >= _SPLICED and _moves(placed, applied[:, least]) >= _PLACED)
    scale, off = max((_scale(due[:, j], applied[:, j]) for j in range(plan.shape[1])), key=_far)
    if off and spliced > abs(shares[least]) + _BETTER:
        off = False  # rows out of their places look like a smaller scale
    exchanged = _exchanged(due, applied, strongest, shares[least])
    return Match(begins, shares[least], spliced, least + 1, scale, off, exchanged, follows)


def standing_in(plan: Array, applied: Array, others: Mapping[str, Array]) -> tuple[int, str, float] | None:
    """Return a channel of a plan that another column follows instead of its own column.

    Return its number from 1, the name of the column and its correlation; None if there is no such channel.

    Args:
        plan, applied: (m, r) both at the samples of the record.
        others: further columns (m,) of it.
    """
    for j in range(plan.shape[1]):
        least = max(LIKE, abs(likeness(plan[:, j], applied[:, j])) + _BETTER)
        for name, column in others.items():
            found = likeness(plan[:, j], column)
            if found > least and not _scale(plan[:, j], column)[1]:
                return j + 1, name, found
    return None


def copied(column: Array, other: Array) -> bool:
    """Return whether a column (m,) is a copy of `other`, at any scale and about any level."""
    return abs(_correlation(_centred(column), _centred(other))) > 1.0 - _COPY


def _far(found: tuple[float, bool]) -> tuple[bool, float]:
    scale, off = found
    return off, abs(scale - 1.0)


def likeness(plan: Array, applied: Array) -> float:
    """Return the correlation of two signals (m, r), about their means or not, whichever is larger in size."""
    return max(_correlation(plan, applied), _correlation(_centred(plan), _centred(applied)), key=abs)


def _centred(signal: Array) -> Array:
    return np.asarray(signal - signal.mean(axis=0), dtype=float)


def _correlation(plan: Array, applied: Array) -> float:
    sizes = float(np.linalg.norm(plan)) * float(np.linalg.norm(applied))
    return float(np.sum(plan * applied)) / sizes if sizes > 0.0 else 0.0


def _followed(plan: Array, applied: Array, strongest: float) -> float:
    """Return the correlation of one channel (m,); 1 or 0 for a channel that should be at rest."""
    if _rms(plan) < _AT_REST * strongest:
        return float(_rms(_centred(applied)) <= _MOVED * strongest)
    return likeness(plan, applied)


def _rms(signal: Array) -> float:
    return float(np.sqrt(np.mean(signal**2)))


def _begins(plan: Array, applied: Array, rows: NDArray[np.int64]) -> int:
    """Return the sample of the plan (n, r) that a record (m, r) of these `rows` begins with."""

    def at(start: int) -> float:
        return abs(likeness(plan[start + rows], applied))

    best = max(range(len(plan) - int(rows[-1])), key=at)
    return best if at(best) > max(LIKE, at(0) + _BETTER) else 0


def _in_step(plan: Array, applied: Array, places: NDArray[np.int64]) -> tuple[float, Array]:
    """Return the correlation if the record (m,) may slip against the plan (n,) by a few samples.

    Return also the samples (m,) of the plan that the record follows. Dynamic programming over the samples:
    the state is the slip, and each change of it has a price.
    """
    slips = np.arange(-_SLIPS, _SLIPS + 1)
    padded = np.pad(plan - plan.mean(), _SLIPS + 1)
    along = padded[np.clip(places[:, None] + slips + _SLIPS + 1, 0, len(padded) - 1)]
    record = applied - applied.mean()
    gains = along * record[:, None] / max(_rms(plan - plan.mean()) * _rms(record), 1e-300)
    total, before = gains[0], []
    for gain in gains[1:]:
        best = int(np.argmax(total))
        stays = total >= total[best] - _PAYS
        before.append(np.where(stays, np.arange(slips.size), best))
        total = np.where(stays, total, total[best] - _PAYS) + gain
    slip = int(np.argmax(total))
    path = [slip]
    for last in reversed(before):
        slip = int(last[slip])
        path.append(slip)
    placed = np.asarray(along[np.arange(len(record)), path[::-1]], dtype=float)
    return float(total.max()) / len(record), placed


def _moves(plan: Array, applied: Array) -> float:
    """Return the scale of a plan in a record (m,), in standard deviations, if the rest is coloured noise.

    Unrelated slow signals are correlated over a few samples. They are not after whitening by regressions of
    the residual on its past ([cochrane-orcutt-1949]).
    """
    x, y = _centred(plan), _centred(applied)
    scale, sure = _scaled(x, y)
    for _ in range(_ROUNDS if len(x) > 2 * _COLOUR + 1 else 0):
        past = _past(y - scale * x)
        colour = np.linalg.lstsq(past, (y - scale * x)[_COLOUR:], rcond=None)[0]
        scale, sure = _scaled(*(_centred(signal[_COLOUR:] - _past(signal) @ colour) for signal in (x, y)))
    return sure


def _scaled(plan: Array, applied: Array) -> tuple[float, float]:
    """Return the scale of a plan in a record (m,), both about their means, and its t-ratio."""
    size = float(np.sum(plan**2))
    if size == 0.0:
        return 0.0, 0.0
    scale = float(np.sum(plan * applied)) / size
    left = float(np.sum((applied - scale * plan) ** 2))
    freedom = max(len(plan) - 2 - _COLOUR, 1)
    return scale, scale * float(np.sqrt(size * freedom / max(left, 1e-300)))


def _past(signal: Array) -> Array:
    """Return the two samples (m - 2, 2) before each sample of a signal (m,)."""
    return np.column_stack([signal[_COLOUR - k : -k] for k in range(1, _COLOUR + 1)])


def _scale(plan: Array, applied: Array) -> tuple[float, bool]:
    """Return the scale at which a plan (m,) was applied, and whether samples without clipping refute 1."""
    scale = _fitted(plan, applied)[0]
    if abs(likeness(plan, applied)) <= LIKE or not _off(plan, applied):
        return scale, False
    low, high = float(np.min(applied)), float(np.max(applied))
    inner = np.abs(applied - 0.5 * (low + high)) < _CLIPPED * 0.5 * (high - low)
    return scale, int(np.sum(inner)) <= _FEW or _off(plan[inner], applied[inner])


def _off(plan: Array, applied: Array) -> bool:
    """Return whether another scale than one explains a record (m,) better than chance does."""
    scale, rest = _fitted(plan, applied)
    size = float(np.sum(_centred(plan) ** 2)) or float(np.sum(plan**2))
    deviation = np.sqrt(rest / (size * max(len(plan) - 2, 1)))
    least = max(_OFF, _SURE * deviation, np.sqrt(rest / size))
    return bool(abs(scale - 1.0) > least)


def _fitted(plan: Array, applied: Array) -> tuple[float, float]:
    """Return the scale of a plan (m,), with a level if that explains more, and the sum of squared errors."""
    found = []
    for p, a in ((plan, applied), (_centred(plan), _centred(applied))):
        size = float(np.sum(p**2))
        if size > 0.0:
            scale = float(np.sum(p * a)) / size
            found.append((abs(_correlation(p, a)), scale, float(np.sum((a - scale * p) ** 2))))
    _, scale, rest = max(found, default=(0.0, 1.0, 0.0))
    return scale, rest


def _exchanged(plan: Array, applied: Array, strongest: float, own: float) -> tuple[int, ...] | None:
    """Return the channels of the record (m, r) in the order of the plan; None if their own order fits best.

    Args:
        own: the likeness of the channel that follows least in their own order.
    """
    for order in permutations(range(plan.shape[1])) if own < 1.0 - _BETTER and plan.shape[1] <= _MOST else ():
        least = min(_followed(plan[:, j], applied[:, k], strongest) for j, k in enumerate(order))
        if least > max(LIKE, own + _BETTER):
            return tuple(k + 1 for k in order)
    return None
