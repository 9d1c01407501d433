"""Transfer matrices in s.

[mohan-spectral], (1)-(2): G_ij = sum_k b_ij^(k) s^k / sum_k a_ij^(k) s^k; the denominators are monic.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.polynomial import polynomial as ascending
from numpy.typing import ArrayLike

from inputdesign_cli.plant.held import polynomial_roots
from inputdesign_cli.plant.intersample import Intersample
from inputdesign_cli.plant.model import Fraction, Parameter, Parametrised, WhiteNoise, entry_label
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.plant.polynomial_model import Rows


@dataclass(frozen=True)
class ContinuousModel(Parametrised, WhiteNoise):
    """A stable transfer matrix in s with white noise of a full covariance (p, p) on its sampled outputs.

    `numerator` and `denominator` hold ascending coefficients, those of s^0 first; denominators are
    monic. With `common` all entries share one denominator and its parameters.

    Parameters are named after their power of s: `b0[2,1]` is the constant of the numerator of entry
    (2, 1), `a1[2,1]` the coefficient of s in its denominator; `a1` of a common one, and without
    brackets for one input and output. Numerator coefficients are free up to the highest nonzero one; an
    entry that is zero has no parameters.
    """

    numerator: Rows
    denominator: Rows
    covariance: Array
    common: bool = False

    continuous = True

    @classmethod
    def monic(
        cls, numerator: Rows, denominator: Rows, covariance: Array, *, common: bool = False
    ) -> ContinuousModel:
        """From any coefficients: trailing zeros dropped, each entry divided by its leading coefficient."""
        low, high = [], []
        for top, bottom in zip(numerator, denominator, strict=True):
            bottoms = [np.trim_zeros(np.asarray(b, dtype=float), "b") for b in bottom]
            high.append(tuple(b / b[-1] for b in bottoms))
            low.append(
                tuple(
                    np.trim_zeros(np.asarray(t, dtype=float), "b") / b[-1] if np.any(t) else np.zeros(1)
                    for t, b in zip(top, bottoms, strict=True)
                )
            )
        return cls(tuple(low), tuple(high), covariance, common)

    @property
    def outputs(self) -> int:
        """Number of outputs p."""
        return len(self.numerator)

    @property
    def inputs(self) -> int:
        """Number of inputs r."""
        return len(self.numerator[0])

    @cached_property
    def active(self) -> tuple[tuple[int, int], ...]:
        """The entries that are not zero."""
        places = ((i, j) for i in range(self.outputs) for j in range(self.inputs))
        return tuple((i, j) for i, j in places if np.any(self.numerator[i][j]))

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Numerator coefficients entry by entry, then those of the denominators."""
        single = self.outputs == self.inputs == 1
        found = [
            Parameter("b", power, ((i, j),), entry_label(i, j, single=single), float(value))
            for i, j in self.active
            for power, value in enumerate(self.numerator[i][j])
        ]
        groups = [self.active] if self.common else [(place,) for place in self.active]
        for places in groups:
            i, j = places[0]
            label = "" if self.common else entry_label(i, j, single=single)
            found += [
                Parameter("a", power, places, label, float(value))
                for power, value in enumerate(self.denominator[i][j][:-1])
            ]
        return tuple(found)

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> ContinuousModel:
        """The same structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""
        above = [[entry.copy() for entry in row] for row in self.numerator]
        below = [[entry.copy() for entry in row] for row in self.denominator]
        for parameter, value in zip(self.parameters, np.asarray(theta, dtype=float), strict=True):
            for i, j in parameter.places:
                (above if parameter.letter == "b" else below)[i][j][parameter.power] = value
        return ContinuousModel(
            tuple(map(tuple, above)),
            tuple(map(tuple, below)),
            self.covariance if covariance is None else covariance,
            self.common,
        )

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """What the interpolation of u (.., n, r) within its band causes (.., n, p), and e itself."""
        return self.driven(u, Intersample(step, hold=False)), e

    def driven(self, u: Array, intersample: Intersample) -> Array:
        """What samples u (.., n, r) cause at the outputs (.., n, p), from rest."""
        y = np.zeros((*u.shape[:-1], self.outputs))
        for i, j in self.active:
            entry = intersample.entry(self.numerator[i][j], self.denominator[i][j])
            y[..., i] += intersample.caused(entry, u[..., j])
        return y

    @cached_property
    def poles(self) -> ComplexArray:
        """Poles in s of all entries."""
        parts = [polynomial_roots(self.denominator[i][j]) for i, j in self.active]
        return np.concatenate(parts)

    @cached_property
    def singularities(self) -> ComplexArray:
        """Poles of G and of all gradients, as points of the frequency plane."""
        return _frequency_plane(self.poles)

    def entry_singularities(self, output: int, input: int) -> ComplexArray:
        """Poles and zeros of one entry of G, as points of the frequency plane."""
        return _frequency_plane(
            np.concatenate([polynomial_roots(p[output][input]) for p in (self.numerator, self.denominator)])
        )

    def is_fraction(self, output: int, input: int) -> bool:
        """Whether numerator and denominator of an entry are affine in theta: always."""
        return True

    def entry_fraction(self, output: int, input: int, w: ArrayLike) -> Fraction:
        """One entry of G as numerator over denominator, gradients (n, k)."""
        s = 1j * np.asarray(w, dtype=float)
        above = np.zeros((s.size, len(self.parameters)), dtype=complex)
        below = np.zeros_like(above)
        for index, parameter in enumerate(self.parameters):
            if (output, input) in parameter.places:
                gradient = above if parameter.letter == "b" else below
                gradient[:, index] = s**parameter.power
        numerator = np.asarray(ascending.polyval(s, self.numerator[output][input]), dtype=complex)
        return Fraction(numerator, self._below(s, output, input), above, below)

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """G (n, p, r)."""
        s = 1j * np.asarray(w, dtype=float)
        G = np.zeros((s.size, self.outputs, self.inputs), dtype=complex)
        for i, j in self.active:
            G[:, i, j] = ascending.polyval(s, self.numerator[i][j]) / self._below(s, i, j)
        return G

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """dG/dtheta (n, k, p, r)."""
        s = 1j * np.asarray(w, dtype=float)
        gradient = np.zeros((s.size, len(self.parameters), self.outputs, self.inputs), dtype=complex)
        for index, parameter in enumerate(self.parameters):
            for i, j in parameter.places:
                below = self._below(s, i, j)
                factor = 1.0 / below
                if parameter.letter == "a":
                    factor = -ascending.polyval(s, self.numerator[i][j]) * factor / below
                gradient[:, index, i, j] = factor * s**parameter.power
        return gradient

    def _below(self, s: ComplexArray, i: int, j: int) -> ComplexArray:
        return np.asarray(ascending.polyval(s, self.denominator[i][j]), dtype=complex)


def _frequency_plane(poles: ComplexArray) -> ComplexArray:
    """Poles in s as frequency + j damping."""
    return np.abs(poles.imag) + 1j * np.abs(poles.real)
