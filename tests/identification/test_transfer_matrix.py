"""Transfer matrices in s from samples: simulation, gradients, estimates and their covariance."""

from pathlib import Path

import numpy as np
import pytest
import scipy.optimize
import scipy.signal

from inputdesign_cli import load_spec, solve
from inputdesign_cli.identification import fit_batch, identify
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.monte_carlo.statistics import whitened_eigenvalues, wishart_range
from inputdesign_cli.plant import ContinuousModel, Intersample, SampledModel
from tests.support.plants import descending, two_by_two

STEP = 0.4


SPECS = Path(__file__).parents[2] / "specs"


def plant(numerator, denominator, *, common=False):
    return ContinuousModel.monic(
        descending(numerator), descending(denominator), np.eye(len(numerator)), common=common
    )


PLANTS = {
    "two by two": two_by_two(),
    "one channel": plant([[[1, 3]]], [[[1, 0.3, 2]]]),
    "biproper": plant([[[1, 2, 3]]], [[[1, 2, 4]]]),
    "one common denominator": plant([[[1, 2], [3]], [[1], [2, 1]]], [[[1, 1, 2]] * 2] * 2, common=True),
    "orders of their own": plant([[[1], [2, 5], [0]]], [[[1, 0.5], [1, 1, 9], [1]]]),
    "a static entry": plant([[[2], [1]]], [[[1], [1, 1]]]),
}
HOLDS = pytest.mark.parametrize("hold", [False, True], ids=["band-limited", "held"])


def actual() -> ContinuousModel:
    """The true plant of the spectral design paper, near its nominal one."""
    return plant(
        [[[3.2], [3.1]], [[5.2], [1.5]]], [[[1, 1.6, 1.5], [1, 1.9, 1]], [[1, 0.5, 0.95], [1, 0.9, 0.3]]]
    )


def excitation(samples, inputs, rng, *, share=0.6):
    """Noise (samples, inputs) below this share of the Nyquist frequency."""
    transform = np.fft.rfft(rng.normal(size=(samples, inputs)), axis=0)
    transform[int(share * len(transform)) :] = 0.0
    return np.fft.irfft(transform, samples, axis=0)


def noisy(model, u, rng, *, hold, level, covariance=None, runs=None):
    """Outputs with noise of `level` times their rms, and the model with the covariance of that noise."""
    y = model.driven(u, Intersample(STEP, hold))
    root = level * np.linalg.cholesky(np.eye(y.shape[1]) if covariance is None else covariance)
    root = y.std(axis=0)[:, None] * root
    shape = y.shape if runs is None else (runs, *y.shape)
    return y + rng.normal(size=shape) @ root.T, model.at(model.theta, root @ root.T)


def as_sampled(model, hold):
    return SampledModel(model, STEP) if hold else model


@pytest.mark.parametrize("name", PLANTS)
def test_the_response_to_a_held_input_agrees_with_zero_order_hold_sampling(name):
    model = PLANTS[name]
    u = np.random.default_rng(0).normal(size=(200, model.inputs))
    expected = np.zeros((200, model.outputs))
    for i, j in model.active:
        top, bottom = model.numerator[i][j][::-1], model.denominator[i][j][::-1]
        b, a, _ = (
            scipy.signal.cont2discrete((top, bottom), STEP, "zoh") if bottom.size > 1 else (top, [1.0], 0)
        )
        expected[:, i] += scipy.signal.lfilter(np.ravel(b), a, u[:, j])
    np.testing.assert_allclose(model.driven(u, Intersample(STEP, True)), expected, atol=1e-11)


def test_the_response_to_a_held_input_is_exact_for_lags_beyond_the_record():
    slow = plant([[[1.0]]], [[[1.0, 1e-6]]])
    u = np.ones((300, 1))
    expected = (1.0 - np.exp(-1e-6 * STEP * np.arange(300))) / 1e-6
    ours = slow.driven(u, Intersample(STEP, True))[:, 0]
    np.testing.assert_allclose(ours, expected, atol=1e-10 * expected.max())


def test_a_band_limited_input_gives_the_response_to_its_interpolation():
    model, factor = PLANTS["two by two"], 64
    u = excitation(256, 2, np.random.default_rng(1), share=0.3) * np.hanning(256)[:, None]
    around = np.concatenate([np.zeros((256, 2)), u, np.zeros((256, 2))])
    fine = scipy.signal.resample(around, factor * len(around), axis=0)
    expected = np.zeros((len(fine), 2))
    for i, j in model.active:
        system = (model.numerator[i][j][::-1], model.denominator[i][j][::-1])
        (above,), below, _ = scipy.signal.cont2discrete(system, STEP / factor, "foh")
        expected[:, i] += scipy.signal.lfilter(above, below, fine[:, j])
    ours = model.driven(u, Intersample(STEP, False))
    np.testing.assert_allclose(ours, expected[256 * factor : 512 * factor : factor], atol=2e-4 * np.std(ours))


@HOLDS
@pytest.mark.parametrize("name", ["two by two", "one common denominator"])
def test_simulated_outputs_agree_with_the_designed_finite_record(name, hold):
    model = PLANTS[name]
    u = excitation(500, model.inputs, np.random.default_rng(2), share=0.3)
    expected = FiniteRecord(Experiment(as_sampled(model, hold), 500), 500, STEP).signals("output", u)
    ours = model.driven(np.stack([u, 2 * u]), Intersample(STEP, hold))
    tolerance = 1e-10 if hold else 1e-5
    np.testing.assert_allclose(ours[0], expected, atol=tolerance * np.std(expected))
    np.testing.assert_allclose(ours[1], 2 * ours[0], atol=1e-12 * np.abs(ours).max())


@HOLDS
@pytest.mark.parametrize("name", PLANTS)
def test_the_gradient_is_a_difference_quotient(name, hold):
    model = PLANTS[name]
    rng = np.random.default_rng(3)
    u = excitation(150, model.inputs, rng)
    kind, y = estimator(as_sampled(model, hold), STEP), rng.normal(size=(150, model.outputs))
    _, psi = kind.errors_and_gradient(model.theta, u, y)
    for index, value in enumerate(model.theta):
        move = 1e-5 * max(abs(value), 0.1) * np.eye(model.theta.size)[index]
        lower, upper = (kind.errors_and_gradient(model.theta + sign * move, u, y)[0] for sign in (-1, 1))
        expected = (lower - upper) / (2 * move[index])
        np.testing.assert_allclose(psi[index], expected, atol=1e-7 * max(np.abs(expected).max(), 1.0))


@HOLDS
@pytest.mark.parametrize("name", PLANTS)
def test_data_without_noise_give_the_true_parameters(name, hold):
    model = PLANTS[name]
    u = excitation(300, model.inputs, np.random.default_rng(5))
    y = model.driven(u, Intersample(STEP, hold))
    found = fit_batch(as_sampled(model, hold), u, y[None], STEP, start=1.15 * model.theta)
    assert np.all(found.converged)
    np.testing.assert_allclose(found.theta[0], model.theta, atol=1e-8)


@pytest.mark.first(2)
@HOLDS
@pytest.mark.parametrize(
    "name", [name if name == "one channel" else pytest.param(name, marks=pytest.mark.slow) for name in PLANTS]
)
def test_parameters_are_found_without_a_start(name, hold):
    model = PLANTS[name]
    rng = np.random.default_rng(6)
    u = excitation(600, model.inputs, rng)
    y, truth = noisy(model, u, rng, hold=hold, level=0.2)
    # The parameter values of the structure are not used.
    anything = model.at(np.ones(model.theta.size))
    found = identify(as_sampled(anything, hold), u, y, STEP)
    assert found.search.converged
    assert found.names == model.names
    off = found.theta - model.theta
    # Mahalanobis distance: chi-squared with k degrees of freedom.
    assert off @ found.information @ off < off.size + 4 * np.sqrt(2 * off.size)
    np.testing.assert_allclose(found.noise, truth.covariance, atol=0.2 * truth.covariance.max())
    assert min(found.simulation.fit) > 75.0
    assert found.tests.whiteness.probability > 1e-3
    assert found.tests.independence.probability > 1e-3


def test_the_estimate_of_one_channel_agrees_with_scipy_least_squares():
    model = PLANTS["one channel"]
    rng = np.random.default_rng(7)
    u = rng.normal(size=(400, 1))
    y, _ = noisy(model, u, rng, hold=True, level=0.3)

    def errors(theta):
        b, a, _ = scipy.signal.cont2discrete((theta[1::-1], [1.0, *theta[:1:-1]]), STEP, "zoh")
        return y[:, 0] - scipy.signal.lfilter(np.ravel(b), a, u[:, 0])

    plain = scipy.optimize.least_squares(
        errors, model.theta, xtol=1e-14, ftol=1e-14, gtol=1e-14, jac="3-point"
    )
    found = identify(as_sampled(model, True), u, y, STEP)
    np.testing.assert_allclose(found.theta, plain.x, atol=1e-6)
    variance = 2 * plain.cost / (400 - 4)
    assert found.noise[0, 0] == pytest.approx(variance, rel=1e-6)
    np.testing.assert_allclose(found.covariance, variance * np.linalg.inv(plain.jac.T @ plain.jac), rtol=1e-4)


@pytest.mark.first(1)
@HOLDS
def test_the_covariance_is_the_inverse_information_of_the_record(hold):
    rng = np.random.default_rng(8)
    u = excitation(500, 2, rng, share=0.4)
    y, _ = noisy(actual(), u, rng, hold=hold, level=0.2, covariance=[[1, 0.7], [0.7, 1]])
    found = identify(as_sampled(two_by_two(), hold), u, y, STEP)
    model = as_sampled(two_by_two().at(found.theta, found.noise), hold)
    expected = FiniteRecord(Experiment(model, 500), 500, STEP).information(u)
    scale = np.sqrt(np.diag(expected))
    difference = (found.information - expected) / np.outer(scale, scale)
    assert np.abs(difference).max() < (1e-9 if hold else 1e-5)
    np.testing.assert_allclose(found.covariance @ found.information, np.eye(12), atol=1e-8)


def test_unstable_starting_points_are_mirrored_at_the_imaginary_axis():
    model = PLANTS["one channel"]
    kind, unstable = estimator(as_sampled(model, True), STEP), np.array([1.0, 1.0, 2.0, -0.3])
    np.testing.assert_allclose(kind.stabilised(unstable, 100), [1.0, 1.0, 2.0, 0.3])
    np.testing.assert_allclose(kind.stabilised(model.theta, 100), model.theta)
    rng = np.random.default_rng(11)
    u = excitation(600, 1, rng)
    y, _ = noisy(model, u, rng, hold=True, level=0.1)
    found = fit_batch(as_sampled(model, True), u, y[None], STEP, start=unstable)
    assert np.all(found.converged)
    np.testing.assert_allclose(found.theta[0], model.theta, atol=0.1)


def test_a_search_that_ends_at_the_edge_of_stability_has_not_converged():
    """The response to a step grows as if the plant integrated, which the structure does not allow."""
    model = plant([[[1.0]]], [[[1.0, 1.0]]])
    rng = np.random.default_rng(12)
    u = np.where(np.arange(400) < 40, 0.0, 1.0)[:, None]
    y = np.cumsum(u, axis=0) ** 1.2 + rng.normal(size=(400, 1))
    found = fit_batch(as_sampled(model, True), u, y[None], STEP, start=[1.0, 0.05])
    assert not found.converged[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("criterion", "level", "covariance"),
    [("D", 0.1, None), ("D", 0.5, 0.9), ("E", 0.1, None), ("E", 0.1, 0.9)],
)
@HOLDS
def test_designed_records_reach_the_cramer_rao_bound(criterion, level, covariance, hold):
    """The case of the spectral design paper; searches begin at the nominal plant."""
    spec = load_spec(
        SPECS / "two_by_two.yaml",
        [f"accuracy.criterion={criterion}", "signal.samples=2000", f"sample_time={STEP}"],
    )
    columns = solve(spec).tables["signal"].columns
    u = np.column_stack([columns["u1"], columns["u2"]])
    full = None if covariance is None else np.array([[1.0, covariance], [covariance, 1.0]])
    rng = np.random.default_rng(16)
    y, truth = noisy(actual(), u, rng, hold=hold, level=level, covariance=full, runs=300)
    found = fit_batch(as_sampled(two_by_two(), hold), u, y, STEP, start=two_by_two().theta)
    assert np.all(found.converged)
    experiment = Experiment(as_sampled(truth, hold), len(u))
    information, off = FiniteRecord(experiment, len(u), STEP).information(u), found.theta - truth.theta
    bound = np.sqrt(np.diag(np.linalg.inv(information)))
    assert 0.9 < np.median(np.sqrt(np.mean(off**2, axis=0)) / bound) < 1.2
    overall = np.sqrt(np.mean((off @ np.linalg.cholesky(information)) ** 2))
    assert overall == pytest.approx(1.0, abs=0.05)
    eigenvalues = whitened_eigenvalues(found.theta, information)
    low, high = wishart_range(12, 300, np.random.default_rng(18))
    assert low < eigenvalues.min() <= eigenvalues.max() < high
