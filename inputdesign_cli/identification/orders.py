"""Which coefficients of one output's polynomials are unknown, and theta as polynomials, many runs at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inputdesign_cli.arrays import Array


@dataclass(frozen=True)
class InputOrders:
    """Orders of B/F from one `input` to an output; B has the coefficients of the lags `delay` to `b`."""

    input: int
    b: int
    f: int
    delay: int


@dataclass(frozen=True)
class Block:
    """The free coefficients of one polynomial: their lags, and where they stand in the theta of the row.

    `entry` is the number of the entry of B or F in its row.
    """

    letter: str
    entry: int
    lags: range
    columns: slice

    @property
    def source(self) -> str:
        """Return the signal of which the columns of psi are delays."""
        return f"{self.letter}{self.entry}" if self.letter in "bf" else self.letter


@dataclass(frozen=True)
class Polynomials:
    """The polynomials of each run, (runs, order + 1), ascending in q^-1; B and F one an entry."""

    A: Array
    B: tuple[Array, ...]
    C: Array
    D: Array
    F: tuple[Array, ...]

    @property
    def order(self) -> int:
        """Return the highest of all orders."""
        return max(p.shape[1] for p in (self.A, self.C, self.D, *self.B, *self.F)) - 1


@dataclass(frozen=True)
class OutputOrders:
    """Orders of one output: A y = sum_j (B_j / F_j) u_j + (C / D) e; entries that are zero are left out.

    theta is ordered as a1.., the coefficients of B entry by entry, c1.., d1.., the coefficients of F.
    """

    a: int
    c: int
    d: int
    entries: tuple[InputOrders, ...]

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """Return the polynomials in the order of theta; those without free coefficients, too."""
        parts = [("a", 0, range(1, self.a + 1))]
        parts += [("b", e, range(x.delay, x.b + 1)) for e, x in enumerate(self.entries)]
        parts += [("c", 0, range(1, self.c + 1)), ("d", 0, range(1, self.d + 1))]
        parts += [("f", e, range(1, x.f + 1)) for e, x in enumerate(self.entries)]
        ends = np.cumsum([len(lags) for _, _, lags in parts]).tolist()
        return tuple(
            Block(letter, e, lags, slice(end - len(lags), end))
            for (letter, e, lags), end in zip(parts, ends, strict=True)
        )

    @cached_property
    def by_letter(self) -> dict[str, tuple[Block, ...]]:
        """Return the blocks of each polynomial; of A, C and D one."""
        return {letter: tuple(b for b in self.blocks if b.letter == letter) for letter in "abcdf"}

    @property
    def size(self) -> int:
        """Return the number of parameters."""
        return self.blocks[-1].columns.stop

    @property
    def memory(self) -> int:
        """Return how far back the regression looks, recursions aside."""
        return max([self.a, *(entry.b for entry in self.entries)])

    def polynomials(self, theta: Array) -> Polynomials:
        """Return theta (runs, k) as polynomials."""

        def of(letter: str) -> tuple[Array, ...]:
            parts = []
            for block in self.by_letter[letter]:
                p = np.zeros((theta.shape[0], block.lags.stop), dtype=theta.dtype)
                p[:, 0] = letter != "b"
                p[:, block.lags.start : block.lags.stop] = theta[:, block.columns]
                parts.append(p)
            return tuple(parts)

        return Polynomials(of("a")[0], of("b"), of("c")[0], of("d")[0], of("f"))
