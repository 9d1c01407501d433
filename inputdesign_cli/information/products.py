"""The gradients F (n, k, p, r) of a prediction at many frequencies, kept for many weights.

An output often depends on few of the parameters: of each output only those are kept that matter to it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array, ComplexArray

_AT_ONCE = 256
_ROUNDING = 1e-15  # shares of the largest gradient of an output


@dataclass(frozen=True)
class WeightedProducts:
    """In parts of the frequencies, by output: the parameters (c,) that matter to it, and F^T (n, r, c)."""

    parts: list[list[tuple[NDArray[np.intp], ComplexArray]]]

    @classmethod
    def of(cls, gradient: Callable[[Array], ComplexArray], w: Array) -> WeightedProducts:
        """Build the products of F = `gradient` (n, k, p, r) at frequencies `w`."""
        return cls(
            [
                _by_output(gradient(w[start : start + _AT_ONCE]))
                for start in range(0, max(w.size, 1), _AT_ONCE)
            ]
        )

    def at(self, weight: Array) -> ComplexArray:
        """(n, r, r): sum over outputs of F^* Y F, Y = `weight` (k, k) symmetric."""
        return np.concatenate([_summed(part, weight) for part in self.parts])


def _by_output(F: ComplexArray) -> list[tuple[NDArray[np.intp], ComplexArray]]:
    found: list[tuple[NDArray[np.intp], ComplexArray]] = []
    if F.shape[2] == 1:  # all parameters matter to the only output
        return [(np.arange(F.shape[1]), np.ascontiguousarray(F[:, :, 0].swapaxes(1, 2)))]
    for output in range(F.shape[2]):
        rows = F[:, :, output]
        size = np.abs(rows).max(axis=(0, 2), initial=0.0)
        used = np.flatnonzero(size > _ROUNDING * size.max(initial=0.0))
        found.append((used, np.ascontiguousarray(rows[:, used].swapaxes(1, 2))))
    return found


def _summed(outputs: list[tuple[NDArray[np.intp], ComplexArray]], weight: Array) -> ComplexArray:
    n, r, _ = outputs[0][1].shape
    total = np.zeros((n, r, r), dtype=complex)
    for used, rows in outputs:
        turned = rows @ (weight if used.size == len(weight) else weight[np.ix_(used, used)])
        if r == 1:
            total[:, 0, 0] += np.einsum("nk,nk->n", rows[:, 0].conj(), turned[:, 0])
        else:
            total += rows.conj() @ turned.swapaxes(1, 2)
    return total
