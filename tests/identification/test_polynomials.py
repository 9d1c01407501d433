from dataclasses import dataclass

import numpy as np
import pytest
import scipy.optimize
import scipy.signal

from inputdesign_cli.identification import fit_batch, identify
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.gauss_newton import minimise
from inputdesign_cli.identification.polynomial_rows import FromRest
from inputdesign_cli.identification.records import RecordProblem, Records, evaluate, information_of
from inputdesign_cli.identification.stability import is_stable, reflected
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.statistics import whitened_eigenvalues, wishart_range
from inputdesign_cli.specification.models.fields import check_delay_stable
from inputdesign_cli.spectrum import FirBasis
from tests.support.identification_systems import SYSTEMS, data, one_channel
from tests.support.plants import arx, box_jenkins, stated
from tests.support.records import check_record, shifted, simulated
from tests.support.refusals import refused


def theory(model, samples):
    """The information matrix M of unit white inputs, by integrals over frequency."""
    experiment = Experiment(model, samples)
    basis = FirBasis(model.inputs, 0)
    maps = basis.integrals(experiment.information_density, experiment.singularities)
    densities = np.array([basis.density(unit, np.zeros(1))[0].real.ravel() for unit in np.eye(len(maps))])
    x = np.linalg.lstsq(densities.T, np.eye(model.inputs).ravel(), rcond=None)[0]
    return experiment.baseline_information + np.tensordot(x, maps, axes=1)


def stacked(model, u, y):
    """Regressors (samples, p, k) of the 2 x 2 ARX plant with a common A of two coefficients, by hand."""
    n = len(y)
    phi = np.zeros((n, 2, 10))
    for i in range(2):
        for lag in (1, 2):
            phi[:, i, lag - 1] = shifted(-y[:, i], lag)
            for j in range(2):
                phi[:, i, 2 + 4 * i + 2 * j + lag - 1] = shifted(u[:, j], lag)
    return phi


@pytest.mark.first(2)
@pytest.mark.parametrize("runs", [3, 30])
def test_the_gradient_of_a_batch_is_a_difference_quotient_of_its_cost(runs):
    model, rng = box_jenkins(), np.random.default_rng(1)
    problem = FromRest.of(model, *simulated(model, 80, rng, runs))
    theta = model.theta * (1 + 0.03 * rng.standard_normal((runs, model.theta.size)))
    cost, hessian, slope = problem.at(theta)
    for k, step in enumerate(1e-6 * np.eye(model.theta.size)):
        ahead, behind = (problem.at(theta + sign * step)[0] for sign in (1, -1))
        expected = -(ahead - behind) / 4e-6
        scale = np.sqrt(hessian[:, k, k] * cost)
        np.testing.assert_allclose(slope[:, k] / scale, expected / scale, atol=1e-6)


def with_known_noise(model, u, y):
    """Theta and its information matrix; the known covariance of the noise weights the search."""
    records = Records(estimator(model, 1.0), ((u, y),), weights=np.linalg.inv(model.covariance))
    theta = minimise(RecordProblem((records,)), model.theta[None]).theta[0]
    return theta, information_of(records, evaluate(records, theta), model.covariance)


def test_with_known_noise_covariance_the_estimate_is_generalised_least_squares():
    model = arx(per_output=False)
    u, y = (x[0] for x in simulated(model, 300, np.random.default_rng(4)))
    root = np.linalg.inv(np.linalg.cholesky(model.covariance))
    phi = np.einsum("pq,nqk->npk", root, stacked(model, u, y)).reshape(600, 10)
    expected = np.linalg.lstsq(phi, (y @ root.T).reshape(600), rcond=None)[0]
    theta, information = with_known_noise(model, u, y)
    np.testing.assert_allclose(theta, expected, atol=1e-9)
    np.testing.assert_allclose(information, phi.T @ phi, rtol=1e-9, atol=1e-6)


def test_with_unknown_noise_covariance_the_estimate_is_zellners():
    """Iterated generalised least squares (Zellner) minimise the determinant of the residual covariance."""
    model = arx(per_output=False)
    u, y = (x[0] for x in simulated(model, 300, np.random.default_rng(5)))
    phi = stacked(model, u, y)
    covariance = np.eye(2)
    for _ in range(50):
        root = np.linalg.inv(np.linalg.cholesky(covariance))
        whitened = np.einsum("pq,nqk->npk", root, phi).reshape(600, 10)
        theta = np.linalg.lstsq(whitened, (y @ root.T).reshape(600), rcond=None)[0]
        left = y - phi @ theta
        covariance = left.T @ left / 300
    found = identify(model, u, y)
    assert found.search.converged
    np.testing.assert_allclose(found.theta, theta, atol=1e-8)
    np.testing.assert_allclose(found.errors, left, atol=1e-7)
    # Unbiased to first order: each output has four parameters of its own and half of the common two.
    np.testing.assert_allclose(found.noise, covariance * 300 / (300 - 5), rtol=1e-6)


@dataclass(frozen=True)
class Renamed:
    """A kind of model from outside the package: a polynomial one by another name."""

    inner: object
    inputs: int = 1


def test_an_estimator_can_be_registered_for_a_new_kind_of_model():
    with pytest.raises(TypeError, match="object"):
        identify(object(), np.ones((10, 1)), np.ones((10, 1)))
    estimator.register(Renamed, lambda model, step: estimator(model.inner, step))
    model = SYSTEMS["oe"]
    u, y = data("oe", 200, np.random.default_rng(1), runs=2)
    one, other = (identify(named, u[0], y[0]).theta for named in (model, Renamed(model)))
    np.testing.assert_array_equal(one, other)
    one, other = (fit_batch(named, u, y, start=model.theta).theta for named in (model, Renamed(model)))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("model", SYSTEMS.values(), ids=SYSTEMS)
def test_prediction_errors_at_the_truth_are_the_noise(model):
    check_record(model, 80)


@pytest.mark.parametrize("name", ["armax", "oe", "bj"])
def test_the_estimates_of_a_batch_agree_with_scipy_least_squares(name):
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
def test_stated_feedback_does_not_fail_the_independence_test():
    """The plant 0.5 q^-1 / (1 - 0.8 q^-1) under u = r - 0.6 y with slow r: u(t) contains e(t)."""
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


MODELS = {"common": arx(per_output=False), "bj": SYSTEMS["bj"], "two bj": box_jenkins(), "two arx": arx()}


@pytest.mark.first(1)
@pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
def test_known_parameters_are_recovered_without_a_start(model):
    u, y = (x[0] for x in simulated(model, 3000, np.random.default_rng(8)))
    found = identify(model, u, y)
    assert found.search.converged
    off, k = found.theta - model.theta, len(found.names)
    # Mahalanobis distance: chi-squared with k degrees of freedom.
    assert off @ np.linalg.solve(found.covariance, off) < k + 6 * np.sqrt(2 * k)
    np.testing.assert_allclose(found.noise, model.covariance, atol=0.15 * model.covariance.max())
    assert found.tests.whiteness.probability > 1e-3
    assert found.tests.independence.probability > 1e-3
    expected = theory(model, 3000)
    np.testing.assert_allclose(found.information, expected, atol=0.15 * expected.max())


MODELS |= SYSTEMS


def test_units_of_the_channels_do_not_matter():
    model = arx(per_output=False)
    u, y = (x[0] for x in simulated(model, 400, np.random.default_rng(9)))
    plain = identify(model, u, y)
    scaled = identify(model, u * [1e4, 1e-3], y * [1e-5, 1e6])
    assert scaled.search.converged
    np.testing.assert_allclose(scaled.theta[:2], plain.theta[:2], atol=1e-7)
    ours, its = ([one.whiteness, *one.scores, *one.future] for one in (plain.tests, scaled.tests))
    for mine, other in zip(ours, its, strict=True):
        assert other.statistic == pytest.approx(mine.statistic, rel=1e-5)


def _channel(x, index, values):
    x = x.copy()
    x[:, index] = values
    return x


@pytest.mark.parametrize(
    ("change", "code", "named"),
    [
        (lambda u, y: (u[:10], y[:10]), "too-few-samples", "10 samples"),
        (lambda u, y: (_channel(u, 1, 2.0), y), "constant-input", "u2"),
        (lambda u, y: (u, _channel(y, 1, 0.0)), "constant-output", "y2"),
        (lambda u, y: (_channel(u, 1, u[:, 0]), y), "not-exciting", "b1[1,1]"),
        (lambda u, y: (u, _channel(y, 1, shifted(u[:, 0], 1))), "noise-free-data", "y2"),
        (lambda u, y: (u, y[:, :1] * [1.0, 2.0]), "noise-free-data", "y1 and y2"),
    ],
)  # fmt: skip
def test_bad_data_is_refused_and_the_channel_named(change, code, named):
    u, y = (x[0] for x in simulated(arx(), 300, np.random.default_rng(14)))
    found = refused(identify, arx(), *change(u, y))
    assert found[0].code == code
    assert named in found[0].message
    assert ("b1[1,1]" in found[0].message) == (named == "b1[1,1]")  # never a determined one


@pytest.mark.parametrize(
    ("model", "runs", "samples"),
    [
        (arx(), 200, 1500),
        *(
            pytest.param(one, 500, 3000, marks=pytest.mark.slow)
            for one in (arx(per_output=False), box_jenkins())
        ),
    ],
    ids=["arx", "common", "bj"],
)
def test_estimates_reach_the_cramer_rao_bound(model, runs, samples):
    u, y = simulated(model, samples, np.random.default_rng(16), runs)
    found = fit_batch(model, u, y, start=model.theta)
    assert np.all(found.converged)
    information = theory(model, samples)
    alone = identify(model, u[3], y[3], start=model.theta)
    # With a noise model the single estimate also estimates the noise before the record.
    apart = (found.theta[3] - alone.theta) / np.sqrt(np.diag(alone.covariance))
    assert np.abs(apart).max() < (1e-5 if model.C[0].size == model.D[0].size == 1 else 0.1)
    np.testing.assert_allclose(found.noise.mean(axis=0), model.covariance, atol=0.02 * model.covariance.max())
    # The mean square in units of the bound, over all directions: its own error is sqrt(2 / (runs k)).
    whitened = (found.theta - model.theta) @ np.linalg.cholesky(information)
    assert np.sqrt(np.mean(whitened**2)) == pytest.approx(1.0, abs=0.05)
    eigenvalues = whitened_eigenvalues(found.theta, information)
    low, high = wishart_range(len(model.names), runs, np.random.default_rng(17))
    assert low < eigenvalues.min() <= eigenvalues.max() < high


@pytest.mark.parametrize("gap", [0.0, 1e-15, 1e-13, 1e-12, 1e-11, 1e-10, 3e-10, 3e-9, 1e-8, 1e-4])
@pytest.mark.parametrize("angle", [0.0, 1.0, np.pi])
def test_polynomials_that_count_as_stable_are_accepted_in_a_spec(gap, angle):
    roots = (1.0 - gap) * np.exp(1j * np.array([angle, -angle] if angle == 1.0 else [angle]))
    for others in ((), (0.5,), (0.5, -0.9)):
        monic = np.poly([*roots, *others]).real
        taken = bool(is_stable(monic[None])[0])
        assert taken or gap < 1e-6
        assert gap > 1e-11 or not taken
        assert not taken or check_delay_stable(tuple(monic.tolist())) is None
        assert check_delay_stable(tuple(reflected(monic).tolist())) is None


_IN_S = "{continuous: {gain: 2, time_constant: 10}, sample: zoh}"


@pytest.mark.parametrize("gap", [-0.5, 0.0, 1e-13, 1e-11, 1e-8])
@pytest.mark.parametrize("plant", ["{B: [0, 1], F: [1, -0.7]}", _IN_S], ids=["q", "s"])
def test_noise_models_of_a_search_are_accepted_in_a_spec(plant, gap):
    """After any step, C and D have their roots inside the circle by more than rounding."""
    model = stated(f"plant: {plant}\nnoise: {{variance: 1, C: [1, 0.2], D: [1, -0.5]}}\n")
    theta = model.theta.copy()
    for name, sign in (("c1", 1.0), ("d1", -1.0)):
        theta[list(model.names).index(name)] = sign * (1.0 - gap)
    found = dict(zip(model.names, estimator(model, 1.0).stabilised(theta, 50), strict=True))
    for name in ("c1", "d1"):
        assert check_delay_stable((1.0, float(found[name]))) is None
    assert found[model.names[0]] == theta[0]
