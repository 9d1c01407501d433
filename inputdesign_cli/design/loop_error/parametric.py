"""The exact finite-order covariance in place of the asymptotic one: the criterion tr(W P).

[rojas-asymptotic] takes the covariance that holds as the model order grows; here it is that of the model
structure, [ljung-1999] Section 9.4.

To first order in the error of the parameters, y - y0 = sum_l dtheta_l X_l (r - v) with
X_l = S G dC_l S = -S dG_l G^-1 T + dT_l, where dT_l is the change of the intended loop with the model.
Hence E||y - y0||^2 = tr(W P), W_lm = mean tr(X_l (Phi_r + Phi_v) X_m^*). The covariance P is the inverse of
an information matrix that is affine in the input spectrum: a convex design like any other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import Cut, inverse_factor
from inputdesign_cli.accuracy.cuts import VarianceCut
from inputdesign_cli.accuracy.requirement import OneCondition
from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information import Experiment

_HELD = 1e-14  # smaller eigenvalues of W, relative to the largest, are rounding
_REACH = 90.0
_STEP = 0.02


@dataclass(frozen=True)
class ParametricCriterion:
    """The criterion tr(W (M0 + M(Phi))^-1) for one sample of the experiment; W (k, k) real and symmetric."""

    W: Array
    experiment: Experiment

    def information(self, w: Array, Phi: ComplexArray, weights: Array) -> Array:
        """Return M0 + M(Phi) (k, k) of a spectrum Phi (K, n, n) at `w`, for a mean with `weights` (K,)."""
        X = self.experiment.excitation_gradient(w)
        excited = np.einsum("klab,kmab,k->lm", X @ Phi[:, None], np.conj(X), weights).real
        return self.experiment.noise_information + excited

    def value(self, information: Array) -> float:
        """Return the criterion tr(W M^-1)."""
        return float(np.trace(np.linalg.solve(information, self.W)))

    @property
    def root(self) -> Array:
        """Return rows V^T (q, k) with W = V V^T."""
        values, vectors = np.linalg.eigh(0.5 * (self.W + self.W.T))
        held = values > _HELD * values[-1]
        return (vectors[:, held] * np.sqrt(values[held])).T

    def error_eigenvalues(self, information: Array) -> Array:
        """Return eigenvalues (k,) of P^1/2 W P^1/2: the weights of the squared normal variables."""
        root = np.linalg.cholesky(np.linalg.inv(information))
        return np.asarray(np.maximum(np.linalg.eigvalsh(root.T @ self.W @ root), 0.0))


@dataclass(frozen=True)
class WeightedCovariance(OneCondition):
    """The requirement tr(V^T P V) <= 1, V = `directions` (k, q) in the coordinates of the experiment."""

    directions: Array

    @property
    def name(self) -> str:
        """See `Requirement`."""
        return "closed_loop_error"

    def ratio(self, information: Array) -> float:
        """Return the root of tr(V^T P V)."""
        return float(np.linalg.norm(inverse_factor(information) @ self.directions))

    def cut(self, frequency: float | None) -> Cut:
        """Return the requirement itself as a cut."""
        return VarianceCut(self.directions)


def root_moments(eigenvalues: Array) -> tuple[float, float]:
    """Return mean and standard deviation of sqrt(sum_i eigenvalue_i z_i^2), z_i standard normal.

    E sqrt(Q) = (1 / 2 sqrt(pi)) integral over s > 0 of (1 - E exp(-s Q)) s^-3/2, and
    E exp(-s Q) = prod (1 + 2 s eigenvalue_i)^-1/2; the trapezoidal rule in log s is exact to rounding.
    """
    scale = float(eigenvalues.sum())
    s = np.arange(-_REACH, _REACH, _STEP)
    logarithm = -0.5 * np.log1p(2 * np.exp(s)[:, None] * eigenvalues / scale).sum(axis=1)
    mean = float(np.sum(-np.expm1(logarithm) * np.exp(-0.5 * s))) * _STEP / (2 * np.sqrt(np.pi))
    return mean * np.sqrt(scale), float(np.sqrt(max(scale * (1 - mean**2), 0.0)))
