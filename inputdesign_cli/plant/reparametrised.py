"""Any model in other parameters than its coefficients, of which some may be known, by the chain rule.

dG/dphi = sum_l dG/dtheta_l dtheta_l/dphi: all results at the parameters phi follow from the model of its
coefficients theta(phi) and the Jacobian J (K, k) of theta. Known parameters have no column in J.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.expressions import Evaluated, Expression, evaluated
from inputdesign_cli.plant.model import Derived, Fraction, Model, SampledPlant, Signals

# Number of recent parameter values that are cached with their coefficients.
_RECENT = 4


@dataclass(frozen=True)
class Parametrisation:
    """Holds m parameters, k of them `free`, and the K coefficients of a model that follow from them.

    The `labels` (m,) are their names for the user, the `symbols` (m,) their names in the `terms` (K,). The
    other `values` (m,) are known.
    """

    labels: tuple[str, ...]
    symbols: tuple[str, ...]
    values: Array
    free: NDArray[np.bool_]
    terms: tuple[Expression, ...]

    @classmethod
    def identity(cls, labels: Sequence[str], values: ArrayLike, known: Sequence[str]) -> Parametrisation:
        """Return the parametrisation by the coefficients themselves, some of them known."""
        symbols = tuple(f"p{i}" for i in range(len(labels)))
        free = np.array([label not in known for label in labels], dtype=bool)
        terms = tuple(Expression(symbol) for symbol in symbols)
        return cls(tuple(labels), symbols, np.asarray(values, dtype=float), free, terms)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Return the labels of the free parameters (k,)."""
        return tuple(label for label, free in zip(self.labels, self.free, strict=True) if free)

    @property
    def theta(self) -> Array:
        """Return the values (k,) of the parameters."""
        return self.values[self.free]

    @property
    def affine(self) -> bool:
        """Return whether every coefficient is affine in the parameters."""
        return all(term.affine for term in self.terms)

    def at(self, theta: ArrayLike) -> Parametrisation:
        """Return the parametrisation with other values (k,) of the free parameters."""
        point = np.asarray(theta, dtype=float)
        key = point.tobytes()
        if key not in self._recent:
            if len(self._recent) >= _RECENT:
                del self._recent[next(iter(self._recent))]
            values = self.values.copy()
            values[self.free] = point
            self._recent[key] = replace(self, values=values)
        return self._recent[key]

    @cached_property
    def _recent(self) -> dict[bytes, Parametrisation]:
        """Return the recent results of `at`: a search asks for the same few points again and again."""
        return {}

    @cached_property
    def coefficients(self) -> Array:
        """Return the coefficients (K,), NaN where a term is not defined."""
        return self._image.values

    @cached_property
    def jacobian(self) -> Array:
        """Return the derivatives (K, k) of the coefficients in the free parameters."""
        return self._image.gradients[:, self.free]

    @cached_property
    def moves(self) -> NDArray[np.bool_]:
        """Return whether each coefficient, as written, contains each free parameter, (K, k)."""
        listed = [[symbol in term.names for symbol in self.symbols] for term in self.terms]
        return np.array(listed, dtype=bool).reshape(len(self.terms), len(self.symbols))[:, self.free]

    @property
    def undefined(self) -> str | None:
        """Return the first term that has no value or no derivative here, or None if all have both."""
        sound = np.isfinite(self.coefficients) & np.all(np.isfinite(self.jacobian), axis=1)
        return None if np.all(sound) else self.terms[int(np.argmin(sound))].text

    @cached_property
    def _image(self) -> Evaluated:
        return evaluated(self.terms, self.symbols, self.values)


# The path to the value of a parameter in a spec as written.
Place = Sequence[str | int]


@dataclass(frozen=True)
class Words:
    """Holds a plant section with named parameters as written, so that it can be repeated with other values.

    The `plant` is None if it lists the coefficients; `places` is by label, and `known` by section.
    """

    plant: Mapping[str, object] | None = None
    places: Mapping[str, Place] = field(default_factory=dict)
    known: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Reparametrised(Derived):
    """A model whose `coefficients` follow from `parametrisation`, with k free parameters."""

    coefficients: Model
    parametrisation: Parametrisation
    words: Words = Words()

    @property
    def inner(self) -> SampledPlant:
        """Return the model of the coefficients."""
        return cast(SampledPlant, self.coefficients)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the free parameters, (k,)."""
        return self.parametrisation.names

    @property
    def theta(self) -> Array:
        """Return the values (k,) of the parameters."""
        return self.parametrisation.theta

    @property
    def flaw(self) -> str | None:
        """See `Model`."""
        undefined = self.parametrisation.undefined
        return self.coefficients.flaw if undefined is None else f"{undefined} is not defined"

    @cached_property
    def in_plant(self) -> NDArray[np.bool_]:
        """Return whether G depends on each parameter, (k,)."""
        return np.any(self.parametrisation.moves[self.coefficients.in_plant], axis=0)

    @cached_property
    def dead_times(self) -> NDArray[np.bool_]:
        """Return whether each parameter moves a dead time, (k,)."""
        return np.any(self.parametrisation.moves[self.coefficients.dead_times], axis=0)

    def bends(self, output: int, input: int) -> NDArray[np.bool_]:
        """Return whether each parameter is in a coefficient that bends, (k,); all True unless affine."""
        if not self.parametrisation.affine:
            return np.ones(len(self.names), dtype=bool)
        return np.any(self.parametrisation.moves[self.coefficients.bends(output, input)], axis=0)

    def entry_fraction(self, output: int, input: int, w: ArrayLike) -> Fraction:
        """Return one entry of G as numerator over denominator, with gradients (n, k)."""
        part, J = self.coefficients.entry_fraction(output, input, w), self.parametrisation.jacobian
        return replace(
            part,
            numerator_gradient=part.numerator_gradient @ J,
            denominator_gradient=part.denominator_gradient @ J,
        )

    def plant_gradient(self, w: ArrayLike) -> ComplexArray:
        """Return the gradient dG/dphi as (n, k, p, r)."""
        return self._chained(self.coefficients.plant_gradient(w))

    def prediction_gradient(self, w: ArrayLike, y: Signals, u: Signals, e: Signals) -> ComplexArray:
        """Return the gradient of the prediction as (n, k, p, m), see `Model`."""
        return self._chained(self.coefficients.prediction_gradient(w, y, u, e))

    def at(self, theta: ArrayLike, covariance: Array | None = None) -> Reparametrised:
        """Return the structure with parameters (k,) and, if given, noise covariance (p, p) of its own."""
        moved = self.parametrisation.at(theta)
        coefficients = self.coefficients.at(moved.coefficients, covariance)
        return replace(self, coefficients=coefficients, parametrisation=moved)

    def _chained(self, gradient: ComplexArray) -> ComplexArray:
        """Return a gradient (n, K, ..) in the coefficients as one (n, k, ..) in the parameters."""
        moved = np.moveaxis(gradient, 1, -1) @ self.parametrisation.jacobian
        return np.asarray(np.moveaxis(moved, -1, 1), dtype=complex)
