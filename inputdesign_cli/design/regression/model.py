"""A linear regression with neglected regressors, and its mean-squared error for given moments.

y = phi_1^T theta_1 + phi_2^T theta_2 + v; only theta_1 is estimated, by least squares on phi_1. The
quantity of interest is L1^T theta_1 + L2^T theta_2 ([eckhard-mse], Section 2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from inputdesign_cli.arrays import Array

# Below this fraction of the largest eigenvalue a direction of R11 counts as not excited.
_RANK = 1e-12
# The part of L1 outside the range of R11, relative to L1, from which on the quantity is not estimable.
_OUTSIDE = 1e-6


@dataclass(frozen=True)
class ErrorSplit:
    """Holds the worst-case mean-squared error over |theta_2| <= alpha: squared bias and variance."""

    bias_squared: float
    variance: float

    @property
    def total(self) -> float:
        """Return the mean-squared error."""
        return self.bias_squared + self.variance


@dataclass(frozen=True)
class Regression:
    """Holds the quantity of interest, the noise variance, and the bound on neglected parameters.

    Attributes:
        estimated: (m,) L1, weights of the estimated parameters.
        neglected: (n - m,) L2, weights of the neglected parameters.
        neglected_norm: alpha, the bound on the norm of the neglected parameters.
        variance: sigma^2, of the white noise on the output.
    """

    estimated: Array
    neglected: Array
    neglected_norm: float
    variance: float

    @property
    def m(self) -> int:
        """Return the number of estimated parameters."""
        return self.estimated.size

    @property
    def n(self) -> int:
        """Return the number of all parameters."""
        return self.estimated.size + self.neglected.size

    def bias(self, R: Array) -> Array:
        """Return R12^T R11^+ L1 - L2 (n - m,); times theta_2 it is the bias of the estimate."""
        return R[self.m :, : self.m] @ self._weights(R) - self.neglected

    def error(self, R: Array) -> ErrorSplit:
        """Return the worst mean-squared error with the moments R (n, n), [eckhard-mse] (6), (33), (34).

        Infinite when R11 does not excite all of L1.
        """
        weights = self._weights(R)
        R11 = R[: self.m, : self.m]
        outside = np.linalg.norm(R11 @ weights - self.estimated)
        if outside > _OUTSIDE * np.linalg.norm(self.estimated):
            return ErrorSplit(np.inf, np.inf)
        bias = R[self.m :, : self.m] @ weights - self.neglected
        return ErrorSplit(
            bias_squared=float(self.neglected_norm**2 * (bias @ bias)),
            variance=float(self.variance * (weights @ R11 @ weights)),
        )

    def _weights(self, R: Array) -> Array:
        R11 = R[: self.m, : self.m]
        return np.linalg.pinv(R11, rcond=_RANK, hermitian=True) @ self.estimated


@dataclass(frozen=True)
class Sensitivity:
    """Holds the derivatives of the optimal value (envelope theorem: at the optimum only the data move).

    `goal` is with respect to the target error for a least-energy design and to the energy for a
    least-error design.
    """

    neglected_norm: float
    goal: float
    noise_deviation: float


def energy_sensitivity(
    regression: Regression, energy: float, target: float, split: ErrorSplit
) -> Sensitivity:
    """Return the sensitivity of the least energy sigma^2 c / (gamma - alpha^2 |b|^2)."""
    slack = target - split.bias_squared
    alpha, sigma = regression.neglected_norm, np.sqrt(regression.variance)
    bias = split.bias_squared / alpha**2 if alpha > 0 else 0.0
    return Sensitivity(
        neglected_norm=2.0 * alpha * bias * energy / slack,
        goal=-energy / slack,
        noise_deviation=2.0 * energy / sigma,
    )


def error_sensitivity(regression: Regression, energy: float, split: ErrorSplit) -> Sensitivity:
    """Return the sensitivity of the least error alpha^2 |b|^2 + sigma^2 c / E."""
    alpha, sigma = regression.neglected_norm, np.sqrt(regression.variance)
    return Sensitivity(
        neglected_norm=2.0 * split.bias_squared / alpha if alpha > 0 else 0.0,
        goal=-split.variance / energy,
        noise_deviation=2.0 * split.variance / sigma,
    )
