"""Requirements on the information matrix as a whole: it exceeds another, or D, A, E or T reach the level one.

The best criterion within limits and the least multiple of the limits at which the criterion reaches one
are the same problem, since all four grow in proportion when M does (in the forms below).

The criterion is that of G M G^T with G = `scaling` (k, k), nonsingular: raw parameters, or parameters
relative to their nominal values.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import scipy

from inputdesign_cli.accuracy.cuts import Cut, DeterminantCut, MatrixCut, TraceCut, VarianceCut
from inputdesign_cli.accuracy.requirement import OneCondition, Requirement, inverse_factor
from inputdesign_cli.arrays import Array


@dataclass(frozen=True)
class InformationTarget(OneCondition):
    """The requirement M >= `target` (k, k, symmetric), in the coordinates of the experiment.

    This covers `information` itself, the standard deviation s of a parameter (e e^T / s^2) and
    application-oriented accuracy, (chi2 gamma / 2) V'': then the confidence ellipsoid lies where the cost of
    the application, to second order, is below 1 / gamma ([annergren-larsson-2016]).
    """

    target: Array
    label: str = "information"

    @property
    def name(self) -> str:
        """Return `information`, `application` or `standard_deviation of` a parameter."""
        return self.label

    def ratio(self, information: Array) -> float:
        """Return the square root of the largest eigenvalue of the target relative to M."""
        K = inverse_factor(information)
        return float(np.sqrt(max(np.linalg.eigvalsh(K @ self.target @ K.T)[-1], 0.0)))

    def cut(self, frequency: float | None) -> MatrixCut:
        """Return the requirement itself as a cut."""
        return MatrixCut(self.target)


Letter = Literal["D", "A", "E", "T"]


@dataclass(frozen=True)
class Criterion(OneCondition):
    """The condition (det M)^{1/k}, 1 / tr(M^-1), lambda_min(M) or tr(M) >= 1, M standing for G M G^T."""

    letter: Letter
    scaling: Array

    @property
    def name(self) -> str:
        """Return `criterion` and its letter, for reports."""
        return f"criterion {self.letter}"

    @property
    def definite(self) -> bool:
        """Return whether the criterion has no value where M is singular: all but T."""
        return self.letter != "T"

    @cached_property
    def _inverse(self) -> Array:
        return np.asarray(np.linalg.inv(self.scaling), dtype=float)

    @cached_property
    def _gain(self) -> float:
        """Return the factor (det G)^{2/k}."""
        return float(np.exp(2.0 * np.linalg.slogdet(self.scaling)[1] / len(self.scaling)))

    def level(self, information: Array) -> float:
        """Return the quantity that must reach one; 0 where M is singular, except for T."""
        if self.letter == "T":
            return float(np.sum(self.scaling * (self.scaling @ information)))
        try:
            factor = np.linalg.cholesky(information)
        except np.linalg.LinAlgError:
            return 0.0
        if self.letter == "D":
            return self._gain * float(np.exp(2.0 * np.log(np.diag(factor)).mean()))
        half = scipy.linalg.solve_triangular(factor, self._inverse, lower=True)
        singular = np.linalg.svd(half, compute_uv=False)
        return float(1.0 / np.sum(singular**2) if self.letter == "A" else 1.0 / singular[0] ** 2)

    def value(self, level: float) -> float:
        """Return the criterion in its textbook form: log det M, -tr M^-1, lambda_min(M) or tr M."""
        if self.letter == "D":
            return len(self.scaling) * float(np.log(level))
        return -1.0 / level if self.letter == "A" else level

    def ratio(self, information: Array) -> float:
        """Return the ratio 1 / sqrt(level)."""
        level = self.level(information)
        return float(1.0 / np.sqrt(level)) if level > 0 else np.inf

    def cut(self, frequency: float | None) -> Cut:
        """Return the criterion itself, as a cone."""
        if self.letter == "D":
            return DeterminantCut(1.0 / self._gain)
        if self.letter == "A":
            return VarianceCut(self._inverse)
        if self.letter == "E":
            return MatrixCut(self._inverse @ self._inverse.T)
        return TraceCut(self.scaling.T @ self.scaling)


def criterion_of(requirements: Sequence[Requirement]) -> Criterion | None:
    """Return the criterion to be maximised, which is then the only requirement, or None."""
    first = requirements[0] if requirements else None
    return first if isinstance(first, Criterion) else None
