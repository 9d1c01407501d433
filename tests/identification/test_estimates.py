from dataclasses import dataclass

import numpy as np
import pytest
import scipy.optimize
import scipy.signal

from inputdesign_cli.errors import SpecError
from inputdesign_cli.identification import fit_batch, identify
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.stability import is_stable, reflected
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.statistics import whitened_eigenvalues, wishart_range
from inputdesign_cli.spectrum import FirBasis
from tests.support.identification_systems import SYSTEMS, data, one_channel


@dataclass(frozen=True)
class Renamed:
    """A kind of model from outside the package: a polynomial one by another name."""

    inner: object
    inputs: int = 1


def test_a_new_kind_of_model_brings_its_estimator():
    with pytest.raises(TypeError, match="object"):
        identify(object(), np.ones((10, 1)), np.ones((10, 1)))
    estimator.register(Renamed, lambda model, step: estimator(model.inner, step))
    model = SYSTEMS["oe"]
    u, y = data("oe", 200, np.random.default_rng(1), runs=2)
    one, other = (identify(named, u[0], y[0]).theta for named in (model, Renamed(model)))
    np.testing.assert_array_equal(one, other)
    one, other = (fit_batch(named, u, y, start=model.theta).theta for named in (model, Renamed(model)))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_gradient_is_the_finite_difference(name):
    model, rng = SYSTEMS[name], np.random.default_rng(1)
    kind, (u, y) = estimator(model, 1.0), (x[0] for x in data(name, 60, rng))
    theta = model.theta * (1 + 0.05 * rng.standard_normal(model.theta.size))
    _, psi = kind.errors_and_gradient(theta, u, y)
    for i, step in enumerate(1e-6 * np.eye(theta.size)):
        ahead, behind = (kind.errors_and_gradient(theta + s * step, u, y)[0] for s in (1, -1))
        np.testing.assert_allclose(psi[i], -(ahead - behind) / 2e-6, atol=1e-6 * np.abs(psi[i]).max())


@pytest.mark.parametrize("name", SYSTEMS)
def test_prediction_errors_at_the_truth_are_the_noise(name):
    model = SYSTEMS[name]
    u, e = np.random.default_rng(2).standard_normal((2, 80, 1))
    errors, _ = estimator(model, 1.0).errors_and_gradient(model.theta, u, sum(model.simulate(u, e, 1.0)))
    np.testing.assert_allclose(errors, e, atol=1e-10)


def theory(name, samples):
    """M of unit white input, from the frequency domain."""
    experiment = Experiment(SYSTEMS[name], samples)
    maps = FirBasis(1, 0).integrals(experiment.information_density, experiment.singularities)
    return experiment.baseline_information + maps[0]


def test_arx_is_least_squares():
    u, y = data("arx", 300, np.random.default_rng(1))
    found = identify(SYSTEMS["arx"], u[0], y[0])
    u, y = u[0, :, 0], y[0, :, 0]
    shifted = [np.concatenate([np.zeros(lag), x[:-lag]]) for x in (-y, u) for lag in (1, 2)]
    phi = np.stack(shifted, axis=1)
    expected = np.linalg.lstsq(phi, y, rcond=None)[0]
    np.testing.assert_allclose(found.theta, expected, atol=1e-9)
    residual = y - phi @ expected
    variance = residual @ residual / (300 - 4)
    assert found.noise[0, 0] == pytest.approx(variance, rel=1e-9)
    np.testing.assert_allclose(found.covariance, variance * np.linalg.inv(phi.T @ phi), rtol=1e-7)


@pytest.mark.first(3)
@pytest.mark.parametrize("name", SYSTEMS)
def test_known_parameters_are_recovered_without_a_start(name):
    model = SYSTEMS[name]
    u, y = data(name, 4000, np.random.default_rng(4))
    found = identify(model, u[0], y[0])
    assert found.search.converged
    off, size = found.theta - model.theta, model.theta.size
    # Mahalanobis distance: chi-squared with k degrees of freedom.
    assert off @ np.linalg.solve(found.covariance, off) < size + 6 * np.sqrt(2 * size)
    assert found.noise[0, 0] == pytest.approx(0.5, rel=0.1)
    assert found.tests.whiteness.probability > 1e-3
    assert found.tests.independence.probability > 1e-3
    np.testing.assert_allclose(found.information, theory(name, 4000), atol=0.15 * theory(name, 4000).max())


@pytest.mark.parametrize("name", ["armax", "oe", "bj"])
def test_a_batch_finds_what_a_plain_optimiser_finds(name):
    model = SYSTEMS[name]
    u, y = data(name, 400, np.random.default_rng(5), runs=4)
    found = fit_batch(model, u, y, start=model.theta)
    assert np.all(found.converged)
    for run in range(4):
        plain = scipy.optimize.least_squares(
            lambda x, run=run: estimator(model, 1.0).errors_and_gradient(x, u[run], y[run])[0][:, 0],
            model.theta,
            xtol=1e-12,
            ftol=1e-14,
            gtol=1e-12,
        )
        np.testing.assert_allclose(found.theta[run], plain.x, atol=1e-6)


def test_runs_of_a_batch_do_not_see_each_other():
    model = SYSTEMS["bj"]
    u, y = data("bj", 200, np.random.default_rng(6), runs=40)
    together = fit_batch(model, u, y, start=model.theta)
    alone = fit_batch(model, u[7:8], y[7:8], start=model.theta)
    np.testing.assert_allclose(together.theta[7], alone.theta[0], atol=1e-7)


def test_a_model_that_is_too_small_fails_the_residual_tests():
    u, y = data("bj", 2000, np.random.default_rng(7))
    small = identify(one_channel([0, 1], F=[1, 0]), u[0], y[0])
    assert small.tests.whiteness.probability < 1e-6
    assert small.tests.independence.probability < 1e-6


@pytest.mark.slow
def test_residuals_of_a_right_model_pass_as_often_as_they_should():
    u, y = data("oe", 400, np.random.default_rng(8), runs=60)
    p = [identify(SYSTEMS["oe"], u[i], y[i]) for i in range(60)]
    for probabilities in (
        [e.tests.whiteness.probability for e in p],
        [e.tests.independence.probability for e in p],
    ):
        assert 0.3 < np.mean(probabilities) < 0.7
        assert np.mean(np.array(probabilities) < 0.05) < 0.2


@pytest.mark.slow
def test_an_input_that_answers_the_noise_is_no_fault_of_the_model():
    """y = 0.5 u(t-1) + 0.8 y(t-1) - .. + e under u = r - 0.6 y, r slow: u(t) itself tells e(t)."""
    model, rng = one_channel([0, 1], F=[1, 0]), np.random.default_rng(3)
    slow = scipy.signal.lfilter([1.0], [1.0, -0.9], rng.standard_normal((40, 400)))
    e, y, u, x = 0.3 * rng.standard_normal((40, 400)), np.zeros((40, 400)), np.zeros((40, 400)), 0.0
    for t in range(400):
        x = 0.8 * x + 0.5 * u[:, t - 1] if t else np.zeros(40)
        y[:, t] = x + e[:, t]
        u[:, t] = slow[:, t] - 0.6 * y[:, t]
    told, untold = (
        np.array(
            [
                identify(
                    model, u[i, :, None], y[i, :, None], feedback=feedback
                ).tests.independence.probability
                for i in range(40)
            ]
        )
        for feedback in (True, False)
    )
    assert 0.3 < np.mean(told) < 0.7
    assert np.mean(told < 0.05) < 0.2
    assert np.mean(untold < 0.05) > 0.3


def test_mirrored_polynomials_are_stable():
    rng = np.random.default_rng(9)
    monic = np.concatenate([np.ones((50, 1)), 2 * rng.standard_normal((50, 4))], axis=1)
    expected = [np.abs(np.roots(p)).max() < 1 for p in monic]
    np.testing.assert_array_equal(is_stable(monic), expected)
    assert np.all(is_stable(np.array([reflected(p) for p in monic])))


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda u, y: (u[:8], y[:8]), "too-few-samples"),
        (lambda u, y: (np.full_like(u, 2.0), y), "constant-input"),
        (lambda u, y: (u, np.full_like(y, 2.0)), "constant-output"),
        (lambda u, y: (np.concatenate([[[0.0]], -0.3 * y[:-1]]), y), "not-exciting"),
    ],
)
def test_bad_data_is_refused(change, code):
    # Feedback without excitation, u(t) = -0.3 y(t - 1), makes b1 u(t - 1) a part of a2 y(t - 2).
    u, y = data("oe", 300, np.random.default_rng(10))
    with pytest.raises(SpecError) as caught:
        identify(one_channel([0, 1], A=[1, 0, 0]), *change(u[0], y[0]))
    assert caught.value.diagnostics[0].code == code


@pytest.mark.slow
@pytest.mark.parametrize("name", ["arx", "armax", "oe", "bj"])
def test_estimates_reach_the_cramer_rao_bound(name):
    model = SYSTEMS[name]
    u, y = data(name, 5000, np.random.default_rng(11), runs=500)
    found = fit_batch(model, u, y, start=model.theta)
    assert np.all(found.converged)
    information = theory(name, 5000)
    off = found.theta - model.theta
    # The mean square in units of the bound, over all directions: its own error is sqrt(2 / (500 k)).
    whitened = off @ np.linalg.cholesky(information)
    assert np.sqrt(np.mean(whitened**2)) == pytest.approx(1.0, abs=0.05)
    eigenvalues = whitened_eigenvalues(found.theta, information)
    low, high = wishart_range(model.theta.size, 500, np.random.default_rng(12))
    assert low < eigenvalues.min() <= eigenvalues.max() < high
    # Each run's own covariance is that of theory, too.
    np.testing.assert_allclose(found.information.mean(axis=0), information, atol=0.01 * information.max())
