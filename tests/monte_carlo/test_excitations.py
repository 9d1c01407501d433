import numpy as np
import pytest

from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.monte_carlo.excitations import InPhase, Reapplied, Recorded, Redrawn
from inputdesign_cli.plant import PolynomialModel
from inputdesign_cli.spectrum import LinesBasis

SAMPLES = 2000
GAINS = np.array([[1.0, 0.4], [0.3, -0.7]])
POWERS = np.array([2.0, 3.0])


def experiment(channels):
    """A plant without memory to speak of: the finite sample shows little else than the spectrum."""
    one = (np.ones(1),)
    F = (one * channels,) * channels
    B = tuple(tuple(np.array([0.0, gain]) for gain in row[:channels]) for row in GAINS[:channels])
    covariance = np.array([[1.0, 0.4], [0.4, 0.5]])[:channels, :channels]
    return Experiment(PolynomialModel(B, one, F, one, one, covariance), SAMPLES)


def flat(method, channels, samples=SAMPLES):
    return Redrawn.flat("f", method, POWERS[:channels], (0.0, np.pi), samples, 1.0)


def check_information(tried, excitation):
    """The information of the spectrum is the mean of that of the records."""
    records = excitation.draw(20, SAMPLES, np.random.default_rng(1))
    assert records.shape == (20, SAMPLES, tried.inputs)
    exact = FiniteRecord(tried, SAMPLES, 1.0)
    found = np.mean([exact.information(record) for record in records], axis=0)
    expected = excitation.information(tried)
    np.testing.assert_allclose(found, expected, atol=0.02 * np.abs(expected).max())
    one = Recorded("r", records[0], 1.0)
    np.testing.assert_allclose(one.information(tried), exact.information(records[0]))


@pytest.mark.first(3)
@pytest.mark.parametrize("channels", [1, 2])
@pytest.mark.parametrize("method", ["white", "prbs", "multisine", "binary"])
def test_the_information_of_a_flat_excitation_is_that_of_its_records(method, channels):
    check_information(experiment(channels), flat(method, channels))


@pytest.mark.parametrize("channels", [1, 2])
def test_the_information_of_sinusoids_is_that_of_their_records(channels):
    w = 2 * np.pi * np.array([100, 300]) / 1000
    amplitudes = np.array([[1.0, 2.0], [3.0, -1.0]])[:, :channels]
    size = np.linalg.norm(amplitudes, axis=1)
    basis = LinesBasis(w, amplitudes / size[:, None] + 0j, w, np.ones(channels))
    check_information(experiment(channels), InPhase("i", w, amplitudes, basis, 0.5 * size**2))


@pytest.mark.parametrize("method", ["white", "prbs", "multisine", "binary"])
def test_flat_excitations_have_their_power_exactly(method):
    records = flat(method, 2, 300).draw(5, 300, np.random.default_rng(2))
    np.testing.assert_allclose(np.mean(records**2, axis=1), np.tile(POWERS, (5, 1)))


def test_reapplied_records_are_those_of_the_excitation_so_many_times_each():
    drawn = Redrawn.flat("design", "white", np.array([2.0]), (0.0, np.pi), 40, 1.0)
    once = drawn.draw(3, 40, np.random.default_rng(7))
    again = Reapplied(drawn, 3).draw(7, 40, np.random.default_rng(7))
    np.testing.assert_array_equal(again, once[[0, 0, 0, 1, 1, 1, 2]])
    assert not np.array_equal(once[0], once[1])
