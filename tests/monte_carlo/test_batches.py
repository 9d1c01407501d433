"""Simulated runs: batches, statistics, excitations, and losses of loops that agree with theory."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli.compute.executor import InProcess
from inputdesign_cli.compute.processes import Processes
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.loop_error.laws import DesiredLoop, InternalModel, ModelReference
from inputdesign_cli.design.loop_error.problem import LoopErrorProblem
from inputdesign_cli.errors import IdesignError
from inputdesign_cli.identification.polynomial_rows import estimated_polynomials, least_squares
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.monte_carlo.batches import run_batches
from inputdesign_cli.monte_carlo.excitations import InPhase, Reapplied, Recorded, Redrawn
from inputdesign_cli.monte_carlo.loop_error import error_filters, prefilter, study_losses
from inputdesign_cli.monte_carlo.statistics import binomial_limits, whitened_eigenvalues, wishart_range
from inputdesign_cli.plant import PolynomialModel, Rational, TransferMatrix
from inputdesign_cli.plant.polynomial import determinant_and_adjugate, multiply
from inputdesign_cli.signal.lines import grid_lines
from inputdesign_cli.signal.periodic import harmonics
from inputdesign_cli.spectrum import LinesBasis
from tests.support import jobs
from tests.support.loop_error import column, matrix_plant, random_plant


@pytest.mark.parametrize(("runs", "size", "lengths"), [(7, 3, [3, 3, 1]), (6, 3, [3, 3]), (2, 9, [2])])
def test_runs_are_split_into_batches_with_streams_of_their_own(runs, size, lengths):
    parts = run_batches(jobs.drawn, runs=runs, size=size, seed=1)
    assert [part.size for part in parts] == lengths
    for index, part in enumerate(parts):
        rng = np.random.default_rng(np.random.SeedSequence(1, spawn_key=(index,)))
        np.testing.assert_array_equal(part, rng.standard_normal(part.size))
    children = np.random.SeedSequence(1).spawn(2)
    one, two, again = (run_batches(jobs.drawn, runs=2, size=1, seed=children[n]) for n in (0, 1, 0))
    np.testing.assert_array_equal(one, again)
    assert len(np.unique(np.concatenate([*one, *two]))) == 4


def test_two_processes_give_the_numbers_of_one():
    one, two = (
        np.concatenate(run_batches(jobs.drawn, runs=50, size=4, seed=3, executor=executor))
        for executor in (InProcess(), Processes(2))
    )
    np.testing.assert_array_equal(one, two)


def test_errors_of_a_batch_are_raised():
    with pytest.raises(ValueError, match="of 4"):
        run_batches(jobs.complain, runs=4, size=4, seed=0)


@pytest.mark.slow
def test_a_batch_whose_processes_are_killed_is_reported():
    with pytest.raises(IdesignError, match="a batch of 2 simulated runs has no result") as caught:
        run_batches(jobs.end, runs=2, size=2, seed=0, executor=Processes(1))
    assert caught.value.diagnostics[0].code == "worker-lost"


@pytest.mark.parametrize(("successes", "runs"), [(0, 20), (17, 20), (20, 20), (415, 500)])
def test_binomial_limits_agree_with_scipy(successes, runs):
    expected = scipy.stats.binomtest(successes, runs).proportion_ci(0.95, method="exact")
    assert binomial_limits(successes, runs) == pytest.approx((expected.low, expected.high))


def test_whitened_eigenvalues_do_not_depend_on_coordinates():
    rng = np.random.default_rng(1)
    M = np.array([[4.0, 1.0], [1.0, 1.0]])
    theta = rng.standard_normal((400, 2)) @ np.linalg.inv(np.linalg.cholesky(M))
    values, T = whitened_eigenvalues(theta, M), np.array([[1e3, 2.0], [0.0, 1e-2]])
    changed = whitened_eigenvalues(theta @ T.T, np.linalg.inv(T).T @ M @ np.linalg.inv(T))
    np.testing.assert_allclose(values, changed, rtol=1e-9)
    np.testing.assert_allclose(values, np.sort(np.linalg.eigvals(np.cov(theta.T) @ M)))
    low, high = wishart_range(2, 400, rng)
    assert low < values[0] <= values[1] < high


SAMPLES = 2000
GAINS = np.array([[1.0, 0.4], [0.3, -0.7]])
POWERS = np.array([2.0, 3.0])


def experiment(channels):
    """A plant with a memory of one sample: a record has nearly the information of its spectrum."""
    one = (np.ones(1),)
    F = (one * channels,) * channels
    B = tuple(tuple(np.array([0.0, gain]) for gain in row[:channels]) for row in GAINS[:channels])
    covariance = np.array([[1.0, 0.4], [0.4, 0.5]])[:channels, :channels]
    return Experiment(PolynomialModel(B, one, F, one, one, covariance), SAMPLES)


def flat(method, channels, samples=SAMPLES):
    return Redrawn.flat("f", method, POWERS[:channels], (0.0, np.pi), samples, 1.0)


def check_information(tried, excitation):
    """The information of the spectrum is the mean information of the records."""
    records = excitation.draw(20, SAMPLES, np.random.default_rng(1))
    assert records.shape == (20, SAMPLES, tried.inputs)
    exact = FiniteRecord(tried, SAMPLES, 1.0)
    found = np.mean([exact.information(record) for record in records], axis=0)
    expected = excitation.information(tried)
    np.testing.assert_allclose(found, expected, atol=0.02 * np.abs(expected).max())
    one = Recorded("r", records[0], 1.0)
    np.testing.assert_allclose(one.information(tried), exact.information(records[0]))


@pytest.mark.first(3)
@pytest.mark.parametrize("channels", [1, 2])
@pytest.mark.parametrize("method", ["white", "prbs", "multisine", "binary"])
def test_the_information_of_a_flat_excitation_is_that_of_its_records(method, channels):
    check_information(experiment(channels), flat(method, channels))


@pytest.mark.parametrize("channels", [1, 2])
def test_the_information_of_sinusoids_is_that_of_their_records(channels):
    w = 2 * np.pi * np.array([100, 300]) / 1000
    amplitudes = np.array([[1.0, 2.0], [3.0, -1.0]])[:, :channels]
    size = np.linalg.norm(amplitudes, axis=1)
    basis = LinesBasis(w, amplitudes / size[:, None] + 0j, w, np.ones(channels))
    check_information(experiment(channels), InPhase("i", w, amplitudes, basis, 0.5 * size**2))


@pytest.mark.parametrize("method", ["white", "prbs", "multisine", "binary"])
def test_flat_excitations_have_their_power_exactly(method):
    """A reapplied excitation repeats each of its records."""
    tried = flat(method, 2, 300)
    records = tried.draw(3, 300, np.random.default_rng(2))
    np.testing.assert_allclose(np.mean(records**2, axis=1), np.tile(POWERS, (3, 1)))
    again = Reapplied(tried, 3).draw(7, 300, np.random.default_rng(2))
    np.testing.assert_array_equal(again, records[[0, 0, 0, 1, 1, 1, 2]])
    assert not np.array_equal(records[0], records[1])


W = np.linspace(0.05, 3.1, 9)


def even_lines(samples, n=2):
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
def test_a_matrix_times_its_adjugate_is_its_determinant(n):
    matrix = np.random.default_rng(n).standard_normal((4, n, n, 3))
    det, adj = determinant_and_adjugate(matrix)
    product = multiply(matrix, adj)
    expected = np.zeros(product.shape)
    expected[:, np.arange(n), np.arange(n), : det.shape[-1]] = det[:, None]
    np.testing.assert_allclose(product, expected, atol=1e-10)


def check_filters(plant, law, law_of, desired, theta):
    """Check the filters of r - v: the loop of each estimate minus the loop that the law asks for."""
    numerator, denominator = error_filters(plant, desired, *estimated_polynomials(plant, theta))
    q = np.exp(-1j * W)
    above = np.einsum("kl,rijl->rkij", q[:, None] ** np.arange(numerator.shape[-1]), numerator)
    below = denominator @ (q ** np.arange(denominator.shape[-1])[:, None])
    found = above / below[:, :, None, None] @ prefilter(desired).at(W)
    for run, own in enumerate(map(plant.at, theta)):
        L = plant.plant_at(W) @ law_of(own).controller(own.plant_at(W), W)
        expected = np.linalg.solve(np.eye(plant.outputs) + L, L) - law.complementary(W)
        np.testing.assert_allclose(found[run], expected, atol=1e-9 * np.abs(expected).max())
    return denominator


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("matrix", [False, True])
@pytest.mark.parametrize("common", [False, True])
def test_the_filters_are_the_difference_of_the_two_loops(n, matrix, common):
    rng = np.random.default_rng(10 * n + matrix)
    bare = arx(column().plant if common and n == 2 else random_plant(rng, n))
    T, theta = target(n, matrix=matrix), bare.theta
    law = ModelReference(T)
    theta = theta + 0.01 * rng.standard_normal((2, theta.size)) * np.abs(theta)
    assert np.all(check_filters(bare, law, lambda _: law, DesiredLoop(T), theta)[:, 0] != 0)


INVERSE = {
    "zero outside": [[[0, 1.0, -1.5]]],
    "pair outside, delay": [[[0, 0, 1.0, -2.0, 3.0]]],
    "no zero": [[[0, 1.0]]],
    "two channels": [[[0, 1.0], [0, 0, 1.8]], [[0, 1.0], [0, 0.9, 0.3]]],
}


def internal(plant):
    return InternalModel.build(plant, Rational.build([0.4], [1, -0.6]))


def internal_model(name, variance=0.1):
    n = len(INVERSE[name])
    plant = matrix_plant(A=[[1, -0.8], [1, -0.5]][:n], B=INVERSE[name], covariance=variance * np.eye(n))
    return LoopErrorProblem(plant, internal(plant), (PowerLimit("input", 1.0),), np.ones(n))


@pytest.mark.parametrize("name", INVERSE)
def test_each_estimate_keeps_its_own_zeros_in_the_loop(name):
    """The filters against the loop of the controller that the law designs on each estimate."""
    problem = internal_model(name)
    plant, law = problem.plant, problem.law
    theta = plant.theta * (1 + 0.05 * np.random.default_rng(5).standard_normal((4, plant.theta.size)))
    denominator = check_filters(plant, law, internal, law.desired, theta)
    # No factor outside the circle is left: a loop with such a model is stable.
    assert all(np.abs(np.roots(row)).max() < 1 for row in denominator)


@pytest.mark.first(1)
@pytest.mark.parametrize("name", ["zero outside", "two channels"])
def test_losses_with_zeros_outside_agree_with_theory(name):
    problem = internal_model(name, variance=0.01)
    samples, runs, n = 2000, 300, problem.plant.outputs
    criterion, lines = problem.parametric(), even_lines(samples, n)
    found = study_losses(problem, {"white": lines}, samples=samples, runs=runs, seed=0)["white"]
    assert found.unstable == 0
    information = criterion.information(lines.frequencies, lines.powers, np.ones(len(lines.powers)))
    squares = found.exact**2
    error = squares.std(ddof=1) / np.sqrt(runs)
    assert squares.mean() == pytest.approx(criterion.value(information), abs=4 * error)
    assert error < 0.1 * squares.mean()
    assert found.loss.mean() == pytest.approx(found.exact.mean(), rel=0.03)


def test_least_squares_without_noise_is_exact():
    plant = arx(random_plant(np.random.default_rng(0), 2))
    u = np.random.default_rng(1).standard_normal((3, 400, 2))
    y = [sum(scipy.signal.lfilter(plant.B[i][j], plant.A[i], u[..., j]) for j in range(2)) for i in range(2)]
    theta = least_squares(plant, u, np.stack(y, axis=-1))
    np.testing.assert_allclose(theta, np.broadcast_to(plant.theta, theta.shape), atol=1e-9)


def test_least_squares_is_weighted_with_the_noise():
    """Against the normal equations written out for one run with correlated noise and a common A."""
    covariance = np.array([[1.0, 0.6], [0.6, 2.0]])
    plant = replace(arx(column(variance=1.0).plant), covariance=covariance)
    u, y = np.random.default_rng(2).standard_normal((2, 200, 2))
    Phi = np.zeros((199, 2, 5))
    Phi[:, :, 0], Phi[:, 0, 1:3], Phi[:, 1, 3:5] = -y[:-1], u[:-1], u[:-1]
    weighted = np.einsum("tik,ij->tkj", Phi, np.linalg.inv(covariance))
    normal, rhs = np.einsum("tkj,tjl->kl", weighted, Phi), np.einsum("tkj,tj->k", weighted, y[1:])
    np.testing.assert_allclose(
        least_squares(plant, u[None], y[None])[0], np.linalg.solve(normal, rhs), rtol=1e-9
    )


def test_the_loss_of_the_column_agrees_with_theory():
    problem = column()
    samples, runs = 4000, 150
    found = study_losses(problem, {"white": even_lines(samples)}, samples=samples, runs=runs, seed=0)["white"]
    assert found.unstable == 0
    error = found.loss.std(ddof=1) / np.sqrt(runs)
    assert found.loss.mean() == pytest.approx(0.002835, abs=4 * error)
    # Each run's sample average lies near its exact H2 norm, run by run.
    assert np.corrcoef(found.loss, found.exact)[0, 1] > 0.99
    assert found.exact.mean() == pytest.approx(found.loss.mean(), rel=0.03)
    np.testing.assert_allclose(found.power, 1.0, rtol=0.02)


def test_a_study_is_repeatable_and_treats_inputs_alike():
    both = {"a": even_lines(500), "b": even_lines(500)}
    study, again = (study_losses(column(), both, samples=500, runs=7, seed=3) for _ in range(2))
    np.testing.assert_array_equal(study["a"].loss, study["b"].loss)
    np.testing.assert_array_equal(study["a"].loss, again["a"].loss)


def test_unstable_loops_are_counted_and_left_out():
    noisy = replace(arx(random_plant(np.random.default_rng(0), 1)), covariance=np.array([[400.0]]))
    law, limits = ModelReference(target(1, matrix=False)), (PowerLimit("input", 1.0),)
    problem = LoopErrorProblem(noisy, law, limits, np.ones(1))
    found = study_losses(problem, {"white": even_lines(60, 1)}, samples=60, runs=80, seed=0)["white"]
    assert found.unstable > 0
    assert found.loss.size == 80 - found.unstable
    assert np.all(np.isfinite(found.loss))
