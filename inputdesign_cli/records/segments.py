"""Segments of a record: stretches without gaps, with even steps, their trends taken away."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.outlying_values import without_spikes
from inputdesign_cli.findings.prepared_records import (
    columns_joined,
    jitter_evened,
    lines_passed_over,
    record_cut,
    trend_removed,
)
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.records.preparation import Detrend, Preparation
from inputdesign_cli.records.signals import Signals
from inputdesign_cli.records.text import BLANK, COMMENTED

# Times may be off by this share of the sample time unsaid, and by the second with a finding.
EVEN = 1e-3
MOST_JITTER = 0.25
# A longer step is a gap; with `resample` it may be longer before it is one.
_GAP, _LONG_GAP = 1.5, 3.0
SHORTEST = 10
# Rows count unchanged where this share of the whole ones stands in long stretches, or, of short records,
# where this share is whole.
_KEPT, _FEW, _SHORT = 0.25, 0.5, 2 * SHORTEST
# Steps of an output that are longer, in its own, are gaps.
_OWN_GAP, _NEARLY, _MOSTLY = 3.0, 1.1, 0.95


@dataclass(frozen=True)
class Segment:
    """A stretch of a record without gaps: times (n,), inputs (n, r), outputs (n, p).

    Attributes:
        lined: whether a line was taken away from an output.
    """

    time: Array
    u: Array
    y: Array
    lined: bool = False


def joined_rows(signals: Signals, *, resample: bool) -> Signals:
    """Return the signals at the times of the output that was written most often; or, if few miss, all rows.

    Inputs are held until they are written again, and are their means until the next row; outputs are
    interpolated linearly. Rows stay unchanged if enough of them are whole.

    Args:
        resample: whether that is asked for.

    Raises:
        DataError: `data-not-a-number`, rows would have to be joined, and that is not asked for or cannot be.
    """
    there = ~np.isnan(np.column_stack([signals.u, signals.y]))
    whole = np.asarray(there.all(axis=1))
    short = len(whole) < _SHORT and whole.mean() >= _FEW
    if short or _in_stretches(whole) > _KEPT * whole.sum():
        return signals
    sheet, names = signals.sheet, (*signals.inputs, *signals.outputs)
    counts = dict(zip(names, there.sum(axis=0).tolist(), strict=True))
    timed = ~np.isnan(signals.time)
    untimed = [name for name, own in zip(names, there.T, strict=True) if not np.any(own & timed)]
    if not (resample and signals.name) or untimed:
        listed = ", ".join(f"{name} in {count}" for name, count in counts.items())
        message = (
            f"hardly a row of {sheet.path.name} has numbers in all columns ({listed} of {len(whole)} rows)"
        )
        hint = "join the rows of each sample, or log the time with them"
        if signals.name and not untimed:
            hint = (
                "add --resample (inputs are held until written again, outputs interpolated), or join the rows"
            )
        raise sheet.error("data-not-a-number", f"{message}: they were written at different times", hint, 0)
    written = ~np.isnan(signals.y) & timed[:, None]
    rows = np.flatnonzero(written[:, int(np.argmax(written.sum(axis=0)))])
    every = np.diff(signals.time[timed])
    even = np.mean(np.abs(every - np.median(every)) <= (_NEARLY - 1.0) * np.median(every)) >= _MOSTLY
    if even and rows.size > 1 and np.median(np.diff(signals.time[rows])) <= _NEARLY * np.median(every):
        rows = np.flatnonzero(timed)  # it misses some only
    time = signals.time[rows]
    inputs = [_until_next(signals.time, x, time) for x in signals.u.T]
    outputs = [_between(signals.time[at], x[at], time) for x, at in zip(signals.y.T, written.T, strict=True)]
    moved = int(np.any([moves for _, moves in inputs], axis=0).sum())
    found = columns_joined(counts, len(whole), moved, len(rows))
    u, y = (np.column_stack(columns) for columns in ([means for means, _ in inputs], outputs))
    return replace(signals.at(rows), u=u, y=y, findings=(*signals.findings, found))


def _until_next(time: Array, x: Array, instants: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Means of x (n,), held until written again, from each instant to the next, and whether it moves there.

    NaN before it was written first; the last one as it is.
    """
    at = np.flatnonzero(~np.isnan(x) & ~np.isnan(time))
    began, values = time[at], x[at]
    here = np.searchsorted(began, instants, side="right") - 1
    held = values[np.maximum(here, 0)]
    # The integral of x is linear between the times at which it is written, and goes on behind the last.
    ends = np.append(began, max(instants[-1], began[-1]) + 1.0)
    area = np.concatenate([[0.0], np.cumsum(values * np.diff(ends))])
    means = np.append(np.diff(np.interp(instants, ends, area)) / np.diff(instants), held[-1])
    moves = (np.abs(means - held) > 1e-9 * np.abs(values).max()) & (here >= 0)
    return np.where(here >= 0, np.where(moves, means, held), np.nan), moves


def _between(time: Array, y: Array, instants: Array) -> Array:
    """y (n,) at some instants, on the line between its neighbours; NaN outside and in gaps."""
    found = np.interp(instants, time, y, left=np.nan, right=np.nan)
    steps = np.diff(time)
    if not steps.size:
        return found
    after = np.clip(np.searchsorted(time, instants, side="left"), 1, len(time) - 1)
    gap = steps[after - 1] > _OWN_GAP * np.median(steps)
    return np.where(gap & ~np.isin(instants, time), np.nan, found)


def _in_stretches(whole: NDArray[np.bool_]) -> int:
    """How many rows stand in stretches that are long enough."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], whole.astype(int), [0]])))
    lengths = edges[1::2] - edges[::2]
    return int(lengths[lengths >= SHORTEST].sum())


def segments_of(
    signals: Signals, step: float, time_unit: str, preparation: Preparation
) -> tuple[list[Segment], list[Finding]]:
    """Return segments with even steps `step`, their trends taken away, and what was done and seen.

    Raises:
        DataError: `data-not-uniform`, the times jitter too much; `data-not-a-number`, no row is whole.
    """
    sheet, time = signals.sheet, signals.time if signals.name else signals.time * step
    whole = ~np.isnan(np.column_stack([time, signals.u, signals.y])).any(axis=1)
    if not np.any(whole):
        message = f"no row of {sheet.path.name} has a number in every column that is asked for"
        hint = "join the rows where a logger writes channels in turn; or name other columns (--columns)"
        raise sheet.error("data-not-a-number", message, hint, 0)
    whole &= ~signals.without
    if not np.any(whole):
        message = f"--without leaves no row of {sheet.path.name}"
        raise sheet.error("data-unreadable", message, "leave fewer rows out")
    names = (*signals.inputs, *signals.outputs)
    y, seen = without_spikes(names, signals.u, signals.y, ~signals.without, sheet.lines)
    signals = replace(signals, y=y)
    parts, cuts = _whole_segments(time, signals, step, whole, resample=preparation.resample)
    evened: list[Finding] = []
    steps = [np.abs(np.diff(part.time) - step) for part in parts if len(part.time) > 1]
    off = float(max((part.max() for part in steps), default=0.0)) / step
    if off > EVEN:
        if off > MOST_JITTER and not preparation.resample:
            row = int(np.nanargmax(np.abs(np.diff(signals.time) - step))) + 1
            message = f"steps of time differ from {step:.6g} {time_unit} by up to {per_cent(off)}"
            hint = f"add --resample to even out more than {MOST_JITTER:.0%}; or give the right --sample-time"
            raise sheet.error("data-not-uniform", message, hint, row)
        moved = sum(_moves_between(part, step) for part in parts)
        parts = [_resampled(part, step) for part in parts]
        evened = [*jitter_evened(step, time_unit, off, moved)]
    taken = [_detrended(part, signals, preparation) for part in parts]
    trends = [one for _, found in taken for one in found]
    return [part for part, _ in taken], [*evened, *cuts, *seen, *dict.fromkeys(trends)]


def _whole_segments(
    time: Array, signals: Signals, step: float, whole: NDArray[np.bool_], *, resample: bool
) -> tuple[list[Segment], list[Finding]]:
    """The stretches between gaps, of ten samples or more if there are any, and where the record is cut."""
    lines = signals.sheet.lines
    apart, passed = _passed_over(signals)
    kept = np.flatnonzero(whole)
    cut = (np.diff(kept) > 1) | apart[kept[1:]]
    long = np.diff(time[kept]) > (_LONG_GAP if resample else _GAP) * step
    parts = np.split(kept, np.flatnonzero(cut | long) + 1)
    longer = [part for part in parts if len(part) >= SHORTEST] or [max(parts, key=len)]
    short = np.setdiff1d(kept, np.concatenate(longer))
    found = record_cut(
        [len(part) for part in longer],
        lines[kept[1:]][long & ~cut],
        lines[~whole & ~signals.without],
        lines[signals.without],
        lines[short],
    )
    return [Segment(time[part], signals.u[part], signals.y[part]) for part in longer], [*passed, *found]


def _passed_over(signals: Signals) -> tuple[NDArray[np.bool_], list[Finding]]:
    """Return whether the record is cut before each row (n,), as by a blank line where it has no times."""
    lines, found = signals.sheet.lines, list[Finding]()
    apart = np.zeros(len(lines), dtype=bool)
    for kind in () if signals.name else (BLANK, COMMENTED):
        passed = [line for line, own in signals.sheet.passed if own == kind and lines[0] < line < lines[-1]]
        apart[np.searchsorted(lines, passed)] = True
        found += [lines_passed_over(kind, passed)] if passed else []
    return apart, found


def _resampled(part: Segment, step: float) -> Segment:
    """The segment at even times: outputs linearly between samples, inputs, which are held, at the nearest."""
    even, nearest = _even_instants(part, step)
    y = np.column_stack([np.interp(even, part.time, column) for column in part.y.T])
    return Segment(even, part.u[nearest], y)


def _moves_between(part: Segment, step: float) -> int:
    """After how many of the even times inputs differ at samples that are left out."""
    nearest = _even_instants(part, step)[1]
    last = np.searchsorted(nearest, np.arange(nearest[-1] + 1), side="right") - 1
    moved = np.any(part.u[: nearest[-1] + 1] != part.u[nearest[last]], axis=1)
    return int(np.unique(last[moved]).size)


def _even_instants(part: Segment, step: float) -> tuple[Array, NDArray[np.int64]]:
    """Times that are `step` apart (n,), and the sample (n,) nearest to each."""
    count = int(np.floor((part.time[-1] - part.time[0]) / step + 0.5)) + 1
    even = part.time[0] + step * np.arange(count)
    return even, np.searchsorted(0.5 * (part.time[1:] + part.time[:-1]), even)


def _detrended(part: Segment, signals: Signals, preparation: Preparation) -> tuple[Segment, list[Finding]]:
    """A segment without its trends or its operating point, and what was taken away."""
    found, lined = [], False
    taken: dict[str, Array] = {}
    for letter, names, values in (("u", signals.inputs, part.u), ("y", signals.outputs, part.y)):
        columns = []
        for name, x in zip(names, values.T, strict=True):
            if preparation.detrend == "none":
                columns.append(x - preparation.operating_point.get(name if name[1:] else f"{name}1", 0.0))
                continue
            away, line = trend(x, preparation.detrend)
            lined |= line and letter == "y"
            found.append(trend_removed(name, away, line=line))
            columns.append(x - away)
        taken[letter] = np.column_stack(columns)
    return Segment(part.time, taken["u"], taken["y"], lined), found


def trend(x: Array, kind: Detrend) -> tuple[Array, bool]:
    """Return what is taken away from a signal x (n,), and whether it is a line.

    `auto` takes a line if it explains half the power about the mean, else the mean.
    """
    level = np.full(x.shape, x.mean())
    if kind in ("linear", "auto"):
        line = np.polynomial.Polynomial.fit(np.arange(len(x)), x, 1)(np.arange(len(x)))
        if kind == "linear" or np.sum((x - line) ** 2) < 0.5 * np.sum((x - level) ** 2):
            return line, True
    return level, False
