"""Columns that were written at different times, brought to the times of one of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.findings.places import SHORTEST
from inputdesign_cli.findings.prepared_records import COLUMNS_JOINED
from inputdesign_cli.records.signals import Signals

# Rows stay as they are where this share of the whole ones stands in long stretches; in short records, where
# this share is whole.
_KEPT, _FEW, _SHORT = 0.25, 0.5, 2 * SHORTEST
# Steps of an output that are longer, in its own, are gaps. Those of all rows may be shorter by the second.
_OWN_GAP, _NEARLY = 3.0, 1.1


def joined_rows(signals: Signals, *, resample: bool) -> Signals:
    """Return the signals at the times of the output that was written most often, if hardly a row is whole.

    Inputs are held until they are written again, and move at the nearest of these times. Outputs are
    interpolated linearly. Raises `DataError` (`data-not-a-number`) unless `resample` asks for it.
    """
    import pandas

    there = ~np.isnan(np.column_stack([signals.u, signals.y]))
    whole = np.asarray(there.all(axis=1))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], whole.astype(int), [0]])))
    stretches = edges[1::2] - edges[::2]
    short = len(whole) < _SHORT and whole.mean() >= _FEW
    if short or stretches[stretches >= SHORTEST].sum() > _KEPT * whole.sum():
        return signals
    counts = dict(zip(signals.names, there.sum(axis=0).tolist(), strict=True))
    listed = ", ".join(f"{name} in {count}" for name, count in counts.items())
    timed = ~np.isnan(signals.time)
    possible = bool(signals.name) and bool(np.all(np.any(there & timed[:, None], axis=0)))
    if not (resample and possible):
        message = f"hardly a row of {signals.sheet.path.name} has numbers in all columns ({listed} of "
        message += f"{len(whole)} rows): they were written at different times"
        option = "add --resample (inputs are held until written again, outputs interpolated), or "
        hint = f"{option * possible}join the rows of each sample, or log the time with them"
        raise signals.sheet.error("data-not-a-number", message, hint, 0)
    signals = signals.at(np.flatnonzero(timed))
    written = ~np.isnan(signals.y)
    rows = np.flatnonzero(written[:, int(np.argmax(written.sum(axis=0)))])
    own, every = (float(np.median(np.diff(t, append=t[-1]))) for t in (signals.time[rows], signals.time))
    if not np.isnan(signals.u).any() and own <= _NEARLY * every:
        rows = np.arange(len(written))  # it misses some rows only
    instants, held = signals.time[rows], pandas.DataFrame(signals.u).ffill().to_numpy()
    u = held[np.searchsorted(signals.time, instants + 0.5 * own) - 1]
    moved = sum(int(k * np.any(np.diff(x, axis=0) != 0.0, axis=1).sum()) for k, x in ((1, held), (-1, u)))
    y = np.column_stack([_between(signals.time, x, instants) for x in signals.y.T])
    fact = (
        f"{listed} of {len(whole)} rows, joined at {len(rows)} times, between which inputs move {moved} times"
    )
    found = COLUMNS_JOINED.found(fact, counts=counts, rows=len(whole), moved=moved, kept=len(rows))
    return replace(signals.at(rows), u=u, y=y, findings=(*signals.findings, found))


def _between(time: Array, y: Array, instants: Array) -> Array:
    """Interpolate y (n,) linearly between the times at which it was written; NaN outside and in gaps."""
    own = time[~np.isnan(y)]
    found = np.interp(instants, own, y[~np.isnan(y)], left=np.nan, right=np.nan)
    steps = np.diff(own, prepend=own[0], append=own[-1])
    gap = steps[np.searchsorted(own, instants)] > _OWN_GAP * np.median(steps[1:-1] if own.size > 1 else 0.0)
    return np.where(gap & ~np.isin(instants, own), np.nan, found)
