"""One output of a polynomial model: where its coefficients stand in theta, and its prediction errors.

epsilon = (D/C)(A y - sum_j (B_j/F_j) u_j) and psi = -d epsilon / d theta ([ljung-1999], Section 10.3), for
many runs at once. Signals are (runs, N), and start from rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg.blas
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.plant import PolynomialModel


@dataclass(frozen=True)
class Coefficients:
    """The free coefficients of one polynomial: their lags, and their `columns` in theta (k,)."""

    letter: str
    lags: range
    columns: NDArray[np.int64]

    @classmethod
    def of(cls, model: PolynomialModel, letter: str, place: tuple[int, int]) -> Coefficients:
        """Return the coefficients of a polynomial that acts at this output and input."""
        own = [
            (parameter.power, column)
            for column, parameter in enumerate(model.parameters)
            if parameter.letter == letter and place in parameter.places
        ]
        first = own[0][0] if own else 1
        columns = np.array([column for _, column in own], dtype=np.int64)
        return cls(letter, range(first, first + len(own)), columns)

    def polynomial(self, theta: Array) -> Array:
        """Return the polynomials (runs, order + 1) of parameters (runs, k), ascending in q^-1."""
        found = np.zeros((len(theta), self.lags.stop), dtype=theta.dtype)
        found[:, 0] = self.letter != "b"
        found[:, self.lags.start :] = theta[:, self.columns]
        return found


@dataclass(frozen=True)
class Row:
    """A y = sum_j (B_j / F_j) u_j + (C / D) e; B and F have one polynomial for each of the `inputs`."""

    inputs: tuple[int, ...]
    a: Coefficients
    b: tuple[Coefficients, ...]
    c: Coefficients
    d: Coefficients
    f: tuple[Coefficients, ...]

    @classmethod
    def of(cls, model: PolynomialModel, output: int) -> Row:
        """Return the row of an output; absent entries are left out."""
        inputs = tuple(j for i, j in model.active if i == output)
        at = {"a": (output, 0), "c": (output, output), "d": (output, output)}
        a, c, d = (Coefficients.of(model, letter, place) for letter, place in at.items())
        b, f = (tuple(Coefficients.of(model, letter, (output, j)) for j in inputs) for letter in "bf")
        return cls(inputs, a, b, c, d, f)

    @property
    def all(self) -> tuple[Coefficients, ...]:
        """Return the coefficients of all polynomials."""
        return (self.a, *self.b, self.c, self.d, *self.f)

    @property
    def size(self) -> int:
        """Return the number of coefficients."""
        return sum(len(one.lags) for one in self.all)

    @property
    def memory(self) -> int:
        """Return how far back the regression looks, recursions aside."""
        return max(one.lags.stop for one in (self.a, *self.b)) - 1

    def whitening(self, theta: Array) -> tuple[Array, Array]:
        """Return D and C, (order + 1,) each, at parameters (k,)."""
        return self.d.polynomial(theta[None])[0], self.c.polynomial(theta[None])[0]


def errors_and_sources(
    row: Row, theta: Array, u: NDArray[np.float64], y: Array
) -> tuple[Array, list[tuple[Coefficients, Array]]]:
    """Return epsilon (runs, N) of one output, and signals (runs, N) of which psi of coefficients are delays.

    Args:
        row: of the output.
        theta: (runs, k).
        u: (runs, r, N), all inputs of the model.
        y: (runs, N), the output.
    """
    A, C, D = (one.polynomial(theta) for one in (row.a, row.c, row.d))
    v, sources = _multiplied(A, y), []
    for j, b, f in zip(row.inputs, row.b, row.f, strict=True):
        B, F = b.polynomial(theta), f.polynomial(theta)
        x = _divided(F, u[:, j])
        v = v - _multiplied(B, x)
        through = _multiplied(D, _divided(C, x))
        sources += [(b, through)]
        sources += [(f, _multiplied(-B, _divided(F, through)))] if f.lags else []
    shaped = _divided(C, v)
    errors = _multiplied(D, shaped)
    sources += [(row.a, _multiplied(-D, _divided(C, y)))] if row.a.lags else []
    sources += [(row.c, _divided(C, errors))] if row.c.lags else []
    return errors, sources + ([(row.d, -shaped)] if row.d.lags else [])


def _multiplied(polynomials: Array, x: Array) -> Array:
    """Return sum_i p_i x(t - i) for polynomials (runs, order + 1) and signals (runs, N)."""
    out = polynomials[:, :1] * x
    for lag in range(1, min(polynomials.shape[1], x.shape[1])):
        out[:, lag:] += polynomials[:, lag, None] * x[:, :-lag]
    return out


def _divided(monic: Array, x: Array) -> Array:
    """Return x / D for monic polynomials D (runs, order + 1) and signals (runs, N).

    All runs, one after the other, are a triangular system with few diagonals.
    """
    order = min(monic.shape[1], x.shape[1]) - 1
    if not order:
        return x
    diagonals = np.zeros((*x.shape, order + 1))
    for lag in range(1, order + 1):
        diagonals[:, :-lag, lag] = monic[:, lag, None]
    flat = scipy.linalg.blas.dtbsv(order, diagonals.reshape(-1, order + 1).T, x.ravel(), lower=1, diag=1)
    return np.asarray(flat).reshape(x.shape)
