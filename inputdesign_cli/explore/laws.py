"""Inputs that a law makes of the outputs, wholly or but for moves of a reference, and inputs that are set."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.inputs import left_over, past, untold
from inputdesign_cli.identification.frequency_response import REPEATS, found_period

# How far back a controller looks; what rounding of its output may leave of the power of an input.
_CONTROLLER, _NOTHING = 6, 1e-6
# A law that holds but for moves of a reference: at so many of the samples, and there it leaves this share of
# what the past of the input leaves.
_MOSTLY, _EXACT = 0.8, 5e-3
# Errors beyond so many robust standard deviations are moves of a reference; stretches of which one has none,
# and rounds of leaving such samples out.
_MOVE, _STRETCHES, _ROUNDS, _TO_DEVIATION = 4.0, 20, 20, 1.4826
# An input that moves at fewer of its samples is held, and one of so few levels is switched.
_HELD, _LEVELS = 1.0 / 3.0, 4
# Jumps in a period of a relay that swings by itself are no more than these.
_SWINGS = 8
_LAGS, _WHITE = 20, 0.01
TOGETHER = 4.0
"""A correlation of white signals, times the root of their number, beyond which it is none by chance."""

Parts = Sequence[tuple[Array, Array]]


def only_answers(parts: Parts) -> list[int]:
    """Inputs that outputs up to now and the inputs' own past leave nothing of, and that past alone does.

    They are what a controller makes of the outputs without a reference or dither: a loop without excitation,
    whose plant the data do not determine ([ljung-1999], Section 13.4).
    """
    centred = [(u - u.mean(axis=0), y - y.mean(axis=0)) for u, y in parts if len(y) > 4 * _CONTROLLER]
    if not centred:
        return []
    own = np.concatenate([past(u, _CONTROLLER) for u, _ in centred])
    present = np.concatenate([y[_CONTROLLER:] for _, y in centred])
    both = np.column_stack([own, present, np.concatenate([past(y, _CONTROLLER) for _, y in centred])])
    found = []
    for j in range(centred[0][0].shape[1]):
        target = np.concatenate([u[_CONTROLLER:, j] for u, _ in centred])
        power = float(np.sum(target**2))
        if left_over(both, target) <= _NOTHING * power < left_over(own, target):
            found.append(j)
    return found


def answers_between_moves(parts: Parts) -> list[tuple[int, float]]:
    """Inputs that outputs up to now and the inputs' own past tell exactly, but for a few samples.

    With each the probability that outputs that have no part in it tell as much. Changes are what counts,
    since what a controller that integrates adds in every sample depends on where the reference rests.

    At these a reference moved that is not in the log. An input that is held or switched is none of them, nor
    one that follows from its own past: what a plant answers at once tells these as exactly without noise.
    """
    changes = [(np.diff(u, axis=0), np.diff(y, axis=0)) for u, y in parts if len(y) > 4 * _CONTROLLER]
    if not changes:
        return []
    level = np.concatenate([np.ones((len(u) - _CONTROLLER, 1)) for u, _ in changes])
    own = np.column_stack([level, np.concatenate([past(u, _CONTROLLER) for u, _ in changes])])
    present = np.concatenate([y[_CONTROLLER:] for _, y in changes])
    both = np.column_stack([own, present, np.concatenate([past(y, _CONTROLLER) for _, y in changes])])
    found = []
    for j in range(changes[0][0].shape[1]):
        if set_apart(parts, j):
            continue
        target = np.concatenate([u[_CONTROLLER:, j] for u, _ in changes])
        kept = _obeying(both, target)
        if np.mean(kept) < _MOSTLY or np.all(kept):
            continue
        before, after = (left_over(columns[kept], target[kept]) for columns in (own, both))
        if after <= _EXACT**2 * before and before > _NOTHING**2 * np.sum(target**2):
            statistic = np.sum(kept) * np.log(before / max(after, 1e-300))
            found.append((j, float(scipy.special.chdtrc(both.shape[1] - own.shape[1], statistic))))
    return found


def _obeying(columns: Array, target: Array) -> NDArray[np.bool_]:
    """Where a regression holds: that of the stretch that does best elsewhere, then that of such samples."""
    size = max(len(target) // _STRETCHES, 3 * columns.shape[1])
    stretches = [slice(begin, begin + size) for begin in range(0, max(len(target) - size, 0) + 1, size)]
    tried = [_errors(columns, target, stretch) for stretch in stretches]
    errors = min(tried, key=lambda found: float(np.median(found)))
    kept = np.zeros(len(target), dtype=bool)
    for _ in range(_ROUNDS):
        scale = max(_TO_DEVIATION * float(np.median(errors)), 1e-12 * float(np.std(target)))
        before, kept = kept, errors <= _MOVE * scale
        if np.array_equal(before, kept):
            break
        errors = _errors(columns, target, kept)
    return kept


def _errors(columns: Array, target: Array, where: slice | NDArray[np.bool_]) -> Array:
    """Of all samples (n,), by a regression of some."""
    solution = np.linalg.lstsq(columns[where], target[where], rcond=1e-12)[0]
    return np.asarray(np.abs(target - columns @ solution))


def together_at_once(parts: Parts) -> NDArray[np.bool_]:
    """(p, r), whether y_i(t) and u_j(t) go together beyond what the pasts of u (n, r), y (n, p) tell."""
    return np.asarray(np.abs(correlation_at_once(parts)) > TOGETHER)


def correlation_at_once(parts: Parts) -> Array:
    """(p, r), the correlation of what is new in y_i(t) and u_j(t), times the root of their number."""
    outputs, inputs = parts[0][1].shape[1], parts[0][0].shape[1]
    lags = max(min(_LAGS, sum(len(y) for _, y in parts) // (8 * (inputs + outputs))), 1)
    long = [np.column_stack([y, u]) for u, y in parts if len(y) > 3 * lags]
    signals = [x - x.mean(axis=0) for x in long]
    if not signals:
        return np.zeros((outputs, inputs))
    new = np.concatenate(untold([past(x, lags) for x in signals], [x[lags:] for x in signals]))
    sizes = np.maximum(np.linalg.norm(new, axis=0), 1e-300)
    together = new[:, :outputs].T @ new[:, outputs:] / np.outer(sizes[:outputs], sizes[outputs:])
    return np.asarray(np.sqrt(len(new)) * together)


def set_apart(parts: Parts, j: int) -> bool:
    """Whether somebody sets input j who does not look at the outputs, as far as it tells by itself.

    It is held, switched between a few levels, periodic, or white.
    """
    u = [part[:, j] for part, _ in parts]
    moves = np.concatenate([np.diff(one) for one in u])
    if np.mean(moves != 0.0) < _HELD or len(np.unique(np.concatenate(u))) <= _LEVELS:
        return True
    return all(found_period(one - one.mean()) for one in u) or _is_white(u)


def repeats_apart(parts: Parts, j: int) -> bool:
    """Whether input j repeats from period to period, and some output does not: then it does not answer them.

    What an input answers it has of the noise, too, which never repeats. A relay may swallow noise, and so an
    input of few levels must jump more often in a period than a relay that swings. All parts must repeat with
    the same period, and one of them hold two; rest before the input moves and after it tells nothing.
    """
    moving = [(u[at], y[at]) for u, y in parts for at in [_moving(u[:, j])]]
    return _repeat_apart(parts, j) or _repeat_apart(moving, j)


def _repeat_apart(parts: Parts, j: int) -> bool:
    """The same of parts as they are."""
    longest = max((u[:, j] for u, _ in parts), key=len)
    if not longest.size:
        return False
    period = found_period(longest - longest.mean())
    jumps = int(np.sum(np.diff(longest[: period + 1]) != 0.0))
    return bool(
        period
        and (jumps > _SWINGS or len(np.unique(longest)) > _LEVELS)
        and all(_follows(u[:, j], period) for u, _ in parts)
        and not all(_follows(x, period) for _, y in parts for x in y.T)
    )


def _moving(x: Array) -> slice:
    """From the first move of a signal (n,) to the last one."""
    moves = np.flatnonzero(np.diff(x))
    return slice(int(moves[0]) + 1, int(moves[-1]) + 2) if moves.size else slice(0)


def _follows(x: Array, period: int) -> bool:
    """Whether a signal (n,) comes again after so many samples, as far as it goes."""
    far = np.abs(x[period:] - x[:-period])
    return not far.size or bool(np.all(far <= REPEATS * np.abs(x - x.mean()).max()))


def _is_white(u: Sequence[Array]) -> bool:
    """Whether signals (n,) have no correlation in time, by the portmanteau test of [ljung-box-1978]."""
    centred = [one - np.mean(np.concatenate(u)) for one in u]
    samples, power = sum(map(len, u)), sum(float(one @ one) for one in centred)
    lags = min(_LAGS, min(map(len, u)) - 1)
    if lags < 1:
        return False
    statistic = 0.0
    for lag in range(1, lags + 1):
        together = sum(float(one[lag:] @ one[:-lag]) for one in centred) / power
        statistic += samples * (samples + 2.0) * together**2 / (samples - lag)
    return bool(scipy.special.chdtrc(lags, statistic) > _WHITE)
