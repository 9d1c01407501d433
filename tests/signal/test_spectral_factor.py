"""Spectral factors of moving averages, and the noise that they make."""

import numpy as np
import pytest

from inputdesign_cli.signal.spectral_factor import SpectralFactor, autocorrelation, spectral_factor
from inputdesign_cli.spectrum import FirBasis


@pytest.mark.parametrize("order", [0, 1, 5, 40, 200])
def test_spectral_factor_of_a_known_factor(order):
    """Random zeros inside the circle: the minimum-phase factor is recovered."""
    rng = np.random.default_rng(order)
    taps = rng.normal(size=order + 1) * 0.7 ** np.arange(order + 1)
    factor = spectral_factor(autocorrelation(taps))
    assert factor.residual < 1e-12
    w = np.linspace(0, np.pi, 257)
    response = np.abs(np.exp(-1j * np.outer(w, np.arange(order + 1))) @ factor.taps) ** 2
    wanted = FirBasis(1, order).density(autocorrelation(taps), w)
    np.testing.assert_allclose(response, wanted, rtol=1e-9, atol=1e-11 * wanted.max())


def test_spectral_factor_with_zeros_on_the_circle():
    """(1 - q^-1)^2 touches zero at DC, of order four in Phi: the residual still vanishes."""
    factor = spectral_factor(autocorrelation(np.array([1.0, -2.0, 1.0])))
    assert factor.residual < 1e-10


def test_filtered_noise_has_the_autocovariances():
    taps = np.array([1.0, 0.8, 0.3])
    x = SpectralFactor(taps, 0.0).filtered(200_000, np.random.default_rng(1))
    for lag, expected in enumerate(autocorrelation(taps)):
        assert np.mean(x[: x.size - lag] * x[lag:]) == pytest.approx(expected, abs=0.03)
