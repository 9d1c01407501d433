"""Records within limits on their values, their moves and their responses: exactly, not nearly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.compute.time_limit import seconds_left

LinearMap = Callable[[Array], Array]
# The limits hold in floating-point arithmetic, not only before rounding.
INSIDE = 1.0 - 1e-12
_ROUNDS = 40
_PENALTIES = (1.0, 10.0, 100.0, 1000.0)
_STEPS = 60


@dataclass(frozen=True)
class SignalConstraint:
    """A limit on signals (n, q) that are linear in the record, as outputs are: the largest modulus (q,).

    `adjoint` is the transpose of `apply`: it answers in the shape of the record.
    """

    apply: LinearMap
    adjoint: LinearMap
    bound: Array


def slow_moves(values: Array, rate: float) -> Array:
    """Return the record nearest to `values` (n,), in the largest deviation, with moves up to `rate`.

    It lies half way between the least such record above and the greatest below, which are found by one pass
    forwards and one backwards. It starts from rest: the first value is a move from zero.
    """
    above, below = values.copy(), values.copy()
    for t in range(1, values.size):
        above[t] = max(above[t], above[t - 1] - rate)
        below[t] = min(below[t], below[t - 1] + rate)
    for t in range(values.size - 2, -1, -1):
        above[t] = max(above[t], above[t + 1] - rate)
        below[t] = min(below[t], below[t + 1] + rate)
    reach = rate * np.arange(1.0, values.size + 1.0)
    return np.clip(0.5 * (above + below), -reach, reach)


def ramped(values: Array, rate: float) -> Array:
    """Return the record that follows `values` (n,) from rest as fast as moves of at most `rate` allow.

    Two levels become two levels with ramps of full speed between them.
    """
    record, reached = np.empty_like(values), 0.0
    for t, value in enumerate(values.tolist()):
        reached = min(max(value, reached - rate), reached + rate)
        record[t] = reached
    return record


def largest_move(values: Array) -> float:
    """Return the largest change from one value to the next, the first from rest."""
    return float(np.abs(np.diff(values, prepend=0.0)).max())


def compressed(values: Array, peak: float) -> Array:
    """Return values (n,) of the same periodogram, with their peak lowered towards `peak`.

    The method is clip and restore, [van-der-ouderaa-1988]: the moduli of the discrete Fourier transform are
    kept, its phases give way.
    """
    best, least = values, float(np.abs(values).max())
    modulus = np.abs(np.fft.rfft(values))
    record = values
    for _ in range(_ROUNDS):
        if least <= peak:
            break
        # Clipping below the goal reaches it sooner.
        transform = np.fft.rfft(np.clip(record, -0.95 * peak, 0.95 * peak))
        size = np.abs(transform)
        direction = np.where(size > 0, transform, 1.0) / np.where(size > 0, size, 1.0)
        record = np.fft.irfft(modulus * direction, values.size)
        reached = float(np.abs(record).max())
        if reached < least:
            best, least = record, reached
    return best


def restrained(values: Array, constraints: tuple[SignalConstraint, ...], *, returns: bool = False) -> Array:
    """Return the record near `values` (n, r) that keeps to all constraints.

    The distance is in least squares, each input in its own root mean square. The excess is penalised ever
    more (a quasi-Newton method). The record is scaled down at the end so that the bounds hold exactly.

    Args:
        returns: whether the last value stays zero, as it is in `values`.
    """
    record = values
    if peak_ratio(record, constraints) > 1.0:
        rms = np.sqrt(np.mean(values**2, axis=0))
        scale = np.where(rms > 0.0, rms, 1.0)
        for penalty in _PENALTIES:
            seconds_left()
            found = scipy.optimize.minimize(
                _penalised,
                (record / scale).ravel(),
                args=(values, scale, constraints, penalty, returns),
                jac=True,
                method="L-BFGS-B",
                options={"maxiter": _STEPS},
            )
            record = found.x.reshape(values.shape) * scale
    excess = peak_ratio(record, constraints)
    return record if excess <= 1.0 else record * (INSIDE / excess)


def peak_ratio(values: Array, constraints: tuple[SignalConstraint, ...]) -> float:
    """Return the largest modulus of any constrained signal relative to its bound."""
    return max((float((np.abs(c.apply(values)) / c.bound).max()) for c in constraints), default=0.0)


def _penalised(
    relative: Array,
    wanted: Array,
    scale: Array,
    constraints: tuple[SignalConstraint, ...],
    penalty: float,
    returns: bool,
) -> tuple[float, Array]:
    """Return half the squared distance, relative to `scale`, with the penalties, and its slope."""
    record = relative.reshape(wanted.shape) * scale
    away = (record - wanted) / scale
    value, slope = 0.5 * float(np.sum(away**2)), away
    for signal in constraints:
        ratio = signal.apply(record) / signal.bound
        excess = ratio - np.clip(ratio, -INSIDE, INSIDE)
        value += 0.5 * penalty * float(np.sum(excess**2))
        slope = slope + penalty * signal.adjoint(excess / signal.bound) * scale
    if returns:
        slope[-1] = 0.0  # the last value stays where it is
    return value, slope.ravel()
