"""Which coefficients of A y = (B/F) u + (C/D) e are unknown, and theta as polynomials, many runs at once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.plant.polynomial import Array

LETTERS = "abcdf"


@dataclass(frozen=True)
class Polynomials:
    """The five polynomials of each run, (runs, order + 1), ascending in q^-1; B with its leading zeros."""

    A: Array
    B: Array
    C: Array
    D: Array
    F: Array


@dataclass(frozen=True)
class Structure:
    """Orders of the five polynomials (SISO).

    `a`, `c`, `d`, `f` are the orders of monic polynomials; B has the coefficients of the lags `delay` to
    `b`. theta is ordered as in `PolynomialModel.names`: a1.., b(delay).., c1.., d1.., f1.. .
    """

    a: int = 0
    b: int = 1
    c: int = 0
    d: int = 0
    f: int = 0
    delay: int = 1

    @classmethod
    def of(cls, model: PolynomialModel) -> Structure:
        """The structure of a model: its orders and its delay."""
        a, b, c, d, f = (len(p) - 1 for p in (model.A, model.B, model.C, model.D, model.F))
        return cls(a, b, c, d, f, model.delay)

    @cached_property
    def lags(self) -> dict[str, range]:
        """The lags of the free coefficients of each polynomial."""
        first = {"b": self.delay}
        return {letter: range(first.get(letter, 1), getattr(self, letter) + 1) for letter in LETTERS}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Parameter names in the order of theta."""
        return tuple(f"{letter}{lag}" for letter, lags in self.lags.items() for lag in lags)

    @property
    def size(self) -> int:
        """Number of parameters k."""
        return len(self.names)

    @cached_property
    def columns(self) -> dict[str, slice]:
        """Where the coefficients of each polynomial stand in theta."""
        ends = np.cumsum([len(lags) for lags in self.lags.values()]).tolist()
        return {
            letter: slice(end - len(lags), end)
            for (letter, lags), end in zip(self.lags.items(), ends, strict=True)
        }

    def polynomials(self, theta: Array) -> Polynomials:
        """theta (runs, k) as polynomials."""
        parts = []
        for letter, lags in self.lags.items():
            p = np.zeros((theta.shape[0], getattr(self, letter) + 1))
            p[:, 0] = letter != "b"
            p[:, lags.start : lags.stop] = theta[:, self.columns[letter]]
            parts.append(p)
        return Polynomials(*parts)

    def model(self, theta: Array, variance: float) -> PolynomialModel:
        """theta (k,) as a model."""
        p = self.polynomials(theta[None])
        return PolynomialModel(A=p.A[0], B=p.B[0], C=p.C[0], D=p.D[0], F=p.F[0], variance=variance)

    def responses(self, theta: Array, w: Array) -> np.ndarray:
        """G (runs, n) of each theta (runs, k) at frequencies `w` (n,) in rad/sample."""
        p = self.polynomials(theta)
        q = np.exp(-1j * w)

        def at(coefficients: Array) -> np.ndarray:
            return np.asarray(coefficients @ q[None, :] ** np.arange(coefficients.shape[1])[:, None])

        return at(p.B) / (at(p.A) * at(p.F))
