"""Compare a record with its plan: where in the plan the record begins, and how well it follows.

Loggers begin late or early and lose a sample, actuators clip, sensors round. Most of a record is in step with
its plan nevertheless; a record of another experiment is not. All signals are compared about their levels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array

LIKE = 0.9
"""From this correlation on a record follows its plan; below it there is a finding."""
UNLIKE = 0.5
"""Below it a record does not follow."""
# How sure the scale of the plan must be, in standard deviations, since slow signals are alike by chance.
_SURE_IN_PLACE, _SURE_SHIFTED = 1.8, 5.0
# Samples that a record may be shifted, and from where on another shift explains so much more.
_SHIFTS, _PAST, _BETTER = 5, 2, 0.02
# A scale is off by more than this, by this number of its standard deviations, and explains most of the error.
_OFF, _SURE = 0.02, 3.0
# An actuator that clips does so in samples beyond this share of half their range.
_CLIPPED = 0.95
# A channel is at rest in plans smaller than this share of the strongest; moved by half of that it is not.
_AT_REST, _MOVED = 0.02, 0.5
# By how much rounding to five digits lowers the correlation of a copy.
_COPY = 1e-10


@dataclass(frozen=True)
class Match:
    """Describes how well a record follows a plan.

    Attributes:
        begins: the sample of the plan that the record begins with.
        likeness: the correlation of the channel that follows least, as recorded; `spliced`: with samples that
            are shifted put in their places.
        channel: its number from 1.
        scale: at which the channel was applied whose scale is farthest off; `off`: that it is not one.
        follows: whether it may be the record of the plan.
    """

    begins: int
    likeness: float
    spliced: float
    channel: int
    scale: float
    off: bool
    follows: bool


def matched(plan: Array, applied: Array, rows: NDArray[np.int64], strongest: float) -> Match:
    """Compare a record with its plan.

    Args:
        plan: (n, r); `applied`: (m, r), whose `rows` (m,) are counted from its first.
        strongest: the largest root mean square of all plans, beside which a plan may be at rest.
    """

    def alike(start: int) -> float:
        return abs(likeness(plan[start + rows], applied))

    best = max(range(len(plan) - int(rows[-1])), key=alike)
    begins = best if alike(best) > max(LIKE, alike(0) + _BETTER) else 0
    due = plan[begins + rows]
    # A channel that should be at rest follows or does not.
    shares = [
        float(np.std(own) <= _MOVED * strongest)
        if np.sqrt(np.mean(wanted**2)) < _AT_REST * strongest
        else likeness(wanted, own)
        for wanted, own in zip(due.T, applied.T, strict=True)
    ]
    least = int(np.argmin(shares))
    spliced, own = shares[least], applied[:, least]
    follows = _follows(spliced, due[:, least], own, _SURE_IN_PLACE)
    if spliced < LIKE:
        placed = _in_step(plan[:, least], own, begins + rows)
        shifted = likeness(placed, own)
        follows = follows or _follows(shifted, placed, own, _SURE_SHIFTED)
        spliced = max(spliced, shifted)
    scales = [_scale(due[:, j], applied[:, j]) for j in range(plan.shape[1])]
    off, _, scale = max((off, abs(scale - 1.0), scale) for scale, off in scales)
    # Rows out of their places look like a smaller scale.
    off = off and spliced <= abs(shares[least]) + _BETTER
    return Match(begins, shares[least], spliced, least + 1, scale, off, follows)


def standing_in(plan: Array, applied: Array, columns: Mapping[str, Array]) -> tuple[int, str, float] | None:
    """Return a channel of a plan that another column follows instead of its own column.

    Return its number from 1, the name of the column and its correlation; None if there is no such channel.

    Args:
        plan, applied: (m, r) both at the samples of the record.
        columns: all columns (m,) of the record.
    """
    for j in range(plan.shape[1]):
        least = max(LIKE, abs(likeness(plan[:, j], applied[:, j])) + _BETTER)
        for name, column in columns.items():
            each = [likeness(due, column) for due in plan.T]
            if each[j] > least and each[j] == max(each) and not _scale(plan[:, j], column)[1]:
                return j + 1, name, each[j]
    return None


def copied(column: Array, other: Array) -> bool:
    """Return whether a column (m,) is a copy of `other`, at any scale and about any level."""
    return abs(likeness(column, other)) > 1.0 - _COPY


def likeness(plan: Array, applied: Array) -> float:
    """Return the correlation of two signals (m,) or (m, r); about zero if the plan is constant."""
    plan, applied = _varying(plan, applied)
    sizes = float(np.linalg.norm(plan)) * float(np.linalg.norm(applied))
    return float(np.sum(plan * applied)) / sizes if sizes > 0.0 else 0.0


def _varying(plan: Array, applied: Array) -> tuple[Array, Array]:
    if np.all(np.ptp(plan, axis=0) == 0.0):
        return plan, applied
    return plan - plan.mean(axis=0), applied - applied.mean(axis=0)


def _in_step(plan: Array, applied: Array, places: NDArray[np.int64]) -> Array:
    """Return the samples (m,) of a plan (n,) that a record follows best if it slips once by a few samples."""
    padded = np.pad(plan - plan.mean(), _SHIFTS)
    along = padded[np.clip(places[:, None] + np.arange(2 * _SHIFTS + 1), 0, len(padded) - 1)]
    before = np.cumsum(along * (applied - applied.mean())[:, None], axis=0)
    after = before[-1] - before
    slip = int(np.argmax(before.max(axis=1) + after.max(axis=1)))
    early, late = int(np.argmax(before[slip])), int(np.argmax(after[slip]))
    return np.concatenate([along[: slip + 1, early], along[slip + 1 :, late]])


def _follows(alike: float, plan: Array, applied: Array, sure: float) -> bool:
    return alike >= LIKE or (alike >= UNLIKE and _sureness(plan, applied) >= sure)


def _sureness(plan: Array, applied: Array) -> float:
    """Return the t-ratio of a plan (m,) in a record, if the rest is noise of order two.

    Unrelated slow signals are correlated over a few samples. They are not after a regression on the past of
    both ([cochrane-orcutt-1949]).
    """
    signals = _varying(plan, applied)
    past = [signal[_PAST - k : -k] for signal in signals for k in range(1, _PAST + 1)]
    x, y = (signal[_PAST:] for signal in signals)
    if len(x) <= len(past) + 1:
        return np.inf
    others = np.column_stack(past)
    x, y = (signal - others @ np.linalg.lstsq(others, signal, rcond=None)[0] for signal in (x, y))
    size, rest = float(x @ x), float(y @ y)
    across = float(x @ y)
    left = max(rest * size - across**2, 1e-300)
    return across * float(np.sqrt(max(len(x) - len(past) - 1, 1) / left))


def _scale(plan: Array, applied: Array) -> tuple[float, bool]:
    """Return the scale at which a plan (m,) was applied, and whether samples without clipping refute 1."""
    scale, off = _fitted(plan, applied)
    if not off or abs(likeness(plan, applied)) <= LIKE:
        return scale, False
    low, high = float(np.min(applied)), float(np.max(applied))
    inner = np.abs(applied - 0.5 * (low + high)) < _CLIPPED * 0.5 * (high - low)
    return scale, int(np.sum(inner)) <= 2 or _fitted(plan[inner], applied[inner])[1]


def _fitted(plan: Array, applied: Array) -> tuple[float, bool]:
    """Return the scale of a plan (m,) in a record, and whether it explains it better than one by chance."""
    plan, applied = _varying(plan, applied)
    size = float(plan @ plan)
    if size == 0.0:
        return 1.0, False
    scale = float(plan @ applied) / size
    rest = float(np.sum((applied - scale * plan) ** 2)) / size
    least = max(_OFF, _SURE * np.sqrt(rest / max(len(plan) - 2, 1)), np.sqrt(rest))
    return scale, bool(abs(scale - 1.0) > least)
