"""Model error r_u(w) <= r_adm(w) at every frequency of a band.

Least-costly paper, (6), (10) and (12): r_u = alpha sqrt(lambda_max(T P T^T)) with T the real and
imaginary parts of Lambda_G, equivalently M >= R_adm(w) = (alpha / r_adm)^2 T^T T.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.accuracy.admissible import AdmissibleError
from inputdesign_cli.accuracy.requirement import Cut, Violation
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import graded_grid, local_maxima, logarithmic_distance
from inputdesign_cli.plant.polynomial import Array, join_roots


@dataclass(frozen=True)
class ModelError:
    """The requirement for one plant (SISO); `band` in rad/sample."""

    experiment: Experiment
    admissible: AdmissibleError
    alpha: float
    band: tuple[float, float] = (0.0, np.pi)

    name = "model_error"

    @cached_property
    def grid(self) -> Array:
        """Frequencies that see every resonance of G, of r_adm and of the loop."""
        model = self.experiment.model
        plant = logarithmic_distance(join_roots([model.poles, model.zeros]))
        singular = np.concatenate([plant, self.experiment.singularities, self.admissible.singularities])
        return graded_grid(singular, *self.band, knots=self.admissible.knots)

    @cached_property
    def _grid_rows(self) -> NDArray[np.float64]:
        return self.rows(self.grid)

    def check_positive(self) -> None:
        """Raise `SpecError` (`admissible-not-positive`) unless r_adm > 0 on the whole band."""
        w, negative = local_maxima(
            lambda w: -self.admissible.at(w), self.grid, -self.admissible.at(self.grid)
        )
        scale = np.median(np.abs(self.admissible.at(self.grid)))
        bad = negative >= -1e-9 * scale
        if np.any(bad):
            at = w[bad][int(np.argmax(negative[bad]))]
            raise bad_spec(
                "admissible-not-positive",
                f"the admissible error is not positive at {at:.6g} rad/sample: no model can be that good",
                hint="restrict `band` to the frequencies that matter, or loosen the requirement there "
                "(a relative bound vanishes where G does; a sensitivity bound where |W S| already reaches 1)",
                key="accuracy.model_error",
            )

    def rows(self, w: ArrayLike) -> NDArray[np.float64]:
        """(n, 2, k): V(w)^T = (alpha / r_adm) T, so that the requirement reads M >= V V^T."""
        gradient = self.experiment.plant_gradient(w)
        scale = self.alpha / self.admissible.at(w)
        return np.stack([gradient.real, gradient.imag], axis=1) * scale[:, None, None]

    def ratios(self, information: Array, frequencies: Array) -> Array:
        """r_u / r_adm (n,) at given frequencies."""
        return _largest_singular(information, self.rows(frequencies))

    def error_bound(self, information: Array, w: ArrayLike) -> Array:
        """r_u (n,) at frequencies `w`, inside or outside the band."""
        gradient = self.experiment.plant_gradient(w)
        return self.alpha * _largest_singular(information, np.stack([gradient.real, gradient.imag], axis=1))

    def violations(self, information: Array, *, above: float = -np.inf) -> list[Violation]:
        """Local maxima of r_u / r_adm over the band, polished between the grid points."""
        factor = _inverse_factor(information)
        on_grid = _norms(factor, self._grid_rows)
        w, ratio = local_maxima(lambda w: _norms(factor, self.rows(w)), self.grid, on_grid, above=above)
        return [Violation(float(r), float(at)) for at, r in zip(w, ratio, strict=True)]

    def cut(self, frequency: float | None) -> Cut:
        """M >= R_adm at this frequency."""
        return Cut(self.rows(np.array([frequency]))[0].T, frequency)


def _inverse_factor(information: Array) -> Array:
    """K (k, k) with K^T K = M^-1."""
    return np.linalg.inv(np.linalg.cholesky(information))


def _norms(factor: Array, rows: NDArray[np.float64]) -> Array:
    """sqrt(lambda_max(V^T M^-1 V)) (n,) for rows V^T (n, 2, k), by the closed form for 2 x 2."""
    real, imaginary = rows[:, 0] @ factor.T, rows[:, 1] @ factor.T
    a, d = np.einsum("ni,ni->n", real, real), np.einsum("ni,ni->n", imaginary, imaginary)
    b = np.einsum("ni,ni->n", real, imaginary)
    return np.sqrt(0.5 * (a + d) + np.hypot(0.5 * (a - d), b))


def _largest_singular(information: Array, rows: NDArray[np.float64]) -> Array:
    return _norms(_inverse_factor(information), rows)
