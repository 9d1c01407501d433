"""Describe a structure of polynomials for one output: its family, orders, and the delay of every input."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.sweep import Regression
from inputdesign_cli.plant import PolynomialModel


@dataclass(frozen=True)
class Orders:
    """Of A y = sum_j (B_j / F_j) u_j + (C / D) e; B_j has `b` coefficients from the lag `delays[j]` on."""

    family: str
    delays: tuple[int, ...]
    b: int
    a: int = 0
    c: int = 0
    d: int = 0
    f: int = 0

    # Whether the parameters have names that mean something: gains, time constants, dead times.
    physical: ClassVar[Literal[False]] = False
    integrates: ClassVar[bool] = False

    @property
    def size(self) -> int:
        """Return the number of parameters."""
        return self.a + self.c + self.d + len(self.delays) * (self.b + self.f)

    @property
    def shared(self) -> bool:
        """Return whether plant and noise share poles."""
        return self.a > 0

    @property
    def order(self) -> int:
        """Return the order of the plant of each input."""
        return self.a + self.f

    @property
    def unknowns(self) -> int:
        """Return the number of coefficients of one input."""
        return self.b + self.order

    @property
    def numbers(self) -> dict[str, int]:
        """Return the orders of the polynomials that the family has."""
        every = {"A": self.a, "B": self.b, "C": self.c, "D": self.d, "F": self.f}
        return {letter: order for letter, order in every.items() if order}

    def start(self, near: Regression) -> Array:
        """Return where to begin (k,), by a regression; ARMAX begins as an output error."""
        rows = [np.resize(np.append(row, np.zeros(self.b)), self.b) for row in near.B]
        F = np.resize(np.append(near.F, np.zeros(self.order)), self.order + 1)
        A, below = (F, _monic(0)) if self.a else (_monic(0), F)
        C = np.resize(np.append(F if self.a and self.c else _monic(0), np.zeros(self.c)), self.c + 1)
        return self._with(rows, A, below, C, _monic(self.d)).theta

    def at(self, theta: Array) -> Orders:
        """Return the same structure: its delays are stated."""
        return self

    def model(self) -> PolynomialModel:
        """Return the structure as a model; its numbers have no meaning."""
        ones = [np.ones(self.b)] * len(self.delays)
        return self._with(ones, _monic(self.a), _monic(self.f), _monic(self.c), _monic(self.d))

    def coloured(self, C: Array, D: Array) -> Orders:
        """Return a plant of the same orders with Box and Jenkins's noise."""
        c, d = C.size - 1, D.size - 1
        return self if self.shared else replace(self, family="BJ" if c + d else self.family, c=c, d=d)

    def noisy(self, theta: Array, C: Array, D: Array) -> PolynomialModel:
        """Return the model with these parameters (k,) of the plant, and C and D where it has none."""
        own = self.model().at(theta)
        return own if self.shared else replace(own, C=(C,), D=(D,))

    def ranges(self, theta: Array, deviations: Array) -> tuple[tuple[int, int], ...]:
        """Return nothing: delays are no parameters."""
        return ()

    def _with(self, rows: list[Array], A: Array, F: Array, C: Array, D: Array) -> PolynomialModel:
        B = tuple(np.concatenate([np.zeros(d), row]) for d, row in zip(self.delays, rows, strict=True))
        ends = (F,) * len(B)
        return PolynomialModel((B,), (A,), (ends,), (C,), (D,), np.eye(1), delays=(self.delays,))


def _monic(order: int) -> Array:
    return np.eye(1, order + 1)[0]
