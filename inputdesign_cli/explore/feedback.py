"""See whether inputs answer the outputs, and whether outputs answer inputs before these move.

Both are regressions with added columns. Past innovations of the outputs help to predict an input in a loop
only ([ljung-1999], Section 13.4). Future inputs help to predict an output only if the input was logged late.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.division import busiest
from inputdesign_cli.explore.regressors import past, residuals

_LAGS, _AHEAD = 20, 8
# Of more samples even what lies beyond the lags would show.
_MOST_SAMPLES = 10_000
_CERTAIN, _EARLY = 1e-4, 1e-6
# An input follows from outputs and its own past if they leave less than this share of its power.
_FOLLOWS = 1e-9
# What is new in u and in y goes together beyond this correlation.
_TOGETHER = 0.1
# A jump is this multiple of an input's median innovation; fewest samples to compare jumps with the rest.
_JUMP, _FEWEST = 6.0, 5
Parts = Sequence[tuple[Array, Array]]


def answers_output(parts: Parts, innovations: Sequence[Array] | None = None) -> list[tuple[int, float]]:
    """Return the inputs that answer the outputs, with the probability of that by chance.

    Each input is regressed on its own past and the other inputs', then on past innovations of the outputs as
    well. An input that follows from outputs and its own past without an error is a controller, too.

    Args:
        parts: records u (n, r), y (n, p).
        innovations: of the outputs of every part, (n, p), from a model; else from a regression.
    """
    lags = _lags(parts)
    long = [len(y) > 3 * lags for _, y in parts]
    kept = _centred([part for part, enough in zip(parts, long, strict=True) if enough])
    if not kept:
        return []
    if innovations is None:
        new = _new(kept, lags)[1]
    else:
        new = [e[lags:] for e, enough in zip(innovations, long, strict=True) if enough]
    own = np.concatenate([past(u, 2 * lags) for u, _ in kept])
    more = np.concatenate([past(e, lags) for e in new])
    targets = np.concatenate([u[2 * lags :] for u, _ in kept])
    laws = only_answers(parts)
    at_once = _moved_at_once(kept, lags)
    chances = [
        0.0 if j in laws else min(_by_chance(own, more, x), at_once[j]) for j, x in enumerate(targets.T)
    ]
    return [(j, probability) for j, probability in enumerate(chances) if probability < _CERTAIN]


def only_answers(parts: Parts) -> list[int]:
    """Return the inputs that are an exact linear function of present and past outputs and of past inputs.

    Inputs that follow from past inputs alone are not among them.
    """
    lags = min(_lags(parts), 5)
    long = _centred([part for part in parts if len(part[1]) > 3 * lags])
    if not long:
        return []
    own = np.concatenate([past(u, lags) for u, _ in long])
    outputs = np.concatenate([np.column_stack([y[lags:], past(y, lags)]) for _, y in long])
    found = []
    for j, target in enumerate(np.concatenate([u[lags:] for u, _ in long]).T):
        power = float(target @ target)
        alone, together = _left(own, target), _left(np.column_stack([own, outputs]), target)
        if power > 0.0 and alone > 1e-3 * power and together <= _FOLLOWS * power:
            found.append(j)
    return found


def _moved_at_once(parts: Parts, lags: int) -> list[float]:
    """Return of each input the probability, by chance, that it answers y(t) between jumps of its own.

    Past inputs hold all that a controller has made of past outputs between two steps of its reference. News
    of u and of y goes together there. If y answered u at once, it would do so at the jumps as well.
    """
    new_u, new_y = (np.concatenate(new) for new in _new(parts, lags))
    found = []
    for x in new_u.T:
        jumps = np.abs(x) > _JUMP * np.median(np.abs(x))
        chance = 1.0
        for e in new_y.T if np.sum(jumps) >= _FEWEST and np.sum(~jumps) >= lags * _FEWEST else ():
            (small, own), (large, other) = (_slope(x[at], e[at]) for at in (~jumps, jumps))
            apart = min(abs(small) / own, abs(small - large) / np.hypot(own, other))
            chance = min(chance, float(scipy.special.erfc(apart / np.sqrt(2.0))))
        found.append(chance)
    return found


def _slope(x: Array, y: Array) -> tuple[float, float]:
    """Return the slope of y (n,) over x (n,), and its deviation."""
    power = max(float(x @ x), 1e-300)
    slope = float(x @ y) / power
    return slope, max(float(np.std(y - slope * x)) / np.sqrt(power), 1e-300)


@dataclass(frozen=True)
class EarlyAnswer:
    """An output that moves `samples` before an input, with the probability of that by chance."""

    output: int
    input: int
    samples: int
    probability: float


def early_answers(parts: Parts) -> list[EarlyAnswer]:
    """Return the outputs that what is new in a future input helps to predict, up to eight samples ahead.

    Args:
        parts: records u (n, r), y (n, p) of an open loop.
    """
    lags, parts = _lags(parts), busiest(parts, _MOST_SAMPLES)
    long = _centred([part for part in parts if len(part[1]) > 4 * (lags + _AHEAD)])
    if not long:
        return []
    rows, targets, ahead = list[Array](), list[Array](), list[Array]()
    news = residuals([past(u, lags) for u, _ in long], [u[lags:] for u, _ in long])
    for (u, y), new in zip(long, news, strict=True):
        last = len(y) - _AHEAD
        rows.append(np.column_stack([past(y, lags), past(u, lags), u[lags:]])[: last - lags])
        targets.append(y[lags:last])
        ahead.append(np.stack([new[k : len(new) - _AHEAD + k] for k in range(1, _AHEAD + 1)], axis=1))
    own, columns = np.concatenate(rows), np.concatenate(ahead)
    found = list[EarlyAnswer]()
    for i, target in enumerate(np.concatenate(targets).T):
        for j in range(columns.shape[2]):
            together = _by_chance(own, columns[:, :, j], target, held=False)
            single = [_by_chance(own, columns[:, [k], j], target, held=False) for k in range(_AHEAD)]
            if max(together, min(single)) < _EARLY:
                last = max(k for k, p in enumerate(single) if p < _EARLY)
                found.append(EarlyAnswer(i, j, last + 1, together))
    return found


def like_answers(parts: Parts, output: int, j: int) -> bool:
    """Return whether u(t) may have been made from y(t): both have news at once, and nobody has set the input.

    An input that is held, white, or follows from its own past was set without a look at the output.
    """
    moves = np.concatenate([np.diff(u[:, j]) != 0.0 for u, _ in parts])
    lags = _lags(parts)
    long = _centred([part for part in parts if len(part[1]) > 3 * lags])
    if not long or np.mean(moves) < 0.5:
        return False
    new_u, new_y = (np.concatenate(new) for new in _new(long, lags))
    size = float(np.linalg.norm(new_u[:, j]) * np.linalg.norm(new_y[:, output]))
    lagged = np.concatenate([past(u[:, j : j + 1], 5) for u, _ in long])
    now = np.concatenate([u[5:, j] for u, _ in long])
    own = _left(lagged, now) <= 1e-6 * float(now @ now)
    white = _by_chance(np.ones((len(now), 1)), lagged, now) > 0.01
    return abs(float(new_u[:, j] @ new_y[:, output])) > _TOGETHER * max(size, 1e-300) and not (own or white)


def _by_chance(own: Array, more: Array, target: Array, *, held: bool = True) -> float:
    """Return the probability that columns `more` explain as much by chance beside `own` (n, m).

    The likelihood ratio says so. Of a target that may be held, and moves at few samples only, so must a score
    test whose covariance allows for errors of any size at any time ([white-1980]).
    """
    both = np.column_stack([own, more])
    alone, together = _left(own, target), _left(both, target)
    if alone <= 1e-12 * float(target @ target) or len(target) <= both.shape[1]:
        return 1.0  # the input follows from its own past: a deterministic signal
    ratio = (len(target) - both.shape[1]) * float(np.log(alone / max(together, 1e-300)))
    if not held:
        return float(scipy.special.chdtrc(more.shape[1], ratio))
    (errors,) = residuals([own], [target])
    (rest,) = residuals([own], [more])
    weighted = rest * errors[:, None]
    total = weighted.sum(axis=0)
    score = float(total @ np.linalg.lstsq(weighted.T @ weighted, total, rcond=1e-10)[0])
    return float(scipy.special.chdtrc(more.shape[1], min(ratio, score)))


def _left(columns: Array, target: Array) -> float:
    (errors,) = residuals([columns], [target])
    return float(errors @ errors)


def _lags(parts: Parts) -> int:
    channels = parts[0][0].shape[1] + parts[0][1].shape[1]
    return max(min(_LAGS, sum(len(y) for _, y in parts) // (8 * channels)), 1)


def _centred(parts: Parts) -> list[tuple[Array, Array]]:
    return [(u - u.mean(axis=0), y - y.mean(axis=0)) for u, y in parts]


def _new(parts: Parts, lags: int) -> tuple[list[Array], list[Array]]:
    """Return what past inputs and outputs do not explain of inputs and of outputs, (n - lags, ..) each."""
    rows = [np.column_stack([past(u, lags), past(y, lags)]) for u, y in parts]
    return residuals(rows, [u[lags:] for u, _ in parts]), residuals(rows, [y[lags:] for _, y in parts])
