"""The entries of information matrices that a finite program is about, and linear maps of them."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
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
            first, second, third = self._places
            total = pairs.take(first) + pairs.take(second)
            mixed = pairs.take(third)
        else:
            total, mixed = np.zeros((i.size, i.size)), np.zeros((i.size, i.size))
            for L, R in zip(left, right, strict=True):
                total += self._product(L[i], i, R[j], j)
                total += self._product(L[j], j, R[i], i)
                mixed += self._product(L[i], j, R[j], i)
        total += mixed
        total += mixed.T
        total *= self._weights
        return total

    def _product(self, one: Array, first: NDArray[np.intp], other: Array, second: NDArray[np.intp]) -> Array:
        """Columns `first` of one times columns `second` of the other, in room that is used again."""
        left, right = self._room
        np.take(one, first, axis=1, out=left, mode="clip")
        np.take(other, second, axis=1, out=right, mode="clip")
        left *= right
        return left

    @cached_property
    def _places(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Where the pairs (i i', j j'), (j j', i i') and (i j', j i') stand."""
        i, j, k = self.rows, self.columns, self.order
        above, below = i[:, None] * k + i, j[:, None] * k + j
        return above * k**2 + below, below * k**2 + above, (i[:, None] * k + j) * k**2 + j[:, None] * k + i

    @cached_property
    def _room(self) -> tuple[Array, Array]:
        return np.empty((self.kept.size,) * 2), np.empty((self.kept.size,) * 2)

    @cached_property
    def _weights(self) -> Array:
        return 0.25 * np.outer(self.scale, self.scale)
