"""The exact finite-order covariance in place of the asymptotic one: least tr(W P) over every spectrum.

[rojas-asymptotic] takes the covariance that holds as the model order grows; here it is that of the model
structure, [ljung-1999] Section 9.4.

To first order in the error of the parameters, y - y0 = sum_l dtheta_l X_l (r - v) with
X_l = S G dC_l S = -S dG_l G^-1 T + dT_l, where dT_l is how the loop that the law aims at errs with the model.
Hence E||y - y0||^2 = tr(W P), W_lm = mean tr(X_l (Phi_r + Phi_v) X_m^*). The covariance P is the inverse of
an information matrix that is affine in the input spectrum: a convex design like any other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import Cut, inverse_factor
from inputdesign_cli.accuracy.cuts import VarianceCut
from inputdesign_cli.accuracy.requirement import OneCondition
from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.design.convex.designs import UnfinishedDesignError, solve_design
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.information import Experiment
from inputdesign_cli.spectrum import LinesBasis

_HELD = 1e-14  # shares of W below this are rounding
# Beyond what is asked: the bound is compared with a value that is computed anew.
_MARGIN = 0.1


@dataclass(frozen=True)
class ParametricCriterion:
    """The criterion tr(W (M0 + M(Phi))^-1) for one sample; W and M0 (k, k) real and symmetric.

    `sources(w)` gives X (K, k, n, m) = Phi_v^-1/2 dG_l, so that
    M_lm(Phi) = mean Re tr(X_l Phi X_m^*).
    """

    W: Array
    noise_information: Array
    sources: Callable[[Array], ComplexArray]

    def information(self, w: Array, Phi: ComplexArray, weights: Array) -> Array:
        """Return M (k, k) of the spectrum Phi (K, n, n) at `w`, for a mean with `weights` (K,)."""
        X = self.sources(w)
        excited = X @ Phi[:, None]
        return self.noise_information + np.einsum("klab,kmab,k->lm", excited, np.conj(X), weights).real

    def value(self, information: Array) -> float:
        """Return the criterion tr(W M^-1)."""
        return float(np.trace(np.linalg.solve(information, self.W)))


@dataclass(frozen=True)
class LineDesign:
    """Holds sinusoids: `spectrum` (J, n, n) are power matrices; Re of their sum is the covariance of u."""

    frequencies: Array
    spectrum: ComplexArray
    value: float
    lower_bound: float
    information: Array
    rounds: int

    @property
    def gap(self) -> float:
        """Return the relative gap (value - lower_bound) / value."""
        return (self.value - self.lower_bound) / self.value


@dataclass(frozen=True)
class WeightedCovariance(OneCondition):
    """The requirement tr(V^T P V) <= 1, V = `directions` (k, q) in the coordinates of the experiment."""

    directions: Array

    @property
    def name(self) -> str:
        """Return the name `closed_loop_error`."""
        return "closed_loop_error"

    def ratio(self, information: Array) -> float:
        """Return the root of the trace."""
        return float(np.linalg.norm(inverse_factor(information) @ self.directions))

    def cut(self, frequency: float | None) -> Cut:
        """Return the requirement itself as a cut."""
        return VarianceCut(self.directions)


def least_error(
    criterion: ParametricCriterion, experiment: Experiment, limits: Sequence[PowerLimit], *, tolerance: float
) -> LineDesign:
    """Find the sinusoids of the least tr(W P), with a bound for every spectrum within the limits.

    Args:
        experiment: one sample of the model structure in open loop, within the band.
        tolerance: relative gap at which to stop.

    Raises:
        OutOfTimeError: not even a first design was found in time.
    """
    values, vectors = np.linalg.eigh(0.5 * (criterion.W + criterion.W.T))
    held = values > _HELD * values[-1]
    root = (vectors[:, held] * np.sqrt(values[held])).T
    question = Question(
        experiment=experiment,
        basis=LinesBasis.anywhere(*experiment.band, experiment.inputs),
        goal="factor",
        requirements=[lambda coordinates: WeightedCovariance(coordinates.whiten_rows(root).T)],
        limits=limits,
    )
    try:
        found = solve_design(question, tolerance=_MARGIN * tolerance).result
    except UnfinishedDesignError as ended:
        found = ended.design.result
    frequencies, Phi = found.basis.lines(found.x)
    M = criterion.information(frequencies, Phi, np.ones(frequencies.size))
    value = criterion.value(M)
    return LineDesign(frequencies, Phi, value, min(found.certificate.bound, value), M, found.rounds)


_REACH = 90.0
_STEP = 0.02


@dataclass(frozen=True)
class LossTheory:
    """Holds N E||y - y0||^2 = `value`, and mean and standard deviation of its root over experiments."""

    value: float
    mean: float
    sd: float


def loss_theory(criterion: ParametricCriterion, information: Array) -> LossTheory:
    """Return the theory for the model structure; `information` (k, k) is of one sample."""
    covariance = np.asarray(np.linalg.inv(information))
    return LossTheory(criterion.value(information), *root_moments(error_eigenvalues(criterion.W, covariance)))


def error_eigenvalues(W: Array, covariance: Array) -> Array:
    """Return eigenvalues of P^1/2 W P^1/2, nonnegative: the weights of the squared normal variables."""
    root = np.linalg.cholesky(covariance)
    return np.asarray(np.maximum(np.linalg.eigvalsh(root.T @ W @ root), 0.0))


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
