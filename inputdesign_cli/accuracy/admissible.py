"""The admissible model error r_adm(w), in the four forms in which a designer states it.

Frequencies are in rad/sample throughout. `singularities` are the points of the frequency plane
near which r_adm changes fast, `knots` the frequencies at which it may have a kink.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.accuracy.continuous_weight import ContinuousWeight, weight_singularities
from inputdesign_cli.plant import Loop, PolynomialModel, Rational, logarithmic_distance
from inputdesign_cli.plant.polynomial import Array, ComplexArray, join_roots, roots_in_z

_NOWHERE = np.zeros(0)
# Where the weight vanishes the requirement is void; a large finite r_adm says so without an infinity.
_NO_WEIGHT = 1e-12


class AdmissibleError(Protocol):
    """r_adm over frequency."""

    @property
    def singularities(self) -> ComplexArray: ...

    @property
    def knots(self) -> Array: ...

    def at(self, w: ArrayLike) -> Array:
        """r_adm (n,) at frequencies `w` (n,)."""
        ...


@dataclass(frozen=True)
class Relative:
    """r_adm = fraction |G|."""

    model: PolynomialModel
    fraction: float
    knots = _NOWHERE

    @cached_property
    def singularities(self) -> ComplexArray:
        return logarithmic_distance(join_roots([self.model.poles, self.model.zeros]))

    def at(self, w: ArrayLike) -> Array:
        return self.fraction * np.abs(self.model.plant_at(w))


@dataclass(frozen=True)
class Absolute:
    """r_adm = level, in the units of G."""

    level: float
    knots = _NOWHERE
    singularities = _NOWHERE.astype(complex)

    def at(self, w: ArrayLike) -> Array:
        return np.full(np.shape(w), self.level)


@dataclass(frozen=True)
class Table:
    """r_adm interpolated between given points, linearly in (log frequency, log r_adm).

    At frequency zero, and below the first point if that stands at zero, the first value holds.
    """

    frequency: Array  # (n,) ascending, rad/sample
    value: Array  # (n,) positive
    singularities = _NOWHERE.astype(complex)

    @property
    def knots(self) -> Array:
        return self.frequency

    def at(self, w: ArrayLike) -> Array:
        tiny = 1e-12
        x = np.log(np.maximum(self.frequency, tiny))
        return np.exp(np.interp(np.log(np.maximum(np.asarray(w, dtype=float), tiny)), x, np.log(self.value)))


@dataclass(frozen=True)
class Sensitivity:
    """r_adm = (|1 + C G| - |W|) / |C|: then |W S| <= 1 for every plant within r_adm of G.

    By the reverse triangle inequality |1 + C G'| >= |1 + C G| - |C| |G' - G| >= |W|. Multiplied
    through with the controller's denominator, so that its slow poles do no harm.
    """

    model: PolynomialModel
    controller: Rational
    weight: Rational

    knots = _NOWHERE

    @cached_property
    def singularities(self) -> ComplexArray:
        return logarithmic_distance(
            join_roots(
                [
                    roots_in_z(Loop(self.model, self.controller).characteristic),
                    self.model.poles,
                    self.controller.poles,
                    self.controller.zeros,
                    self.weight.poles,
                    self.weight.zeros,
                ]
            )
        )

    def at(self, w: ArrayLike) -> Array:
        numerator, denominator = self.controller.numerator_at(w), self.controller.denominator_at(w)
        room = np.abs(denominator + numerator * self.model.plant_at(w))
        used = np.abs(self.weight.at(w)) * np.abs(denominator)
        return (room - used) / np.abs(numerator)


@dataclass(frozen=True)
class Weighted:
    """r_adm / |W|, so that |W| r_u stays below r_adm."""

    inner: AdmissibleError
    weight: Rational | ContinuousWeight

    @property
    def knots(self) -> Array:
        return self.inner.knots

    @cached_property
    def singularities(self) -> ComplexArray:
        return np.concatenate([self.inner.singularities, weight_singularities(self.weight)])

    def at(self, w: ArrayLike) -> Array:
        return self.inner.at(w) / np.maximum(np.abs(self.weight.at(w)), _NO_WEIGHT)
