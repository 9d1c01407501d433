"""One record -> one model: theta with its covariance, the noise variance, and how far to trust them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.signal
from numpy.typing import ArrayLike

from inputdesign_cli.errors import bad_spec
from inputdesign_cli.identification.predictor import prediction_errors
from inputdesign_cli.identification.residual_tests import ResidualTest, cross_correlation, whiteness
from inputdesign_cli.identification.search import minimise
from inputdesign_cli.identification.starts import starting_points
from inputdesign_cli.identification.structure import Structure
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.plant.polynomial import Array

# Below this share of the largest eigenvalue (parameters scaled) a direction is not excited.
_FAINT = 1e-12
# Residuals of this power relative to the output are rounding.
_EXACT = 1e-20
# Fewer samples than this for each parameter say nothing about a covariance.
_SAMPLES_A_PARAMETER = 3


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


def identify(structure: Structure, u: ArrayLike, y: ArrayLike, *, start: ArrayLike | None = None) -> Estimate:
    """Prediction-error estimate from one record (samples,); in closed loop the direct method.

    Several starts are tried, `start` (k,) among them if given, and the least cost wins. A model without
    C, D and F (ARX) is linear in its parameters: every start leads to the least-squares solution.

    Raises:
        SpecError: `too-few-samples`, `constant-input` or `not-exciting`.
    """
    u, y = np.asarray(u, dtype=float), np.asarray(y, dtype=float)
    _check(structure, u, y)
    points = starting_points(structure, u, y)
    if start is not None:
        points = np.concatenate([np.asarray(start, dtype=float)[None], points])
    found = minimise(
        structure, points, np.repeat(u[:, None], len(points), 1), np.repeat(y[:, None], len(points), 1)
    )
    best = int(np.argmin(np.where(np.isfinite(found.cost), found.cost, np.inf)))
    settled = found.converged & (found.cost <= found.cost[best] * (1 + 1e-6))
    if np.any(settled):
        best = int(np.flatnonzero(settled)[np.argmin(found.cost[settled])])
    theta = found.theta[best]
    errors = prediction_errors(structure, theta[None], u[:, None], y[:, None])[:, 0]
    variance = float(errors @ errors) / (y.size - structure.size)
    if variance <= _EXACT * float(y @ y) / y.size:
        raise bad_spec(
            "noise-free-data",
            "the model explains the output to the last digit: there is no noise to estimate a variance from",
            hint="is y computed from u? Real data have noise",
            key="y",
        )
    information = found.hessian[best] / variance
    return Estimate(
        structure=structure,
        theta=theta,
        covariance=_inverse(structure, information),
        information=information,
        variance=variance,
        errors=errors,
        converged=bool(found.converged[best]),
        steps=int(found.steps[best]),
        starts=len(points),
        fit=_fit(structure, theta, u, y),
        whiteness=whiteness(errors, fitted=structure.a + structure.c + structure.d),
        independence=cross_correlation(errors, u, fitted=structure.b + 1 - structure.delay + structure.f),
    )


def _check(structure: Structure, u: Array, y: Array) -> None:
    needed = _SAMPLES_A_PARAMETER * structure.size + max(structure.lags["b"][-1], structure.a)
    if y.size < needed:
        raise bad_spec(
            "too-few-samples",
            f"{y.size} samples are too few for {structure.size} parameters: at least {needed} are needed",
            hint="record more samples, or lower the orders",
            key="u",
        )
    for name, signal in (("u", u), ("y", y)):
        if np.ptp(signal) <= 1e-12 * max(float(np.abs(signal).max()), 1e-300):
            raise bad_spec(
                "constant-input" if name == "u" else "constant-output",
                f"{name} has the same value {signal[0]:g} in every sample: "
                + (
                    f"nothing but a static gain could be seen, and {', '.join(structure.names)} cannot be "
                    "told apart"
                    if name == "u"
                    else "it shows neither the input nor noise"
                ),
                hint="is the signal in another column, or the logger stuck?",
                key=name,
            )


def _inverse(structure: Structure, information: Array) -> Array:
    """M^-1 by way of unit diagonal.

    Raises:
        SpecError: `not-exciting`.
    """
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    if values[0] <= _FAINT * values[-1]:
        weak = np.abs(vectors[:, 0])
        names = [n for n, v in zip(structure.names, weak, strict=True) if v > 0.05 * weak.max()]
        raise bad_spec(
            "not-exciting",
            f"the data cannot tell these parameters apart: {', '.join(names)}",
            hint="the input is too simple (too few sinusoids, a short step), or the orders are too high",
            key="u",
        )
    half = vectors / np.sqrt(values)
    return (half @ half.T) / np.outer(scale, scale)


def _fit(structure: Structure, theta: Array, u: Array, y: Array) -> float | None:
    model = structure.model(theta, 1.0)
    denominator = np.convolve(model.A, model.F)
    if np.any(np.abs(model.poles) >= 1.0):
        return None
    left = y - scipy.signal.lfilter(model.B, denominator, u)
    return float(100.0 * (1.0 - np.linalg.norm(left) / np.linalg.norm(y - y.mean())))
