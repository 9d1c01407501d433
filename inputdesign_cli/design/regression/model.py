"""A linear regression with neglected regressors, its mean-squared error, and the moments with the least.

y = phi_1^T theta_1 + phi_2^T theta_2 + v; only theta_1 is estimated, by least squares on phi_1. The
quantity of interest is L1^T theta_1 + L2^T theta_2 ([eckhard-mse], Section 2).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from inputdesign_cli.arrays import Array

# Below this fraction of the largest eigenvalue a direction of R11 counts as not excited.
RANK = 1e-12
# The part of L1 outside the range of R11, relative to L1, from which on the quantity is not estimable.
_OUTSIDE = 1e-7


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
        variance: sigma^2, the variance of the white noise on the output.
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

    def weights(self, R: Array) -> Array | None:
        """Return u with R11 u = L1, of least norm, (m,); None if R11 does not excite all of L1."""
        values, vectors = np.linalg.eigh(R[: self.m, : self.m])
        parts = vectors.T @ self.estimated
        kept = values > RANK * values[-1]
        if np.linalg.norm(parts[~kept]) > _OUTSIDE * np.linalg.norm(parts):
            return None
        return vectors[:, kept] @ (parts[kept] / values[kept])

    def error(self, R: Array) -> ErrorSplit:
        """Return the worst mean-squared error with the moments R (n, n), [eckhard-mse] (6), (33), (34).

        Infinite when R11 does not excite all of L1.
        """
        u = self.weights(R)
        if u is None:
            return ErrorSplit(np.inf, np.inf)
        bias = self.neglected_norm * (R[self.m :, : self.m] @ u - self.neglected)
        return ErrorSplit(float(bias @ bias), float(self.variance * (self.estimated @ u)))


@dataclass(frozen=True)
class MomentsDesign:
    """Holds moments R (n, n) with their error, and the proof of their energy or error: the `bound`.

    No R of the structure does better than the bound. Toeplitz moments have autocorrelations `rho` (n,), with
    rho_0 = 1, and `counts` of the steps of search and proof.
    """

    R: Array
    split: ErrorSplit
    bound: float
    rho: Array | None = None
    counts: Mapping[str, float] = field(default_factory=dict)

    @property
    def energy(self) -> float:
        """Return the energy, trace R."""
        return float(np.trace(self.R))


def least_error(regression: Regression, energy: float) -> Array:
    """Return the R (n, n) of trace `energy` with the least worst mean-squared error.

    By [eckhard-mse], Lemma 1, it is rank one, along v = [L1; L2 + delta]: regressors that move together in
    one direction. Its error alpha^2 |delta|^2 + sigma^2 |v|^2 / energy is least at
    delta = -sigma^2 L2 / (alpha^2 energy + sigma^2).
    """
    gain = regression.neglected_norm**2 * energy
    v = np.concatenate([regression.estimated, gain / (gain + regression.variance) * regression.neglected])
    return energy * np.outer(v, v) / (v @ v)


def error_bound(regression: Regression, energy: float) -> float:
    """Return a lower bound on the error of any R >= 0 of trace `energy`, whatever its structure.

    The error is at least alpha^2 |d|^2 + sigma^2 (|L1|^2 + |L2 + d|^2) / E for some d, and this is least as
    stated in `least_error`.
    """
    a2, variance = regression.neglected_norm**2, regression.variance
    first, second = (float(L @ L) for L in (regression.estimated, regression.neglected))
    return variance * first / energy + a2 * variance * second / (a2 * energy + variance)


def energy_bound(regression: Regression, target: float) -> float:
    """Return the energy below which no R >= 0, whatever its structure, has the error `target`.

    `error_bound` falls in E. It is gamma = `target` at the positive root of a quadratic, written so that
    nothing cancels ([eckhard-mse], Theorem 2):
    gamma alpha^2 E^2 + (gamma - alpha^2 |L1|^2 - alpha^2 |L2|^2) sigma^2 E = sigma^4 |L1|^2.
    """
    a2, variance = regression.neglected_norm**2, regression.variance
    first, second = (float(L @ L) for L in (regression.estimated, regression.neglected))
    linear = target - a2 * (first + second)
    root = np.sqrt(linear**2 + 4.0 * target * a2 * first)
    scaled = 2.0 * first / (linear + root) if linear >= 0.0 else (root - linear) / (2.0 * target * a2)
    return float(variance * scaled)
