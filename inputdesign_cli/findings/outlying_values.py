"""Values of a record stand far from all others: spikes are replaced, other ones are named and kept."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, FindingKind, Severity, listed
from inputdesign_cli.findings.sensor_limits import sensor_limits
from inputdesign_cli.outcome.shares import per_cent

OUTLYING_VALUES = FindingKind(
    "outlying-values",
    Severity.NOTE,
    "values stand far from all others",
    "Values are more than eight robust standard deviations from the median or from their neighbours. The "
    "inputs do not explain them. They are kept.",
    "Look at the record. Leave faults of measurement out with `--without`.",
)
SPIKES_REPLACED = FindingKind(
    "spikes-replaced",
    Severity.NOTE,
    "single spikes were replaced by interpolation",
    "One sample is more than twelve robust standard deviations from a running median, and its neighbours are "
    "not. The inputs do not explain it. The mean of its neighbours counts instead.",
    "Nothing, if it is a fault of measurement. To cut the record there instead, use `--without`.",
)

# Farther off than this many robust standard deviations.
_OUTLYING, _SPIKE = 8.0, 12.0
# A single spike stands out this much more than its neighbours; above this share they are no accidents.
_ALONE, _SELDOM = 4.0, 0.01
_SHORTEST = 10
# More values than this share are no outliers, but the other level of the signal.
_OFTEN = 0.05
# Squares of signals are powers, and a spec has none beyond the square of this, or below that of its inverse.
_EXTREME = 1e18
# Beside a value this many times farther off than any other, all others are lost in rounding when squared.
_ABSURD = 1e10
# How far back an input is taken to act, and the samples from which that is estimated: this is a quick look.
_LAGS, _MOST, _RIDGE = 150, 5000, 1e-9
_PER_LAG = 6
_PASSES, _USUAL = 3, 4.0
# Of an autoregression, with this many samples to a parameter at least: enough for a few resonances.
_ORDER = 8


def without_spikes(
    names: Sequence[str], u: Array, y: Array, counts: NDArray[np.bool_], rows: NDArray[np.int64]
) -> tuple[Array, list[Finding]]:
    """Return outputs (n, p) with single spikes replaced, and what is seen in all signals.

    Args:
        names: of the inputs u (n, r), then of the outputs y (n, p); NaN where a number is missing.
        counts: (n,), whether a sample is not left out.
        rows: (n,), of the file.
    """
    r, found, plain = u.shape[1], [], y.copy()
    for name, x in zip(names[:r], u.T, strict=True):
        there = np.flatnonzero(~np.isnan(x) & counts)
        found += outlying_inputs(name, x[there], rows[there])
    for name, x in zip(names[r:], plain.T, strict=True):
        there = np.flatnonzero(~np.isnan(x) & counts)
        inputs, values = u[there], x[there]
        at = single_spikes(values, inputs)
        found += _replaced(name, values, at, rows[there])
        values[at] = 0.5 * (values[at - 1] + values[np.minimum(at + 1, len(values) - 1)])
        x[there] = values
        found += [*outlying_outputs(name, values, inputs, rows[there]), *sensor_limits(name, values)]
    return plain, found


def single_spikes(y: Array, u: Array) -> NDArray[np.int64]:
    """Return where an output y (n,) has a spike of one sample that inputs u (n, r) do not explain."""
    if y.size < _SHORTEST:
        return np.zeros(0, dtype=np.int64)
    at = _spikes(y)
    if at.size:
        rest = y - _caused(u, y)
        at = np.intersect1d(at, _spikes(rest))
    return at if at.size <= max(1, _SELDOM * y.size) else at[:0]


def _spikes(y: Array) -> NDArray[np.int64]:
    off = np.abs(y - scipy.ndimage.median_filter(y, 5, mode="nearest"))
    steps, between = np.abs(np.diff(y)), np.abs(y[1:-1] - 0.5 * (y[:-2] + y[2:]))
    # Rounded values lie between their neighbours most of the time: their least step counts.
    least = float(np.min(steps[steps > 0.0], initial=np.inf))
    spread = max(1.4826 * float(np.median(between)), float(np.quantile(between, 0.95)) / 2.0, least)
    far = np.flatnonzero(off[1:-1] > _SPIKE * spread) + 1
    return far[np.maximum(off[far - 1], off[far + 1]) * _ALONE < off[far]]


def _replaced(name: str, y: Array, at: NDArray[np.int64], lines: NDArray[np.int64]) -> list[Finding]:
    """Say which samples of an output y (n,), with their rows in the file, were replaced."""
    if not at.size:
        return []
    first = int(at[0])
    if len(at) == 1:
        around = 0.5 * (y[first - 1] + y[first + 1])
        said = f"{name} has a spike in row {lines[first]}: {y[first]:.6g} between values about {around:.6g}."
    else:
        said = f"{name} has {len(at)} single spikes ({listed(lines[at])})."
    more = "Interpolation replaces it." if len(at) == 1 else "Interpolation replaces them."
    rows, values = lines[at].tolist(), y[at].tolist()
    return [SPIKES_REPLACED.found(f"{said} {more}", where=name, rows=rows, values=values)]


def outlying_inputs(name: str, x: Array, lines: NDArray[np.int64]) -> list[Finding]:
    """Say which values of an input x (n,), with their rows in the file, are far from the median."""
    return _outlying(name, _far(x), x, lines)


def outlying_outputs(name: str, y: Array, u: Array, lines: NDArray[np.int64]) -> list[Finding]:
    """Say which values of an output y (n,) are far from the median, or from their neighbours.

    What the inputs u (n, r), NaN where missing, explain is neither: a plant answers pulses and jumps. Nor is
    a swing that the values before it explain.
    """
    far, alone = _far(y), _alone(y)
    if np.any(far) or np.any(alone):
        rest = y - _caused(u, y)
        far, alone = far & _far(rest), alone & _unforeseen(rest, _alone(rest))
    found = _outlying(name, far, y, lines)
    if found or alone.sum() <= _OFTEN * y.size:
        return found
    said = f"{name} has {alone.sum()} values ({per_cent(alone.mean(), 2)}) far from their neighbours"
    return [
        OUTLYING_VALUES.found(
            f"{said} ({listed(lines[alone])}). Look whether they are spikes.",
            where=name,
            values=int(alone.sum()),
        )
    ]


def _outlying(name: str, far: NDArray[np.bool_], x: Array, lines: NDArray[np.int64]) -> list[Finding]:
    count = int(far.sum())
    if not 0 < count <= _OFTEN * x.size:
        return []
    said = f"{name} has {count} outlying value{'s' * (count > 1)} ({listed(lines[far])}): look at the record."
    return [OUTLYING_VALUES.found(said, where=name, values=count, rows=lines[far][:5].tolist())]


def spread_of(x: Array) -> float:
    """Return a standard deviation of x (n,) that a few values do not move."""
    spread = 1.4826 * float(np.median(np.abs(x - np.median(x))))
    low, high = np.quantile(x, [0.5 * _OFTEN, 1.0 - 0.5 * _OFTEN])
    # Two levels have no spread about the more frequent one.
    return max(spread, float(high - low) / 4.0)


def _far(x: Array) -> NDArray[np.bool_]:
    spread = spread_of(x)
    return np.abs(x - np.median(x)) > _OUTLYING * spread if spread > 0.0 else np.zeros(x.size, dtype=bool)


def _alone(x: Array) -> NDArray[np.bool_]:
    """Return whether a value is far from the median of the five about it."""
    found = np.zeros(x.size, dtype=bool)
    if x.size >= _SHORTEST:
        off = np.abs(x[2:-2] - np.median(np.lib.stride_tricks.sliding_window_view(x, 5), axis=1))
        found[2:-2] = (off > _OUTLYING * 1.4826 * np.median(off)) & (np.median(off) > 0.0)
    return found


def _caused(u: Array, y: Array) -> Array:
    """Return the part (n,) of an output that past inputs explain, by a finite impulse response."""
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
    """Return which of the suspected values are far from the prediction by an autoregression of the others."""
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


def beyond_precision(name: str, x: Array) -> tuple[int, str, str] | None:
    """Return the row of a value in x (n,) whose square leaves double precision, with message and hint.

    x is NaN where samples are missing. Return None if all squares stay in range, also relative to each other.
    """
    row, lost = int(np.nanargmax(np.abs(x))), absurd(x)
    size = abs(float(x[row]))
    if lost is not None:
        message = f"{x[lost]:.6g} in column {name} is so large that all other values are lost in rounding"
        return lost, message, "write the value that was meant"
    if size and not 1.0 / _EXTREME < size < _EXTREME:
        message = f"the column {name} has values up to {size:.3g}: their squares leave the range of numbers"
        hint = (
            f"write it in another unit: below {_EXTREME:.0e}, and the largest value above {1 / _EXTREME:.0e}"
        )
        return row, message, hint
    return None


def absurd(x: Array) -> int | None:
    """Return the first value of x (n,), NaN where missing, beside which all others are rounding."""
    there = np.flatnonzero(~np.isnan(x))
    scaled = x[there] / max(float(np.abs(x[there]).max()), np.finfo(float).tiny)
    middle = float(np.median(scaled))
    off = np.abs(scaled - middle)
    sizes = np.sort(off[off > 0.0])
    jumps = np.flatnonzero(sizes[1:] > _ABSURD * sizes[:-1])
    if not jumps.size:
        return None
    least = sizes[jumps[-1] + 1]
    far = there[off >= least]
    # Beside a level, or as often as the other level of a signal, it is no fault.
    if far.size > _OFTEN * there.size or least <= _ABSURD * max(abs(middle), spread_of(scaled)):
        return None
    return int(far[0])
