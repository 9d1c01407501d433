"""What the inputs are worth, and what their pasts tell."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from inputdesign_cli.arrays import Array

_FAINT = 1e-9
# The past of another input that an input may follow, and samples to a regressor, at least.
_PAST, _PER_LAG = 20, 10


def order_of_excitation(parts: Sequence[tuple[Array, Array]], most: int = 50) -> int:
    """The order to which all inputs together are persistently exciting, `most` at most.

    The largest n for which n delays of every input, and a level, are linearly independent ([ljung-1999],
    Section 13.2): a sinusoid over a part of a period has a mean, which tells no more than the level does.
    """
    longest = max((u for u, _ in parts), key=len)
    x = longest - longest.mean(axis=0)
    n = max(min(most, len(x) // (3 * x.shape[1])), 1)
    # Fewer delays are told by all rows of more, and by rows before these: a step may stand there.
    told, open_from = 0, n + 1
    while open_from - told > 1:
        middle = n if open_from > n else (told + open_from) // 2
        told, open_from = (middle, open_from) if _independent(x, middle) else (told, middle)
    return told


def _independent(x: Array, delays: int) -> bool:
    """Whether so many delays of signals x (n, r), and a level, are linearly independent."""
    columns = np.hstack([x[delays - lag : len(x) - lag] for lag in range(delays)])
    columns = columns - columns.mean(axis=0)
    gram = columns.T @ columns
    scale = np.sqrt(np.maximum(np.diag(gram), 1e-300))
    return bool(np.linalg.eigvalsh(gram / np.outer(scale, scale))[0] > _FAINT * delays)


def left_of_inputs(parts: Sequence[tuple[Array, Array]]) -> list[float]:
    """Of the power of each input of u (n, r) the share that the other inputs and their pasts leave."""
    inputs, samples = parts[0][0].shape[1], sum(len(u) for u, _ in parts)
    lags = min(_PAST, samples // (_PER_LAG * inputs))
    long = [u - u.mean(axis=0) for u, _ in parts if len(u) > 3 * lags]
    if inputs < 2 or lags < 1 or not long:
        return [1.0] * inputs
    found = []
    for j in range(inputs):
        others = [np.delete(u, j, axis=1) for u in long]
        rows = [np.column_stack([other[lags:], past(other, lags)]) for other in others]
        own = [u[lags:, j] for u in long]
        left = sum(float(e @ e) for e in untold(rows, own))
        found.append(left / max(sum(float(x @ x) for x in own), 1e-300))
    return found


def past(signal: Array, lags: int) -> Array:
    """(n - lags, lags channels): the samples before each of a signal (n, channels) but the first."""
    shifted = [signal[lags - lag : len(signal) - lag] for lag in range(1, lags + 1)]
    return np.stack(shifted, axis=1).reshape(len(signal) - lags, -1)


def untold(rows: Sequence[Array], targets: Sequence[Array]) -> list[Array]:
    """What regressors (n, m) of every part, of the same coefficients, leave of its targets (n,), (n, p)."""
    solution = np.linalg.lstsq(np.concatenate(rows), np.concatenate(targets), rcond=1e-10)[0]
    return [target - own @ solution for own, target in zip(rows, targets, strict=True)]


def left_over(columns: Array, target: Array) -> float:
    """The sum of squares that a regression leaves."""
    return float(np.sum(untold([columns], [target])[0] ** 2))
