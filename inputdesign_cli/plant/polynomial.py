"""Polynomials and rational functions in the delay operator q^-1, coefficients ascending."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


def unit_circle(w: ArrayLike) -> ComplexArray:
    """q^-1 at normalised frequencies `w` (rad/sample), same shape.

    With w - j rho it is on a circle of radius e^-rho: the transform of signals weighted with e^(-rho t).
    """
    return np.exp(-1j * np.asarray(w))


def evaluate(coefficients: ArrayLike, q: ComplexArray) -> ComplexArray:
    """Value of sum_i coefficients[i] q^i at each element of `q` (q stands for q^-1)."""
    return np.asarray(
        np.polynomial.polynomial.polyval(q, np.asarray(coefficients, dtype=float)), dtype=complex
    )


def roots_in_z(coefficients: ArrayLike) -> ComplexArray:
    """Roots in z = q of a polynomial in q^-1; leading zeros (pure delay) contribute none.

    Trailing zeros are roots at the origin and are left out: they neither resonate nor destabilise.
    """
    trimmed = np.trim_zeros(np.asarray(coefficients, dtype=float))
    return np.asarray(np.roots(trimmed), dtype=complex) if trimmed.size > 1 else np.zeros(0, dtype=complex)


@dataclass(frozen=True)
class Rational:
    """numerator / (product of the denominator factors), all in q^-1.

    The factors are kept apart: a controller's slow pole next to z = 1 loses digits when it is
    multiplied out, and the sensitivity function at low frequency depends on just those digits.
    """

    numerator: Array
    denominator: tuple[Array, ...] = (np.ones(1),)

    @classmethod
    def build(
        cls, numerator: Sequence[float], denominator: Sequence[float] | Sequence[Sequence[float]] = (1.0,)
    ) -> Rational:
        """From plain numbers; `denominator` is one polynomial or a list of factors."""
        listed = list(denominator)
        factors = listed if listed and not np.isscalar(listed[0]) else [listed]
        return cls(np.asarray(numerator, dtype=float), tuple(np.asarray(f, dtype=float) for f in factors))

    def numerator_at(self, w: ArrayLike) -> ComplexArray:
        """Numerator at normalised frequencies `w`."""
        return evaluate(self.numerator, unit_circle(w))

    def denominator_at(self, w: ArrayLike) -> ComplexArray:
        """Product of the denominator factors at normalised frequencies `w`."""
        q = unit_circle(w)
        value = np.ones_like(q)
        for factor in self.denominator:
            value = value * evaluate(factor, q)
        return value

    def at(self, w: ArrayLike) -> ComplexArray:
        """Frequency response at normalised frequencies `w`."""
        return self.numerator_at(w) / self.denominator_at(w)

    @cached_property
    def poles(self) -> ComplexArray:
        """Poles in z, factor by factor."""
        return join_roots(roots_in_z(factor) for factor in self.denominator)

    @cached_property
    def zeros(self) -> ComplexArray:
        """Zeros in z, those at the origin and at infinity left out."""
        return roots_in_z(self.numerator)

    @cached_property
    def denominator_polynomial(self) -> Array:
        """The denominator factors multiplied out."""
        product = np.ones(1)
        for factor in self.denominator:
            product = np.convolve(product, factor)
        return product


def join_roots(parts: Iterable[ComplexArray]) -> ComplexArray:
    """All roots of several polynomials in one array."""
    listed = [np.asarray(p, dtype=complex) for p in parts]
    return np.concatenate(listed) if listed else np.zeros(0, dtype=complex)
