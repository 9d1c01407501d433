"""From columns as they were logged to segments with even steps, each change told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.tasks.build import rows

Detrend = Literal["none", "constant", "linear", "auto"]
Run = tuple[str, int, int]
"""Rows of a file, the first and the last; no name: of the only file."""
DETRENDS: dict[str, Detrend] = {"none": "none", "constant": "constant", "linear": "linear", "auto": "auto"}

# Times may be off by this share of the sample time without a word, and by the second with one.
EVEN = 1e-3
MOST_JITTER = 0.1
# A longer step is a gap; with `resample` it may be longer before it is one.
_GAP, _LONG_GAP = 1.5, 3.0
SHORTEST = 10
_FEW_LEVELS = 10
_CLIPPED, _RUN = 0.02, 3
_COARSE = 0.1
# Evidence that a signal is rounded: off a grid by these shares of its step, at least as counted and at most;
# the chance that a value comes again, of which so many count; less than this by chance in all.
_LEAST_OFF, _MOST_OFF, _REFINED, _PARTS = 1e-3, 0.1, 3, (1, 2, 3)
_AGAIN, _ENOUGH_RETURNS = 0.1, 10
_BY_CHANCE = 2e-4


@dataclass(frozen=True)
class Preparation:
    """How a record is to be read and prepared.

    Attributes:
        columns: channel (`u1`, `y1`, `time`) -> name or number of its column.
        sample_time, time_unit: what the file does not say, or says wrongly.
        resample: whether times that jitter more than `MOST_JITTER` are resampled, too.
        detrend: what is taken away from the signals of every segment; `auto` a line where it explains much.
        skip: rows to leave out at the beginning.
        span: of times, in the unit of the file, to keep.
        without: rows to leave out, as notes number them; the record is cut there.
        operating_point: by channel, what is taken away where no trend is.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    sample_time: float | None = None
    time_unit: str | None = None
    resample: bool = False
    detrend: Detrend = "none"
    skip: int = 0
    span: tuple[float, float] | None = None
    without: tuple[Run, ...] = ()
    operating_point: Mapping[str, float] = field(default_factory=dict)

    @property
    def levels(self) -> Mapping[str, float]:
        """By channel, what the signals were about: the operating point, where it is what was taken away."""
        return self.operating_point if self.detrend == "none" else {}


@dataclass(frozen=True)
class Segment:
    """A stretch of a record without gaps: times (n,), inputs (n, r), outputs (n, p).

    Attributes:
        held: (n, p), whether an output is what it was a sample before, as it was recorded.
        lined: whether a line was taken away from an output.
    """

    time: Array
    u: Array
    y: Array
    held: NDArray[np.bool_]
    lined: bool = False

    @classmethod
    def recorded(cls, time: Array, u: Array, y: Array) -> Segment:
        """One from which nothing was taken away."""
        held = np.concatenate([np.zeros((1, y.shape[1]), dtype=bool), y[1:] == y[:-1]])
        return cls(time, u, y, held[: len(y)])


def whole_segments(
    time: Array,
    u: Array,
    y: Array,
    step: float,
    apart: NDArray[np.bool_],
    lines: NDArray[np.int64],
    without: NDArray[np.bool_],
    *,
    resample: bool,
) -> tuple[list[Segment], list[str]]:
    """The stretches between gaps: missing numbers, steps of time that are too long, and where they are apart.

    Stretches of fewer than ten samples are left out where there are longer ones.

    Args:
        time: (n,), increasing.
        u, y: (n, r), (n, p), NaN where a number is missing.
        step: the sample time.
        apart: (n,), whether a stretch ends before a row, whatever its time.
        lines: (n,), the number of each row in the file.
        without: (n,), rows that are to be left out.
    """
    told = [f"{rows.told(lines[without])} left out, as --without says"] if np.any(without) else []
    whole = ~np.isnan(np.column_stack([time, u, y])).any(axis=1)
    missing = lines[~whole & ~without]
    whole &= ~without
    kept = np.flatnonzero(whole)
    cut = (np.diff(kept) > 1) | apart[kept[1:]]
    long = np.diff(time[kept]) > (_LONG_GAP if resample else _GAP) * step
    parts = np.split(kept, np.flatnonzero(cut | long) + 1)
    if missing.size:
        count, were = ("1 row", "was") if missing.size == 1 else (f"{missing.size} rows", "were")
        told.append(f"{count} with a missing number {were} left out ({rows.told(missing)})")
    gaps = lines[kept[1:]][long & ~cut]
    if gaps.size:
        told.append(f"the time has {gaps.size} gap{'s' * (gaps.size > 1)} (before {rows.told(gaps)})")
    if len(parts) > 1:
        longer = [part for part in parts if len(part) >= SHORTEST] or [max(parts, key=len)]
        left = [line for part in parts if not any(part is one for one in longer) for line in lines[part]]
        told.append(
            f"the record is {len(longer)} segment{'s' * (len(longer) > 1)}, each with a start of its own"
            + (f"; {len(left)} samples in shorter ones were left out ({rows.told(left)})" if left else "")
        )
        parts = longer
    return [Segment.recorded(time[part], u[part], y[part]) for part in parts], told


def jitter(segments: Sequence[Segment], step: float) -> float:
    """The largest deviation of a step of time, as a share of the sample time."""
    steps = [np.abs(np.diff(part.time) - step) for part in segments if len(part.time) > 1]
    return float(max((part.max() for part in steps), default=0.0)) / step


def resampled(part: Segment, step: float) -> Segment:
    """The same at even times: outputs linearly between samples, inputs, which are held, at the nearest."""
    even, nearest = _even_instants(part, step)
    y = np.column_stack([np.interp(even, part.time, column) for column in part.y.T])
    return Segment.recorded(even, part.u[nearest], y)


def moves_between(part: Segment, step: float) -> int:
    """After how many of the even instants inputs are, at samples that are left out, others than there."""
    nearest = _even_instants(part, step)[1]
    last = np.searchsorted(nearest, np.arange(nearest[-1] + 1), side="right") - 1
    moved = np.any(part.u[: nearest[-1] + 1] != part.u[nearest[last]], axis=1)
    return int(np.unique(last[moved]).size)


def _even_instants(part: Segment, step: float) -> tuple[Array, NDArray[np.int64]]:
    """Times that are `step` apart (n,), and the sample (n,) nearest to each."""
    count = int(np.floor((part.time[-1] - part.time[0]) / step + 0.5)) + 1
    even = part.time[0] + step * np.arange(count)
    return even, np.searchsorted(0.5 * (part.time[1:] + part.time[:-1]), even)


def trend(x: Array, kind: Detrend) -> tuple[Array, str, bool]:
    """What is taken away from a signal x (n,), what that is in words, and whether it is a line.

    `auto` takes a line where it leaves less than half the power that the mean leaves, else the mean.
    """
    level = np.full(x.shape, x.mean())
    if kind in ("linear", "auto"):
        line = np.polynomial.Polynomial.fit(np.arange(len(x)), x, 1)(np.arange(len(x)))
        if kind == "linear" or np.sum((x - line) ** 2) < 0.5 * np.sum((x - level) ** 2):
            return line, f"a line from {line[0]:.6g} to {line[-1]:.6g}", True
    return level, f"the mean {level[0]:.6g}", False


def limits_of_sensor(name: str, x: Array) -> list[str]:
    """Whether a measured signal x (n,) stays at an extreme value, or moves in steps that one can see."""
    levels = np.unique(x)
    told = []
    if levels.size > _FEW_LEVELS:
        for word, value in (("largest", levels[-1]), ("smallest", levels[0])):
            at = x == value
            # At the beginning it may be at rest, before the input moves.
            at[: int(np.argmin(at))] = False
            runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], at.astype(int), [0]]))))[::2]
            stays = int(runs[runs >= _RUN].sum())
            if stays > _CLIPPED * x.size:
                told.append(
                    f"{name} stays at its {word} value {value:.6g} for {stays} samples: is it saturated?"
                )
    spread = float(np.std(x))
    step, chance = _grid(x, levels)
    if step > _COARSE * spread > 0.0 and chance < _BY_CHANCE:
        told.append(
            f"{name} is rounded to steps of {step:.3g}, {step / spread:.2f} of its standard deviation"
        )
    return told


def _grid(x: Array, levels: Array) -> tuple[float, float]:
    """The step between the distinct levels of x, and how probable it is that they lie on a grid by chance.

    Of continuous values the gaps in units of the step lie anywhere between two integers, and no value comes
    again after another. Where levels are missing the smallest gap is a few steps.
    """
    gaps = np.diff(levels)
    if not gaps.size:
        return 0.0, 1.0
    returns = min(int(np.sum(np.diff(x) != 0.0)) + 1 - levels.size, _ENOUGH_RETURNS)
    tried = [_on_grid(gaps, float(gaps.min()) / part) for part in _PARTS]
    step, chance = min(tried, key=lambda one: one[1])
    return step, min(len(_PARTS) * chance, 1.0) * (_AGAIN**returns if chance < 1.0 or gaps.size == 1 else 1.0)


def _on_grid(gaps: Array, step: float) -> tuple[float, float]:
    """The step that suits the gaps best, near to one, and the probability that all suit it as well."""
    for _ in range(_REFINED):
        whole = np.round(gaps / step)
        step = float(whole @ gaps / (whole @ whole))
    off = max(float(np.max(np.abs(gaps / step - np.round(gaps / step)))), _LEAST_OFF)
    return step, (2.0 * off) ** (gaps.size - 1) if off < _MOST_OFF else 1.0
