"""The cone constraints of `interior`: their slacks S, multipliers Z, and contributions to a step.

Every block states S(a) in its cone. Its argument a is the unknowns v or, for blocks of M, the entries of
svec(M) and s. A step solves, linearised, S + dS = S(a + da) and
Z + dZ = target S^-1 - (Z dS S^-1) - corrector, products of matrices made symmetric.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.spectrum import smat, svec, svec_layout

Stack = NDArray[np.float64]  # matrices (number, d, d)

# Products of all pairs of entries together pay off from this number of matrices, up to this number of pairs.
_TOGETHER, _MOST_PAIRS = 4, 1 << 23


class Entries:
    """Selects the entries of symmetric matrices (k, k) that may differ from zero, scaled as in svec, then s.

    Block-diagonal matrices keep few entries: the products of all pairs of entries, which dominate the cost of
    the linear system, then concern the blocks alone.
    """

    def __init__(self, order: int, kept: NDArray[np.intp], *, with_s: bool) -> None:
        rows, columns, scale = svec_layout(order)
        self.order, self.with_s, self.kept = order, with_s, kept
        self.rows, self.columns, self.scale = rows[kept], columns[kept], scale[kept]

    @property
    def size(self) -> int:
        """Return the number of unknowns of the blocks of M."""
        return self.kept.size + int(self.with_s)

    def matrix(self, at: Array) -> Array:
        """Build the matrix (k, k) from the entries."""
        found = np.zeros((self.order, self.order))
        values = at[: self.kept.size] / self.scale
        found[self.rows, self.columns] = found[self.columns, self.rows] = values
        return found

    def vector(self, matrices: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the entries (.., size) of symmetric matrices (.., k, k), with zero for s."""
        values = matrices[..., self.rows, self.columns] * self.scale
        if not self.with_s:
            return values
        return np.concatenate([values, np.zeros((*values.shape[:-1], 1))], axis=-1)

    def products(self, left: Stack, right: Stack) -> Array:
        """Return X -> sum of (L X R + R X L) / 2 as (kept, kept), L and R symmetric (number, k, k)."""
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
        """Multiply columns `first` of one by columns `second` of the other, in memory that is reused."""
        left, right = self._room
        np.take(one, first, axis=1, out=left, mode="clip")
        np.take(other, second, axis=1, out=right, mode="clip")
        left *= right
        return left

    @cached_property
    def _places(self) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
        """Return the places of the pairs (i i', j j'), (j j', i i') and (i j', j i')."""
        i, j, k = self.rows, self.columns, self.order
        above, below = i[:, None] * k + i, j[:, None] * k + j
        return above * k**2 + below, below * k**2 + above, (i[:, None] * k + j) * k**2 + j[:, None] * k + i

    @cached_property
    def _room(self) -> tuple[Array, Array]:
        return np.empty((self.kept.size,) * 2), np.empty((self.kept.size,) * 2)

    @cached_property
    def _weights(self) -> Array:
        return 0.25 * np.outer(self.scale, self.scale)


class Cone(ABC):
    """A conic block with slack S and multiplier Z, and the step dS and dZ of both.

    `degree` is the number of its complementarity products; `curved` where S is not linear.
    """

    degree: int
    curved = False
    S: NDArray[np.float64]
    Z: NDArray[np.float64]
    dS: NDArray[np.float64]
    dZ: NDArray[np.float64]

    @property
    def gap(self) -> float:
        """Return the duality gap <S, Z> of the block."""
        return float(np.sum(self.S * self.Z))

    @abstractmethod
    def look(self, at: Array) -> float:
        """Evaluate the constraint at the unknowns `at` (n,); return its largest difference from the slack S.

        Raises:
            LinAlgError: the slack has left the cone.
        """

    @abstractmethod
    def pull(self) -> Array:
        """Return A^T Z, the weight of the multipliers on the unknowns."""

    @abstractmethod
    def add_to(self, matrix: Array) -> None:
        """Add A^T (Z . S^-1) A."""

    @abstractmethod
    def push(self, target: float, *, corrected: bool) -> Array:
        """Return A^T (target S^-1 - Z miss S^-1 - corrector)."""

    @abstractmethod
    def turn(self, step: Array) -> None:
        """Find dS and dZ for a step of the unknowns, with the target and the corrector of the last `push`."""

    @abstractmethod
    def lengths(self) -> tuple[float, float]:
        """Return the largest step lengths along dS and dZ that stay in the cone, infinite without a bound."""

    def gap_after(self, up: float, down: float) -> float:
        """Return the duality gap <S + up dS, Z + down dZ> after a step."""
        return float(np.sum((self.S + up * self.dS) * (self.Z + down * self.dZ)))

    def move(self, up: float, down: float) -> None:
        """Move S and Z along dS and dZ by these lengths."""
        self.S = self.S + up * self.dS
        self.Z = self.Z + down * self.dZ

    @abstractmethod
    def multipliers(self) -> list[Array]:
        """Return the multipliers Z, one array for each part of the block."""


class Orthant(Cone):
    """The linear inequalities offset + rows a >= 0, `rows` (l, number of unknowns)."""

    def __init__(self, rows: Array, offset: Array, slack: Array, weight: Array) -> None:
        self.rows, self.offset, self.S, self.Z = rows, offset, slack, weight
        self.dS, self.dZ = np.zeros_like(slack), np.zeros_like(weight)
        self.degree = slack.size

    def look(self, at: Array) -> float:
        """See `Cone`."""
        self.miss = self.offset + self.rows @ at - self.S
        return float(np.abs(self.miss).max(initial=0.0))

    def pull(self) -> Array:
        """See `Cone`."""
        return self.rows.T @ self.Z

    def add_to(self, matrix: Array) -> None:
        """See `Cone`."""
        matrix += (self.rows.T * (self.Z / self.S)) @ self.rows

    def push(self, target: float, *, corrected: bool) -> Array:
        """See `Cone`."""
        self.aim = target / self.S - (self.dZ * self.dS / self.S if corrected else 0.0)
        return self.rows.T @ (self.aim - self.Z / self.S * self.miss)

    def turn(self, step: Array) -> None:
        """See `Cone`."""
        self.dS = self.miss + self.rows @ step
        self.dZ = self.aim - self.Z - self.Z / self.S * self.dS

    def lengths(self) -> tuple[float, float]:
        """See `Cone`."""
        return reach(self.S, self.dS), reach(self.Z, self.dZ)

    def multipliers(self) -> list[Array]:
        """Return the multipliers of all inequalities: one array (l,)."""
        return [self.Z]


class Atoms(Orthant):
    """The sign constraint on the first unknowns, which are nonnegative and are the slack."""

    def __init__(self, start: Array, weight: Array) -> None:
        super().__init__(np.zeros((0, 0)), np.zeros(0), start, weight)
        self.miss = np.zeros(1)

    def look(self, at: Array) -> float:
        """See `Cone`."""
        self.total, self.S = at.size, at[: self.degree]
        return 0.0

    def pull(self) -> Array:
        """See `Cone`."""
        return np.pad(self.Z, (0, self.total - self.degree))

    def add_to(self, matrix: Array) -> None:
        """See `Cone`."""
        matrix.flat[: self.degree * (self.total + 1) : self.total + 1] += self.Z / self.S

    def push(self, target: float, *, corrected: bool) -> Array:
        """See `Cone`."""
        self.aim = target / self.S - (self.dZ * self.dS / self.S if corrected else 0.0)
        return np.pad(self.aim, (0, self.total - self.degree))

    def turn(self, step: Array) -> None:
        """See `Cone`."""
        self.dS = step[: self.degree]
        self.dZ = self.aim - self.Z - self.Z / self.S * self.dS


class Semidefinite(Cone):
    """Holds constraints S_b >= 0 on matrices of one order d; `S` and `Z` are (number, d, d)."""

    def __init__(self, number: int, order: int, slack: float, weight: float) -> None:
        self.degree = number * order
        unit = np.broadcast_to(np.eye(order), (number, order, order))
        self.S, self.Z = slack * unit, weight * unit
        self.dS, self.dZ = np.zeros_like(self.S), np.zeros_like(self.Z)

    def factor(self) -> None:
        """Compute the inverses of S and of its Cholesky factors."""
        self.root = np.linalg.inv(np.linalg.cholesky(self.S))
        self.inverse = self.root.swapaxes(1, 2) @ self.root
        self.dual_root = np.linalg.inv(np.linalg.cholesky(self.Z))

    def scaled(self, X: Stack) -> Stack:
        """Return Z X S^-1, made symmetric."""
        return symmetric(self.Z @ X @ self.inverse)

    def aimed(self, target: float, *, corrected: bool) -> Stack:
        """Return target S^-1 - corrector."""
        self.aim = target * self.inverse
        if corrected:
            self.aim = self.aim - symmetric(self.dZ @ self.dS @ self.inverse)
        return self.aim

    def answer(self, dS: Stack) -> None:
        """Set dS, and the dZ that follows from it."""
        self.dS = dS
        self.dZ = self.aim - self.Z - self.scaled(dS)

    def lengths(self) -> tuple[float, float]:
        """See `Cone`."""
        up = furthest(self.root @ self.dS @ self.root.swapaxes(1, 2))
        return up, furthest(self.dual_root @ self.dZ @ self.dual_root.swapaxes(1, 2))

    def multipliers(self) -> list[Array]:
        """Return the multipliers Z, one matrix each."""
        return list(self.Z)


class Gram(Semidefinite):
    """The first unknowns are svec of a positive semidefinite matrix."""

    def __init__(self, order: int, slack: float, weight: float) -> None:
        super().__init__(1, order, slack, weight)
        self.entries = Entries(order, np.arange(order * (order + 1) // 2), with_s=False)

    def look(self, at: Array) -> float:
        """See `Cone`. The slack is the unknown itself."""
        self.at = at
        self.S = smat(at[: self.entries.size])[None]
        self.factor()
        return 0.0

    def _spread(self, values: Array) -> Array:
        return np.concatenate([values, np.zeros(self.at.size - values.size)])

    def pull(self) -> Array:
        """See `Cone`."""
        return self._spread(svec(self.Z[0]))

    def add_to(self, matrix: Array) -> None:
        """See `Cone`."""
        size = self.entries.size
        matrix[:size, :size] += self.entries.products(self.Z, self.inverse)

    def push(self, target: float, *, corrected: bool) -> Array:
        """See `Cone`."""
        return self._spread(svec(self.aimed(target, corrected=corrected)[0]))

    def turn(self, step: Array) -> None:
        """See `Cone`."""
        self.answer(smat(step[: self.entries.size])[None])


def symmetric(X: Stack) -> Stack:
    """Return the symmetric parts."""
    return 0.5 * (X + X.swapaxes(1, 2))


def reach(values: Array, steps: Array) -> float:
    """Return the largest share of the steps that keeps the values positive."""
    least = float(np.min(steps / values, initial=0.0))
    return -1.0 / least if least < 0.0 else np.inf


def furthest(changes: Stack) -> float:
    """Return the largest share for which all matrices I + share * change are positive semidefinite."""
    least = float(np.linalg.eigvalsh(changes)[:, 0].min())
    return -1.0 / least if least < 0.0 else np.inf
