"""Model error r_u(w) <= r_adm(w) at every frequency of a band.

Least-costly paper, (6), (10) and (12): r_u = alpha sqrt(lambda_max(T P T^T)) with T the real and
imaginary parts of Lambda_G, equivalently M >= R_adm(w) = (alpha / r_adm)^2 T^T T.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.accuracy.admissible import AdmissibleError
from inputdesign_cli.accuracy.cuts import MatrixCut
from inputdesign_cli.accuracy.over_frequency import OverFrequency
from inputdesign_cli.accuracy.requirement import inverse_factor
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import local_maxima
from inputdesign_cli.plant.polynomial import Array, ComplexArray


@dataclass(frozen=True)
class ModelError(OverFrequency):
    """The requirement for one plant (SISO); `band` in rad/sample."""

    experiment: Experiment
    admissible: AdmissibleError
    alpha: float
    band: tuple[float, float] = (0.0, np.pi)

    name = "model_error"

    @property
    def knots(self) -> Array:  # type: ignore[override]
        return self.admissible.knots

    @property
    def own_singularities(self) -> ComplexArray:
        return self.admissible.singularities

    def check_positive(self) -> None:
        """Raise `SpecError` (`admissible-not-positive`) unless r_adm > 0 on the whole band."""
        check_positive(self.admissible, self.grid)

    def rows(self, w: ArrayLike) -> NDArray[np.float64]:
        """(n, 2, k): V(w)^T = (alpha / r_adm) T, so that the requirement reads M >= V V^T."""
        return (
            real_rows(self.experiment.plant_gradient(w)) * (self.alpha / self.admissible.at(w))[:, None, None]
        )

    def measure(self, half: NDArray[np.float64], w: Array) -> Array:
        """r_u / r_adm."""
        return row_norms(half)

    def error_bound(self, information: Array, w: ArrayLike) -> Array:
        """r_u (n,) at frequencies `w`, inside or outside the band."""
        return error_bound(self.experiment, information, self.alpha, w)

    def cut(self, frequency: float | None) -> MatrixCut:
        """M >= R_adm at this frequency."""
        rows = self.rows(np.array([frequency]))[0]
        return MatrixCut(rows.T @ rows, frequency)


def check_positive(
    admissible: AdmissibleError, grid: Array, *, unit: float = 1.0, named: str = "rad/sample"
) -> None:
    """Raise `SpecError` (`admissible-not-positive`) unless r_adm > 0 between the ends of the `grid`.

    The diagnostic tells the frequency divided by `unit`, in the unit `named`.
    """
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


def error_bound(experiment: Experiment, information: Array, alpha: float, w: ArrayLike) -> Array:
    """r_u (n,) at frequencies `w`: the radius of the confidence ellipse of G, to first order."""
    rows = real_rows(experiment.plant_gradient(w))
    return alpha * row_norms(rows @ inverse_factor(information).T)


def real_rows(gradient: ComplexArray) -> NDArray[np.float64]:
    """(n, k) complex -> (n, 2, k): real and imaginary parts."""
    return np.stack([gradient.real, gradient.imag], axis=1)


def row_norms(half: NDArray[np.float64]) -> Array:
    """Largest singular values (n,) of (n, 2, k), by the closed form for two rows."""
    real, imaginary = half[:, 0], half[:, 1]
    a, d = np.einsum("ni,ni->n", real, real), np.einsum("ni,ni->n", imaginary, imaginary)
    b = np.einsum("ni,ni->n", real, imaginary)
    return np.sqrt(0.5 * (a + d) + np.hypot(0.5 * (a - d), b))
