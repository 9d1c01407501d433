"""Estimates of a model, whatever its kind, and how far to trust them: of one record, and of many."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.identification.checks import covariance_of
from inputdesign_cli.identification.residual_tests import ResidualTest, cross_correlations, whiteness
from inputdesign_cli.plant.polynomial import Array


@dataclass(frozen=True)
class Estimate:
    """A prediction-error estimate of a model with p outputs, r inputs and k parameters.

    Attributes:
        names, theta: (k,).
        covariance, information: (k, k) of theta; they are inverse to each other.
        noise: (p, p) covariance of e; of white noise on the samples where the model knows no other.
        errors: (samples, p) prediction errors at theta.
        converged: whether the search settled; `steps` that it took, from the best of `starts`.
        fit: output by output, per cent of the rms of y (its mean taken off) that the model's simulation
            explains; None where the model is unstable and cannot be simulated.
        whiteness, independence: of the residuals, and of residuals and past inputs, all channels at once;
            their correlations are (lags, p, p) and (lags, p, r).
    """

    names: tuple[str, ...]
    theta: Array
    covariance: Array
    information: Array
    noise: Array
    errors: Array
    converged: bool
    steps: int
    starts: int
    fit: tuple[float | None, ...]
    whiteness: ResidualTest
    independence: ResidualTest


@dataclass(frozen=True)
class BatchEstimate:
    """Prediction-error estimates of many records.

    Attributes:
        theta: (runs, k).
        noise: (runs, p, p) covariance of e, unbiased to first order.
        information: (runs, k, k) sum over the samples of psi noise^-1 psi^T; its inverse is the covariance of
            theta.
        converged, steps: (runs,) of the search.
    """

    theta: Array
    noise: NDArray[np.float64]
    information: NDArray[np.float64]
    converged: NDArray[np.bool_]
    steps: NDArray[np.int64]


def concluded(
    names: tuple[str, ...],
    theta: Array,
    information: Array,
    noise: Array,
    errors: Array,
    u: Array,
    *,
    feedback: bool,
    in_noise: int,
    in_plant: int,
    fit: tuple[float | None, ...],
    converged: bool,
    steps: int,
    starts: int,
) -> Estimate:
    """The estimate with its covariance and the tests of its residuals.

    Args:
        names, theta: (k,).
        information: (k, k) sum over the samples of psi(t) noise^-1 psi(t)^T.
        noise: (p, p) covariance of e.
        errors, u: (samples, p), (samples, r).
        feedback: whether u(t) answers y(t).
        in_noise: number of parameters that make residuals look whiter: those of A, C and D.
        in_plant: number of parameters that take directions of past inputs away: those of B and F.
        fit, converged, steps, starts: see `Estimate`.

    Raises:
        SpecError: `not-exciting`.
    """
    return Estimate(
        names=names,
        theta=np.asarray(theta, dtype=float),
        covariance=covariance_of(names, information),
        information=information,
        noise=noise,
        errors=errors,
        converged=converged,
        steps=steps,
        starts=starts,
        fit=fit,
        whiteness=whiteness(errors, fitted=in_noise),
        independence=cross_correlations(errors, u, fitted=in_plant, feedback=feedback),
    )
