"""Theorem 2: the paper's examples, brute force, bounds, limits, sensitivities."""

from dataclasses import replace

import cvxpy as cp
import numpy as np
import pytest
import scipy.optimize

from inputdesign_cli.design.regression.model import Regression, energy_bound, error_bound, least_error
from inputdesign_cli.questions.regression.solve import sensitivity
from tests.support.regression import mse

ONE = Regression(np.array([1.0]), np.array([1.0]), 1.0, 1.0)


def random_regression(rng, m, n):
    return Regression(
        rng.standard_normal(m), rng.standard_normal(n - m), rng.uniform(0.1, 3.0), rng.uniform(0.2, 2.0)
    )


def least_energy(regression, target):
    return least_error(regression, energy_bound(regression, target))


# alpha -> R11, R12, R22: Figure 1 by Theorem 2 in 50 digits (Python's decimal), and the limits of Remark 4.
FIGURE_1 = {
    0.1: (1.0098980305898036, 0.010097970609796571, 0.00010096961014644528),
    1.0: (1.1708203932499369, 0.72360679774997897, 0.44721359549995794),
    10.0: (1.0024937188677710, 0.99749378136659913, 0.99251878105410499),
    0.0: (1, 0, 0),
    1e-9: (1, 0, 0),
    1e9: (1, 1, 1),
}


@pytest.mark.parametrize("alpha", FIGURE_1)
def test_figure_1_and_its_limits_agree_with_theorem_2(alpha):
    R = least_energy(replace(ONE, neglected_norm=alpha), 1.0)
    np.testing.assert_allclose([R[0, 0], R[0, 1], R[1, 1]], FIGURE_1[alpha], rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("second", [np.zeros(2), np.zeros(0)])
def test_without_neglected_weights_the_least_energy_is_the_variance_term(second):
    R = least_energy(Regression(np.array([3.0, 4.0]), second, 2.0, 0.5), 2.0)
    assert np.trace(R) == pytest.approx(0.5 * 25 / 2.0, rel=1e-14)


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
        for _ in range(4):  # restarts where it stops: the optimum is singular, and BFGS gets stuck
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
    assert energy_bound(regression, target) == pytest.approx(problem.value, rel=1e-6)


@pytest.mark.parametrize("seed", range(20))
def test_the_target_is_met_and_the_bounds_hold_for_any_moments(seed):
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, 4))
    n = m + int(rng.integers(0, 4))
    regression, target = random_regression(rng, m, n), rng.uniform(0.1, 3.0)
    R = least_energy(regression, target)
    energy = np.trace(R)
    assert regression.error(R).total == pytest.approx(target, rel=1e-12)
    assert np.linalg.eigvalsh(R)[0] >= -1e-12 * energy
    assert error_bound(regression, energy) == pytest.approx(target, rel=1e-11)
    F = rng.standard_normal((n, n))
    reached, spent = regression.error(F @ F.T).total, float(np.sum(F**2))
    assert energy_bound(regression, reached) <= spent * (1 + 1e-12)
    assert error_bound(regression, spent) <= reached * (1 + 1e-12)


@pytest.mark.parametrize("of_energy", [True, False])
def test_sensitivities_are_derivatives(of_energy):
    rng = np.random.default_rng(3)
    regression, value, step = random_regression(rng, 2, 4), 0.7 if of_energy else 5.0, 1e-5

    def least(alpha=0.0, goes=0.0, sigma=0.0):
        moved = replace(
            regression,
            neglected_norm=regression.neglected_norm + alpha,
            variance=(np.sqrt(regression.variance) + sigma) ** 2,
        )
        return (energy_bound if of_energy else error_bound)(moved, value + goes)

    energy = least() if of_energy else value
    split = regression.error(least_error(regression, energy))
    found = sensitivity(regression, energy, split, target=of_energy)
    for name, slope in zip(
        ("alpha", "goes", "sigma"),
        (found.neglected_norm, found.target or found.energy, found.noise_deviation),
        strict=True,
    ):
        differences = (least(**{name: step}) - least(**{name: -step})) / (2 * step)
        assert slope == pytest.approx(differences, rel=1e-7)


def test_a_quantity_that_is_not_excited_has_no_finite_error():
    regression = Regression(np.array([1.0, 1.0]), np.array([1.0]), 1.0, 1.0)
    assert regression.error(np.diag([1.0, 0.0, 1.0])).total == np.inf
