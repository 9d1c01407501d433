"""Difference equations, discretised controllers, and spectra of noise."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.plant import Rational, TransferMatrix, delayed, discretised, pid
from inputdesign_cli.plant.filtering import filtered
from inputdesign_cli.plant.noise_spectrum import NoiseSpectrum
from tests.support.plants import stated
from tests.support.refusals import code_of


def by_definition(b, a, x):
    y = np.zeros(x.shape, dtype=np.result_type(x, float))
    for t in range(len(x)):
        now = sum((b[i] * x[t - i] for i in range(len(b)) if i <= t), np.zeros(x.shape[1:]))
        back = sum((a[i] * y[t - i] for i in range(1, len(a)) if i <= t), np.zeros(x.shape[1:]))
        y[t] = (now - back) / a[0]
    return y


@pytest.mark.parametrize("shape", [(40,), (40, 3), (2, 2), (1,), (0,)])
@pytest.mark.parametrize(("m", "k"), [(1, 1), (3, 1), (1, 4), (4, 3)])
def test_a_filter_is_its_difference_equation(shape, m, k):
    rng = np.random.default_rng(m + 10 * k)
    b, a = rng.standard_normal(m), 2.0 * np.poly(rng.uniform(-0.9, 0.9, k - 1))
    a = np.atleast_1d(a)
    x = rng.standard_normal(shape)
    assert filtered(b, a, x, axis=0) == pytest.approx(by_definition(b, a, x), abs=1e-12)
    complex_values = x + 1j * x[::-1]
    twice = filtered(b, a, x, axis=0) + 1j * filtered(b, a, x[::-1], axis=0)
    assert filtered(b, a, complex_values, axis=0) == pytest.approx(twice, abs=1e-12)


@pytest.mark.parametrize("samples", [9_000, 11_000])
def test_short_and_long_records_are_filtered_alike(samples):
    rng = np.random.default_rng(samples)
    b, a, x = np.array([0.0, 1.0, 0.5]), np.poly([0.99, 0.9j, -0.9j]).real, rng.standard_normal(samples)
    expected = scipy.signal.lfilter(b, a, x)
    assert filtered(b, a, x) == pytest.approx(expected, rel=0, abs=1e-11 * np.abs(expected).max())
    several = np.stack([x, 2 * x])
    assert filtered(b, a, several)[1] == pytest.approx(2 * expected, rel=0, abs=1e-10)


H = 0.2
W = np.linspace(0.01, np.pi, 30)
SCIPY = {"tustin": "bilinear", "backward": "backward_diff", "zoh": "zoh"}


@pytest.mark.parametrize("rule", SCIPY)
@pytest.mark.parametrize("numerator", [[2.0, 3.0], [0.5], [1.0, 0.4, 2.0]])
def test_a_discretised_transfer_function_agrees_with_scipy(rule, numerator):
    factors = [[2.0, 1.0], [1.0, 0.7]]
    found = discretised(numerator, factors, H, rule)
    top, bottom, _ = scipy.signal.cont2discrete((numerator, np.polymul(*factors)), H, SCIPY[rule])
    _, expected = scipy.signal.freqz(np.pad(top[0], (bottom.size - top.size, 0)), bottom, W)
    np.testing.assert_allclose(found.at(W), expected, rtol=1e-10, atol=1e-12)
    assert all(factor[0] == 1.0 for factor in found.denominator)


@pytest.mark.parametrize("rule", SCIPY)
def test_a_pid_is_the_sum_of_its_parts(rule):
    """Each part is discretised by scipy; the pole of the integrator is exactly one."""
    Kp, Ti, Td, Tf = 2.0, 3.0, 0.5, 0.1
    found = pid(Kp, Ti, Td, Tf, H, rule)
    expected = Kp * np.ones(W.size, dtype=complex)
    for part in (([Kp / Ti], [1, 0]), ([Kp * Td, 0], [Tf, 1])):
        top, bottom, _ = scipy.signal.cont2discrete(part, H, SCIPY[rule])
        expected += scipy.signal.freqz(np.pad(top[0], (bottom.size - top.size, 0)), bottom, W)[1]
    np.testing.assert_allclose(found.at(W), expected, rtol=1e-10)
    assert found.denominator[0].tolist() == [1.0, -1.0]


def test_backward_differences_need_no_filter():
    found = pid(2.0, None, 0.5, 0.0, H, "backward")
    np.testing.assert_allclose(found.numerator, [2.0 + 2.0 * 0.5 / H, -2.0 * 0.5 / H])
    assert found.denominator == ()
    late = delayed(found, 2)
    np.testing.assert_allclose(late.at(W), found.at(W) * np.exp(-2j * W), rtol=1e-12)


def test_a_row_keeps_a_factor_that_entries_share_once():
    """Two PI controllers that drive one input have one integrator; the filter of one is kept."""
    rows = [
        [pid(2.0, 3.0, 0.0, 0.0, H, "zoh"), pid(1.0, 4.0, 0.5, 0.1, H, "zoh")],
        [Rational(np.zeros(1))] * 2,
    ]
    made = TransferMatrix.of(rows)
    for i in range(2):
        for j in range(2):
            np.testing.assert_allclose(made.at(W)[:, i, j], rows[i][j].at(W), rtol=1e-9, atol=1e-12)
    assert np.sum(np.abs(made.poles - 1.0) < 1e-9) == 1


PLANT = "plant: {B: [0, 1], F: [1, -0.5]}\n"


def noise(text):
    return NoiseSpectrum.of(stated(PLANT + text))


def test_the_noise_spectrum_of_a_moving_average_has_its_closed_form():
    k, period, periods = np.arange(1, 40), 81, 3
    w = 2 * np.pi * k / period
    found = noise("noise: {C: [1, -0.9], variance: 2.0}")
    assert found.at(period, k)[:, 0] == pytest.approx(2.0 * (1.81 - 1.8 * np.cos(w)), rel=1e-12)
    # Fejer's kernel weights the covariance of lag one by 1 - 1/N.
    seen = 2.0 * (1.81 - 1.8 * (1 - 1 / (period * periods)) * np.cos(w))
    assert found.averaged(period, k, periods)[:, 0] == pytest.approx(seen, rel=1e-12)


def test_the_mean_periodogram_of_a_short_record_has_covariances_with_fejer_weights():
    a, period = 0.95, 24
    k = np.arange(1, 12)
    found = noise(f"noise: {{D: [1, -{a}], variance: 1.0}}").averaged(period, k, 1)[:, 0]
    lags = np.arange(-period + 1, period)
    r = a ** np.abs(lags) / (1 - a**2) * (1 - np.abs(lags) / period)
    plain = [np.sum(r * np.cos(2 * np.pi * one * lags / period)) for one in k]
    assert found == pytest.approx(plain, rel=1e-10)


def test_the_noise_spectra_of_correlated_outputs_have_their_closed_form():
    model = stated(
        "plant: {B: [[[0, 1]], [[0, 2]]], F: [[[1, -0.5]], [[1, -0.2]]]}\n"
        "noise: {C: [[1, 0.5], [1]], variance: [[1.0, 0.6], [0.6, 2.0]]}"
    )
    found, k = NoiseSpectrum.of(model), np.array([3, 7])
    w = 2 * np.pi * k / 20
    assert found.at(20, k) == pytest.approx(np.stack([1.25 + np.cos(w), np.full(2, 2.0)], axis=1), rel=1e-12)


def test_noise_with_a_pole_too_close_to_the_circle_is_refused():
    assert (
        code_of(noise, "noise: {D: [1, -0.99999], variance: 1.0}", kind=InaccurateError)
        == "integral-inaccurate"
    )
