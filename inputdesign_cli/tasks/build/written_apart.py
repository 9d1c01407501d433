"""Logs whose columns were written at different times: few rows that follow each other are whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.tasks.build.preparation import MOST_JITTER, SHORTEST
from inputdesign_cli.tasks.build.signals import Signals

# Rows count as they stand where so much of those that are whole stand in long stretches; of records that are
# too short for these, where so many are whole.
_KEPT, _FEW, _SHORT = 0.25, 0.5, 2 * SHORTEST
# Steps of an output that are longer, in its own, are gaps. Times are even where so many steps are.
_GAP, _MOSTLY = 3.0, 0.95


def joined_rows(signals: Signals, *, resample: bool) -> tuple[Signals, list[str]]:
    """The rows of the output that was written most often, the other columns brought to its times.

    All rows where that misses some only. Inputs are held until they are written again, and are their means
    until the next row; outputs are interpolated linearly. Rows as they stand, where enough of those that
    follow each other are whole.

    Args:
        resample: whether that is asked for.

    Raises:
        DataError: `data-not-a-number`, rows would have to be joined, and that is not asked for or cannot be.
    """
    together = np.column_stack([signals.u, signals.y])
    there = ~np.isnan(together)
    whole = np.asarray(there.all(axis=1))
    short = len(whole) < _SHORT and whole.mean() >= _FEW
    if short or _in_stretches(whole) > _KEPT * whole.sum():
        return signals, []
    names = (*signals.inputs, *signals.outputs)
    counts = ", ".join(f"{name} in {n}" for name, n in zip(names, there.sum(axis=0), strict=True))
    if not (resample and signals.name):
        sheet = signals.sheet
        few = int(whole.sum())
        share = f"{few} of {len(whole)} rows" if few else "no row"
        message = (
            f"{share} of {sheet.path.name} {'have' if few > 1 else 'has'} a number in every column that is "
            f"asked for, hardly ever {SHORTEST} that follow each other ({counts} of {len(whole)}): the "
            "columns were written at different times"
        )
        hint = (
            "add --resample (inputs are held until they are written again, outputs interpolated), or join "
            "the rows"
            if signals.name
            else "inputs and outputs of a sample stand in one row: join the rows, or log the time with them"
        )
        raise DataError(sheet.error("data-not-a-number", message, hint, 0))
    timed = ~np.isnan(signals.time)
    untimed = np.flatnonzero(~np.any(there & timed[:, None], axis=0))
    if untimed.size:
        message = f"{names[untimed[0]]} has no number in any row of {signals.sheet.path.name} with a time"
        hint = f"write the time ({signals.name}) into its rows, too"
        raise DataError(signals.sheet.error("data-not-a-number", message, hint, 0))
    written = ~np.isnan(signals.y) & timed[:, None]
    rows = np.flatnonzero(written[:, int(np.argmax(written.sum(axis=0)))])
    if _misses_some(signals.time[timed], signals.time[rows]):
        rows = np.flatnonzero(timed)
    time = signals.time[rows]
    inputs = [_until_next(signals.time, x, time) for x in signals.u.T]
    outputs = [_between(signals.time[at], x[at], time) for x, at in zip(signals.y.T, written.T, strict=True)]
    sheet = signals.sheet
    texts = [sheet.texts[i] for i in rows.tolist()] if sheet.texts else ()
    kept = replace(sheet, lines=sheet.lines[rows], texts=texts)
    told = [
        f"the columns were written at different times ({counts} of {len(whole)} rows): inputs are held until "
        "they are written again, outputs interpolated at the times of the one that was written most often"
    ]
    moved = int(np.any([moves for _, moves in inputs], axis=0).sum())
    if moved:
        told.append(
            f"inputs move between {moved} of the {len(rows)} instants that are kept, and count by their "
            "means from one to the next: what is faster than that cannot be told"
        )
    u = np.column_stack([means for means, _ in inputs])
    y, without = np.column_stack(outputs), signals.without[rows]
    return replace(signals, sheet=kept, time=time, u=u, y=y, without=without), told


def _misses_some(every: Array, own: Array) -> bool:
    """Whether rows at even times have an output at some `own` times among them, mostly a step apart."""
    if len(own) < 2:
        return False
    steps = np.diff(every)
    typical = float(np.median(steps))
    even = np.mean(np.abs(steps - typical) <= MOST_JITTER * typical) >= _MOSTLY
    return bool(even and np.median(np.diff(own)) <= (1.0 + MOST_JITTER) * typical)


def _until_next(time: Array, x: Array, instants: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Means of x (n,), held until it is written again, from each instant to the next; the last as it is.

    NaN before it was written first. With them whether it moves before the next instant.
    """
    at = np.flatnonzero(~np.isnan(x) & ~np.isnan(time))
    began, values = time[at], x[at]
    here = np.searchsorted(began, instants, side="right") - 1
    last = np.maximum(here, 0)
    changes = np.cumsum(np.concatenate([[0], values[1:] != values[:-1]]))
    before_next = np.maximum(np.searchsorted(began, instants[1:], side="left") - 1, 0)
    moves = np.append((changes[before_next] > changes[last[:-1]]) & (here[:-1] >= 0), False)
    area = np.concatenate([[0.0], np.cumsum(values[:-1] * np.diff(began))])
    until = area[last] + values[last] * (instants - began[last])
    means = np.append(np.diff(until) / np.diff(instants), values[last[-1]])
    held = np.where(moves, means, values[last])
    return np.where(here >= 0, held, np.nan), moves


def _between(time: Array, y: Array, instants: Array) -> Array:
    """y (n,) at some instants, on the line between its neighbours; NaN outside and in gaps."""
    found = np.interp(instants, time, y, left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(time, instants, side="left"), 1, max(len(time) - 1, 1))
    steps = np.diff(time)
    if not steps.size:
        return found
    gap = steps[after - 1] > _GAP * np.median(steps)
    return np.where(gap & ~np.isin(instants, time), np.nan, found)


def _in_stretches(whole: NDArray[np.bool_]) -> int:
    """How many rows stand in stretches that are long enough."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], whole.astype(int), [0]])))
    lengths = edges[1::2] - edges[::2]
    return int(lengths[lengths >= SHORTEST].sum())
