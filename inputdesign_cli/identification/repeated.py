"""Detect samples that were recorded once and given twice: their prediction errors repeat.

If the model is right, errors of different times are independent. Only a copy of the same noise, even rounded,
shifted or scaled, repeats. If the model is wrong, errors are coloured, and slow ones follow each other by
chance. Inputs that repeat bring the same errors, too. So the part that past errors and the inputs explain is
taken off first, by an autoregression with inputs.

A controller makes u(t) from y(t), so that u(t) contains e(t). A regression on u(t) then leaves steps of the
reference, which repeat. So in a loop only past inputs count. Without a loop u(t) may act at once. Since a
loop may be unknown, samples are given twice only if they repeat both with u(t) as regressor and without it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.identification.records import shifted

# A row of _IN_A_ROW samples has a correlation beyond this at another time by chance in one of 1e10 cases.
_IN_A_ROW, _FOLLOWS = 30, 0.9
# Of the lags, those at which most errors follow each other.
_LAGS = 8
# Larger errors, in standard deviations, count as much: single spikes say nothing.
_SPIKE = 3.0
_ORDER = 20
# Lags are fewer in a short record; in a long one at most this number of samples is fitted.
_SAMPLES_A_LAG, _MOST_FITTED = 10, 20_000
NORMAL = 0.6745  # the median of the absolute value of a normal variable, in standard deviations


@dataclass(frozen=True)
class Repetition:
    """Errors from sample `second` on follow those from `first` on, over about `length` samples."""

    first: int
    second: int
    length: int


def repetition(errors: Array, inputs: Array | None = None, *, feedback: bool = False) -> Repetition | None:
    """Return the longest stretch of errors (samples, p) that repeats, or None if none does.

    Args:
        inputs: (samples, r), of the same times.
        feedback: whether the inputs were made from the outputs.
    """
    spread = np.median(np.abs(errors), axis=0) / NORMAL
    samples = len(errors)
    if samples < 2 * _IN_A_ROW or not np.all(spread > 0.0):
        return None
    columns = np.clip(errors / spread, -_SPIKE, _SPIKE).T
    u = np.zeros((samples, 0)) if inputs is None else inputs
    found = _again(np.column_stack([_unexplained(x, u, newest=1) for x in columns]))
    if found is None or feedback or not np.any(np.ptp(u, axis=0)):
        return found
    beside = _again(np.column_stack([_unexplained(x, u, newest=0) for x in columns]))
    return beside and found


def _again(e: Array) -> Repetition | None:
    """Return the longest stretch of white errors (samples, p) that repeats."""
    samples = len(e)
    around = scipy.fft.rfft(e, 2 * samples, axis=0)
    products = scipy.fft.irfft(np.sum(np.abs(around) ** 2, axis=1), 2 * samples)
    lags = np.arange(_IN_A_ROW, samples - _IN_A_ROW + 1)
    strength = np.abs(products[lags]) / np.sqrt(samples - lags)
    tried = lags[np.argsort(-strength, kind="stable")[:_LAGS]]
    found = [one for lag in tried.tolist() if (one := _at(e, lag)) is not None]
    return max(found, key=lambda one: one.length, default=None)


def whitened(x: Array) -> Array:
    """Return the residuals of an autoregression of a signal (N,), by the equations of Yule and Walker."""
    order = min(_ORDER, x.size // 10)
    x = x - x.mean()
    products = scipy.fft.irfft(np.abs(scipy.fft.rfft(x, 2 * x.size)) ** 2, 2 * x.size)[: order + 1]
    products[0] *= 1.0 + 1e-9
    ahead = scipy.linalg.solve_toeplitz(products[:-1], products[1:])
    return np.asarray(np.convolve(x, np.concatenate([[1.0], -ahead]))[: x.size])


def _unexplained(x: Array, u: Array, newest: int) -> Array:
    """What an autoregression with inputs u (N, r), the newest of lag `newest`, leaves of a signal (N,)."""
    order = min(_ORDER, x.size // (_SAMPLES_A_LAG * (1 + u.shape[1])))
    moving = u[:, np.ptp(u, axis=0) > 0.0]
    if not order or not moving.shape[1]:
        return whitened(x)
    own, by = x - x.mean(), (moving - moving.mean(axis=0)) / moving.std(axis=0)
    head = len(own[:_MOST_FITTED])
    signals = [own, *by.T]
    firsts = [1, *(newest for _ in by.T)]
    lags = [(one, lag) for one, first in zip(signals, firsts, strict=True) for lag in range(first, order + 1)]
    past = np.column_stack([shifted(one[:head], lag, (head,)) for one, lag in lags])
    weights = np.linalg.lstsq(past, own[:head], rcond=None)[0]
    left = own.copy()
    for one, first in zip(signals, firsts, strict=True):
        ahead, weights = np.split(weights, [order + 1 - first])
        left -= np.convolve(one, np.concatenate([np.zeros(first), ahead]))[: own.size]
    return left


def _at(e: Array, lag: int) -> Repetition | None:
    early, late = e[:-lag], e[lag:]
    both, own, other = (_in_a_row(np.sum(x, axis=1)) for x in (early * late, early**2, late**2))
    starts = np.flatnonzero(np.abs(both) > _FOLLOWS * np.sqrt(own * other))
    if not starts.size:
        return None
    first, last = int(starts[0]), int(starts[-1])
    return Repetition(first, first + lag, last + _IN_A_ROW - first)


def _in_a_row(x: Array) -> Array:
    total = np.concatenate([np.zeros(1), np.cumsum(x)])
    return np.asarray(total[_IN_A_ROW:] - total[:-_IN_A_ROW])
