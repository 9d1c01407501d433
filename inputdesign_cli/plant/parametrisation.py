"""Coefficients of a model as functions of other parameters, of which some may be known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.expressions import Evaluated, Expression, evaluated

# Number of recent parameter values that are kept with their coefficients.
_RECENT = 4


@dataclass(frozen=True)
class Parametrisation:
    """m parameters, k of them `free`, and the K coefficients of a model that follow from them.

    Attributes:
        labels: (m,) what the user calls them; `symbols` (m,) what `terms` (K,) call them.
        values: (m,); parameters that are not free are known.
    """

    labels: tuple[str, ...]
    symbols: tuple[str, ...]
    values: Array
    free: NDArray[np.bool_]
    terms: tuple[Expression, ...]

    @classmethod
    def identity(cls, labels: Sequence[str], values: ArrayLike, known: Sequence[str]) -> Parametrisation:
        """The coefficients themselves, some of them known."""
        symbols = tuple(f"p{i}" for i in range(len(labels)))
        free = np.array([label not in known for label in labels], dtype=bool)
        terms = tuple(Expression(symbol) for symbol in symbols)
        return cls(tuple(labels), symbols, np.asarray(values, dtype=float), free, terms)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """(k,): labels of the free ones."""
        return tuple(label for label, free in zip(self.labels, self.free, strict=True) if free)

    @property
    def theta(self) -> Array:
        """(k,): values of the free ones."""
        return self.values[self.free]

    @property
    def affine(self) -> bool:
        """Whether every coefficient is affine in the parameters."""
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
        """Where `at` has been: a search asks for the same few points again and again."""
        return {}

    @cached_property
    def coefficients(self) -> Array:
        """(K,): not a number where a term is not defined."""
        return self._image.values

    @cached_property
    def jacobian(self) -> Array:
        """Return the derivatives (K, k) of the coefficients in the free parameters."""
        return self._image.gradients[:, self.free]

    @cached_property
    def moves(self) -> NDArray[np.bool_]:
        """(K, k): which coefficient is an expression in which free parameter, whatever its slope is here."""
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
