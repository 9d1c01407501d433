"""The noise of what is explored: a model that the tests refute is not taken where another does as well."""

import numpy as np
import pytest
from scipy.signal import lfilter

from inputdesign_cli.identification.explore import explore_records

GAIN, LAG, SECOND, LATE, STEP, FINER = 2.35, 205.0, 8.0, 28.0, 5.0, 20


def heater(seed, samples=1440):
    """Two lags and a dead time, simulated on a finer grid; noise with a memory of ten samples, and rounding."""
    rng = np.random.default_rng(seed)
    u = 5.0 * np.repeat(rng.choice([-1.0, 1.0], samples // 24), 24)
    fine = np.concatenate([np.zeros(int(LATE / STEP * FINER)), np.repeat(u, FINER)])[: samples * FINER]
    for lag in (LAG, SECOND):
        pole = np.exp(-STEP / FINER / lag)
        fine = lfilter([0.0, 1.0 - pole], [1.0, -pole], fine)
    noise = lfilter([1.0], [1.0, -0.9], 0.05 * rng.standard_normal(samples))
    y = GAIN * fine[::FINER] + noise + 0.03 * rng.standard_normal(samples)
    return u[:, None], y[:, None]


@pytest.mark.parametrize("seed", [1, 2])
def test_correlated_noise_is_not_taken_for_white(seed):
    found = explore_records([heater(seed)], step=STEP)
    assert not found.estimate.failed
    names = dict(zip(found.estimate.names, found.estimate.theta, strict=True))
    spread = dict(zip(found.estimate.names, np.sqrt(np.diag(found.estimate.covariance)), strict=True))
    assert abs(names["K"] - GAIN) < 4.0 * spread["K"]
    assert abs(names["L"] - LATE) < 4.0 * spread["L"]
    lags = np.array([2.0 * names["zeta"] * names["T"], names["T"] ** 2])
    np.testing.assert_allclose(lags, [LAG + SECOND, LAG * SECOND], rtol=0.1)
