"""Model error r_u(w) <= r_adm(w) at every frequency of a band, of one entry of G or of its norm.

[bombois-least-costly], (6), (10) and (12): r_u = alpha sqrt(lambda_max(T P T^T)) with T the real and
imaginary parts of the gradient of the entry, equivalently M >= R_adm(w) = (alpha / r_adm)^2 T^T T. With the
gradients of all entries in T, r_u bounds the Frobenius norm of the error of G over the confidence ellipsoid,
to first order, and with it the largest singular value, which is what a sensitivity asks for.

Entries that are held to bounds of their own share the confidence factor alpha of all parameters of G, so
that all of them hold at once with that probability.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.accuracy.admissible import AdmissibleError
from inputdesign_cli.accuracy.cuts import MatrixCut
from inputdesign_cli.accuracy.requirement import (
    OverFrequency,
    Requirement,
    inverse_factor,
    largest_singular,
    turned,
)
from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.plant import local_maxima


@dataclass(frozen=True, kw_only=True)
class OnModelError(OverFrequency):
    """Holds the common part of requirements on a model error: r_adm, alpha, and r_u to first order."""

    admissible: AdmissibleError
    alpha: float

    @property
    def name(self) -> str:
        """Return the name `model_error`."""
        return "model_error"

    @property
    def knots(self) -> Array:
        """Return the knots of r_adm."""
        return self.admissible.knots

    @property
    def own_singularities(self) -> ComplexArray:
        """Return the singularities of r_adm."""
        return self.admissible.singularities

    def weight_at(self, w: ArrayLike) -> Array:
        """Return alpha / r_adm: with V(w)^T = (alpha / r_adm) T the requirement reads M >= V V^T."""
        return self.alpha / self.admissible.at(w)

    def error_bound(self, information: Array, w: ArrayLike) -> Array:
        """Return r_u (n,) at frequencies `w`, inside or outside the band, to first order."""
        return self.alpha * largest_singular(turned(self.plant_rows(w), inverse_factor(information).T))


@dataclass(frozen=True, kw_only=True)
class ModelError(OnModelError):
    """The requirement on the model error to first order."""

    def cut(self, frequency: float | None) -> MatrixCut:
        """Return the cut M >= R_adm at this frequency."""
        rows = self.rows(np.array([frequency]))[0]
        return MatrixCut(rows.T @ rows, frequency)


def model_errors(requirements: Iterable[Requirement]) -> list[OnModelError]:
    """Return the requirements that bound a model error; bound.csv shows them."""
    return [requirement for requirement in requirements if isinstance(requirement, OnModelError)]


def check_positive(admissible: AdmissibleError, grid: Array, *, unit: float, named: str) -> None:
    """Raise `SpecError` (`admissible-not-positive`) unless r_adm > 0 between the ends of the `grid`.

    The message states the frequency divided by `unit`, in the unit `named`.
    """
    if not np.any(admissible.at(grid)):
        raise bad_spec(
            "admissible-not-positive",
            "the admissible error is zero at every frequency: no model can be that good",
            hint="an entry of G that is zero at the nominal parameters has no relative error: ask for an "
            "absolute one, or for that of the norm (norm: frobenius)",
            key="accuracy.model_error",
        )
    w, negative = local_maxima(lambda w: -admissible.at(w), grid, -admissible.at(grid))
    scale = np.median(np.abs(admissible.at(grid)))
    bad = negative >= -1e-9 * scale
    if np.any(bad):
        at = w[bad][int(np.argmax(negative[bad]))]
        raise bad_spec(
            "admissible-not-positive",
            f"the admissible error is not positive at {at / unit:.6g} {named}: no model can be that good",
            hint="restrict `band` to the frequencies that matter, or loosen the requirement there "
            "(a relative bound vanishes where G does; a sensitivity bound where |W S| already reaches 1)",
            key="accuracy.model_error",
        )
