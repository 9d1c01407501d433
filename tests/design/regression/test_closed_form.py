"""Theorem 2 in its stable form: the paper's examples, brute force, bounds, limits, sensitivities."""

from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest
import scipy.optimize

from inputdesign_cli.design.regression import (
    Regression,
    energy_bound,
    energy_sensitivity,
    error_bound,
    error_sensitivity,
    least_energy,
    least_error,
)
from tests.support.regression import mse

ONE = Regression(np.array([1.0]), np.array([1.0]), 1.0, 1.0)


def random_regression(rng, m, n):
    return Regression(
        rng.standard_normal(m), rng.standard_normal(n - m), rng.uniform(0.1, 3.0), rng.uniform(0.2, 2.0)
    )


def test_example_1_exactly():
    R = least_energy(ONE, 1.0)
    root = np.sqrt(5.0)
    np.testing.assert_allclose(
        R, [[(5 + 3 * root) / 10, (5 + root) / 10], [(5 + root) / 10, 1 / root]], rtol=1e-14
    )


# Figure 1: Theorem 2 in 50 digits (Python's decimal), alpha -> R11, R12, R22, trace.
FIGURE_1 = {
    0.1: (1.0098980305898036, 0.010097970609796571, 0.00010096961014644528, 1.00999900019995),
    1.0: (1.1708203932499369, 0.72360679774997897, 0.44721359549995794, 1.6180339887498948),
    10.0: (1.0024937188677710, 0.99749378136659913, 0.99251878105410499, 1.9950124999218760),
}


@pytest.mark.parametrize("alpha", FIGURE_1)
def test_figure_1(alpha):
    R = least_energy(replace(ONE, neglected_norm=alpha), 1.0)
    np.testing.assert_allclose([R[0, 0], R[0, 1], R[1, 1], np.trace(R)], FIGURE_1[alpha], rtol=1e-14)


@pytest.mark.parametrize(
    ("alpha", "limit"), [(0.0, [[1, 0], [0, 0]]), (1e-9, [[1, 0], [0, 0]]), (1e9, [[1, 1], [1, 1]])]
)
def test_the_limits_of_remark_4(alpha, limit):
    np.testing.assert_allclose(least_energy(replace(ONE, neglected_norm=alpha), 1.0), limit, atol=1e-15)


@pytest.mark.parametrize("second", [np.zeros(2), np.zeros(0)])
def test_nothing_neglected_counts(second):
    regression = Regression(np.array([3.0, 4.0]), second, 2.0, 0.5)
    R = least_energy(regression, 2.0)
    assert np.trace(R) == pytest.approx(0.5 * 25 / 2.0, rel=1e-14)
    assert energy_bound(regression, 2.0, R) == pytest.approx(np.trace(R), rel=1e-13)


@pytest.mark.first(2)
@pytest.mark.parametrize(("m", "n"), [(1, 2), (2, 3), (1, 3), (2, 4)])
def test_brute_force_finds_nothing_better(m, n):
    """The original problem over all R = F F^T with F of full size: nothing below, and the same to 1e-6."""
    rng = np.random.default_rng([m, n])
    regression = random_regression(rng, m, n)
    target = rng.uniform(0.3, 3.0)
    L1, L2 = regression.estimated, regression.neglected
    alpha, variance = regression.neglected_norm, regression.variance
    exact = np.trace(least_energy(regression, target))

    def energy(entries):
        F = entries.reshape(n, n)
        R = F @ F.T
        R = R / np.trace(R) + 1e-14 * np.eye(n)
        bias = mse(R, L1, L2, alpha, 0.0)
        return mse(R, L1, L2, 0.0, variance) / (target - bias) if bias < 0.999 * target else 1e3 * (1 + bias)

    values = []
    for _ in range(2):
        # Regressors close to the direction that carries the quantity leave the search a feasible start.
        start = 0.05 * rng.standard_normal((n, n))
        start[:, 0] += np.concatenate([L1, L2])
        point = start.ravel()
        for _ in range(4):  # anew from where it stops: the optimum is singular, and BFGS gets stuck
            point = scipy.optimize.minimize(energy, point, method="BFGS", jac="3-point").x
        values.append(energy(point))
    assert min(values) >= exact * (1.0 - 1e-9)
    assert min(values) == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(("m", "n"), [(1, 2), (2, 4), (3, 5)])
def test_the_schur_program_agrees(m, n):
    """With R free the bound [[R, (L1, z)], [., q]] >= 0, alpha^2 |z - L2|^2 + sigma^2 q <= gamma is exact."""
    rng = np.random.default_rng([m, n])
    regression, target = random_regression(rng, m, n), 0.8
    z, q = cp.Variable(n - m), cp.Variable((1, 1))
    y = cp.reshape(cp.hstack([regression.estimated, z]), (n, 1), order="F")
    R = cp.Variable((n, n), symmetric=True)
    a2 = regression.neglected_norm**2
    limit = a2 * cp.sum_squares(z - regression.neglected) + regression.variance * q[0, 0] <= target
    problem = cp.Problem(cp.Minimize(cp.trace(R)), [cp.bmat([[R, y], [y.T, q]]) >> 0, limit])
    problem.solve(solver=cp.CLARABEL)
    assert np.trace(least_energy(regression, target)) == pytest.approx(problem.value, rel=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_the_target_is_met_and_both_problems_agree(seed):
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, 4))
    regression = random_regression(rng, m, m + int(rng.integers(0, 4)))
    target = rng.uniform(0.1, 3.0)
    R = least_energy(regression, target)
    energy = np.trace(R)
    assert regression.error(R).total == pytest.approx(target, rel=1e-12)
    assert np.linalg.eigvalsh(R)[0] >= -1e-12 * energy
    np.testing.assert_allclose(least_error(regression, energy), R, rtol=1e-9, atol=1e-9 * energy)
    assert energy_bound(regression, target, R) == pytest.approx(energy, rel=1e-11)
    assert error_bound(regression, energy) == pytest.approx(target, rel=1e-11)


@pytest.mark.parametrize("seed", range(5))
def test_bounds_hold_for_any_moments(seed):
    """Read off the wrong R the bound is weaker, but it is a bound."""
    rng = np.random.default_rng(seed)
    regression = random_regression(rng, 2, 4)
    F = rng.standard_normal((4, 4))
    R = F @ F.T
    target = regression.error(R).total
    assert energy_bound(regression, target, R) <= np.trace(least_energy(regression, target)) * (1 + 1e-12)
    assert np.trace(least_energy(regression, target)) <= np.trace(R)
    assert error_bound(regression, float(np.trace(R))) <= target


@pytest.mark.parametrize("goal", ["target", "energy"])
def test_sensitivities_are_derivatives(goal):
    rng = np.random.default_rng(3)
    regression, value, step = random_regression(rng, 2, 4), 0.7 if goal == "target" else 5.0, 1e-5

    def least(alpha=0.0, goes=0.0, sigma=0.0):
        moved = replace(
            regression,
            neglected_norm=regression.neglected_norm + alpha,
            variance=(np.sqrt(regression.variance) + sigma) ** 2,
        )
        if goal == "target":
            return np.trace(least_energy(moved, value + goes))
        return moved.error(least_error(moved, value + goes)).total

    def slope(name):
        return pytest.approx((least(**{name: step}) - least(**{name: -step})) / (2 * step), rel=1e-7)

    if goal == "target":
        found = energy_sensitivity(
            regression, least(), value, regression.error(least_energy(regression, value))
        )
    else:
        found = error_sensitivity(regression, value, regression.error(least_error(regression, value)))
    assert found.neglected_norm == slope("alpha")
    assert found.goal == slope("goes")
    assert found.noise_deviation == slope("sigma")


def test_a_quantity_that_is_not_excited_has_no_finite_error():
    regression = Regression(np.array([1.0, 1.0]), np.array([1.0]), 1.0, 1.0)
    assert regression.error(np.diag([1.0, 0.0, 1.0])).total == np.inf
