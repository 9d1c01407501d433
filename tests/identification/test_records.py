"""Several records, of one system or of several, and records that do not begin at rest."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli.identification import identify
from inputdesign_cli.identification.estimators import estimator
from inputdesign_cli.identification.records import Records, evaluate
from inputdesign_cli.plant import SampledModel
from tests.support.identification_systems import SYSTEMS, data, one_channel
from tests.support.plants import box_jenkins, two_by_two
from tests.support.records import arx_regressors

CUT = 60


def model_and_data(name, samples, rng, noise):
    """A model, its inputs u (samples, r) and its outputs y (samples, p)."""
    if name == "in s":
        model = SampledModel(two_by_two(), 0.4)
    else:
        model = box_jenkins() if name == "two outputs" else SYSTEMS[name]
    u = rng.standard_normal((samples, model.inputs))
    e = noise * rng.standard_normal((samples, model.outputs)) @ np.linalg.cholesky(model.covariance).T
    return model, u, sum(model.simulate(u, e, 1.0))


def record_of(name):
    """Two records of a structure, neither of them at rest, and a theta near the truth."""
    rng = np.random.default_rng(3)
    model, u, y = model_and_data(name, 260, rng, 1.0)
    parts = tuple((u[part] + 2.0, y[part] + 5.0) for part in (slice(CUT, 150), slice(150, 260)))
    theta = model.theta * (1 + 0.03 * rng.standard_normal(model.theta.size))
    return Records(estimator(model, 1.0), parts, free=True), theta


@pytest.mark.first(5)
@pytest.mark.parametrize("ramp", [False, True])
@pytest.mark.parametrize("name", [*SYSTEMS, "two outputs", "in s"])
def test_the_slope_with_unknown_starts_is_a_difference_quotient(name, ramp):
    records, theta = record_of(name)
    records = replace(records, ramp=ramp)
    point = evaluate(records, theta)
    for k, size in enumerate(np.maximum(np.abs(theta), 1e-2) * 1e-5):
        step = size * np.eye(theta.size)[k]
        ahead, behind = (evaluate(records, theta + sign * step).cost for sign in (1, -1))
        scale = np.sqrt(point.hessian[k, k] * point.cost)
        assert point.slope[k] / scale == pytest.approx(-(ahead - behind) / (4 * size) / scale, abs=2e-6)


@pytest.mark.parametrize("name", [*SYSTEMS, "two outputs", "in s"])
def test_an_unknown_start_explains_a_record_cut_out_of_a_longer_one(name):
    """Without noise, the later part of a record about any level leaves no error at the true parameters."""
    model, u, y = model_and_data(name, 300, np.random.default_rng(5), 0.0)
    records = Records(estimator(model, 1.0), ((u[CUT:], y[CUT:] + 7.0),))
    left = replace(records, free=True).at(model.theta).errors
    np.testing.assert_allclose(left, 0.0, atol=1e-6 * np.abs(y).max())
    assert np.abs(records.at(model.theta).errors).max() > 1e-2


@pytest.mark.parametrize("name", [*SYSTEMS, "two outputs", "in s"])
def test_the_ramp_of_a_start_removes_straight_lines_from_the_outputs(name):
    """With the ramp, lines in the records change neither errors nor gradient; without it errors change."""
    records, theta = record_of(name)
    records = replace(records, ramp=True)
    lined = tuple(
        (u, y + np.outer(np.arange(len(y)), slope * np.arange(1, y.shape[1] + 1)))
        for slope, (u, y) in zip((0.03, -0.02), records.parts, strict=True)
    )
    plain, drifting = records.at(theta), replace(records, parts=lined).at(theta)
    np.testing.assert_allclose(drifting.errors, plain.errors, atol=1e-6 * np.abs(plain.errors).max())
    np.testing.assert_allclose(drifting.psi, plain.psi, atol=1e-5 * np.abs(plain.psi).max())
    assert np.abs(replace(records, parts=lined, ramp=False).at(theta).errors - plain.errors).max() > 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["arx", pytest.param("bj", marks=pytest.mark.slow)])
def test_joint_estimates_of_records_about_different_levels_reach_the_covariance(name):
    """The mean square of the error in units of its covariance is k, over 15 pairs of records."""
    model, rng = SYSTEMS[name], np.random.default_rng(6)
    squares = []
    for _ in range(15):
        u, y = (x[0] for x in data(name, 700, rng))
        u, y = u[100:], y[100:] + np.repeat([[3.0], [-8.0]], 300, axis=0)
        found = identify(model, u, y, lengths=(300, 300))
        assert found.search.converged
        assert found.start.free
        off = found.theta - model.theta
        squares.append(off @ found.information @ off)
    k = model.theta.size
    assert np.mean(squares) == pytest.approx(k, abs=5 * np.sqrt(2 * k / 15))


@pytest.mark.parametrize("runs", [1, 2])
def test_arx_from_rest_is_stacked_least_squares(runs):
    u, y = (x[..., 0] for x in data("arx", 200, np.random.default_rng(8), runs=runs))
    phi = np.concatenate([arx_regressors(*record) for record in zip(u, y, strict=True)])
    expected = np.linalg.lstsq(phi, y.ravel(), rcond=None)[0]
    left = y.ravel() - phi @ expected
    signals = (x.reshape(-1, 1) for x in (u, y))
    found = identify(SYSTEMS["arx"], *signals, lengths=(200,) * runs, rest=True)
    np.testing.assert_allclose(found.theta, expected, atol=1e-9)
    np.testing.assert_allclose(found.errors[:, 0], left, atol=1e-8)
    variance = left @ left / (left.size - 4)
    assert found.noise[0, 0] == pytest.approx(variance, rel=1e-9)
    np.testing.assert_allclose(found.covariance, variance * np.linalg.inv(phi.T @ phi), rtol=1e-7)


def test_the_simulation_starts_in_the_state_of_the_record():
    """The record begins with a decaying oscillation; the simulation contains its level and initial state."""
    rng = np.random.default_rng(9)
    u = rng.standard_normal((400, 1))
    y = scipy.signal.lfilter([0, 1.0, 0.5], [1, -1.5, 0.7], u, axis=0)
    swing = scipy.signal.lfilter([1.0], [1, -1.5, 0.7], np.eye(1, 400)[0])[:, None]
    y = y + 50.0 + 20.0 * swing + 0.1 * rng.standard_normal((400, 1))
    found = identify(SYSTEMS["oe"], u, y)
    assert found.start.free
    assert found.simulation.fit[0] > 95


def test_levels_of_records_do_not_count_as_explained():
    """The fit of records about different levels equals the fit of the same records about zero."""
    u, y = (x[0] for x in data("oe", 200, np.random.default_rng(3)))
    levels = np.repeat([[40.0], [-5.0]], 100, axis=0)
    apart, plain = (identify(SYSTEMS["oe"], u, v, lengths=(100, 100), rest=False) for v in (y + levels, y))
    assert apart.simulation.fit[0] == pytest.approx(plain.simulation.fit[0], abs=1e-6)
    assert plain.simulation.fit[0] < 95.0


def recorded(b, samples, seed, spread=1.0):
    rng = np.random.default_rng(seed)
    u = rng.standard_normal(samples)
    y = scipy.signal.lfilter([0, b, 0.5], [1, -1.5, 0.7], u)
    return u, y + scipy.signal.lfilter([1], [1, -1.5, 0.7], spread * rng.standard_normal(samples))


def jointly(*records, model=SYSTEMS["arx"]):
    u, y = (np.concatenate(parts)[:, None] for parts in zip(*records, strict=True))
    lengths = [len(record[0]) for record in records]
    return identify(model, u, y, lengths=lengths, experiments=lengths, rest=True)


def test_the_equality_test_of_two_arx_records_is_the_wald_test():
    """Each record has its own regression; its noise is estimated from the residuals of the joint estimate."""
    records = [recorded(1.0, 300, 1), recorded(1.1, 200, 2, spread=2.0)]
    found = jointly(*records)
    estimates, variances = [], []
    for u, y in records:
        matrix = arx_regressors(u, y)
        left = y - matrix @ found.theta
        estimates.append(np.linalg.lstsq(matrix, y, rcond=None)[0])
        variances.append(np.mean(left**2) * np.linalg.inv(matrix.T @ matrix))
    apart = estimates[0] - estimates[1]
    statistic = apart @ np.linalg.solve(sum(variances), apart)
    assert found.tests.alike == pytest.approx([scipy.stats.chi2.sf(statistic, 4)] * 2, rel=1e-6)


@pytest.mark.slow
def test_the_equality_test_has_uniform_probability_for_one_system():
    model = one_channel([0, 1.0, 0.5], F=[1, -1.5, 0.7])
    found = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        u = rng.standard_normal((2, 250))
        y = scipy.signal.lfilter([0, 1.0, 0.5], [1, -1.5, 0.7], u) + rng.standard_normal((2, 250))
        found.append(jointly(*zip(u, y, strict=True), model=model).tests.alike[0])
    assert scipy.stats.kstest(found, "uniform").pvalue > 1e-3


@pytest.mark.first(4)
@pytest.mark.parametrize("samples", [1, 2, 3])
@pytest.mark.parametrize("seed", range(4))
def test_a_very_short_first_experiment_does_not_change_the_estimate(samples, seed):
    """It has no information in most directions, exactly none in some."""
    u, y = recorded(1.0, 200, seed)
    with np.errstate(all="raise", under="ignore"):
        found = identify(
            SYSTEMS["arx"], u[:, None], y[:, None], experiments=[samples, 200 - samples], rest=True
        )
    expected = np.linalg.lstsq(arx_regressors(u, y), y, rcond=None)[0]
    np.testing.assert_allclose(found.theta, expected, rtol=1e-6)
    assert np.all(np.array(found.tests.alike) > 0.01)


@pytest.mark.parametrize("samples", range(1, 7))
def test_gradients_of_a_segment_shorter_than_its_lags_are_difference_quotients(samples):
    """A segment between gaps may be shorter than the delay and the orders."""
    model = one_channel([0, 0, 0, 0.4, 0.2], F=[1, -0.8], C=[1, 0.5], D=[1, -0.7, 0.1])
    kind, rng = estimator(model, 1.0), np.random.default_rng(samples)
    u, y = rng.standard_normal((2, samples, 1))
    errors, psi = kind.errors_and_gradient(model.theta, u, y)
    for k, step in enumerate(1e-6 * np.eye(model.theta.size)):
        up, down = (kind.errors_and_gradient(model.theta + sign * step, u, y)[0] for sign in (1.0, -1.0))
        np.testing.assert_allclose(psi[k].ravel(), -(up - down).ravel() / 2e-6, atol=1e-8)
    assert errors.shape == (samples, 1)
