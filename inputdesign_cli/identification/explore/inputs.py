"""What the inputs are worth, and whether they answer the outputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.special

from inputdesign_cli.plant.polynomial import Array

_LAGS = 20
_CERTAIN = 1e-4
_FAINT = 1e-9


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


def answers_output(parts: Sequence[tuple[Array, Array]]) -> list[tuple[int, float]]:
    """Inputs that past outputs help to predict, with the probability of that by chance: a hint of a loop.

    Each input is regressed on its own past and the other inputs', then on the outputs' past as well
    ([ljung-1999], Section 13.4); the test is that of the likelihood ratio.
    """
    found = []
    r, p = parts[0][0].shape[1], parts[0][1].shape[1]
    lags = max(min(_LAGS, sum(len(y) for _, y in parts) // (8 * (r + p))), 1)
    for j in range(r):
        left = [0.0, 0.0]
        samples = 0
        blocks = []
        for u, y in parts:
            if len(y) <= 2 * lags:
                continue
            x, z = u - u.mean(axis=0), y - y.mean(axis=0)
            past = [
                np.stack([s[lags - lag : len(s) - lag] for lag in range(1, lags + 1)], axis=1).reshape(
                    len(s) - lags, -1
                )
                for s in (x, z)
            ]
            blocks.append((past[0], past[1], x[lags:, j]))
            samples += len(x) - lags
        if not blocks:
            continue
        target = np.concatenate([t for _, _, t in blocks])
        own = np.concatenate([a for a, _, _ in blocks])
        both = np.column_stack([own, np.concatenate([b for _, b, _ in blocks])])
        for k, columns in enumerate((own, both)):
            solution = np.linalg.lstsq(columns, target, rcond=1e-10)[0]
            left[k] = float(np.sum((target - columns @ solution) ** 2))
        if left[0] <= 1e-12 * float(np.sum(target**2)):
            continue  # the input follows from its own past: a deterministic signal
        statistic = samples * np.log(left[0] / max(left[1], 1e-300))
        probability = float(scipy.special.chdtrc(p * lags, statistic))
        if probability < _CERTAIN:
            found.append((j, probability))
    return found
