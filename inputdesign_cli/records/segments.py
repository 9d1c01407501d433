"""Segments of a record: stretches without gaps, with even steps, their trends taken away."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, listed
from inputdesign_cli.findings.outlying_values import without_spikes
from inputdesign_cli.findings.places import SHORTEST
from inputdesign_cli.findings.prepared_records import (
    INPUTS_MOVE_BETWEEN,
    JITTER_EVENED,
    LINES_PASSED_OVER,
    RECORD_CUT,
    ROWS_LEFT_OUT,
    TREND_REMOVED,
)
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.records.sheet import Detrend, Preparation
from inputdesign_cli.records.signals import Signals

# Steps may differ by EVEN from the sample time, relatively, and by MOST_JITTER with a finding.
EVEN = 1e-3
MOST_JITTER = 0.25
# A step of more sample times is a gap; the second holds with `resample`.
_GAP, _LONG_GAP = 1.5, 3.0
# Gaps after a larger share of the rows come from times that are rounded, or from another sample time.
_OFTEN = 0.1


class Segment(NamedTuple):
    """Holds a stretch of a record without gaps: times (n,), inputs (n, r), outputs (n, p)."""

    time: Array
    u: Array
    y: Array


def segments_of(
    signals: Signals, step: float, time_unit: str, preparation: Preparation
) -> tuple[list[Segment], list[Finding]]:
    """Return segments with even steps `step`, their trends taken away, and what was done and seen.

    Raises:
        DataError: `data-not-uniform`, the times jitter too much; `data-not-a-number`, no row is complete;
            `data-unreadable`, no row remains.
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
    y, seen = without_spikes(signals.names, signals.u, signals.y, ~signals.without, sheet.lines)
    parts, cuts = _cut(time, replace(signals, y=y), step, whole, resample=preparation.resample)
    evened: list[Finding] = []
    steps = [np.abs(np.diff(part.time) - step) for part in parts if len(part.time) > 1]
    off = float(max((part.max() for part in steps), default=0.0)) / step
    if off > EVEN:
        fact = f"steps differ from {step:.6g} {time_unit} by up to {per_cent(off, 2)}"
        if off > MOST_JITTER and not preparation.resample:
            row = int(np.nanargmax(np.abs(np.diff(signals.time) - step))) + 1
            hint = f"add --resample to even out more than {MOST_JITTER:.0%}; or give the right --sample-time"
            raise sheet.error("data-not-uniform", f"{fact}, and gaps begin at {_GAP} steps", hint, row)
        evened = [JITTER_EVENED.found(fact, step=step, largest=off)]
        parts, moves = map(list, zip(*(_resampled(part, step) for part in parts), strict=True))
        moved = sum(moves)
        evened += INPUTS_MOVE_BETWEEN.when(moved, f"between {moved} of the even times", instants=moved)
    taken = [_detrended(part, signals.names, preparation) for part in parts]
    trends = [one for _, found in taken for one in found]
    return [part for part, _ in taken], [*evened, *cuts, *seen, *dict.fromkeys(trends)]


def _cut(
    time: Array, signals: Signals, step: float, whole: NDArray[np.bool_], *, resample: bool
) -> tuple[list[Segment], list[Finding]]:
    """Cut a record at its gaps into stretches, of ten samples or more if there are any, with findings."""
    lines, found = signals.sheet.lines, list[Finding]()
    apart = np.zeros(len(lines), dtype=bool)
    passed = [line for line in signals.sheet.passed if lines[0] < line < lines[-1] and not signals.name]
    apart[np.searchsorted(lines, passed)] = True
    found += LINES_PASSED_OVER.when(passed, listed(passed, "line"), lines=len(passed))
    kept = np.flatnonzero(whole)
    cut = (np.diff(kept) > 1) | apart[kept[1:]]
    long = np.diff(time[kept]) > (_LONG_GAP if resample else _GAP) * step
    parts = np.split(kept, np.flatnonzero(cut | long) + 1)
    if np.sum(long & ~cut) > _OFTEN * len(kept):
        row = int(kept[1:][long & ~cut][0])
        message = f"times of {signals.sheet.path.name} often advance by more than {_GAP} times {step:.6g}"
        hint = "if they are rounded, --columns time=none and --sample-time; if rows are missing, --resample"
        raise signals.sheet.error("data-not-uniform", message, hint, row)
    longer = [part for part in parts if len(part) >= SHORTEST] or [max(parts, key=len)]
    short, gaps = np.setdiff1d(kept, np.concatenate(longer)), lines[kept[1:]][long & ~cut]
    for rows, why in (
        (lines[signals.without], "as --without says"),
        (lines[~whole & ~signals.without], "since a number is missing"),
    ):
        found += ROWS_LEFT_OUT.when(rows.size, f"{listed(rows)}, {why}", rows=len(rows))
    facts = [f"{len(longer)} with initial states of their own" if len(longer) > 1 else "one is used"]
    facts += [f"gaps before {listed(gaps)}"] if gaps.size else []
    facts += [f"{listed(lines[short])} left out as too short"] if short.size else []
    found += RECORD_CUT.when(
        len(longer) > 1 or gaps.size or short.size,
        ", ".join(facts),
        segments=len(longer),
        gaps=len(gaps),
        samples_left_out=len(short),
    )
    return [Segment(time[part], signals.u[part], signals.y[part]) for part in longer], found


def _resampled(part: Segment, step: float) -> tuple[Segment, int]:
    """Resample a segment at even times: outputs by linear interpolation, inputs at the nearest sample.

    The number counts the even times after which inputs change at samples that are left out.
    """
    count = int(np.floor((part.time[-1] - part.time[0]) / step + 0.5)) + 1
    even = part.time[0] + step * np.arange(count)
    nearest = np.searchsorted(0.5 * (part.time[1:] + part.time[:-1]), even)
    last = np.searchsorted(nearest, np.arange(nearest[-1] + 1), side="right") - 1
    moved = np.any(part.u[: nearest[-1] + 1] != part.u[nearest[last]], axis=1)
    y = np.column_stack([np.interp(even, part.time, column) for column in part.y.T])
    return Segment(even, part.u[nearest], y), int(np.unique(last[moved]).size)


def _detrended(
    part: Segment, names: tuple[str, ...], preparation: Preparation
) -> tuple[Segment, list[Finding]]:
    """Return a segment without its trends or its operating point, and findings on the trends."""
    found, left = list[Finding](), []
    for name, x in zip(names, (*part.u.T, *part.y.T), strict=True):
        if preparation.detrend == "none":
            left.append(x - preparation.operating_point.get(name if name[1:] else f"{name}1", 0.0))
            continue
        away, line = trend(x, preparation.detrend)
        first, last = float(away[0]), float(away[-1])
        fact = f"a line from {first:.6g} to {last:.6g} of {name}" if line else f"{first:.6g} of {name}"
        found.append(TREND_REMOVED.found(fact, where=name, first=first, last=last, line=line))
        left.append(x - away)
    u, y = np.split(np.column_stack(left), [part.u.shape[1]], axis=1)
    return Segment(part.time, u, y), found


def trend(x: Array, kind: Detrend) -> tuple[Array, bool]:
    """Return the trend (n,) of a signal x (n,), and whether it is a line.

    `auto` takes a line if it explains half the power about the mean, else the mean.
    """
    level, line = (x - scipy.signal.detrend(x, type=shape) for shape in ("constant", "linear"))
    explains = np.sum((x - line) ** 2) < 0.5 * np.sum((x - level) ** 2)
    return (line, True) if kind == "linear" or (kind == "auto" and explains) else (level, False)
