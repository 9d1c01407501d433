"""The search on costs with known minima that rounding errors or a kink make hard to find."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from inputdesign_cli.identification.gauss_newton import MOST_STEPS, minimise

_ERRORS = 12_000


@dataclass(frozen=True)
class Valley:
    """cost = (N + sum x^2) (1 + rounding): deviations are one. The Hessian is too large by a share."""

    rounding: float
    share: float = 0.3
    errors: int = _ERRORS

    def at(self, theta):
        cost = _ERRORS + np.sum(theta**2, axis=1)
        # Cancellation loses the last digits like this, differently at every theta.
        cost *= 1.0 + self.rounding * np.sin(1e13 * theta[:, 0])
        hessian = np.tile((1.0 + self.share) * np.eye(theta.shape[1]), (len(theta), 1, 1))
        return cost, hessian, -theta

    def stabilised(self, theta):
        return theta.copy()

    def kept(self, runs):
        return self


@dataclass(frozen=True)
class Kink(Valley):
    """cost = N + |x - 0.3|, whose minimum no Gauss-Newton step finds."""

    def at(self, theta):
        cost = _ERRORS + np.abs(theta[:, 0] - 0.3)
        return cost, np.full((len(theta), 1, 1), 0.1), -0.5 * np.sign(theta - 0.3)


@pytest.mark.parametrize("rounding", [0.0, 1e-13, 2e-11, 5e-11])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_the_minimum_of_a_cost_with_rounding_errors_is_found(rounding, share):
    start = np.array([[30.0, -20.0], [1.0, 1e-3]])
    found = minimise(Valley(rounding, share), start)
    assert np.all(found.converged)
    # In standard deviations.
    assert np.abs(found.theta).max() < 1e-3


def test_at_a_kink_the_search_ends_early_and_has_not_converged():
    found = minimise(Kink(0.0), np.array([[5.0], [0.31]]))
    assert not np.any(found.converged)
    assert np.all(found.steps < MOST_STEPS)
    assert np.abs(found.theta - 0.3).max() < 0.05
