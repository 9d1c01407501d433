from dataclasses import dataclass

import numpy as np
import pytest
import scipy.optimize
import scipy.signal

from inputdesign_cli.identification import fit_batch, identify
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.stability import is_stable, reflected
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
