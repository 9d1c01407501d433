import numpy as np
import pytest

from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.monte_carlo.excitations import Flat, InPhase, Multisine, Recorded
from inputdesign_cli.plant import PolynomialChannels
from inputdesign_cli.signal import Lines, channel_record_information

W = 2 * np.pi * np.array([100, 300]) / 1000
POWERS = np.array([[[2.0, 0.5j], [-0.5j, 1.0]], [[1.0, 1.0], [1.0, 3.0]]])
GAINS = np.array([[1.0, 0.4], [0.3, -0.7]])


def experiment(channels):
    """A plant without memory to speak of: the finite sample shows little else than the spectrum."""
    one = (np.ones(1),)
    F = (one * channels,) * channels
    B = tuple(tuple(np.array([0.0, gain]) for gain in row[:channels]) for row in GAINS[:channels])
    covariance = np.array([[1.0, 0.4], [0.4, 0.5]])[:channels, :channels]
    return ChannelExperiment(PolynomialChannels(B, one, F, one, one, covariance), 2000)


def excitation(kind, channels):
    powers = np.array([2.0, 3.0])[:channels]
    if kind == "multisine":
        return Multisine("m", Lines(W, POWERS[:, :channels, :channels], 1000), "orthogonal", 1.0)
    if kind == "in_phase":
        return InPhase("i", W, np.array([[1.0, 2.0], [3.0, -1.0]])[:, :channels], 1.0)
    return Flat("f", powers, kind)


@pytest.mark.parametrize("channels", [1, 2])
@pytest.mark.parametrize("kind", ["multisine", "in_phase", "prbs", "white", "binary"])
def test_the_information_of_an_excitation_is_that_of_its_records(kind, channels):
    tried, what = experiment(channels), excitation(kind, channels)
    records = what.draw(20, 2000, np.random.default_rng(1))
    assert records.shape == (20, 2000, channels)
    found = np.mean([channel_record_information(tried, r, 1.0) for r in records], axis=0)
    expected = what.information(tried)
    np.testing.assert_allclose(found, expected, atol=0.02 * np.abs(expected).max())
    one = Recorded("r", records[0], 1.0)
    np.testing.assert_allclose(one.information(tried), channel_record_information(tried, records[0], 1.0))


@pytest.mark.parametrize("kind", ["prbs", "white", "binary"])
def test_flat_excitations_have_their_powers_exactly(kind):
    records = excitation(kind, 2).draw(5, 300, np.random.default_rng(2))
    np.testing.assert_allclose(np.mean(records**2, axis=1), np.tile([2.0, 3.0], (5, 1)))
    if kind != "white":
        np.testing.assert_allclose(np.ptp(np.abs(records), axis=1), 0.0, atol=1e-12)
