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
from inputdesign_cli.design.regression.model import RANK, Regression


@dataclass(frozen=True)
class Shape:
    """Holds autocorrelations `rho` (n,) with rho_0 = 1, the `bias` (n - m,), and the variance factor `v`."""

    rho: Array
    bias: Array
    v: float

    @property
    def bias_squared(self) -> float:
        """Return the squared bias |b|^2."""
        return float(self.bias @ self.bias)

    def error(self, kappa: float) -> float:
        """Return |b|^2 + kappa v, the error for a given energy in the units of `ToeplitzProblem`."""
        return self.bias_squared + kappa * self.v


@dataclass(frozen=True)
class ToeplitzProblem(Regression):
    """The regression in units where |L1|, sigma and alpha are 1, so that all blocks are of order one.

    Where alpha is 0, it stays 0, and so does the bias of a shape.
    """

    @classmethod
    def of(cls, regression: Regression) -> ToeplitzProblem:
        """Return the problem of a regression; `Goal` has the units that are left out here."""
        scale = float(np.linalg.norm(regression.estimated))
        alpha = float(regression.neglected_norm > 0.0)
        return cls(regression.estimated / scale, regression.neglected / scale, alpha, 1.0)

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
        identity = np.eye(self.n)
        both = [identity + identity[::-1], identity - identity[::-1]]
        parts = [part[:, : (self.n + sign) // 2] for part, sign in zip(both, (1, 0), strict=True)]
        return tuple(part / np.linalg.norm(part, axis=0) for part in parts if part.size)

    def evaluate(self, rho: Array) -> Shape | None:
        """Return the shape of autocorrelations, made positive semidefinite; None if L1 is not excited.

        Where their Toeplitz matrix has a negative eigenvalue they are scaled towards white noise.
        """
        rho = rho / rho[0]
        lowest = float(np.linalg.eigvalsh(scipy.linalg.toeplitz(rho))[0])
        rho = rho / (1.0 + max(0.0, -lowest))
        rho[0] = 1.0
        P = scipy.linalg.toeplitz(rho)
        u = self.weights(P)
        if u is None:
            return None
        bias = self.neglected_norm * (P[self.m :, : self.m] @ u - self.neglected)
        return Shape(rho, bias, float(self.estimated @ u))

    def bias_jacobian(self, rho: Array) -> NDArray[np.float64]:
        """Return the derivatives (n - m, n - 1) of b with respect to rho_1 .. rho_{n-1}."""
        m = self.m
        P = scipy.linalg.toeplitz(rho)
        inverse = np.linalg.pinv(P[:m, :m], rcond=RANK, hermitian=True)
        u, predictor = inverse @ self.estimated, P[m:, :m] @ inverse
        moved = self.lags[1:, :, :m] @ u  # (n - 1, n)
        return self.neglected_norm * (moved[:, m:] - moved[:, :m] @ predictor.T).T


@dataclass(frozen=True)
class Goal:
    """The goal: least error for an energy, or least energy for a target error, in units of `ToeplitzProblem`.

    Attributes:
        kappa: sigma^2 n / (energy unit): the error of v = 1 when the energy is given; else None.
        target: the largest |b|^2 + kappa v that is allowed when the energy is sought; else None.
        error: the error of the regression for |b|^2 + kappa v = 1, alpha^2 |L1|^2.
        energy: the energy of the regression for kappa = 1; it is in inverse proportion to kappa.
    """

    kappa: float | None = None
    target: float | None = None
    error: float = 1.0
    energy: float = 1.0

    @classmethod
    def of(cls, regression: Regression, *, target: float | None, energy: float | None) -> Goal:
        """Return the goal of a target, or else of an energy, in the units of the regression."""
        size = float(regression.estimated @ regression.estimated)
        error = size * (regression.neglected_norm**2 or 1.0)
        unit = regression.n * regression.variance * size / error
        if target is not None:
            return cls(None, target / error, error, unit)
        assert energy is not None
        return cls(unit / energy, None, error, unit)

    def value(self, shape: Shape) -> float:
        """Return what is minimised: the error, or 1 / kappa (energy up to a factor); infinite if not met."""
        if self.kappa is not None:
            return shape.error(self.kappa)
        assert self.target is not None
        slack = self.target - shape.bias_squared
        return shape.v / slack if slack > 0.0 else np.inf

    def kappa_at(self, value: float) -> float:
        """Return the kappa at a reached value: least error at that energy, [dinkelbach-1967]."""
        return 1.0 / value if self.kappa is None else self.kappa

    def stated(self, value: float) -> float:
        """Return a value, or a bound on it, in the units of the regression."""
        return value * (self.energy if self.kappa is None else self.error)
