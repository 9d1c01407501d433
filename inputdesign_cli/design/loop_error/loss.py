"""What theory says of the loss of a run: the root of a quadratic form of Gaussian parameter errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.loop_error.parametric import ParametricCriterion

_REACH = 90.0
_STEP = 0.02


@dataclass(frozen=True)
class LossTheory:
    """N E||y - y0||^2 = `value`, and mean and standard deviation of its root over experiments."""

    value: float
    mean: float
    sd: float


def loss_theory(criterion: ParametricCriterion, information: Array) -> LossTheory:
    """For the model structure; `information` (k, k) is that of one sample."""
    covariance = np.asarray(np.linalg.inv(information))
    return LossTheory(criterion.value(information), *root_moments(error_eigenvalues(criterion.W, covariance)))


def error_eigenvalues(W: Array, covariance: Array) -> Array:
    """Eigenvalues of P^1/2 W P^1/2, nonnegative: the weights of the squared normal variables."""
    root = np.linalg.cholesky(covariance)
    return np.asarray(np.maximum(np.linalg.eigvalsh(root.T @ W @ root), 0.0))


def root_moments(eigenvalues: Array) -> tuple[float, float]:
    """Mean and standard deviation of sqrt(sum_i eigenvalue_i z_i^2), z_i standard normal.

    E sqrt(Q) = (1 / 2 sqrt(pi)) integral over s > 0 of (1 - E exp(-s Q)) s^-3/2, and
    E exp(-s Q) = prod (1 + 2 s eigenvalue_i)^-1/2; the trapezoidal rule in log s is exact to rounding.
    """
    scale = float(eigenvalues.sum())
    s = np.arange(-_REACH, _REACH, _STEP)
    logarithm = -0.5 * np.log1p(2 * np.exp(s)[:, None] * eigenvalues / scale).sum(axis=1)
    mean = float(np.sum(-np.expm1(logarithm) * np.exp(-0.5 * s))) * _STEP / (2 * np.sqrt(np.pi))
    return mean * np.sqrt(scale), float(np.sqrt(max(scale * (1 - mean**2), 0.0)))
