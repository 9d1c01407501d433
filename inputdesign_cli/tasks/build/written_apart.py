"""Logs whose columns were written at different times: hardly any rows in a row have numbers everywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.tasks.build.preparation import SHORTEST
from inputdesign_cli.tasks.build.signals import Signals

# Of records that are too short for a stretch of rows: half of their rows are enough.
_FEW, _SHORT = 0.5, 2 * SHORTEST


def joined_rows(signals: Signals, *, resample: bool) -> tuple[Signals, list[str]]:
    """The rows of the output that was written most often, the other columns brought to its times.

    Inputs are what they were written last, outputs are interpolated linearly. Rows as they stand, where
    enough of them that follow each other are whole.

    Args:
        resample: whether that is asked for.

    Raises:
        DataError: `data-not-a-number`, rows would have to be joined, and that is not asked for or cannot be.
    """
    together = np.column_stack([signals.u, signals.y])
    there = ~np.isnan(together)
    whole = np.asarray(there.all(axis=1))
    short = len(whole) < _SHORT and whole.mean() >= _FEW
    if short or _longest_run(whole) >= SHORTEST:
        return signals, []
    names = (*signals.inputs, *signals.outputs)
    counts = ", ".join(f"{name} in {n}" for name, n in zip(names, there.sum(axis=0), strict=True))
    if not (resample and signals.name):
        sheet = signals.sheet
        few = int(whole.sum())
        share = f"{few} of {len(whole)} rows" if few else "no row"
        message = (
            f"{share} of {sheet.path.name} {'have' if few > 1 else 'has'} a number in every column that is "
            f"asked for, and never {SHORTEST} that follow each other ({counts} of {len(whole)}): the columns "
            "were written at different times"
        )
        hint = (
            "add --resample (inputs are held until they are written again, outputs interpolated), or join "
            "the rows"
            if signals.name
            else "inputs and outputs of a sample stand in one row: join the rows, or log the time with them"
        )
        raise DataError(sheet.error("data-not-a-number", message, hint, 0))
    timed = ~np.isnan(signals.time)
    written = ~np.isnan(signals.y) & timed[:, None]
    rows = np.flatnonzero(written[:, int(np.argmax(written.sum(axis=0)))])
    time = signals.time[rows]
    u = np.column_stack([_held(signals.time, x, time) for x in signals.u.T])
    y = np.column_stack(
        [
            np.interp(time, signals.time[at], x[at], left=np.nan, right=np.nan)
            for x, at in zip(signals.y.T, written.T, strict=True)
        ]
    )
    sheet = signals.sheet
    texts = [sheet.texts[i] for i in rows.tolist()] if sheet.texts else ()
    kept = replace(sheet, lines=sheet.lines[rows], texts=texts)
    note = (
        f"the columns were written at different times ({counts} of {len(whole)} rows): inputs are held until "
        "they are written again, outputs interpolated at the times of the one that was written most often"
    )
    return replace(signals, sheet=kept, time=time, u=u, y=y), [note]


def _held(time: Array, x: Array, instants: Array) -> Array:
    """What x (n,) was last at some instants; NaN before it was written first."""
    at = np.flatnonzero(~np.isnan(x) & ~np.isnan(time))
    last = np.searchsorted(time[at], instants, side="right") - 1
    return np.where(last >= 0, x[at][np.maximum(last, 0)], np.nan)


def _longest_run(whole: NDArray[np.bool_]) -> int:
    """Of rows that follow each other."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], whole.astype(int), [0]])))
    return int((edges[1::2] - edges[::2]).max(initial=0))
