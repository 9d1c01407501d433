"""The entries of information matrices that a finite program is about, and linear maps of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.spectrum import svec_layout

Stack = NDArray[np.float64]  # matrices (number, d, d)

# Products of all pairs of entries at once pay from this many matrices on, and fit up to this many pairs.
_TOGETHER, _MOST_PAIRS = 4, 1 << 23


class Entries:
    """The entries of symmetric matrices (k, k) that are not zero throughout, as svec scales them, then s.

    Matrices that fall into blocks keep few: products of all pairs of entries, which is what the linear system
    costs, then concern the blocks alone.
    """

    def __init__(self, order: int, kept: NDArray[np.intp], *, with_s: bool) -> None:
        rows, columns, scale = svec_layout(order)
        self.order, self.with_s, self.kept = order, with_s, kept
        self.rows, self.columns, self.scale = rows[kept], columns[kept], scale[kept]

    @property
    def size(self) -> int:
        """Number of unknowns that M-blocks see."""
        return self.kept.size + int(self.with_s)

    def matrix(self, at: Array) -> Array:
        """(k, k) from the entries."""
        found = np.zeros((self.order, self.order))
        values = at[: self.kept.size] / self.scale
        found[self.rows, self.columns] = found[self.columns, self.rows] = values
        return found

    def vector(self, matrices: NDArray[np.float64]) -> NDArray[np.float64]:
        """(.., size) of symmetric matrices (.., k, k), zero for s."""
        values = matrices[..., self.rows, self.columns] * self.scale
        if not self.with_s:
            return values
        return np.concatenate([values, np.zeros((*values.shape[:-1], 1))], axis=-1)

    def products(self, left: Stack, right: Stack) -> Array:
        """(kept, kept): X -> sum over the stacks of (L X R + R X L) / 2, L and R symmetric (number, k, k)."""
        i, j, k = self.rows, self.columns, self.order
        if len(left) >= _TOGETHER and k**4 <= _MOST_PAIRS:
            # pairs[a k + c, b k + d] = sum L_ac R_bd
            pairs = left.reshape(len(left), -1).T @ right.reshape(len(right), -1)
            at = np.ravel_multi_index
            first, second = at((i[:, None], i), (k, k)), at((j[:, None], j), (k, k))
            across, back = at((i[:, None], j), (k, k)), at((j[:, None], i), (k, k))
            total = pairs[first, second] + pairs[second, first] + pairs[across, back] + pairs[back, across]
        else:
            total = np.zeros((i.size, i.size))
            for L, R in zip(left, right, strict=True):
                total += L[i[:, None], i] * R[j[:, None], j] + L[j[:, None], j] * R[i[:, None], i]
                total += L[i[:, None], j] * R[j[:, None], i] + L[j[:, None], i] * R[i[:, None], j]
        total *= 0.25 * np.outer(self.scale, self.scale)
        return 0.5 * (total + total.T)
