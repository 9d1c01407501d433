"""Faults of measurement: spikes, sensors that stand still, signals that are logged at another time.

An innovation of standard deviation s falls into a cell of width d with a probability of at most d f / s.
Here f is the largest density of usual noise. If that is small, a row of equal samples is beyond chance. If
rounding hides the noise, the model decides: the simulation moves by more than a cell and its own errors while
the sensor does not.

An input that is logged a sample late biases estimates in closed loop. No residual shows it: the model takes
the shift for a delay. The controller shows it if the reference was logged too.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.identification.white import Whitening
from inputdesign_cli.levels import level
from inputdesign_cli.plant import TransferMatrix

# The median of the absolute value of a normal variable, in standard deviations.
_NORMAL = 0.6745
# Spikes are farther from zero than _FAR robust standard deviations, or twice that in _UNSURE samples.
_FAR, _UNSURE = 8.0, 20
# Spikes are at most _FEW of the samples, as a share, and hold at least _MOST of the sum of squares.
_FEW, _MOST = 0.05, 0.5
# The shortest run of equal samples that counts, and the fewest samples that give a deviation.
_SHORTEST, _FEWEST = 5, 20
# The largest density of noise with two-sided exponential tails, times its robust deviation; normal: 0.4.
_DENSITY = 0.52
# The variance of rounding, d^2 / 12, is six times as large after two differences.
_ROUNDING = 6.0 / 12.0
# A measured input at rest may flicker by its rounding, which moves no output. It counts as moving beyond this
# share of its standard deviation.
_MOVES = 0.1
# The errors of a simulation rarely span this number of their robust standard deviations.
_SPAN = 8.0
# The shifts that are tried, in samples. A shift is right if its rms error of the control law is below these
# shares of the error as logged, and of the input.
_LAGS, _BETTER, _GOOD = (-2, -1, 1, 2), 0.1, 0.3


class Spikes(NamedTuple):
    """The samples whose errors in one output hold the `share` of the sum of squares there."""

    output: int
    samples: tuple[int, ...]
    share: float


class Shift(NamedTuple):
    """Signals `letter` of input `channel` obey the controller `lag` samples later (earlier, if negative).

    `left` is the rms error of the control law as logged, `then` the one after the shift. Both are relative to
    the rms of the input.
    """

    letter: str
    channel: int
    lag: int
    left: float
    then: float


def spikes(errors: Array) -> list[Spikes]:
    """Return the spikes of prediction errors (samples, p): a few samples with most of the sum of squares."""
    found = []
    for output, e in enumerate(errors.T):
        spread = float(np.median(np.abs(e))) / _NORMAL
        far = np.flatnonzero(np.abs(e) > _FAR * (1.0 + _UNSURE / e.size) * spread)
        if not far.size or not spread > 0.0 or far.size > _FEW * e.size:
            continue
        size = np.abs(e).max()
        share = float(np.sum((e[far] / size) ** 2) / np.sum((e / size) ** 2))
        if share >= _MOST:
            found.append(Spikes(output, tuple(far.tolist()), share))
    return found


def period_spikes(y: Array, periods: Periods, *, repeats: int = 1) -> list[Spikes]:
    """Return the spikes of outputs (N, p) of inputs that repeat, as differences between the periods.

    Medians of the periods, and over them, keep a spike or a drifting level from counting elsewhere.
    """
    each = periods.parts(y, repeats)
    apart = each - np.median(each, axis=1, keepdims=True)
    levelled = each - np.median(apart, axis=2, keepdims=True)
    errors = levelled - np.median(levelled, axis=1, keepdims=True)
    at = periods.parts(np.arange(float(len(y)))[:, None], repeats).ravel().astype(np.int64)
    found = spikes(errors.reshape(-1, y.shape[1]))
    return [one._replace(samples=tuple(sorted(at[list(one.samples)].tolist()))) for one in found]


def frozen(
    held: NDArray[np.bool_],
    resolution: Array,
    u: Array,
    errors: Array,
    apart: Array,
    simulated: Array,
    lengths: Sequence[int],
) -> dict[int, list[tuple[int, int]]]:
    """Return by output the first and last samples of stretches in which it stands still and an input moves.

    Args:
        held: (samples, p), whether a sample equals the one before, recorded in steps of `resolution` (p,).
        u: (samples, r), the inputs.
        errors, simulated: (samples, p), prediction errors and simulated outputs.
        apart: (samples, p), the record less the simulation.
        lengths: samples of the stretches without gaps.
    """
    ends, moves = np.cumsum([0, *lengths]), _MOVES * np.std(u, axis=0)
    found: dict[int, list[tuple[int, int]]] = {}
    for output, d in enumerate(resolution.tolist()):
        stays = _repeat_probability(errors[:, [output]], d)
        size = _spread(apart[:, output])
        for start, end in pairwise(ends.tolist()):
            edges = np.flatnonzero(np.diff(held[start + 1 : end, output], prepend=False, append=False))
            for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
                length = last - first + 1
                run = slice(start + first, start + first + length)
                if length < _SHORTEST or not np.any(np.ptp(u[run][:-1], axis=0) > moves):
                    continue
                by_chance = len(u) * stays ** (length - 1)
                if by_chance < level("frozen") or np.ptp(simulated[run, output]) > d + _SPAN * size:
                    found.setdefault(output, []).append((run.start, run.stop - 1))
    return found


def resolution_of(y: Array) -> Array:
    """Return the resolution (p,) of outputs y (n, p), NaN where missing; it is small for unrounded noise."""
    found = np.zeros(y.shape[1])
    for output, x in enumerate(y.T):
        steps = np.abs(np.diff(x[~np.isnan(x)]))
        moves = steps[steps > 0.0]
        if moves.size:  # the quantile ignores a single value filled in by hand between the cells
            found[output] = np.quantile(moves, 0.05, method="lower")
    return found


def _repeat_probability(errors: Array, d: float) -> float:
    """Return the largest probability that a sample falls into the same cell as the last one."""
    if len(errors) < _FEWEST or not np.any(errors):
        return 1.0
    white = Whitening.of(errors, (len(errors),)).through(errors[None])
    variance = _spread(white) ** 2 - _ROUNDING * d**2
    return min(1.0, _DENSITY * d / float(np.sqrt(variance))) if variance > 0.0 else 1.0


def _spread(x: Array) -> float:
    return float(np.median(np.abs(x - np.median(x)))) / _NORMAL


def shifted(controller: TransferMatrix, u: Array, y: Array, r: Array, lengths: Sequence[int]) -> list[Shift]:
    """Return by input the shift of u (n, m), y (n, p) or r (n, m) that makes u = r - C y hold much better.

    Args:
        lengths: samples of the stretches without gaps; the level of each is subtracted.
    """
    ends = np.cumsum(lengths)[:-1]
    parts = list(zip(*(np.split(x, ends) for x in (u, y, r)), strict=True))
    found = []
    for i in range(u.shape[1]):
        left = _law_error(controller, i, parts, "", 0)
        tried = [(letter, lag) for letter in "uyr" for lag in _LAGS]
        each = [Shift(one[0], i, one[1], left, _law_error(controller, i, parts, *one)) for one in tried]
        best = min(each, key=lambda one: one.then)
        if best.then < min(_BETTER * left, _GOOD):
            found.append(best)
    return found


def _law_error(
    controller: TransferMatrix, i: int, parts: Sequence[tuple[Array, ...]], letter: str, lag: int
) -> float:
    """Return the rms of q u - q r + P y relative to q u, with the signals of one letter shifted."""
    most = max(map(abs, _LAGS))
    P, q = controller.numerator[i], controller.denominator[i]
    memory = max(P.shape[1], len(q)) - 1
    squares = np.zeros(2)
    for part in parts:
        kept = len(part[0]) - 2 * most
        if kept < memory + _FEWEST:
            continue
        u, y, r = (x[most + lag * (name == letter) :][:kept].T for name, x in zip("uyr", part, strict=True))
        driven, asked, *fed = (
            np.convolve(x, p)[memory:kept] for x, p in ((u[i], q), (r[i], q), *zip(y, P, strict=True))
        )
        law = driven - asked + sum(fed)
        squares += [np.sum((x - x.mean()) ** 2) for x in (law, driven)]
    return float(np.sqrt(squares[0] / squares[1])) if squares[1] > 0.0 else 0.0
