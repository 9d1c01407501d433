"""Good data are never refused for rounding, poor data always are, and units change no estimate."""

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings, strategies as st

from inputdesign_cli.expressions import Expression
from inputdesign_cli.identification import identify
from inputdesign_cli.identification.derived import brought_back
from inputdesign_cli.plant import Intersample, Parametrisation, PolynomialModel
from tests.support.plants import lag_of
from tests.support.records import simulated
from tests.support.refusals import refused

# A slow pole and noise that nearly vanishes at low frequency: scaled, eigenvalues of M are 1e13 apart.
SLOW = PolynomialModel.single(
    [0, 0, 0, 2.2, -0.84, 0.086], F=[1, -2.0885, 1.4, -0.3073], C=[1, -0.98], variance=0.07
)
DECADES = st.integers(-6, 6)


def test_the_covariance_of_collinear_gradients_agrees_with_a_qr_factorisation():
    u, y = simulated(SLOW, 400, np.random.default_rng(0))
    found = identify(SLOW, u[0], y[0], rest=True)
    theta = [float(x) for x in found.theta]
    B, C, F = [0.0, 0.0, 0.0, *theta[:3]], [1.0, theta[3]], [1.0, *theta[4:]]
    filtered = scipy.signal.lfilter([1], np.convolve(C, F), u[0, :, 0])
    second = -scipy.signal.lfilter(np.convolve(B, [1]), F, filtered)
    # The noise before the record, w, is an additional unknown and an additional error.
    impulse = np.eye(1, 400)[0]
    of_w = np.append(-theta[3] * scipy.signal.lfilter([1], C, impulse), 1.0)
    errors = np.append(scipy.signal.lfilter([1], C, y[0, :, 0] - scipy.signal.lfilter(B, F, u[0, :, 0])), 0.0)
    w = -(errors @ of_w) / (of_w @ of_w)
    errors = (errors + w * of_w)[:-1]
    third = scipy.signal.lfilter([1], C, np.concatenate([[w], errors[:-1]]))

    def delayed(x, lag):
        return np.concatenate([np.zeros(lag), x[: x.size - lag], [0.0]])

    lags = [(filtered, 3), (filtered, 4), (filtered, 5), (third, 0), (second, 1), (second, 2), (second, 3)]
    psi = np.array([*(delayed(x, lag) for x, lag in lags), of_w]).T
    half = np.linalg.inv(np.linalg.qr(psi, mode="r"))
    expected = (found.noise[0, 0] * half @ half.T)[:7, :7]
    np.testing.assert_allclose(np.diag(found.covariance), np.diag(expected), rtol=1e-5)


@pytest.mark.slow
@settings(max_examples=2, deadline=None)
@given(of_u=DECADES, of_y=DECADES)
@pytest.mark.parametrize("rest", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_units_of_signals_change_no_estimate(rest, of_u, of_y):
    # If a level is estimated, the root 0.98 of C runs to the circle in 400 samples, without a minimum.
    of_noise = np.array([name == "c1" for name in SLOW.names])
    model = SLOW if rest else SLOW.at(np.where(of_noise, -0.5, SLOW.theta))
    u, y = simulated(model, 400, np.random.default_rng(4))
    one = identify(model, u[0], y[0], start=model.theta, rest=rest)
    assert one.search.converged
    scale = np.where([name[0] == "b" for name in one.names], 10.0 ** (of_y - of_u), 1.0)
    other = identify(model, 10.0**of_u * u[0], 10.0**of_y * y[0], start=scale * model.theta, rest=rest)
    deviation = np.sqrt(np.diag(one.covariance))
    np.testing.assert_allclose(other.theta / scale, one.theta, atol=1e-3 * deviation.min())
    np.testing.assert_allclose(np.sqrt(np.diag(other.covariance)) / scale, deviation, rtol=1e-3)
    assert [test.name for test in other.tests.failed] == [test.name for test in one.tests.failed]


@settings(max_examples=2, deadline=None)
@given(of_time=st.integers(-4, 4), of_y=DECADES)
@pytest.mark.first(1)
@pytest.mark.parametrize("rest", [False, True])
def test_the_unit_of_time_changes_no_estimate(rest, of_time, of_y):
    rng = np.random.default_rng(5)
    u = rng.standard_normal((600, 1))
    found = []
    for unit, gain in ((1.0, 1.0), (10.0**of_time, 10.0**of_y)):
        # 2 / (s^2 + s + 1) with time counted in other units
        model = lag_of([2.0 * gain * unit**2], [1.0, unit, unit**2])
        between = 0.3 / unit
        y = model.driven(u, Intersample(between, hold=False))
        noise = 0.05 * gain * np.random.default_rng(6).standard_normal(y.shape)
        one = identify(model, u, y + noise, between, start=model.theta, rest=rest)
        found.append((one.theta / model.theta, np.sqrt(np.diag(one.covariance)) / np.abs(model.theta)))
    np.testing.assert_allclose(found[1][0], found[0][0], atol=1e-3 * found[0][1].min())
    np.testing.assert_allclose(found[1][1], found[0][1], rtol=1e-3)


@settings(max_examples=3, deadline=None)
@given(of_u=DECADES, of_y=DECADES)
@pytest.mark.parametrize("kind", ["a sinusoid too few", "two inputs as one", "feedback alone"])
def test_data_that_do_not_determine_parameters_are_refused_in_any_unit(kind, of_u, of_y):
    rng = np.random.default_rng(7)
    e = 0.1 * rng.standard_normal(300)
    match kind:
        case "a sinusoid too few":
            u = np.sin(0.7 * np.arange(300))[:, None]
            model, rest = PolynomialModel.single([0, 1, 1, 1]), False
            y = scipy.signal.lfilter([0, 1, 0.5, 0.2], [1], u[:, 0]) + e
        case "two inputs as one":
            u = rng.standard_normal(300)[:, None] * [1.0, 3.0]
            model, rest = _two_inputs(), None
            y = scipy.signal.lfilter([0, 1], [1, -0.7], u[:, 0]) + e
        case _:
            y = scipy.signal.lfilter([1], [1, -0.4, 0.2], e)
            u = np.concatenate([[0.0], -0.3 * y[:-1]])[:, None]
            model, rest = PolynomialModel.single([0, 1], A=[1, 0, 0]), None
    found = refused(identify, model, 10.0**of_u * u, 10.0**of_y * y[:, None], rest=rest)
    assert found[0].code == "not-exciting"


def _two_inputs():
    one, entry, pole = np.ones(1), np.array([0.0, 1.0]), np.array([1.0, -0.7])
    return PolynomialModel(((entry, entry),), (pole,), ((one, one),), (one,), (one,), np.eye(1))


# Numerator and denominator by parameters p, q: negative values are out of reach, their infimum at infinity.
OUT_OF_REACH = [("exp(p)", "exp(q)"), ("p*p", "1/(q*q)"), ("exp(p)/q", "1/q"), ("exp(p + q)", "exp(q)")]


@pytest.mark.first(1)
@pytest.mark.parametrize("terms", OUT_OF_REACH)
def test_a_start_that_no_parameters_reach_gives_finite_parameters(terms):
    at = Parametrisation(
        ("p", "q"), ("p", "q"), np.array([1.0, 1.0]), np.ones(2, dtype=bool), tuple(map(Expression.of, terms))
    )
    rng = np.random.default_rng(4)
    for _ in range(60):
        root = rng.standard_normal((2, 2)) * 10.0 ** rng.uniform(-3, 3, 2)
        theta = -(10.0 ** rng.uniform(-6, 2, 2)) * rng.choice([-1, 1], 2)
        point = SimpleNamespace(theta=theta, cost=1.0, hessian=root.T @ root)
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            assert np.all(np.isfinite(brought_back(at, point)))
