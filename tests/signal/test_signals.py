"""Signals have the spectrum that they claim, and buy the information that a simulation measures."""

import dataclasses

import numpy as np
import pytest
import scipy.signal
from plants import random_case

from inputdesign_cli.information import Experiment
from inputdesign_cli.signal import (
    SignalSettings,
    Sinusoids,
    Target,
    autocorrelation,
    filtered_noise,
    line_powers,
    prediction_gradient,
    realise,
    record_information,
    spectral_factor,
)
from inputdesign_cli.spectrum import FirBasis, LinesBasis


@pytest.mark.parametrize("order", [0, 1, 5, 40, 200])
def test_spectral_factor_of_a_known_factor(order):
    """Random zeros inside the circle: the minimum-phase factor is recovered."""
    rng = np.random.default_rng(order)
    taps = rng.normal(size=order + 1) * 0.7 ** np.arange(order + 1)
    factor = spectral_factor(autocorrelation(taps))
    assert factor.residual < 1e-12
    w = np.linspace(0, np.pi, 257)
    response = np.abs(np.exp(-1j * np.outer(w, np.arange(order + 1))) @ factor.taps) ** 2
    wanted = FirBasis(order).density(autocorrelation(taps), w)
    np.testing.assert_allclose(response, wanted, rtol=1e-9, atol=1e-11 * wanted.max())


def test_spectral_factor_with_zeros_on_the_circle():
    """(1 - q^-1)^2 touches zero at DC, of order four in Phi: the residual still vanishes."""
    factor = spectral_factor(autocorrelation(np.array([1.0, -2.0, 1.0])))
    assert factor.residual < 1e-10


def test_filtered_noise_has_the_autocovariances():
    taps = np.array([1.0, 0.8, 0.3])
    x = filtered_noise(taps, 200_000, np.random.default_rng(1))
    for lag, expected in enumerate(autocorrelation(taps)):
        assert np.mean(x[: x.size - lag] * x[lag:]) == pytest.approx(expected, abs=0.03)


@pytest.mark.parametrize("samples", [64, 65])
def test_multisine_has_exactly_its_line_powers(samples):
    c = autocorrelation(np.array([1.0, -0.6, 0.2]))
    w = 2 * np.pi * np.arange(samples // 2 + 1) / samples
    power = line_powers(FirBasis(2).density(c, w), samples)
    assert power.sum() == pytest.approx(c[0], rel=1e-12)
    lines = Sinusoids.on_grid(power, samples)
    x = lines.record(lines.random_phases(np.random.default_rng(2)))
    spectrum = np.abs(np.fft.rfft(x) / samples) ** 2
    spectrum[1 : (samples + 1) // 2] *= 2
    np.testing.assert_allclose(spectrum, power, atol=1e-14)


@pytest.mark.parametrize("seed", [1, 5, 7, 9, 15])
def test_prediction_gradient_is_the_derivative_of_the_prediction_error(seed):
    """Finite differences of epsilon = (D/C)(A y - (B/F) u) on noise-free data, open and closed loop."""
    case = random_case(seed)
    experiment = Experiment(case.loop, 50)
    model = case.loop.model
    r = np.random.default_rng(seed).normal(size=50)
    controller = case.loop.controller
    u, y = np.zeros(50), np.zeros(50)
    den, nc = (controller.denominator_polynomial, controller.numerator) if controller else ([1.0], [0.0])
    plant = np.convolve(model.A, model.F)
    feedback = np.zeros(50)
    for t in range(50):  # the loop, sample by sample
        y[t] = sum(model.B[i] * u[t - i] for i in range(1, len(model.B)) if t >= i) - sum(
            plant[i] * y[t - i] for i in range(1, len(plant)) if t >= i
        )
        feedback[t] = sum(nc[i] * y[t - i] for i in range(len(nc)) if t >= i) - sum(
            den[i] * feedback[t - i] for i in range(1, len(den)) if t >= i
        )
        u[t] = r[t] - feedback[t]

    def residual(theta):
        values = dict(zip(model.names, theta, strict=True))
        p = {}
        for letter in "ABCDF":
            p[letter] = np.array(getattr(model, letter), dtype=float)
            for lag in range(len(p[letter])):
                p[letter][lag] = values.get(f"{letter.lower()}{lag}", p[letter][lag])
        clean = scipy.signal.lfilter(p["A"], [1.0], y) - scipy.signal.lfilter(p["B"], p["F"], u)
        return scipy.signal.lfilter(p["D"], p["C"], clean)

    found = prediction_gradient(experiment, r)
    h = 1e-6
    for k in range(len(model.names)):
        if model.names[k][0] in "cd":
            continue  # the noise parameters act on epsilon, which is zero here
        step = h * np.eye(len(model.names))[k]
        difference = -(residual(model.theta + step) - residual(model.theta - step)) / (2 * h)
        np.testing.assert_allclose(found[:, k], difference, rtol=1e-4, atol=1e-6 * np.abs(found).max())


def test_record_information_tends_to_that_of_the_spectrum(first_order):
    """A long white record of power two has the information of the spectrum to a few per cent."""
    N = 100_000
    experiment = dataclasses.replace(first_order, samples=N).whitened(2.0)
    record = np.sqrt(2.0) * np.random.default_rng(0).standard_normal(N)
    np.testing.assert_allclose(record_information(experiment, record), np.eye(3), atol=0.03)


def test_free_lines_that_a_record_cannot_tell_apart_do_not_cancel(first_order):
    """Four sinusoids near w = 0 are one constant of their power; the line at 2.0 keeps its own power."""
    basis = LinesBasis(np.array([1e-5, 2.0, 1.1e-5, 3e-4, 2.0 + 1e-6, 4e-4]), free=True)
    x = np.array([1.0, 0.5, 1.0, 1.0, 0.5, 1.0])
    for seed in range(6):
        recipe = SignalSettings("multisine", candidates=1, seed=seed)
        record = realise(first_order, basis, x, Target(lambda _: 0.0), recipe, samples=500)
        assert abs(np.mean(record.samples)) == pytest.approx(2.0, rel=0.01)
        line = 2 * np.abs(np.mean(record.samples * np.exp(-2.0j * np.arange(500)))) ** 2
        assert line == pytest.approx(1.0, rel=0.05)


def test_given_lines_are_made_as_they_are_given(first_order):
    basis = LinesBasis(np.array([1.0, 1.001]))
    recipe = SignalSettings("multisine", candidates=1)
    record = realise(first_order, basis, np.ones(2), Target(lambda _: 0.0), recipe, samples=500)
    rows = np.exp(1j * np.outer([1.0, 1.001], np.arange(500)))
    regressors = np.concatenate([rows.real, rows.imag]).T
    fit = np.linalg.lstsq(regressors, record.samples, rcond=None)
    np.testing.assert_allclose(regressors @ fit[0], record.samples, atol=1e-8)
    amplitude = np.hypot(fit[0][:2], fit[0][2:])
    assert amplitude[0] == pytest.approx(amplitude[1], rel=1e-6)
