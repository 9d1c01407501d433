"""An earlier estimate counts as the data that it came from."""

import numpy as np
import pytest
import scipy.stats

from inputdesign_cli.identification import Earlier, identify
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.gauss_newton import minimise
from inputdesign_cli.identification.records import RecordProblem, Records, evaluate
from inputdesign_cli.plant import Intersample, PolynomialModel
from tests.support.plants import lag_of
from tests.support.records import arx_regressors, shifted, simulated

ARX = PolynomialModel.single([0, 1.0, 0.5], A=[1, -1.2, 0.5], variance=0.3)
JENKINS = PolynomialModel.single([0, 1.0], F=[1, -0.8], C=[1, 0.4], D=[1, -0.6], variance=0.2)


def as_earlier(found):
    return Earlier(found.theta, found.information)


def test_arx_with_known_noise_is_ridge_regression():
    rng = np.random.default_rng(1)
    u, y = (x[0] for x in simulated(ARX, 60, rng))
    root = rng.standard_normal((4, 4))
    earlier = Earlier(ARX.theta + 0.1 * rng.standard_normal(4), 50.0 * root @ root.T)
    records = Records(estimator(ARX, 1.0), ((u, y),), weights=np.array([[1.0 / 0.3]]), earlier=earlier)
    point = evaluate(records, minimise(RecordProblem((records,)), ARX.theta[None]).theta[0])
    phi = arx_regressors(u[:, 0], y[:, 0])
    information = phi.T @ phi / 0.3 + earlier.information
    right = phi.T @ y[:, 0] / 0.3 + earlier.information @ earlier.theta
    np.testing.assert_allclose(point.theta, np.linalg.solve(information, right), rtol=1e-8)
    np.testing.assert_allclose(point.hessian, information, rtol=1e-8)
    alone = np.linalg.lstsq(phi, y[:, 0], rcond=None)[0]
    both = np.linalg.inv(phi.T @ phi / 0.3) + np.linalg.inv(earlier.information)
    statistic = (alone - earlier.theta) @ np.linalg.solve(both, alone - earlier.theta)
    differing = earlier.agreement(point.theta, np.linalg.cholesky(information))
    assert differing == pytest.approx(scipy.stats.chi2.sf(statistic, 4), rel=1e-6)


def in_s(rng):
    model = lag_of([2.0], [1.0, 0.8, 1.0])
    u = rng.standard_normal((2, 800, 1))
    y = np.array([model.driven(x, Intersample(0.4, hold=False)) for x in u])
    return model, u, y + 0.3 * rng.standard_normal(y.shape)


@pytest.mark.slow
@pytest.mark.parametrize(
    "made", [in_s, lambda rng: (JENKINS, *simulated(JENKINS, 1500, rng, runs=2))], ids=["s", "q"]
)
def test_sequential_estimates_approach_the_joint_estimate_of_two_records(made):
    model, u, y = made(np.random.default_rng(3))
    first = identify(model, u[0], y[0], 0.4, rest=True)
    then = identify(model, u[1], y[1], 0.4, rest=True, earlier=as_earlier(first))
    both = np.concatenate(u), np.concatenate(y)
    joint = identify(model, *both, 0.4, rest=True, lengths=[len(u[0])] * 2)
    deviation = np.sqrt(np.diag(joint.covariance))
    assert np.all(np.abs(then.theta - joint.theta) < 0.15 * deviation)
    np.testing.assert_allclose(np.sqrt(np.diag(then.covariance)), deviation, rtol=0.05)


def test_an_earlier_estimate_without_information_changes_nothing():
    u, y = (x[0] for x in simulated(JENKINS, 400, np.random.default_rng(5)))
    plain = identify(JENKINS, u, y, rest=True)
    nothing = identify(JENKINS, u, y, rest=True, earlier=Earlier(JENKINS.theta, np.zeros((4, 4))))
    np.testing.assert_allclose(nothing.theta, plain.theta, atol=1e-6)
    np.testing.assert_allclose(nothing.covariance, plain.covariance, rtol=1e-5)
    assert nothing.prior.differing == 1.0
    assert plain.prior is None


def test_knowledge_of_one_parameter_makes_up_for_missing_excitation():
    u = np.sin(0.7 * np.arange(300))[:, None]
    model = PolynomialModel.single([0, 1, 1, 1])
    y = np.array([shifted(u[:, 0], lag) * b for lag, b in ((1, 1.0), (2, 0.5), (3, 0.2))]).sum(axis=0)
    y = y[:, None] + 0.1 * np.random.default_rng(6).standard_normal((300, 1))
    information = np.zeros((3, 3))
    information[2, 2] = 1e6
    found = identify(model, u, y, rest=False, earlier=Earlier(np.array([0, 0, 0.2]), information))
    np.testing.assert_allclose(found.theta, [1.0, 0.5, 0.2], atol=0.06)


@pytest.mark.first(1)
@pytest.mark.parametrize("model", [ARX, JENKINS], ids=["arx", "bj"])
def test_an_earlier_estimate_from_the_same_data_is_recognised(model):
    """Another record, another output for the same input, and a part of the data are not."""
    rng = np.random.default_rng(7)
    u, y = simulated(model, 200, rng, runs=2)
    other = y[0] + 0.1 * rng.standard_normal(y[0].shape)
    first = as_earlier(identify(model, u[0], y[0], rest=True))
    same = []
    for ours, theirs in ((u[0], y[0]), (u[1], y[1]), (u[0], other), (u[0][:150], y[0][:150])):
        found = identify(model, ours, theirs, rest=True, earlier=first)
        same.append(first.is_of_these_data(found.theta, found.factor))
    assert same == [True, False, False, False]
