"""Test whether logged signals obey the known controller, u = r - C y, sample by sample.

An input that is logged a sample late biases estimates in closed loop. No residual shows it: the model takes
the shift for a delay. The controller shows it if the reference was logged too.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.plant import TransferMatrix

_LAGS = (-2, -1, 1, 2)
# Another lag holds if its error is below these shares of the error as logged, and of the input itself.
_BETTER, _GOOD = 0.1, 0.3
_FEWEST = 20


@dataclass(frozen=True)
class Shift:
    """Signals `letter` of input `channel` obey the controller `lag` samples later (earlier, if negative).

    `left` is the rms error of the control law as logged, `then` the one after the shift. Both are relative to
    the rms of the input.
    """

    letter: str
    channel: int
    lag: int
    left: float
    then: float


def shifted(controller: TransferMatrix, u: Array, y: Array, r: Array, lengths: Sequence[int]) -> list[Shift]:
    """By input, the shift of u (n, m), y (n, p) or r (n, m) by which they obey u = r - C y, if one is better.

    Args:
        lengths: of the stretches without gaps; levels are taken away from each.
    """
    ends = np.cumsum(lengths)[:-1]
    parts = list(zip(*(np.split(x, ends) for x in (u, y, r)), strict=True))
    found = []
    for i in range(u.shape[1]):
        left = _left(controller, i, parts, {})
        tried = [(letter, lag) for letter in "uyr" for lag in _LAGS]
        each = [
            Shift(letter, i, lag, left, _left(controller, i, parts, {letter: lag})) for letter, lag in tried
        ]
        best = min(each, key=lambda one: one.then)
        if best.then < min(_BETTER * left, _GOOD):
            found.append(best)
    return found


def _left(
    controller: TransferMatrix, i: int, parts: Sequence[tuple[Array, ...]], lags: Mapping[str, int]
) -> float:
    """Return the rms of q u - q r + P y of an input over that of q u, the signals in `lags` moved."""
    most = max(map(abs, _LAGS))
    P, q = controller.numerator[i], controller.denominator[i]
    memory = max(P.shape[1], len(q)) - 1
    left, whole = [], []
    for u, y, r in parts:
        kept = len(u) - 2 * most
        if kept < memory + _FEWEST:
            continue
        moved = {name: x[most + lags.get(name, 0) :][:kept] for name, x in (("u", u), ("y", y), ("r", r))}

        def through(x: Array, polynomial: Array, kept: int = kept) -> Array:
            return np.convolve(x, polynomial)[memory:kept]

        driven = through(moved["u"][:, i], q)
        law = driven - through(moved["r"][:, i], q)
        law = law + sum(through(x, p) for x, p in zip(moved["y"].T, P, strict=True))
        left.append(law - law.mean())
        whole.append(driven - driven.mean())
    size = float(np.linalg.norm(np.concatenate(whole))) if whole else 0.0
    return float(np.linalg.norm(np.concatenate(left))) / size if size > 0.0 else 0.0
