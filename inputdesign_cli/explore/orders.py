"""Structures that are tried: a family, its orders, and the delay of every input, for one output."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.explore.fits import Parts
from inputdesign_cli.explore.regression import SharedDenominator
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.records import longest
from inputdesign_cli.plant import PolynomialModel

NOISE_ORDERS = (1, 2)
"""Those of C and D that are tried."""


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

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.a + self.c + self.d + len(self.delays) * (self.b + self.f)

    @property
    def shared(self) -> bool:
        """Whether plant and noise have poles in common: a wrong noise model then biases the plant."""
        return self.a > 0

    @property
    def coloured(self) -> bool:
        """Whether the noise has a filter of its own."""
        return self.c + self.d > 0

    @property
    def unknowns(self) -> int:
        """What the input must tell: the coefficients of one input."""
        return self.b + self.order

    @property
    def order(self) -> int:
        """Of the plant, input by input."""
        return self.a + self.f

    @property
    def numbers(self) -> dict[str, int]:
        """The orders of the polynomials that the family has."""
        every = {"A": self.a, "B": self.b, "C": self.c, "D": self.d, "F": self.f}
        return {letter: order for letter, order in every.items() if order}

    def starts(self, parts: Parts, quick: SharedDenominator, b: int) -> Array:
        """(n, k): where to begin, by regression on records at rest."""
        return estimator(self.model(), 1.0).kind.starts(longest(parts), None).points

    def ranges(self, theta: Array, deviations: Array) -> tuple[tuple[int, int], ...]:
        """None: delays are no parameters."""
        return ()

    def beyond(self, theta: Array, longest: int) -> list[tuple[str, float]]:
        """None: poles in q^-1 are those of the samples."""
        return []

    def at(self, theta: Array) -> Orders:
        """The same: its delays are stated."""
        return self

    def with_coloured_noise(self) -> list[Orders]:
        """A plant of the same orders, Box and Jenkins's noise."""
        return [Orders("BJ", self.delays, self.b, c=n, d=n, f=self.order) for n in NOISE_ORDERS]

    def model(self) -> PolynomialModel:
        """The structure, with numbers that mean nothing."""
        B = tuple(np.concatenate([np.zeros(delay), np.ones(self.b)]) for delay in self.delays)
        F = tuple(_monic(self.f) for _ in self.delays)
        return PolynomialModel((B,), (_monic(self.a),), (F,), (_monic(self.c),), (_monic(self.d),), np.eye(1))


def arx(delays: tuple[int, ...], a: int, b: int) -> Orders:
    """A y = B u + e."""
    return Orders("ARX", delays, b, a=a)


def plant_order(n: int, delays: tuple[int, ...]) -> list[Orders]:
    """The families with a plant of this order; B has one coefficient more than that at order one."""
    b = max(n, 2)
    return [Orders("ARX", delays, b, a=n), Orders("ARMAX", delays, b, a=n, c=n), Orders("OE", delays, b, f=n)]


def static_gain(delays: tuple[int, ...]) -> Orders:
    """A gain and a delay: one coefficient for each input, no pole."""
    return Orders("FIR", delays, 1)


def _monic(order: int) -> Array:
    return np.concatenate([[1.0], np.zeros(order)])
