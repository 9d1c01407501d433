"""Toeplitz moments: the regressors are delayed copies of one input (an FIR model with taps left out).

Scaling R changes the variance but not the bias, so a design is a shape rho = (1, rho_1 .. rho_{n-1}),
the autocorrelations, and an energy E = n r_0. With P the Toeplitz matrix of rho, P11 u = L1,

    b(rho) = P21 u - L2,   v(rho) = L1^T u,   error = alpha^2 |b|^2 + sigma^2 n v / E.

For every fixed error the energy follows, and the other way round.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.regression.model import Regression

# As in `Regression.error`: directions of P11 that count as not excited, and how much of L1 may lie there.
_RANK = 1e-12
_OUTSIDE = 1e-7


@dataclass(frozen=True)
class Autocorrelations:
    """Holds autocorrelations `rho` (n,) with rho_0 = 1, the `bias` (n - m,), and the variance factor `v`."""

    rho: Array
    bias: Array
    v: float

    @property
    def bias_squared(self) -> float:
        """Return the squared bias |b|^2."""
        return float(self.bias @ self.bias)


@dataclass(frozen=True)
class ToeplitzProblem:
    """The regression in units where |L1| = 1 and alpha = 1 or 0, so that all blocks are of order one.

    Attributes:
        first: (m,) L1 / |L1|.
        second: (n - m,) L2 / |L1|.
        biased: whether bias counts (alpha > 0).
    """

    first: Array
    second: Array
    biased: bool = True

    @staticmethod
    def of(regression: Regression) -> ToeplitzProblem:
        """Return the problem of a regression; `Weight` carries the units that are left out here."""
        scale = float(np.linalg.norm(regression.estimated))
        return ToeplitzProblem(
            regression.estimated / scale, regression.neglected / scale, regression.neglected_norm > 0.0
        )

    @property
    def m(self) -> int:
        """Return the number of estimated parameters."""
        return self.first.size

    @property
    def n(self) -> int:
        """Return the number of all parameters."""
        return self.first.size + self.second.size

    @cached_property
    def lags(self) -> NDArray[np.float64]:
        """Return matrices lags[k] with ones where |i - j| = k, (n, n, n)."""
        i = np.arange(self.n)
        distance = np.abs(i[:, None] - i[None, :])
        return (distance[None] == i[:, None, None]).astype(float)

    @cached_property
    def halves(self) -> tuple[NDArray[np.float64], ...]:
        """Return orthonormal bases (n, .) of the symmetric and the skew vectors.

        A symmetric Toeplitz matrix maps each into itself, so a cone of order n falls into two of half
        that order.
        """
        n, half = self.n, self.n // 2
        identity = np.eye(half)
        mirror = identity[:, ::-1]
        middle = np.zeros((half, n % 2))
        symmetric = np.hstack([identity, middle, mirror]).T / np.sqrt(2.0)
        skew = np.hstack([identity, middle, -mirror]).T / np.sqrt(2.0)
        if n % 2:
            centre = np.zeros((n, 1))
            centre[half] = 1.0
            symmetric = np.hstack([symmetric, centre])
        return (symmetric, skew) if half else (symmetric,)

    def evaluate(self, rho: Array) -> Autocorrelations | None:
        """Return the shape of autocorrelations, made positive semidefinite; None if L1 is not excited."""
        rho = _inside(rho)
        P = scipy.linalg.toeplitz(rho)
        u = self.weights(P)
        if u is None:
            return None
        return Autocorrelations(rho, P[self.m :, : self.m] @ u - self.second, float(self.first @ u))

    def weights(self, P: Array) -> Array | None:
        """Return u with P11 u = L1, of least norm, (m,); None if there is none, to rounding."""
        values, vectors = np.linalg.eigh(P[: self.m, : self.m])
        parts = vectors.T @ self.first
        kept = values > _RANK * values[-1]
        if np.any(np.abs(parts[~kept]) > _OUTSIDE):
            return None
        return vectors[:, kept] @ (parts[kept] / values[kept])

    def bias_jacobian(self, rho: Array) -> NDArray[np.float64]:
        """Return the derivatives (n - m, n - 1) of b with respect to rho_1 .. rho_{n-1}."""
        m = self.m
        P = scipy.linalg.toeplitz(rho)
        inverse = np.linalg.pinv(P[:m, :m], rcond=_RANK, hermitian=True)
        u, predictor = inverse @ self.first, P[m:, :m] @ inverse
        moved = self.lags[1:, :, :m] @ u  # (n - 1, n)
        return (moved[:, m:] - moved[:, :m] @ predictor.T).T


@dataclass(frozen=True)
class Weight:
    """Weighs |b|^2 + kappa v: the error for a given energy in the units of `ToeplitzProblem`.

    The error is unit (|b|^2 + kappa v) with unit = alpha^2 |L1|^2; without bias (alpha = 0) kappa v alone.
    """

    kappa: float
    biased: bool = True

    def __call__(self, shape: Autocorrelations) -> float:
        """Return the weighted sum for a shape."""
        bias = shape.bias_squared if self.biased else 0.0
        return bias + self.kappa * shape.v


def _inside(rho: Array) -> Array:
    """Return autocorrelations scaled towards white until their Toeplitz matrix has no negative eigenvalue."""
    rho = rho / rho[0]
    lowest = float(np.linalg.eigvalsh(scipy.linalg.toeplitz(rho))[0])
    shrunk = rho / (1.0 + max(0.0, -lowest))
    shrunk[0] = 1.0
    return shrunk
