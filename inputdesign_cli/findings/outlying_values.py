"""Values of a record stand far from all others, at the end of a range, or on coarse steps."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, listed, note

OUTLYING_VALUES = note(
    "outlying-values",
    "Some values lie far from all others. They are more than eight robust standard deviations from the "
    "median. The inputs do not explain them. They are kept.",
    "Inspect the record. Leave out faulty values with `--without`.",
)
SPIKES_REPLACED = note(
    "spikes-replaced",
    "Single spikes were replaced by interpolation. One sample is more than twelve robust standard "
    "deviations from a running median, unlike its neighbours. The inputs do not explain it.",
    "Nothing, if it is a measurement fault. To cut the record there instead, use `--without`.",
)
SENSOR_SATURATED = note(
    "sensor-saturated",
    "An output stays at its largest or smallest value. At least two per cent of the samples lie there, in "
    "runs of three or more. The sensor may be at the end of its range.",
    "Leave these rows out with `--without`, or measure with another range.",
)
SENSOR_ROUNDED = note(
    "sensor-rounded",
    "An output moves in visible steps. All values lie on a grid whose step exceeds a tenth of the standard "
    "deviation. Rounding acts as noise, if the noise is no smaller than half a step.",
    "Log with more digits, or excite with larger moves.",
)

# Distances in robust standard deviations beyond which values are outlying, or spikes.
_OUTLYING, _SPIKE = 8.0, 12.0
# A single spike stands out by this factor from its neighbours; spikes beyond this share are no accidents.
_ALONE, _SELDOM = 4.0, 0.01
_SHORTEST = 10  # the fewest samples in which spikes are looked for
# More values than this share are no outliers, but the other level of the signal.
_OFTEN = 0.05
# Squares of signals are powers, and a spec has none beyond the square of this, or below that of its inverse.
_EXTREME = 1e18
# A value this many times farther off than usual leaves all others to rounding when squared.
_ABSURD = 1e10
# The most lags of an impulse response, the most samples that give it, its ridge, and the samples per lag.
_LAGS, _MOST, _RIDGE, _PER_LAG = 150, 5000, 1e-9, 6
_PASSES, _USUAL = 3, 4.0  # fits without outliers; their largest residual, in median absolute residuals
# A saturated signal has more than _FEW_LEVELS levels, and _CLIPPED of its samples at an extreme, in runs of
# _RUN. Rounded values are off their grid by less than _OFF_GRID steps of at least _COARSE deviations.
_FEW_LEVELS, _CLIPPED, _RUN = 10, 0.02, 3
_OFF_GRID, _COARSE = 1e-3, 0.1


def without_spikes(
    names: Sequence[str], u: Array, y: Array, counts: NDArray[np.bool_], rows: NDArray[np.int64]
) -> tuple[Array, list[Finding]]:
    """Return outputs (n, p) with single spikes replaced, and findings on all signals.

    Args:
        names: names of the inputs u (n, r), then of the outputs y (n, p); NaN where a number is missing.
        counts: (n,), whether a sample is not left out.
        rows: (n,), rows of the file.
    """
    r, found, plain = u.shape[1], [], y.copy()
    for name, x in zip(names[:r], u.T, strict=True):
        there = np.flatnonzero(~np.isnan(x) & counts)
        found += outlying(name, x[there], None, rows[there])
    for name, x in zip(names[r:], plain.T, strict=True):
        there = np.flatnonzero(~np.isnan(x) & counts)
        inputs, values = u[there], x[there]
        at = single_spikes(values, inputs)
        between = 0.5 * (values[at - 1] + values[np.minimum(at + 1, len(values) - 1)])
        lines, was = rows[there][at], values[at].tolist()
        fact = f"{name} in {listed(lines)}"
        if at.size == 1:
            fact += f", {was[0]:.6g} between values about {between[0]:.6g}"
        found += SPIKES_REPLACED.when(at.size, fact, where=name, rows=lines.tolist(), values=was)
        values[at] = between
        x[there] = values
        found += [*outlying(name, values, inputs, rows[there]), *sensor_limits(name, values)]
    return plain, found


def single_spikes(y: Array, u: Array) -> NDArray[np.int64]:
    """Return where an output y (n,) has a spike of one sample that inputs u (n, r) do not explain."""
    if y.size < _SHORTEST:
        return np.zeros(0, dtype=np.int64)
    at = _spikes(y)
    if at.size:
        at = np.intersect1d(at, _spikes(y - _response(u, y)))
    return at if at.size <= max(1, _SELDOM * y.size) else at[:0]


def _spikes(y: Array) -> NDArray[np.int64]:
    off = np.abs(y - scipy.ndimage.median_filter(y, 5, mode="nearest"))
    steps, between = np.abs(np.diff(y)), np.abs(y[1:-1] - 0.5 * (y[:-2] + y[2:]))
    # Most rounded values equal the mean of their neighbours, so that the least step counts as well.
    least = float(np.min(steps[steps > 0.0], initial=np.inf))
    spread = max(1.4826 * float(np.median(between)), float(np.quantile(between, 0.95)) / 2.0, least)
    far = np.flatnonzero(off[1:-1] > _SPIKE * spread) + 1
    return far[np.maximum(off[far - 1], off[far + 1]) * _ALONE < off[far]]


def outlying(name: str, x: Array, u: Array | None, lines: NDArray[np.int64]) -> list[Finding]:
    """Say which values of a signal x (n,), with their rows in the file, are far from the median.

    Values of an output that the inputs u (n, r), NaN where missing, explain do not count.
    """
    far = _far(x)
    if u is not None and np.any(far):
        far &= _far(x - _response(u, x))
    count, rows = int(far.sum()), lines[far]
    fact = f"{count} of {name} ({listed(rows)})"
    seldom = 0 < count <= _OFTEN * x.size
    return OUTLYING_VALUES.when(seldom, fact, where=name, values=count, rows=rows[:5].tolist())


def sensor_limits(name: str, x: Array) -> list[Finding]:
    """Say whether a measured signal x (n,) stays at an extreme value, or moves in visible steps."""
    levels, found, spread = np.unique(x), [], float(np.std(x))
    for word, at in (("largest", x == levels[-1]), ("smallest", x == levels[0])):
        value = float(levels[-1] if word == "largest" else levels[0])
        at[: int(np.argmin(at))] = False  # at the beginning it may be at rest, before the input moves
        runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], at.astype(int), [0]]))))[::2]
        stays = int(runs[runs >= _RUN].sum())
        if levels.size > _FEW_LEVELS and stays > _CLIPPED * x.size:
            fact = f"{name} at its {word} value {value:.6g} for {stays} samples"
            found.append(SENSOR_SATURATED.found(fact, where=name, value=value, samples=stays))
    step = visible_step(x)
    if step:
        fact = f"{name} in steps of {step:.3g}, {step / spread:.2f} of its standard deviation"
        found.append(SENSOR_ROUNDED.found(fact, where=name, step=step, share=step / spread))
    return found


def visible_step(x: Array) -> float:
    """Return the step of a grid on which a signal x (n,) moves, beyond a tenth of its deviation; 0: none."""
    levels = np.unique(x)
    gaps = np.diff(levels)
    step = float(gaps.min(initial=np.inf))
    # Values that are not rounded rarely recur.
    visible = _COARSE * float(np.std(x)) < step < np.inf and 2 * levels.size < x.size
    return step if visible and np.all(np.abs(gaps / step - np.round(gaps / step)) < _OFF_GRID) else 0.0


def _far(x: Array) -> NDArray[np.bool_]:
    off = np.abs(x - np.median(x))
    low, high = np.quantile(x, [0.5 * _OFTEN, 1.0 - 0.5 * _OFTEN])
    # A few outliers do not change this spread. The median deviation of a signal with two levels may be zero.
    spread = max(1.4826 * float(np.median(off)), float(high - low) / 4.0)
    return off > (_OUTLYING * spread if spread > 0.0 else np.inf)


def _response(u: Array, y: Array) -> Array:
    """Return the part (n,) of an output that past inputs explain, by a finite impulse response."""
    u = u[:, ~np.all(np.isnan(u), axis=0)]
    lags = min(_LAGS, len(y) // (_PER_LAG * max(u.shape[1], 1))) if u.size else 0
    if lags == 0:
        return np.zeros(y.size)
    there = np.where(np.isnan(u), np.nanmedian(u, axis=0), u)
    moved = (there - there[0]) / np.maximum(np.abs(there).max(axis=0), np.finfo(float).tiny)
    columns = np.column_stack([scipy.linalg.toeplitz(x[:_MOST], np.zeros(lags)) for x in moved.T])
    # Inputs from before the record act on its first samples.
    columns = np.column_stack([columns, np.ones(len(columns))])[lags:]
    level = float(np.median(y))
    wanted, kept = y[lags:_MOST] - level, np.ones(len(columns), dtype=bool)
    for _ in range(_PASSES):  # outliers do not affect the fit
        own = columns[kept]
        gram = own.T @ own + _RIDGE * len(columns) * np.eye(own.shape[1])
        solution = np.asarray(np.linalg.solve(gram, own.T @ wanted[kept]), dtype=float)
        off = np.abs(wanted - columns @ solution)
        kept = off <= _USUAL * np.median(off)
    responses = np.split(solution[:-1], moved.shape[1])
    return sum(
        (np.convolve(x, h)[: len(y)] for x, h in zip(moved.T, responses, strict=True)), level + solution[-1]
    )


def beyond_precision(name: str, x: Array) -> tuple[int, str, str] | None:
    """Return the row of a value in x (n,) whose square leaves double precision, with message and hint.

    x is NaN where samples are missing. Return None if all squares stay in range, also relative to each other.
    """
    row, there = int(np.nanargmax(np.abs(x))), np.flatnonzero(~np.isnan(x))
    size = abs(float(x[row]))
    scaled = x[there] / max(size, np.finfo(float).tiny)
    middle = float(np.median(scaled))
    off = np.abs(scaled - middle)
    usual = max(float(np.median(off[off > 0.0])), abs(middle)) if np.any(off > 0.0) else np.inf
    far = there[off > _ABSURD * usual]
    if 0 < far.size <= _OFTEN * there.size:  # more frequent values are another level of the signal
        message = f"{x[far[0]]:.6g} in column {name} is so large that all other values are lost in rounding"
        return int(far[0]), message, "write the value that was meant"
    if size and not 1.0 / _EXTREME < size < _EXTREME:
        message = f"the column {name} has values up to {size:.3g}: their squares leave the range of numbers"
        hint = f"write it in another unit: below {_EXTREME:.0e}, and the largest value above "
        return row, message, hint + f"{1 / _EXTREME:.0e}"
    return None
