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
def test_prediction_errors_at_the_truth_are_the_noise(name):
    model = SYSTEMS[name]
    u, e = np.random.default_rng(2).standard_normal((2, 80, 1))
    errors, _ = estimator(model, 1.0).errors_and_gradient(model.theta, u, sum(model.simulate(u, e, 1.0)))
    np.testing.assert_allclose(errors, e, atol=1e-10)


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
def test_an_input_that_answers_the_noise_is_no_fault_of_the_model():
    """y = 0.5 u(t-1) + 0.8 y(t-1) - .. + e under u = r - 0.6 y, r slow: u(t) itself tells e(t)."""
    model, rng = one_channel([0, 1], F=[1, 0]), np.random.default_rng(3)
    slow = scipy.signal.lfilter([1.0], [1.0, -0.9], rng.standard_normal((40, 400)))
    e, y, u, x = 0.3 * rng.standard_normal((40, 400)), np.zeros((40, 400)), np.zeros((40, 400)), 0.0
    for t in range(400):
        x = 0.8 * x + 0.5 * u[:, t - 1] if t else np.zeros(40)
        y[:, t] = x + e[:, t]
        u[:, t] = slow[:, t] - 0.6 * y[:, t]
    pairs = [(one[:, None], other[:, None]) for one, other in zip(u, y, strict=True)]
    told, untold = (
        np.array([identify(model, *pair, feedback=loop).tests.independence.probability for pair in pairs])
        for loop in (True, False)
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
