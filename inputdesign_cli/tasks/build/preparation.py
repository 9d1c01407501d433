"""From columns as they were logged to segments with even steps, each change told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.shares import per_cent
from inputdesign_cli.tasks.build.extremes import OFTEN, spread_of

Detrend = Literal["none", "constant", "linear", "auto"]
DETRENDS: dict[str, Detrend] = {"none": "none", "constant": "constant", "linear": "linear", "auto": "auto"}

# Times may be off by this share of the sample time without a word, and by the second with one.
EVEN = 1e-3
MOST_JITTER = 0.1
# A longer step is a gap; with `resample` it may be longer before it is one.
_GAP, _LONG_GAP = 1.5, 3.0
_SHORTEST = 10
# Farther from the median than this many (robust) standard deviations: most likely not of this experiment.
_OUTLYING = 8.0
_SHOWN = 5
_FEW_LEVELS = 10
_CLIPPED, _RUN = 0.02, 3
_COARSE = 0.1


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
        operating_point: by channel, what is taken away where no trend is.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    sample_time: float | None = None
    time_unit: str | None = None
    resample: bool = False
    detrend: Detrend = "none"
    skip: int = 0
    span: tuple[float, float] | None = None
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
    """

    time: Array
    u: Array
    y: Array
    held: NDArray[np.bool_]

    @classmethod
    def recorded(cls, time: Array, u: Array, y: Array) -> Segment:
        """One from which nothing was taken away."""
        held = np.concatenate([np.zeros((1, y.shape[1]), dtype=bool), y[1:] == y[:-1]])
        return cls(time, u, y, held[: len(y)])


def whole_segments(
    time: Array, u: Array, y: Array, step: float, apart: NDArray[np.bool_], *, resample: bool
) -> tuple[list[Segment], list[str]]:
    """The stretches between gaps: missing numbers, steps of time that are too long, and where they are apart.

    Stretches of fewer than ten samples are left out where there are longer ones.

    Args:
        time: (n,), increasing.
        u, y: (n, r), (n, p), NaN where a number is missing.
        step: the sample time.
        apart: (n,), whether a stretch ends before a row, whatever its time.
    """
    told = []
    whole = ~np.isnan(np.column_stack([time, u, y])).any(axis=1)
    missing = int((~whole).sum())
    kept = np.flatnonzero(whole)
    cut = (np.diff(kept) > 1) | apart[kept[1:]]
    long = np.diff(time[kept]) > (_LONG_GAP if resample else _GAP) * step
    parts = np.split(kept, np.flatnonzero(cut | long) + 1)
    if missing:
        told.append(f"{missing} rows with a missing number were left out")
    if int((long & ~cut).sum()):
        told.append(f"the time has {int((long & ~cut).sum())} gaps")
    if len(parts) > 1:
        longer = [part for part in parts if len(part) >= _SHORTEST] or [max(parts, key=len)]
        left = sum(map(len, parts)) - sum(map(len, longer))
        told.append(
            f"the record is {len(longer)} segment{'s' * (len(longer) > 1)}, each with a start of its own"
            + (f"; {left} samples in shorter ones were left out" if left else "")
        )
        parts = longer
    return [Segment.recorded(time[part], u[part], y[part]) for part in parts], told


def jitter(segments: Sequence[Segment], step: float) -> float:
    """The largest deviation of a step of time, as a share of the sample time."""
    steps = [np.abs(np.diff(part.time) - step) for part in segments if len(part.time) > 1]
    return float(max((part.max() for part in steps), default=0.0)) / step


def resampled(part: Segment, step: float) -> Segment:
    """The same at even times: outputs linearly between samples, inputs, which are held, at the nearest."""
    count = int(np.floor((part.time[-1] - part.time[0]) / step + 0.5)) + 1
    even = part.time[0] + step * np.arange(count)
    y = np.column_stack([np.interp(even, part.time, column) for column in part.y.T])
    nearest = np.searchsorted(0.5 * (part.time[1:] + part.time[:-1]), even)
    return Segment.recorded(even, part.u[nearest], y)


def trend(x: Array, kind: Detrend) -> tuple[Array, str]:
    """What is taken away from a signal x (n,), and what that is in words.

    `auto` takes a line where it leaves less than half the power that the mean leaves, else the mean.
    """
    level = np.full(x.shape, x.mean())
    if kind in ("linear", "auto"):
        line = np.polynomial.Polynomial.fit(np.arange(len(x)), x, 1)(np.arange(len(x)))
        if kind == "linear" or np.sum((x - line) ** 2) < 0.5 * np.sum((x - level) ** 2):
            return line, f"a line from {line[0]:.6g} to {line[-1]:.6g}"
    return level, f"the mean {level[0]:.6g}"


def outliers(name: str, x: Array, rows: NDArray[np.int64]) -> list[str]:
    """Values far from the median of a signal x (n,), with their rows in the file."""
    middle, spread = np.median(x), spread_of(x)
    if spread <= 0.0:
        return []
    found = np.flatnonzero(np.abs(x - middle) > _OUTLYING * spread)
    if not found.size or found.size > OFTEN * x.size:
        return []
    listed = ", ".join(str(rows[i]) for i in found[:_SHOWN]) + (", .." if found.size > _SHOWN else "")
    return [
        f"{name} has {found.size} outlying value{'s' * (found.size > 1)} (row {listed}): look at the record"
    ]


def standing_alone(name: str, x: Array, rows: NDArray[np.int64]) -> list[str]:
    """More values of a measured signal x (n,) than outliers are, each far from its neighbours: spikes."""
    if x.size < _SHORTEST:
        return []
    near = np.median(np.lib.stride_tricks.sliding_window_view(x, 5), axis=1)
    off = np.abs(x[2:-2] - near)
    found = 2 + np.flatnonzero(off > _OUTLYING * 1.4826 * np.median(off))
    if not np.median(off) > 0.0 or found.size <= OFTEN * x.size:
        return []
    listed = ", ".join(str(rows[i]) for i in found[:_SHOWN])
    return [
        f"{name} has {found.size} values ({per_cent(found.size / x.size, 2)}) far from their neighbours (row "
        f"{listed}, ..): spikes? Look at the record, and empty the cells that are faults of measurement"
    ]


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
    step = float(np.min(np.diff(levels), initial=np.inf))
    spread = float(np.std(x))
    if np.isfinite(step) and step > _COARSE * spread > 0.0:
        told.append(
            f"{name} is rounded to steps of {step:.3g}, {step / spread:.2f} of its standard deviation"
        )
    return told
