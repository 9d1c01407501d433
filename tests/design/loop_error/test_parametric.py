"""The exact finite-order criterion: its ingredients, its optimum, and the figures of docs/errata.md."""

import numpy as np
import pytest

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.loop_error.design import design_loop_error
from inputdesign_cli.design.loop_error.laws import InternalModel, MinimumVariance, ModelReference
from inputdesign_cli.design.loop_error.parametric import root_moments
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.plant import Rational, TransferMatrix
from tests.support.loop_error import column, matrix_plant, random_hermitian, random_plant

W = np.array([0.05, 0.4, 1.3, 2.8])


def moved(plant, index, step):
    """The plant with one parameter changed."""
    theta = plant.theta.copy()
    theta[index] += step
    return plant.at(theta)


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


FILTER = Rational.build([0.4], [1, -0.6])
KEPT = {
    "no zero outside": [[[0, 1.0, -0.5]]],
    "one zero": [[[0, 1.0, -1.5]]],
    "a pair and a delay": [[[0, 0, 1.0, -2.0, 3.0]]],
    "a double zero": [[[0, 1.0, 3.0, 2.25]]],
    "inside and outside": [[[0, 0.5, -1.0, 0.4]]],
    "two channels": [[[0, 1.0], [0, 0, 1.8]], [[0, 1.0], [0, 0.9, 0.3]]],
}


DELAYED = {"A": [[1, -0.7, 0.2]], "B": [[[0, 0, 0, 1.0, 0.4]]], "covariance": [[0.1]]}
MINIMUM = {
    "minimum variance": matrix_plant(**DELAYED),
    "minimum variance, coloured": matrix_plant(**DELAYED, C=[[1, 0.3]], D=[[1, 0.5]]),
    "minimum variance, two channels": random_plant(np.random.default_rng(4), 2),
}


def with_zeros(B):
    n = len(B)
    return matrix_plant(A=[[1, -0.8], [1, -0.5]][:n], B=B, covariance=0.1 * np.eye(n) + 0.02)


@pytest.mark.parametrize("name", [*KEPT, "model reference", *MINIMUM])
def test_the_weight_w_includes_the_dependence_of_the_control_law_on_the_model(name):
    """W agrees with differences of the loop whose controller is designed on a slightly perturbed model."""
    if name in KEPT:
        plant = with_zeros(KEPT[name])

        def law_of(model):
            return InternalModel.build(model, FILTER)
    elif name == "model reference":
        plant = random_plant(np.random.default_rng(1), 2)
        law = ModelReference(TransferMatrix.diagonal(Rational.build([0, 0.4], [1, -0.6]), 2))

        def law_of(_):
            return law
    else:
        plant, law_of = MINIMUM[name], MinimumVariance
    weights = np.arange(1.0, plant.outputs + 1.0)
    problem = LoopErrorProblem(plant, law_of(plant), (PowerLimit("input", 1.0),), weights)
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


def test_the_figures_of_the_errata_and_the_theory_row_of_table_i():
    problem, alternative = column(), column(white_noise=True)
    criterion, rule = problem.parametric(), problem.rule(1)
    S2, *_ = problem.asymptotic()
    S1, *_ = alternative.asymptotic()
    w = rule.nodes
    rows = (
        (np.broadcast_to(np.eye(2, dtype=complex), (w.size, 2, 2)), 1.02222e-5, (0.002835, 0.001479)),
        (problem.spectrum_at(w, S2.multipliers), 5.26272e-6, (0.002050, 0.001030)),
        (alternative.spectrum_at(w, S1.multipliers), 6.24395e-6, (0.002283, 0.001015)),
    )
    for Phi, value, moments in rows:
        M = criterion.information(w, Phi, rule.weights)
        assert criterion.value(M) == pytest.approx(value, rel=5e-6)  # about a unit of the last digit
        found = root_moments(criterion.error_eigenvalues(M))
        assert found == pytest.approx(moments, rel=1e-3)
    best = design_loop_error(problem, "parametric", tolerance=1e-6)
    assert best.value == pytest.approx(5.204e-6, rel=1e-4)
    assert 0 <= best.gap < 1e-6


def test_the_optimum_meets_its_limits_and_no_random_spectrum_beats_its_bound():
    limits = (
        PowerLimit("input", 1.0, channel=0),
        PowerLimit("input", 0.5, channel=1),
        PowerLimit("output", 1e-3, channel=0),
    )
    problem = column(limits=limits)
    criterion = problem.parametric()
    best = design_loop_error(problem, "parametric", tolerance=1e-5)
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


def test_the_moments_of_the_loss_agree_with_closed_forms_and_monte_carlo():
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
