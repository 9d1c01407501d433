"""Prediction-error models y = G(q, theta) u + H(q, theta) e and their parameter gradients.

The five-polynomial form A y = (B/F) u + (C/D) e of Ljung, System Identification (1999), Section 4.2,
holds ARX, ARMAX, ARARMAX, OE, BJ and FIR as special cases.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.plant.polynomial import (
    Array,
    ComplexArray,
    evaluate,
    join_roots,
    roots_in_z,
    unit_circle,
)


@dataclass(frozen=True)
class Response:
    """G, H and their gradients at n frequencies: p outputs, r inputs, k parameters."""

    G: ComplexArray  # (n, p, r)
    H: ComplexArray  # (n, p, p)
    dG: ComplexArray  # (n, k, p, r)
    dH: ComplexArray  # (n, k, p, p)


@dataclass(frozen=True)
class Fraction:
    """G = numerator / denominator at n frequencies, both affine in theta: (n,), their gradients (n, k)."""

    numerator: ComplexArray
    denominator: ComplexArray
    numerator_gradient: ComplexArray
    denominator_gradient: ComplexArray


def _one() -> Array:
    return np.ones(1)


@dataclass(frozen=True)
class PolynomialModel:
    """SISO model A y = (B/F) u + (C/D) e, e white of the given variance.

    A, C, D and F are monic; every later coefficient, and every coefficient of B from its first
    nonzero one on, is a free parameter (zeros in between included).
    """

    B: Array
    A: Array = field(default_factory=_one)
    C: Array = field(default_factory=_one)
    D: Array = field(default_factory=_one)
    F: Array = field(default_factory=_one)
    variance: float = 1.0

    outputs = 1
    inputs = 1

    @cached_property
    def delay(self) -> int:
        """Number of leading zeros of B."""
        return int(np.flatnonzero(self.B)[0])

    @cached_property
    def _lags(self) -> dict[str, range]:
        return {
            "a": range(1, len(self.A)),
            "b": range(self.delay, len(self.B)),
            "c": range(1, len(self.C)),
            "d": range(1, len(self.D)),
            "f": range(1, len(self.F)),
        }

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Parameter names in the order of theta: a1.., b(delay).., c1.., d1.., f1.. ."""
        return tuple(f"{letter}{lag}" for letter, lags in self._lags.items() for lag in lags)

    @cached_property
    def theta(self) -> Array:
        """Parameter values (k,), in the order of `names`."""
        polynomials = {"a": self.A, "b": self.B, "c": self.C, "d": self.D, "f": self.F}
        return np.array([polynomials[letter][lag] for letter, lags in self._lags.items() for lag in lags])

    @cached_property
    def in_plant(self) -> np.ndarray:
        """(k,) bool: the parameters on which G depends (k_G of them)."""
        return np.array([name[0] in "abf" for name in self.names])

    @cached_property
    def poles(self) -> ComplexArray:
        """Poles of G in z."""
        return join_roots([roots_in_z(self.A), roots_in_z(self.F)])

    @cached_property
    def zeros(self) -> ComplexArray:
        """Finite zeros of G in z."""
        return roots_in_z(self.B)

    @cached_property
    def predictor_poles(self) -> ComplexArray:
        """Poles in z of the gradient of the one-step prediction with respect to theta."""
        return join_roots(roots_in_z(p) for p in (self.C, self.D, self.F))

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """G at normalised frequencies `w` (n,): (n,)."""
        q = unit_circle(w)
        return evaluate(self.B, q) / (evaluate(self.A, q) * evaluate(self.F, q))

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """dG/dtheta at normalised frequencies `w` (n,): (n, k)."""
        q = unit_circle(w)
        A, F = evaluate(self.A, q), evaluate(self.F, q)
        G = evaluate(self.B, q) / (A * F)
        zero = np.zeros_like(G)
        return self._stack(q, {"a": -G / A, "b": 1 / (A * F), "c": zero, "d": zero, "f": -G / F})

    def fraction(self, w: ArrayLike) -> Fraction:
        """G as a fraction of two polynomials that are affine in theta, at `w` (n,).

        Raises:
            ValueError: both A and F have free coefficients, so that the denominator is a product.
        """
        if len(self.A) > 1 and len(self.F) > 1:
            raise ValueError("the denominator A F is not affine in the parameters")
        q = unit_circle(w)
        one, zero = np.ones_like(q), np.zeros_like(q)
        none = {"a": zero, "b": zero, "c": zero, "d": zero, "f": zero}
        return Fraction(
            numerator=evaluate(self.B, q),
            denominator=evaluate(self.A, q) * evaluate(self.F, q),
            numerator_gradient=self._stack(q, {**none, "b": one}),
            denominator_gradient=self._stack(q, {**none, "a": one, "f": one}),
        )

    def noise_gradient(self, w: ArrayLike) -> ComplexArray:
        """dH/dtheta at normalised frequencies `w` (n,): (n, k)."""
        q = unit_circle(w)
        A, D = evaluate(self.A, q), evaluate(self.D, q)
        H = evaluate(self.C, q) / (A * D)
        zero = np.zeros_like(H)
        return self._stack(q, {"a": -H / A, "b": zero, "c": 1 / (A * D), "d": -H / D, "f": zero})

    def response(self, w: ArrayLike) -> Response:
        """G, H and their exact gradients at normalised frequencies `w` (n,)."""
        q = unit_circle(w)
        H = evaluate(self.C, q) / (evaluate(self.A, q) * evaluate(self.D, q))
        return Response(
            G=self.plant_at(w)[:, None, None],
            H=H[:, None, None],
            dG=self.plant_gradient(w)[:, :, None, None],
            dH=self.noise_gradient(w)[:, :, None, None],
        )

    def prediction_gradient(
        self, w: ArrayLike, y: ComplexArray, u: ComplexArray, e: ComplexArray
    ) -> ComplexArray:
        """Gradient psi = -d epsilon / d theta of the one-step prediction: (n, k).

        `y`, `u`, `e` (n,) are the transfer functions from one common source to the output, the input
        and the prediction error epsilon = (D/C)(A y - (B/F) u). Written with the polynomials of the
        predictor alone (Ljung, Section 10.3), so that the poles of an unstable A cancel exactly.
        """
        q = unit_circle(w)
        B, C, D, F = (evaluate(p, q) for p in (self.B, self.C, self.D, self.F))
        return self._stack(
            q,
            {
                "a": -D / C * y,
                "b": D / (C * F) * u,
                "c": e / C,
                "d": -e / D,
                "f": -D * B / (C * F * F) * u,
            },
        )

    def _stack(self, q: ComplexArray, families: dict[str, ComplexArray]) -> ComplexArray:
        columns = [families[letter] * q**lag for letter, lags in self._lags.items() for lag in lags]
        return np.stack(columns, axis=-1)
