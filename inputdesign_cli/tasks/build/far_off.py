"""Values of a log that stand far from the others: named, and kept."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.tasks.build import rows
from inputdesign_cli.tasks.build.extremes import OFTEN, spread_of

# Farther off than this many (robust) standard deviations: most likely not of this experiment.
_OUTLYING = 8.0
_SHORTEST = 10
# How far back an input is taken to act, and the samples from which that is estimated: this is a quick look.
_LAGS, _MOST, _RIDGE = 150, 5000, 1e-9
_PER_LAG = 6
_PASSES, _USUAL = 3, 4.0
# Of an autoregression, with so many samples to a parameter at least: enough for a few resonances.
_ORDER = 8


def outliers(name: str, x: Array, lines: NDArray[np.int64]) -> list[str]:
    """Values far from the median of an input x (n,), with their rows in the file."""
    return _outlying(name, _far(x), x, lines)


def strange_values(name: str, y: Array, u: Array, lines: NDArray[np.int64]) -> list[str]:
    """Values of an output y (n,) far from the median, or more of them far from their neighbours: spikes.

    What the inputs u (n, r), NaN where missing, explain is neither: a plant answers pulses and jumps. Nor is
    a swing that the values before it explain.
    """
    far, alone = _far(y), _alone(y)
    if np.any(far) or np.any(alone):
        left = y - _caused(u, y)
        far, alone = far & _far(left), alone & _unforeseen(left, _alone(left))
    told = _outlying(name, far, y, lines)
    if told or alone.sum() <= OFTEN * y.size:
        return told
    return [
        f"{name} has {alone.sum()} values ({per_cent(alone.mean(), 2)}) far from their neighbours "
        f"({rows.told(lines[alone])}): spikes? Look at the record, and leave rows out that are faults of "
        "measurement (--without)"
    ]


def _outlying(name: str, far: NDArray[np.bool_], x: Array, lines: NDArray[np.int64]) -> list[str]:
    count = int(far.sum())
    if not 0 < count <= OFTEN * x.size:
        return []
    return [
        f"{name} has {count} outlying value{'s' * (count > 1)} ({rows.told(lines[far])}): look at the record"
    ]


def _far(x: Array) -> NDArray[np.bool_]:
    spread = spread_of(x)
    return np.abs(x - np.median(x)) > _OUTLYING * spread if spread > 0.0 else np.zeros(x.size, dtype=bool)


def _alone(x: Array) -> NDArray[np.bool_]:
    """Whether a value is far from the median of the five about it."""
    found = np.zeros(x.size, dtype=bool)
    if x.size >= _SHORTEST:
        off = np.abs(x[2:-2] - np.median(np.lib.stride_tricks.sliding_window_view(x, 5), axis=1))
        found[2:-2] = (off > _OUTLYING * 1.4826 * np.median(off)) & (np.median(off) > 0.0)
    return found


def _caused(u: Array, y: Array) -> Array:
    """(n,): what past inputs explain of an output, by a finite impulse response and least squares."""
    u = u[:, ~np.all(np.isnan(u), axis=0)]
    if not u.size:
        return np.zeros(y.size)
    there = np.where(np.isnan(u), np.nanmedian(u, axis=0), u)
    scaled = (there - there.mean(axis=0)) / np.maximum(np.abs(there).max(axis=0), np.finfo(float).tiny)
    samples, r = scaled.shape
    lags = min(_LAGS, samples // (_PER_LAG * r))
    if lags == 0:
        return np.zeros(samples)
    moved, some = scaled - scaled[0], slice(lags, _MOST)
    columns = np.column_stack([scipy.linalg.toeplitz(x[:_MOST], np.zeros(lags)) for x in moved.T])
    # Inputs from before the record act on its first samples.
    columns = np.column_stack([columns, np.ones(len(columns))])[lags:]
    level = float(np.median(y))
    solution = _usual_solution(columns, y[some] - level)
    responses = np.split(solution[:-1], r)
    return sum(
        (np.convolve(x, h)[:samples] for x, h in zip(moved.T, responses, strict=True)), level + solution[-1]
    )


def _unforeseen(x: Array, suspected: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Those of the suspected values that are far from what an autoregression of the others foresees."""
    order = min(_ORDER, x.size // (2 * _PER_LAG))
    spread = spread_of(x)
    if order == 0 or spread == 0.0 or not np.any(suspected):
        return suspected
    scaled = (x - np.median(x)) / spread
    # Faults would speak for what follows them.
    plain = np.where(suspected, scipy.ndimage.median_filter(scaled, 5), scaled)
    columns, wanted = np.lib.stride_tricks.sliding_window_view(plain, order)[:-1], scaled[order:]
    off = np.abs(wanted - columns @ _usual_solution(columns[:_MOST], wanted[:_MOST]))
    found = suspected.copy()
    found[order:] &= off > _OUTLYING * 1.4826 * np.median(off)
    return found


def _usual_solution(columns: Array, wanted: Array) -> Array:
    """Least squares, in which faults do not decide what is explained."""
    kept = np.ones(len(wanted), dtype=bool)
    for _ in range(_PASSES):
        theirs = columns[kept]
        gram = theirs.T @ theirs + _RIDGE * len(columns) * np.eye(theirs.shape[1])
        solution = np.asarray(np.linalg.solve(gram, theirs.T @ wanted[kept]), dtype=float)
        off = np.abs(wanted - columns @ solution)
        kept = off <= _USUAL * np.median(off)
    return solution
