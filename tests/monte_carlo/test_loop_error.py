"""The Monte Carlo study: exact filters, exact estimates, and losses that agree with theory."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.loop_error import InternalModel, LoopErrorProblem, ModelReference
from inputdesign_cli.design.loop_error.desired_loop import DesiredLoop
from inputdesign_cli.identification.polynomial_rows import estimated_polynomials, least_squares
from inputdesign_cli.monte_carlo.loop_error import error_filters, prefilter, study_losses
from inputdesign_cli.plant import Rational, TransferMatrix
from inputdesign_cli.plant.polynomial import determinant_and_adjugate, multiply
from inputdesign_cli.signal.lines import grid_lines
from inputdesign_cli.signal.periodic import harmonics
from tests.support.loop_error import column, matrix_plant, random_plant

W = np.linspace(0.05, 3.1, 9)


def flat(samples, n=2):
    L = harmonics(samples)
    return grid_lines(np.broadcast_to(np.eye(n, dtype=complex), (L.size, n, n)), samples, 1.0)


def target(n, *, matrix):
    if not matrix:
        return TransferMatrix.diagonal(Rational.build([0.0, 0.4], [1.0, -0.6]), n)
    entries = [[[0.0, 0.4 if i == j else 0.05 * (i - j)] for j in range(n)] for i in range(n)]
    return TransferMatrix.build(entries, [[[1.0, -0.6]] * n] * n)


def arx(plant):
    """The plant with white equation noise."""
    return replace(plant, C=(np.ones(1),), D=(np.ones(1),))


@pytest.mark.parametrize("n", [1, 2, 3])
def test_adjugate_and_determinant(n):
    matrix = np.random.default_rng(n).standard_normal((4, n, n, 3))
    det, adj = determinant_and_adjugate(matrix)
    product = multiply(matrix, adj)
    for i in range(n):
        for j in range(n):
            expected = np.zeros((4, product.shape[-1]))
            if i == j:
                expected[:, : det.shape[-1]] = det
            np.testing.assert_allclose(product[:, i, j], expected, atol=1e-10)


def filtered(plant, desired, theta):
    """Return the filters (runs, len(W), n, n) behind r - v, and their denominators."""
    numerator, denominator = error_filters(plant, desired, *estimated_polynomials(plant, theta))
    q = np.exp(-1j * W)
    above = np.einsum("kl,rijl->rkij", q[:, None] ** np.arange(numerator.shape[-1]), numerator)
    below = denominator @ (q ** np.arange(denominator.shape[-1])[:, None])
    return above / below[:, :, None, None] @ prefilter(desired).at(W), denominator


def difference(plant, law, controller):
    """Return the loop with a controller (len(W), n, n) less the loop that the law asks for."""
    L = plant.plant_at(W) @ controller
    return np.linalg.solve(np.eye(plant.outputs) + L, L) - law.complementary(W)


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("matrix", [False, True])
@pytest.mark.parametrize("common", [False, True])
def test_the_filters_are_the_difference_of_the_two_loops(n, matrix, common):
    rng = np.random.default_rng(10 * n + matrix)
    bare = arx(column().plant if common and n == 2 else random_plant(rng, n))
    T = target(n, matrix=matrix)
    law, theta = ModelReference(T), bare.theta
    theta = theta + 0.01 * rng.standard_normal((2, theta.size)) * np.abs(theta)
    found, denominator = filtered(bare, DesiredLoop(T), theta)
    for run in range(2):
        expected = difference(bare, law, law.controller(bare.at(theta[run]).plant_at(W), W))
        np.testing.assert_allclose(found[run], expected, atol=1e-9 * np.abs(expected).max())
        assert abs(denominator[run, 0]) > 0


INVERSE = {
    "zero outside": [[[0, 1.0, -1.5]]],
    "pair outside, delay": [[[0, 0, 1.0, -2.0, 3.0]]],
    "no zero": [[[0, 1.0]]],
    "two channels": [[[0, 1.0], [0, 0, 1.8]], [[0, 1.0], [0, 0.9, 0.3]]],
}


def internal_model(name, variance=0.1):
    B = INVERSE[name]
    n = len(B)
    plant = matrix_plant(A=[[1, -0.8], [1, -0.5]][:n], B=B, covariance=variance * np.eye(n))
    law = InternalModel.build(plant, Rational.build([0.4], [1, -0.6]))
    return LoopErrorProblem(plant, law, (PowerLimit("input", 1.0),), np.ones(n))


@pytest.mark.parametrize("name", INVERSE)
def test_each_estimate_keeps_its_own_zeros_in_the_loop(name):
    """The filters against the loop of the controller that the law designs on each estimate."""
    problem = internal_model(name)
    plant, desired = problem.plant, problem.law.desired
    rng = np.random.default_rng(5)
    theta = plant.theta * (1 + 0.05 * rng.standard_normal((4, plant.theta.size)))
    found, denominator = filtered(plant, desired, theta)
    for run in range(4):
        model = plant.at(theta[run])
        law = InternalModel.build(model, Rational.build([0.4], [1, -0.6]))
        expected = difference(plant, problem.law, law.controller(model.plant_at(W), W))
        np.testing.assert_allclose(found[run], expected, atol=1e-9 * np.abs(expected).max())
        # No factor outside the circle is left: a loop with such a model is stable.
        assert np.abs(np.roots(denominator[run])).max() < 1


@pytest.mark.parametrize("name", ["zero outside", "two channels"])
def test_losses_with_zeros_outside_agree_with_theory(name):
    problem = internal_model(name, variance=0.01)
    samples, runs, n = 2000, 300, problem.plant.outputs
    found = study_losses(problem, {"white": flat(samples, n)}, samples=samples, runs=runs, seed=0)["white"]
    assert found.unstable == 0
    criterion, lines = problem.parametric(), flat(samples, n)
    information = criterion.information(lines.frequencies, lines.powers, np.ones(len(lines.powers)))
    squares = found.exact**2
    error = squares.std(ddof=1) / np.sqrt(runs)
    assert squares.mean() == pytest.approx(criterion.value(information), abs=4 * error)
    assert error < 0.1 * squares.mean()
    assert found.loss.mean() == pytest.approx(found.exact.mean(), rel=0.03)


def test_least_squares_without_noise_is_exact():
    plant = arx(random_plant(np.random.default_rng(0), 2))
    u = np.random.default_rng(1).standard_normal((3, 400, 2))
    y = np.zeros_like(u)
    for i in range(2):
        for j in range(2):
            y[..., i] += scipy.signal.lfilter(plant.B[i][j], plant.A[i], u[..., j])
    theta = least_squares(plant, u, y)
    np.testing.assert_allclose(theta, np.broadcast_to(plant.theta, theta.shape), atol=1e-9)


def test_least_squares_is_weighted_with_the_noise():
    """Against the normal equations written out for one run with correlated noise and a common A."""
    problem = column(variance=1.0)
    covariance = np.array([[1.0, 0.6], [0.6, 2.0]])
    plant = arx(problem.plant)
    plant = replace(plant, covariance=covariance)
    rng = np.random.default_rng(2)
    u, y = rng.standard_normal((1, 200, 2)), rng.standard_normal((1, 200, 2))
    inverse = np.linalg.inv(covariance)
    normal, rhs = np.zeros((5, 5)), np.zeros(5)
    for t in range(1, 200):
        Phi = np.zeros((2, 5))
        Phi[:, 0] = -y[0, t - 1]
        Phi[0, 1:3] = u[0, t - 1]
        Phi[1, 3:5] = u[0, t - 1]
        normal += Phi.T @ inverse @ Phi
        rhs += Phi.T @ inverse @ y[0, t]
    np.testing.assert_allclose(least_squares(plant, u, y)[0], np.linalg.solve(normal, rhs), rtol=1e-9)


def test_the_loss_of_the_column_agrees_with_theory():
    problem = column()
    samples, runs = 4000, 150
    found = study_losses(problem, {"white": flat(samples)}, samples=samples, runs=runs, seed=0)["white"]
    assert found.unstable == 0
    error = found.loss.std(ddof=1) / np.sqrt(runs)
    assert found.loss.mean() == pytest.approx(0.002835, abs=4 * error)
    # Each run's sample average lies near its exact H2 norm, run by run.
    assert np.corrcoef(found.loss, found.exact)[0, 1] > 0.99
    assert found.exact.mean() == pytest.approx(found.loss.mean(), rel=0.03)
    np.testing.assert_allclose(found.power, 1.0, rtol=0.02)


def test_a_study_is_repeatable_and_treats_inputs_alike():
    problem = column()
    both = {"a": flat(500), "b": flat(500)}
    study = study_losses(problem, both, samples=500, runs=7, seed=3)
    np.testing.assert_array_equal(study["a"].loss, study["b"].loss)
    again = study_losses(problem, both, samples=500, runs=7, seed=3)
    np.testing.assert_array_equal(study["a"].loss, again["a"].loss)


def test_unstable_loops_are_counted_and_left_out():
    plant = arx(random_plant(np.random.default_rng(0), 1))
    noisy = replace(plant, covariance=np.array([[400.0]]))
    problem = LoopErrorProblem(
        noisy, ModelReference(target(1, matrix=False)), (PowerLimit("input", 1.0),), np.ones(1)
    )
    found = study_losses(problem, {"white": flat(60, 1)}, samples=60, runs=80, seed=0)["white"]
    assert found.unstable > 0
    assert found.loss.size == 80 - found.unstable
    assert np.all(np.isfinite(found.loss))
