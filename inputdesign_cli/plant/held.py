"""One entry of a transfer matrix behind a zero-order hold, with the gradients of its parameters in s.

Both come from one matrix exponential ([van-loan-1978]). The same states serve samples that are not held but
interpolated within their band.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.linalg
from numpy.polynomial import polynomial as ascending

from inputdesign_cli.plant.polynomial import Array, ComplexArray

# What is left of a state, far below rounding.
_FORGOTTEN = 1e-20


@dataclass(frozen=True)
class HeldEntry:
    """b / a behind a hold, as rows on the sampled states (1, s, .., s^{n-1}) / a and the same over a^2.

    The unit of time is the geometric mean of the time constants, which keeps the companion form tame;
    `unit` is what it is in the time of the spec, so that s = s' unit.
    """

    numerator: Array  # ascending in s, padded to the length of the denominator
    denominator: Array
    unit: float
    transition: Array
    entry: Array

    @classmethod
    def of(cls, numerator: Array, denominator: Array, sample_time: float) -> HeldEntry:
        """b / a, ascending in s, held over `sample_time`."""
        n = denominator.size - 1
        padded = np.zeros(n + 1)
        padded[: numerator.size] = numerator
        poles = np.abs(polynomial_roots(denominator))
        unit = float(np.exp(np.mean(np.log(poles)))) if n else 1.0
        below = denominator * unit ** (np.arange(n + 1.0) - n)
        companion = np.eye(n, k=1)
        if n:
            companion[-1] = -below[:-1]
        system = np.zeros((2 * n + 1, 2 * n + 1))
        system[:n, :n] = system[n : 2 * n, n : 2 * n] = companion
        if n:
            system[2 * n - 1, 0] = 1.0  # the second copy is driven by 1 / a
            system[n - 1, 2 * n] = 1.0
        held = scipy.linalg.expm(system * (unit * sample_time))
        return cls(padded, denominator, unit, held[: 2 * n, : 2 * n], held[: 2 * n, 2 * n])

    @property
    def order(self) -> int:
        """n, the degree of the denominator."""
        return self.denominator.size - 1

    @property
    def direct(self) -> float:
        """What acts without delay: b / a at infinite frequency."""
        return float(self.numerator[-1])

    @cached_property
    def gain(self) -> Array:
        """(2 order,): the row of what acts with a delay."""
        return self.row(self.numerator - self.direct * self.denominator, 1)

    def states(self, z: ComplexArray) -> ComplexArray:
        """(n, 2 order): the states at points z of the unit circle.

        By back-substitution in Schur's triangular form, for all points at once.
        """
        if not self.order:
            return np.zeros((z.size, 0), dtype=complex)
        triangle, basis = self._schur
        driven = basis.conj().T @ self.entry
        modes = np.zeros((driven.size, z.size), dtype=complex)
        for row in reversed(range(driven.size)):
            above = driven[row] + triangle[row, row + 1 :] @ modes[row + 1 :]
            modes[row] = above / (z - triangle[row, row])
        return np.asarray((basis @ modes).T, dtype=complex)

    @cached_property
    def _schur(self) -> tuple[ComplexArray, ComplexArray]:
        """Schur's triangular form of the transition, and its basis."""
        triangle, basis = scipy.linalg.schur(self.transition, output="complex")
        return triangle, basis

    def interpolated_states(self, w: Array) -> ComplexArray:
        """(n, 2 order): the states at frequencies w of the continuous entry, without a hold."""
        s = 1j * w[:, None] / self.unit
        scaled = self.denominator * self.unit ** (np.arange(self.order + 1.0) - self.order)
        below = ascending.polyval(s, scaled)
        chain = s ** np.arange(self.order) / below
        return np.concatenate([chain, chain / below], axis=1)

    def forgetting(self, states: ComplexArray, z: ComplexArray, samples: int) -> ComplexArray:
        """States (n, 2 order) at points z whose memory ends after so many samples.

        Exact in a record that is no longer, whatever the poles: there is nothing older to remember.
        """
        lost = np.linalg.matrix_power(self.transition, samples)
        if np.all(np.abs(lost) < _FORGOTTEN):
            return states
        return np.asarray(states - z[:, None] ** -float(samples) * (states @ lost.T), dtype=complex)

    def gradient(self, letter: str, power: int) -> tuple[float, Array]:
        """Direct term and row of the gradient with respect to one coefficient."""
        above = np.zeros(power + 1)
        above[power] = 1.0
        if letter == "b":
            if power == self.order:
                return 1.0, self.row(above - self.denominator, 1)
            return 0.0, self.row(above, 1)
        whole, rest = ascending.polydiv(ascending.polymul(above, self.numerator), self.denominator)
        return 0.0, -self.row(np.asarray(whole), 1) - self.row(np.asarray(rest), 2)

    def row(self, coefficients: Array, copy: int) -> Array:
        """The row that reads coefficients(s) / a^copy off the states; powers of s carry their unit."""
        row = np.zeros(2 * self.order)
        trimmed = np.asarray(coefficients, dtype=float)[: self.order]
        powers = np.arange(trimmed.size) - copy * self.order
        start = (copy - 1) * self.order
        row[start : start + trimmed.size] = trimmed * self.unit ** powers.astype(float)
        return row

    @cached_property
    def roots(self) -> ComplexArray:
        """Poles and zeros in z."""
        n = self.order
        if not n:
            return np.zeros(0, dtype=complex)
        A, b, c = self.transition[:n, :n], self.entry[:n], self.gain[:n]
        bottom = np.poly(A)
        top = np.poly(A - np.outer(b, c)) + (self.direct - 1.0) * bottom
        significant = np.abs(top) > 1e-12 * np.abs(top).max()
        top = top[int(np.argmax(significant)) :]
        return np.concatenate([np.linalg.eigvals(A), np.roots(top)]).astype(complex)


def polynomial_roots(coefficients: Array) -> ComplexArray:
    """Roots of a polynomial with ascending coefficients."""
    return np.asarray(ascending.polyroots(np.trim_zeros(coefficients, "b")), dtype=complex)
