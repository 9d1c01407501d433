"""The spectrum of the noise at lines, in the limit and through a finite record, against closed forms."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.plant.noise_spectrum import NoiseSpectrum
from inputdesign_cli.questions.building.system import build_model

PLANT = "plant: {B: [0, 1], F: [1, -0.5]}\n"


def noise(text):
    return NoiseSpectrum.of(build_model(parse_spec(f"{PLANT}{text}", design=False)))


def test_of_a_moving_average():
    k, period, periods = np.arange(1, 40), 81, 3
    w = 2 * np.pi * k / period
    found = noise("noise: {C: [1, -0.9], variance: 2.0}")
    assert found.at(period, k)[:, 0] == pytest.approx(2.0 * (1.81 - 1.8 * np.cos(w)), rel=1e-12)
    # Fejer's kernel weights the covariance of lag one by 1 - 1/N.
    seen = 2.0 * (1.81 - 1.8 * (1 - 1 / (period * periods)) * np.cos(w))
    assert found.averaged(period, k, periods)[:, 0] == pytest.approx(seen, rel=1e-12)


def test_of_an_autoregression_through_a_record_shorter_than_its_memory():
    a, period = 0.95, 24
    k = np.arange(1, 12)
    found = noise(f"noise: {{D: [1, -{a}], variance: 1.0}}").averaged(period, k, 1)[:, 0]
    lags = np.arange(-period + 1, period)
    r = a ** np.abs(lags) / (1 - a**2) * (1 - np.abs(lags) / period)
    plain = [np.sum(r * np.cos(2 * np.pi * one * lags / period)) for one in k]
    assert found == pytest.approx(plain, rel=1e-10)


def test_of_correlated_outputs():
    spec = parse_spec(
        "plant: {B: [[[0, 1]], [[0, 2]]], F: [[[1, -0.5]], [[1, -0.2]]]}\n"
        "noise: {C: [[1, 0.5], [1]], variance: [[1.0, 0.6], [0.6, 2.0]]}",
        design=False,
    )
    found, k = NoiseSpectrum.of(build_model(spec)), np.array([3, 7])
    w = 2 * np.pi * k / 20
    assert found.at(20, k) == pytest.approx(np.stack([1.25 + np.cos(w), np.full(2, 2.0)], axis=1), rel=1e-12)


def test_noise_that_hardly_forgets_is_refused():
    with pytest.raises(InaccurateError, match="hardly forgets"):
        noise("noise: {D: [1, -0.99999], variance: 1.0}")
