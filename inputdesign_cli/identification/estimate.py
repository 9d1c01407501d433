"""One record -> one model: theta with its covariance, the noise variance, and how far to trust them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.signal
from numpy.typing import ArrayLike

from inputdesign_cli.identification.checks import (
    check_length,
    check_noisy,
    check_varying,
    covariance_of,
    fit_percent,
)
from inputdesign_cli.identification.predictor import prediction_errors
from inputdesign_cli.identification.problem import PredictionErrors
from inputdesign_cli.identification.residual_tests import ResidualTest, cross_correlation, whiteness
from inputdesign_cli.identification.search import best_run, minimise
from inputdesign_cli.identification.starts import starting_points
from inputdesign_cli.identification.structure import Structure
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.plant.polynomial import Array


@dataclass(frozen=True)
class Estimate:
    """A prediction-error estimate.

    Attributes:
        theta, names: (k,).
        covariance, information: (k, k) of theta; they are inverse to each other.
        variance: of e.
        errors: (samples,) prediction errors at theta.
        converged: whether the search settled; `steps` that it took, from the best of `starts`.
        fit: per cent of the rms of y (its mean taken off) that the model's simulation explains; None where
            the plant is unstable and cannot be simulated.
        whiteness, independence: of the residuals, and of residuals and past inputs.
    """

    structure: Structure
    theta: Array
    covariance: Array
    information: Array
    variance: float
    errors: Array
    converged: bool
    steps: int
    starts: int
    fit: float | None
    whiteness: ResidualTest
    independence: ResidualTest

    @property
    def names(self) -> tuple[str, ...]:
        return self.structure.names

    @property
    def model(self) -> PolynomialModel:
        """The estimate as a model."""
        return self.structure.model(self.theta, self.variance)


def identify(
    structure: Structure,
    u: ArrayLike,
    y: ArrayLike,
    *,
    start: ArrayLike | None = None,
    feedback: bool = False,
) -> Estimate:
    """Prediction-error estimate from one record (samples,); in closed loop the direct method.

    Several starts are tried, `start` (k,) among them if given, and the least cost wins. A model without
    C, D and F (ARX) is linear in its parameters: every start leads to the least-squares solution.
    With `feedback` the residuals' test of past inputs leaves out u(t), which answers y(t).

    Raises:
        SpecError: `too-few-samples`, `constant-input` or `not-exciting`.
    """
    u, y = np.asarray(u, dtype=float), np.asarray(y, dtype=float)
    check_length(y.size, structure.size, structure.row.memory)
    check_varying(structure.names, u[:, None], y[:, None])
    record = PredictionErrors.single(structure.row, [u[:, None]], y[:, None])
    points = starting_points(structure.row, [u], y)
    if start is not None:
        points = np.concatenate([np.asarray(start, dtype=float)[None], points])
    found = minimise(record.repeated(len(points)), points)
    best = best_run(found)
    theta = found.theta[best]
    errors = prediction_errors(structure.row, theta[None], record.u, record.y[0])[:, 0]
    variance = float(errors @ errors) / (y.size - structure.size)
    check_noisy(np.array([variance]), y[:, None])
    information = found.hessian[best] / variance
    return Estimate(
        structure=structure,
        theta=theta,
        covariance=covariance_of(structure.names, information),
        information=information,
        variance=variance,
        errors=errors,
        converged=bool(found.converged[best]),
        steps=int(found.steps[best]),
        starts=len(points),
        fit=_fit(structure, theta, u, y),
        whiteness=whiteness(errors, fitted=structure.a + structure.c + structure.d),
        independence=cross_correlation(
            errors, u, fitted=structure.b + 1 - structure.delay + structure.f, feedback=feedback
        ),
    )


def _fit(structure: Structure, theta: Array, u: Array, y: Array) -> float | None:
    model = structure.model(theta, 1.0)
    denominator = np.convolve(model.A, model.F)
    if np.any(np.abs(model.poles) >= 1.0):
        return None
    return fit_percent(y, scipy.signal.lfilter(model.B, denominator, u))
