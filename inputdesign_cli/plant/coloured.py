"""Add coloured noise, by polynomials in q^-1, or drift to any model.

With H = H0 C / (D (1 - q^-1)) the prediction errors of output i are the model's, filtered once more:
epsilon_i = (D_i (1 - q^-1) / C_i) epsilon0_i ([ljung-1999], Section 4.2). The integrator is known and has no
parameter, so that it is no more than this filter: signals are differenced, and noise is summed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar, cast

import numpy as np
from numpy.polynomial.polynomial import polyval
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.frequencies import logarithmic_distance
from inputdesign_cli.plant.loop import BESIDE, INTEGRATES, beside_zero
from inputdesign_cli.plant.model import (
    Derived,
    Fraction,
    Listed,
    Parameter,
    Parametrised,
    SampledPlant,
    Signals,
    row_parameters,
    tables_at,
)
from inputdesign_cli.plant.polynomial import all_roots

_T = TypeVar("_T")
_ONE = (np.ones(1),)
_DIFFERENCE = np.array([1.0, -1.0])


@dataclass(frozen=True)
class Coloured(Parametrised, Derived):
    """A model `plant` with H0 whose noise is filtered by C_i / (D_i Delta_i); H0 is diagonal.

    C and D are monic, one common to all outputs or one an output; their coefficients are the last parameters.
    A D that is `held` is known: it may have roots on the unit circle, and its gradient counts as zero. If the
    noise `drift`s, it integrates: Delta = 1 - q^-1.
    """

    plant: Listed
    C: tuple[Array, ...] = _ONE
    D: tuple[Array, ...] = _ONE
    held: tuple[bool, ...] = (False,)
    drift: tuple[bool, ...] = (False,)

    @property
    def inner(self) -> SampledPlant:
        """Return the wrapped plant, whose noise this noise replaces."""
        return cast(SampledPlant, self.plant)

    @cached_property
    def own_parameters(self) -> tuple[Parameter, ...]:
        """Return the coefficients of C and D."""
        return tuple(
            one
            for letter, rows in (("c", self.C), ("d", self.D))
            for one in row_parameters(letter, rows, self.outputs, self.inputs)
        )

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters of the plant, then the coefficients of C and D."""
        return (*self.plant.parameters, *self.own_parameters)

    @cached_property
    def in_plant(self) -> NDArray[np.bool_]:
        """Return whether G depends on each parameter, (k,)."""
        return np.concatenate([self.plant.in_plant, np.zeros(len(self.own_parameters), dtype=bool)])

    @cached_property
    def fixed(self) -> tuple[Array, ...]:
        """Return the known polynomial in the noise filter of each output: D where it is held, and Delta."""
        return tuple(
            np.convolve(d if held else np.ones(1), _DIFFERENCE if drifts else np.ones(1))
            for d, held, drifts in zip(*map(self._per_output, (self.D, self.held, self.drift)), strict=True)
        )

    @cached_property
    def inverse_filters(self) -> tuple[tuple[Array, Array], ...]:
        """Return D Delta and C of each output: their quotient filters the prediction errors of the plant."""
        return tuple(
            (np.convolve(d, _DIFFERENCE if drifts else np.ones(1)), c)
            for d, drifts, c in zip(*map(self._per_output, (self.D, self.drift, self.C)), strict=True)
        )

    def _per_output(self, rows: Sequence[_T]) -> Sequence[_T]:
        return tuple(rows) * self.outputs if len(rows) == 1 else rows

    @cached_property
    def estimated_roots(self) -> ComplexArray:
        """Return the roots in z of C and of the estimated parts of D."""
        free = [d for d, held in zip(self.D, self.held, strict=True) if not held]
        return all_roots([*self.C, *free])

    @property
    def integrates(self) -> bool:
        """Return whether some noise has infinite power at frequency zero."""
        return any(abs(np.sum(p)) < 1e-9 for p in self.fixed)

    @property
    def radius(self) -> float:
        """See `Model`; known parts of the noise, for example an integrator, do not count."""
        return max(self.plant.radius, float(np.abs(self.estimated_roots).max(initial=0.0)))

    @property
    def memory(self) -> float:
        """See `Model`."""
        return self.plant.memory + max(above.size + below.size for above, below in self.inverse_filters)

    @cached_property
    def singularities(self) -> ComplexArray:
        """Return the poles of G and of all gradients, as points of the frequency plane."""
        return np.concatenate([self.plant.singularities, logarithmic_distance(self.estimated_roots)])

    @property
    def predictor_poles(self) -> ComplexArray:
        """See `SampledPlant`."""
        return np.concatenate([self.inner.predictor_poles, self.estimated_roots])

    def bends(self, output: int, input: int) -> NDArray[np.bool_]:
        """Return `bends` (k,) of the plant, and False for the coefficients of C and D."""
        return np.concatenate(
            [self.plant.bends(output, input), np.zeros(len(self.own_parameters), dtype=bool)]
        )

    def entry_fraction(self, output: int, input: int, w: ArrayLike) -> Fraction:
        """Return the fraction of the plant; it does not depend on C and D."""
        part = self.plant.entry_fraction(output, input, w)
        none = np.zeros((len(part.numerator), len(self.own_parameters)), dtype=complex)
        return replace(
            part,
            numerator_gradient=np.concatenate([part.numerator_gradient, none], axis=1),
            denominator_gradient=np.concatenate([part.denominator_gradient, none], axis=1),
        )

    def plant_at(self, w: ArrayLike) -> ComplexArray:
        """Return the frequency response G as (n, p, r)."""
        return self.plant.plant_at(self._beside_zero(w))

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the gradient dG/dtheta as (n, k, p, r)."""
        return self._with_own(self.plant.plant_gradient(self._beside_zero(w)))

    @cached_property
    def _nearest(self) -> float:
        """Return the frequency below which responses are held; zero unless plant and noise integrate.

        The inverse noise filter has a zero where the plant has its pole: their product is finite.
        """
        near = np.abs(self.plant.singularities)
        if not self.integrates or np.all(near > INTEGRATES):
            return 0.0
        return BESIDE * float(
            np.min(np.abs(self.singularities)[np.abs(self.singularities) > INTEGRATES], initial=1.0)
        )

    def _beside_zero(self, w: ArrayLike) -> Array | ComplexArray:
        return beside_zero(w, self._nearest)

    def _inverse_at(self, w: ArrayLike) -> ComplexArray:
        q = np.exp(-1j * np.asarray(w))
        return np.stack([polyval(q, a) / polyval(q, b) for a, b in self.inverse_filters], axis=-1)

    def prediction_gradient(self, w: ArrayLike, y: Signals, u: Signals, e: Signals) -> ComplexArray:
        """Return the gradient of the prediction as (n, k, p, m), see `Model`."""
        if y is None and u is None:
            return self._with_own(self.plant.prediction_gradient(w, None, None, e), w, e)
        at = self._beside_zero(w) if y is None else w
        none = None if y is None or e is None else np.zeros_like(e)
        of_signals = self.plant.prediction_gradient(at, y, u, none) * self._inverse_at(at)[:, None, :, None]
        if y is None or u is None:
            return self._with_own(of_signals)
        of_errors = self.plant.prediction_gradient(w, np.zeros_like(y), np.zeros_like(u), e)
        return self._with_own(of_signals + of_errors, w, e)

    def _with_own(
        self, of_plant: ComplexArray, w: ArrayLike | None = None, e: Signals = None
    ) -> ComplexArray:
        """Return a gradient (n, k, p, m): that of the plant, then the slopes in C and D by e (n, p, m)."""
        shape = (len(of_plant), len(self.own_parameters), *of_plant.shape[2:])
        own = np.zeros(shape, dtype=complex)
        if w is not None and e is not None:
            q = np.exp(-1j * np.asarray(w))
            for index, parameter in enumerate(self.own_parameters):
                for i, _ in parameter.places:
                    below, sign = self.below(parameter.letter, i)
                    if below is not None:
                        factor = sign * q**parameter.power / polyval(q, below)
                        own[:, index, i] = factor[:, None] * e[:, i]
        return np.concatenate([of_plant, own], axis=1)

    def below(self, letter: str, output: int) -> tuple[Array | None, float]:
        """Return C or D of an output, and the sign of its gradient; None for a D that is held."""
        if letter == "c":
            return self._per_output(self.C)[output], 1.0
        return None if self._per_output(self.held)[output] else self._per_output(self.D)[output], -1.0

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> Coloured:
        """Return the structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""
        first, values = len(self.plant.parameters), np.asarray(theta, dtype=float)
        plant = self.plant.at(values[:first], covariance)
        tables = tables_at(self.own_parameters, values[first:], {"c": self.C, "d": self.D})
        return replace(self, plant=plant, C=tables["c"], D=tables["d"])

    def shaped(self, e: Array) -> Array:
        """Return e (.., n, p) filtered by C / (D Delta), from rest."""
        shaped = [filtered(b, a, e[..., i]) for i, (a, b) in enumerate(self.inverse_filters)]
        return np.stack(shaped, axis=-1)

    def simulate(self, u: Array, e: Array, step: float) -> tuple[Array, Array]:
        """Return the outputs (.., n, p) that u (.., n, r) and e (.., n, p) cause, each from rest."""
        return self.plant.simulate(u, self.shaped(e), step)

    def forcing_at(self, w: ArrayLike) -> ComplexArray:
        """See `SampledPlant`."""
        return self.inner.forcing_at(w) / self._inverse_at(w)[:, None, :]

    def forcing(self, e: Array) -> Array:
        """See `SampledPlant`."""
        return self.inner.forcing(self.shaped(e))
