"""What the inputs are worth, and whether they answer the outputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from inputdesign_cli.plant.polynomial import Array

_LAGS = 20
_CERTAIN = 1e-4
_FAINT = 1e-9
# How far back a controller looks; what rounding of its output may leave of the power of an input.
_CONTROLLER, _NOTHING = 6, 1e-6
# A correlation of white signals beyond this, times the root of their number, is none by chance.
_TOGETHER = 4.0


def order_of_excitation(parts: Sequence[tuple[Array, Array]], most: int = 50) -> int:
    """The order to which all inputs together are persistently exciting, `most` at most.

    The largest n for which n delays of every input are linearly independent ([ljung-1999], Section 13.2).
    """
    longest = max((u for u, _ in parts), key=len)
    x = longest - longest.mean(axis=0)
    n = max(min(most, len(x) // (3 * x.shape[1])), 1)
    columns = np.stack([x[n - lag : len(x) - lag] for lag in range(n)], axis=1).reshape(len(x) - n, -1)
    gram = columns.T @ columns
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    normal = gram / np.outer(scale, scale)
    r = x.shape[1]
    for order in range(n, 0, -1):
        if np.linalg.eigvalsh(normal[: order * r, : order * r])[0] > _FAINT * order:
            return order
    return 0


def answers_output(
    parts: Sequence[tuple[Array, Array]], innovations: Sequence[Array] | None = None
) -> list[tuple[int, float]]:
    """Inputs that past noise of the outputs helps to predict, with the probability of that by chance.

    That hints of a loop. Each input is regressed on its own past and the other inputs', then on past
    innovations of the outputs as well ([ljung-1999], Section 13.4). Not outputs but what is new in them:
    outputs remember inputs longer than the regression does, and so they would help to predict one that is
    held.

    Both the test of the likelihood ratio and a score test whose covariance allows for errors of any size at
    any time ([white-1980]) must say so. An input that is held moves at few samples only; where the output
    follows at once, what is new there is large at the same samples, and the first test errs.

    Args:
        innovations: of the outputs of every part, (n, p), where a model tells them; else those of a
            regression on past inputs and outputs.
    """
    found = []
    r, p = parts[0][0].shape[1], parts[0][1].shape[1]
    lags = max(min(_LAGS, sum(len(y) for _, y in parts) // (8 * (r + p))), 1)
    long = [len(y) > 3 * lags for _, y in parts]
    centred = [
        (u - u.mean(axis=0), y - y.mean(axis=0)) for (u, y), kept in zip(parts, long, strict=True) if kept
    ]
    if not centred:
        return []
    if innovations is None:
        new = _innovations(centred, lags)
    else:
        new = [e[lags:] for e, kept in zip(innovations, long, strict=True) if kept]
    # As far back as what is new in the outputs remembers inputs.
    own = np.concatenate([_past(u, 2 * lags) for u, _ in centred])
    both = np.column_stack([own, np.concatenate([_past(e, lags) for e in new])])
    for j in range(r):
        target = np.concatenate([u[2 * lags :, j] for u, _ in centred])
        left = [_left_over(columns, target) for columns in (own, both)]
        if left[0] <= 1e-12 * float(np.sum(target**2)):
            continue  # the input follows from its own past: a deterministic signal
        statistic = (len(target) - both.shape[1]) * np.log(left[0] / max(left[1], 1e-300))
        statistic = min(statistic, _score(own, both[:, own.shape[1] :], target))
        probability = float(scipy.special.chdtrc(p * lags, statistic))
        if probability < _CERTAIN:
            found.append((j, probability))
    return found


def _score(own: Array, more: Array, target: Array) -> float:
    """Of columns beside those of a regression, chi-squared where they tell nothing of its errors."""
    errors = target - own @ np.linalg.lstsq(own, target, rcond=1e-10)[0]
    beside = more - own @ np.linalg.lstsq(own, more, rcond=1e-10)[0]
    weighted = beside * errors[:, None]
    total = weighted.sum(axis=0)
    return float(total @ np.linalg.lstsq(weighted.T @ weighted, total, rcond=1e-10)[0])


def acts_late(parts: Sequence[tuple[Array, Array]], gains: Array) -> list[bool]:
    """Of each input in a loop, whether a delay of the plant is to be taken for granted.

    Where a controller answers y(t) by u(t), what is new in the two goes together, and a model with a delay of
    zero takes the controller for the plant ([ljung-1999], Section 13.4). A controller that holds a plant
    opposes it: what goes together with the sign of the plant's gain is not of its making.

    Args:
        parts: u (n, r), y (n, 1).
        gains: (r,), of the plant, estimated with delays.
    """
    r = parts[0][0].shape[1]
    lags = max(min(_LAGS, sum(len(y) for _, y in parts) // (8 * (r + 1))), 1)
    long = [(u - u.mean(axis=0), y - y.mean(axis=0)) for u, y in parts if len(y) > 3 * lags]
    if not long:
        return [True] * r
    past = np.concatenate([np.column_stack([_past(u, lags), _past(y, lags)]) for u, y in long])
    now = np.concatenate([np.column_stack([u, y])[lags:] for u, y in long])
    new = now - past @ np.linalg.lstsq(past, now, rcond=1e-10)[0]
    sizes = np.maximum(np.linalg.norm(new, axis=0), 1e-300)
    together = new[:, :r].T @ new[:, r] / (sizes[:r] * sizes[r])
    return [bool(x <= _TOGETHER / np.sqrt(len(new))) for x in together * np.sign(gains)]


def _innovations(parts: Sequence[tuple[Array, Array]], lags: int) -> list[Array]:
    """What past inputs and outputs do not tell of the outputs: (n - lags, p) of every part (n, ..)."""
    rows = [np.column_stack([_past(u, lags), _past(y, lags)]) for u, y in parts]
    columns, targets = np.concatenate(rows), np.concatenate([y[lags:] for _, y in parts])
    solution = np.linalg.lstsq(columns, targets, rcond=1e-10)[0]
    return [y[lags:] - own @ solution for (_, y), own in zip(parts, rows, strict=True)]


def _past(signal: Array, lags: int) -> Array:
    """(n - lags, lags channels): the samples before each of a signal (n, channels) but the first."""
    shifted = [signal[lags - lag : len(signal) - lag] for lag in range(1, lags + 1)]
    return np.stack(shifted, axis=1).reshape(len(signal) - lags, -1)


def _left_over(columns: Array, target: Array) -> float:
    """The sum of squares that a regression leaves."""
    solution = np.linalg.lstsq(columns, target, rcond=1e-10)[0]
    return float(np.sum((target - columns @ solution) ** 2))


def only_answers(parts: Sequence[tuple[Array, Array]]) -> list[int]:
    """Inputs that outputs up to now and the inputs' own past leave nothing of, and that past alone does.

    They are what a controller makes of the outputs without a reference or dither: a loop without excitation,
    whose plant the data do not determine ([ljung-1999], Section 13.4).
    """
    centred = [(u - u.mean(axis=0), y - y.mean(axis=0)) for u, y in parts if len(y) > 4 * _CONTROLLER]
    if not centred:
        return []
    own = np.concatenate([_past(u, _CONTROLLER) for u, _ in centred])
    present = np.concatenate([y[_CONTROLLER:] for _, y in centred])
    both = np.column_stack([own, present, np.concatenate([_past(y, _CONTROLLER) for _, y in centred])])
    found = []
    for j in range(centred[0][0].shape[1]):
        target = np.concatenate([u[_CONTROLLER:, j] for u, _ in centred])
        power = float(np.sum(target**2))
        if _left_over(both, target) <= _NOTHING * power < _left_over(own, target):
            found.append(j)
    return found
