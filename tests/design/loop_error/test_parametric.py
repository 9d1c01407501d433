"""The exact finite-order criterion: its ingredients, its optimum, and the figures of docs/errata.md."""

import numpy as np
import pytest

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.loop_error import InternalModel, LoopErrorProblem, MinimumVariance, ModelReference
from inputdesign_cli.design.loop_error.laws import sensitivity
from inputdesign_cli.design.loop_error.parametric import error_eigenvalues, root_moments
from inputdesign_cli.plant import Rational, TransferMatrix
from tests.support.loop_error import column, matrix_plant, random_hermitian, random_plant

W = np.array([0.05, 0.4, 1.3, 2.8])


def full_plant():
    """Every polynomial has parameters; two outputs, two inputs."""
    return matrix_plant(
        A=[[1, -0.5], [1, 0.3, 0.1]],
        B=[[[0, 1.0, 0.2], [0, 0.1]], [[0, 0, 0.3], [0, 1.5]]],
        F=[[[1, -0.2], [1]], [[1, 0.1, 0.2], [1, 0.4]]],
        C=[[1, 0.3], [1]],
        D=[[1], [1, -0.6]],
        covariance=[[1.0, 0.2], [0.2, 0.5]],
    )


def moved(plant, index, step):
    """The plant with one parameter changed."""
    theta = plant.theta.copy()
    theta[index] += step
    return plant.at(theta)


@pytest.mark.parametrize("plant", [full_plant(), column().plant], ids=["all polynomials", "column"])
def test_gradients_are_those_of_finite_differences(plant):
    dG, dH = plant.plant_gradient(W), plant.noise_at(W)[:, None] @ plant.noise_gradient(W)
    step = 1e-6
    for k in range(plant.theta.size):
        up, down = moved(plant, k, step), moved(plant, k, -step)
        np.testing.assert_allclose(
            dG[:, k], (up.plant_at(W) - down.plant_at(W)) / (2 * step), rtol=1e-7, atol=1e-8
        )
        np.testing.assert_allclose(
            dH[:, k], (up.noise_at(W) - down.noise_at(W)) / (2 * step), rtol=1e-7, atol=1e-8
        )


def test_parameters_are_named_by_output_and_input():
    assert column().plant.names == ("a1", "b1[1,1]", "b1[1,2]", "b1[2,1]", "b1[2,2]")
    assert full_plant().names[:4] == ("a1[1]", "a1[2]", "a2[2]", "b1[1,1]")


def test_the_information_of_an_arx_model_is_that_of_its_regressors():
    """M = sum of E phi phi^T / lambda: covariances of y and u from impulse responses, not from integrals."""
    a, b, variance, power = 0.8, 0.5, 0.3, 2.0
    plant = matrix_plant(A=[[1, -a]], B=[[[0, b]]], covariance=[[variance]])
    problem = LoopErrorProblem(
        plant,
        ModelReference(TransferMatrix.diagonal(Rational.build([0, 0.5], [1, -0.5]), 1)),
        (PowerLimit("input", 1.0),),
        np.ones(1),
    )
    criterion = problem.parametric()
    rule = problem.rule(1)
    M = criterion.information(rule.nodes, np.full((rule.nodes.size, 1, 1), power, complex), rule.weights)
    yy = (b**2 * power + variance) / (1 - a**2)
    np.testing.assert_allclose(M, [[yy / variance, 0], [0, power / variance]], rtol=1e-10, atol=1e-10)


def test_w_is_the_second_order_growth_of_the_error_of_the_loop():
    """theta^T W theta against the H2 norm of the loop with a slightly wrong model."""
    plant = random_plant(np.random.default_rng(1), 2)
    law = ModelReference(TransferMatrix.diagonal(Rational.build([0, 0.4], [1, -0.6]), 2))
    problem = LoopErrorProblem(plant, law, (PowerLimit("input", 1.0),), np.array([1.0, 2.0]))
    Wmatrix = problem.parametric().W
    rule = problem.rule(1)
    w = rule.nodes
    G, entering = plant.plant_at(w), problem.entering(w)
    T = law.complementary(w)
    for index in range(6):
        step = 1e-5
        C = law.controller(moved(plant, index, step).plant_at(w), w)
        error = np.linalg.solve(np.eye(2) + G @ C, G @ C) - T
        square = np.einsum("kab,kbc,kac,k->", error, entering, np.conj(error), rule.weights).real
        assert square / step**2 == pytest.approx(Wmatrix[index, index], rel=2e-3, abs=1e-9)


def test_w_of_minimum_variance_includes_the_noise_model():
    plant = random_plant(np.random.default_rng(4), 2)
    problem = LoopErrorProblem(plant, MinimumVariance(plant), (PowerLimit("input", 1.0),), np.ones(2))
    Wmatrix = problem.parametric().W
    rule = problem.rule(1)
    w, step = rule.nodes, 1e-5
    G, entering = plant.plant_at(w), problem.entering(w)
    for index in range(plant.theta.size):
        other = moved(plant, index, step)
        C = MinimumVariance(other).controller(other.plant_at(w), w)
        S = np.linalg.inv(np.eye(2) + G @ C)
        error = sensitivity(S) - MinimumVariance(plant).complementary(w)
        square = np.einsum("kab,kbc,kac,k->", error, entering, np.conj(error), rule.weights).real
        assert square / step**2 == pytest.approx(Wmatrix[index, index], rel=2e-3, abs=1e-9)


FILTER = Rational.build([0.4], [1, -0.6])
KEPT = {
    "no zero outside": [[[0, 1.0, -0.5]]],
    "one zero": [[[0, 1.0, -1.5]]],
    "a pair and a delay": [[[0, 0, 1.0, -2.0, 3.0]]],
    "a double zero": [[[0, 1.0, 3.0, 2.25]]],
    "inside and outside": [[[0, 0.5, -1.0, 0.4]]],
    "of two channels": [[[0, 1.0], [0, 0, 1.8]], [[0, 1.0], [0, 0.9, 0.3]]],
}


def with_zeros(B):
    n = len(B)
    return matrix_plant(A=[[1, -0.8], [1, -0.5]][:n], B=B, covariance=0.1 * np.eye(n) + 0.02)


@pytest.mark.parametrize("name", [*KEPT, "minimum variance", "minimum variance, coloured"])
def test_w_includes_what_the_law_has_from_the_model_as_a_whole(name):
    """The controller designed on a model that is slightly off: its own zeros outside, its own first terms."""
    if name in KEPT:
        plant = with_zeros(KEPT[name])

        def law_of(model):
            return InternalModel.build(model, FILTER)
    else:
        colour = {"C": [[1, 0.3]], "D": [[1, 0.5]]} if "coloured" in name else {}
        plant = matrix_plant(A=[[1, -0.7, 0.2]], B=[[[0, 0, 0, 1.0, 0.4]]], covariance=[[0.1]], **colour)
        law_of = MinimumVariance
    problem = LoopErrorProblem(plant, law_of(plant), (PowerLimit("input", 1.0),), np.ones(plant.outputs))
    rule, step = problem.rule(1), 1e-5
    w, identity = rule.nodes, np.eye(plant.outputs)
    G, entering = plant.plant_at(w), problem.entering(w)

    def loop(index, off):
        model = moved(plant, index, off)
        C = law_of(model).controller(model.plant_at(w), w)
        return np.linalg.solve(identity + G @ C, G @ C)

    size = range(plant.theta.size)
    X = np.array([(loop(index, step) - loop(index, -step)) / (2 * step) for index in size])
    expected = np.einsum("lkab,kbc,mkac,k->lm", X, entering, np.conj(X), rule.weights).real
    np.testing.assert_allclose(problem.parametric().W, expected, rtol=1e-6, atol=1e-7 * expected.max())


def value_of(problem, criterion, density):
    rule = problem.rule(1)
    return criterion.value(criterion.information(rule.nodes, density(rule.nodes), rule.weights))


def test_the_figures_of_the_errata():
    problem, alternative = column(), column(white_noise=True)
    criterion = problem.parametric()
    S2, *_ = problem.asymptotic()
    S1, *_ = alternative.asymptotic()

    def flat(w):
        return np.broadcast_to(np.eye(2, dtype=complex), (w.size, 2, 2))

    figures = {
        1.02222e-5: value_of(problem, criterion, flat),
        5.26272e-6: value_of(problem, criterion, lambda w: problem.spectrum_at(w, S2.multipliers)),
        6.24395e-6: value_of(problem, criterion, lambda w: alternative.spectrum_at(w, S1.multipliers)),
    }
    for expected, computed in figures.items():
        assert computed == pytest.approx(expected, rel=5e-6)  # about a unit of the last digit
    best = problem.best_lines(criterion, tolerance=1e-6)
    assert best.value == pytest.approx(5.204e-6, rel=1e-4)
    assert 0 <= best.gap < 1e-6


def test_the_optimum_meets_its_limits_and_no_mixture_beats_its_bound():
    limits = (
        PowerLimit("input", 1.0, channel=0),
        PowerLimit("input", 0.5, channel=1),
        PowerLimit("output", 1e-3, channel=0),
    )
    problem = column(limits=limits)
    criterion = problem.parametric()
    best = problem.best_lines(criterion, tolerance=1e-5)
    powers = np.einsum("pkab,kba->p", problem.metrics(best.frequencies), best.spectrum).real
    assert np.all(powers <= problem.most * (1 + 1e-6))
    assert best.gap < 1e-4
    M = criterion.information(best.frequencies, best.spectrum, np.ones(best.frequencies.size))
    assert criterion.value(M) == pytest.approx(best.value, rel=1e-6)
    rng = np.random.default_rng(0)
    for _ in range(10):
        w = np.sort(rng.uniform(0.001, 3.1, 12))
        Phi = random_hermitian(rng, 12, 2)
        scale = np.max(np.einsum("pkab,kba->p", problem.metrics(w), Phi).real / problem.most)
        assert criterion.value(criterion.information(w, Phi / scale, np.ones(12))) > best.lower_bound


def test_the_moments_of_the_loss():
    mean, sd = root_moments(np.array([3.0]))
    assert mean == pytest.approx(np.sqrt(3.0 * 2 / np.pi), rel=1e-12)
    mean, sd = root_moments(np.array([2.0, 2.0]))
    assert mean == pytest.approx(np.sqrt(2.0) * np.sqrt(np.pi / 2), rel=1e-12)
    eigenvalues = np.array([1.0, 0.2, 1e-3, 0.0])
    mean, sd = root_moments(eigenvalues)
    draws = np.sqrt((np.random.default_rng(0).standard_normal((200_000, 4)) ** 2) @ eigenvalues)
    assert mean == pytest.approx(draws.mean(), abs=4 * draws.std() / np.sqrt(draws.size))
    assert sd == pytest.approx(draws.std(), rel=0.01)
    assert mean**2 + sd**2 == pytest.approx(eigenvalues.sum(), rel=1e-12)


def test_the_theory_row_of_table_i():
    problem = column()
    criterion = problem.parametric()
    rule = problem.rule(1)
    S2, *_ = problem.asymptotic()
    alternative = column(white_noise=True)
    S1, *_ = alternative.asymptotic()
    w = rule.nodes
    rows = (
        (np.broadcast_to(np.eye(2, dtype=complex), (w.size, 2, 2)), (0.002835, 0.001479)),
        (alternative.spectrum_at(w, S1.multipliers), (0.002283, 0.001015)),
        (problem.spectrum_at(w, S2.multipliers), (0.002050, 0.001030)),
    )
    for Phi, expected in rows:
        P = np.linalg.inv(criterion.information(w, Phi, rule.weights))
        assert root_moments(error_eigenvalues(criterion.W, P)) == pytest.approx(expected, rel=1e-3)
