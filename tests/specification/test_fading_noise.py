"""Noise by its standard deviation and correlation time is exactly the sampled Gauss-Markov process."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.plant.noise_spectrum import NoiseSpectrum
from inputdesign_cli.questions.building.system import build_model
from tests.support.refusals import code_of

LAG = "plant: {continuous: {gain: 1, time_constant: 60}, sample: zoh}\n"
POLYNOMIAL = "plant: {B: [0, 1], F: [1, -0.5]}\n"
TWO = "plant: {B: [[[0, 1]], [[0, 1]]], F: [[[1, -0.5]], [[1, -0.7]]]}\n"
ASKED = "sample_time: 10\naccuracy: {model_error: {relative: 0.1}}\nlimits: {samples: 100}\n"
FADES = "noise: {standard_deviation: 0.1, correlation_time: 60}\n"


def autocovariance(spec, output=0, lags=5):
    """The first autocovariances of an output without input, from the impulse responses of the model."""
    h = NoiseSpectrum.of(build_model(spec)).impulses[:, :, output]
    return [np.sum(h[:, : h.shape[1] - k] * h[:, k:]) for k in range(lags)]


@pytest.mark.parametrize("plant", [LAG, POLYNOMIAL])
@pytest.mark.parametrize("step", [0.5, 10.0, 100.0])
def test_the_samples_have_the_autocovariance_of_the_process(plant, step):
    """sigma^2 exp(-k h/T) at k samples, whatever the sample time."""
    spec = parse_spec(plant + ASKED + FADES, overrides=[f"sample_time={step}"])
    for found, h in ((spec, step), (spec.with_(sample_time=2.0 * step), 2.0 * step)):
        closed = 0.01 * np.exp(-np.arange(5) * h / 60.0)
        np.testing.assert_allclose(autocovariance(found), closed, rtol=1e-9)


def test_every_output_has_its_own_deviation_and_correlation_time():
    noise = "noise: {standard_deviation: [0.1, 0.3], correlation_time: [60, 20]}\n"
    spec, common = parse_spec(TWO + ASKED + noise), parse_spec(TWO + ASKED + FADES)
    for output, (deviation, time) in enumerate(((0.1, 60.0), (0.3, 20.0))):
        closed = np.exp(-10.0 * np.arange(5) / np.array([[time], [60.0]]))
        np.testing.assert_allclose(autocovariance(spec, output), deviation**2 * closed[0], rtol=1e-9)
        np.testing.assert_allclose(autocovariance(common, output), 0.01 * closed[1], rtol=1e-9)


def test_noise_without_a_correlation_time_is_white():
    noise = parse_spec(LAG + ASKED + "noise: {standard_deviation: 0.2}\n").noise
    assert (noise.variance, noise.C, noise.D) == (pytest.approx(0.04), (1.0,), (1.0,))


def test_the_true_noise_of_a_study_is_stated_with_the_same_keys():
    study = "simulation: {noise: {standard_deviation: 0.2, correlation_time: 30}}\n"
    found = parse_spec(LAG + ASKED + FADES + study).simulation.noise
    same = parse_spec(LAG + ASKED + "noise: {standard_deviation: 0.2, correlation_time: 30}\n").noise
    assert (found.variance, found.D) == (same.variance, same.D)


def test_the_written_spec_keeps_the_stated_keys_and_can_be_read_again():
    spec = parse_spec(LAG + ASKED + FADES)
    assert "correlation_time: 60" in spec.to_yaml()
    assert "variance" not in spec.to_yaml()
    assert parse_spec(spec.to_yaml()).noise == spec.noise
    assert code_of(spec.with_, **{"noise.variance": 2.0}) == "conflicting-keys"


@pytest.mark.parametrize("fades", [0.0, 20.0, 300.0, 5e3, 5e5])
def test_noise_that_drifts_is_the_stated_noise_and_a_random_walk(fades):
    """The spectrum is the sum of both; the walk moves by a fifth of the standard deviation in a sample."""
    time = f", correlation_time: {fades}" if fades else ""
    text = "sample_time: 10\nplant: {continuous: {gain: 1, time_constant: 99}, sample: zoh}\n"
    plain, moving = (
        parse_spec(f"{text}noise: {{standard_deviation: 0.5{time}{more}}}\n", design=False).noise
        for more in ("", ", drift: true")
    )
    assert (moving.D, moving.drift) == (plain.D, True)
    delay = np.exp(-1j * np.geomspace(1e-6, np.pi, 40))
    fading = plain.variance / np.abs(np.polyval(plain.D[::-1], delay)) ** 2
    found = (
        moving.variance * np.abs(np.polyval(moving.C[::-1], delay) / np.polyval(moving.D[::-1], delay)) ** 2
    )
    walk = (0.2 * 0.5) ** 2
    assert found == pytest.approx(np.abs(1.0 - delay) ** 2 * fading + walk, rel=1e-7)
