"""An estimate from earlier data, in place of these: Gaussian knowledge of the parameters.

Its density adds q = (theta - theta_0)^T M_0 (theta - theta_0) to -2 log likelihood. The estimate minimises
the sum (maximum a posteriori; [ljung-1999], Section 7.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.arrays import Array

# Directions are not compared if one estimate has less than this share of the information on them.
_LEAST_INFORMATION = 1e-9
# Two estimates from the same data agree to this share of a deviation, and of the information.
_AGREEMENT = 1e-3
# An estimate from the same data has half of the joint information at most. A far smaller share may come from
# a covariance that was stated cautiously.
_LEAST_SHARE, _MOST_SHARE = 0.2, 0.6


@dataclass(frozen=True)
class Earlier:
    """An estimate `theta` (k,) of `information` (k, k), singular where some parameters are not known."""

    theta: Array
    information: Array

    @property
    def rows(self) -> Array:
        """Return a square root R (k, k) of the information, R^T R."""
        scale = np.sqrt(np.maximum(np.diag(self.information), 1e-300))
        values, vectors = np.linalg.eigh(self.information / np.outer(scale, scale))
        return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T * scale)

    def slope(self, theta: Array) -> Array:
        """Return half the gradient (k,) of q at theta."""
        return np.asarray(self.information @ (theta - self.theta))

    def q(self, theta: Array) -> float:
        """Return the squared distance of theta in standard deviations."""
        return float(np.sum((self.rows @ (theta - self.theta)) ** 2))

    def is_of_these_data(self, theta: Array, factor: Array) -> bool:
        """Return whether the estimate is of these data: it has half of the information, and theta stays.

        Other data of the same length have another input or noise, and move theta by about a deviation.
        """
        inner = np.linalg.solve(factor, self.rows.T)
        shares = np.linalg.eigvalsh(inner @ inner.T)
        away = float(np.linalg.norm(factor.T @ (theta - self.theta)))
        return bool(np.all(np.abs(shares - 0.5) < _AGREEMENT) and away < _AGREEMENT * np.sqrt(len(theta)))

    def agreement(self, theta: Array, factor: Array) -> float:
        """Return the probability that two estimates of one system differ as much as this one and the data's.

        The estimate theta (k,) from both has the information L L^T, L the lower triangular `factor` (k, k).
        """
        statistic, directions = self._apart(theta, factor, _LEAST_INFORMATION, 1.0 - _LEAST_INFORMATION)
        return float(scipy.special.chdtrc(directions, statistic)) if directions else 1.0

    def likeness(self, theta: Array, factor: Array) -> float:
        """Return the probability that estimates from different data agree as closely as this and the data's.

        It is small for a record that is given again, rounded, or with a few rows less.
        """
        statistic, directions = self._apart(theta, factor, _LEAST_SHARE, _MOST_SHARE)
        return float(scipy.special.chdtr(directions, statistic)) if directions else 1.0

    def _apart(self, theta: Array, factor: Array, least: float, most: float) -> tuple[float, int]:
        """Return the squared distance of the two, in deviations of their difference, and its dimension.

        Args:
            least, most: a direction counts if this estimate has a share of its information between these.
        """
        inner = np.linalg.solve(factor, self.rows.T)
        shares, turn = np.linalg.eigh(inner @ inner.T)
        away = (turn.T @ (factor.T @ (theta - self.theta))) ** 2
        both = (shares > least) & (shares < most)
        return float(np.sum(away[both] * shares[both] / (1.0 - shares[both]))), int(both.sum())
