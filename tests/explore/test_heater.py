"""A heater with noise that has a memory, and with a drift: its own lags come back, and no others."""

import numpy as np
import pytest
from scipy.signal import lfilter

from inputdesign_cli.explore import explore_records
from inputdesign_cli.explore.drifting import lines_of

GAIN, LAG, SECOND, LATE, STEP, FINER = 2.35, 205.0, 8.0, 28.0, 5.0, 20


def heater(seed, samples=1440):
    """Two lags and a dead time, simulated on a finer grid; noise with a memory, and white."""
    rng = np.random.default_rng(seed)
    u = 5.0 * np.repeat(rng.choice([-1.0, 1.0], samples // 24), 24)
    fine = np.concatenate([np.zeros(int(LATE / STEP * FINER)), np.repeat(u, FINER)])[: samples * FINER]
    for lag in (LAG, SECOND):
        pole = np.exp(-STEP / FINER / lag)
        fine = lfilter([0.0, 1.0 - pole], [1.0, -pole], fine)
    noise = lfilter([1.0], [1.0, -0.9], 0.05 * rng.standard_normal(samples))
    y = GAIN * fine[::FINER] + noise + 0.03 * rng.standard_normal(samples)
    return u[:, None], y[:, None]


def is_the_heater(found):
    assert not found.estimate.failed
    names = dict(zip(found.estimate.names, found.estimate.theta, strict=True))
    spread = dict(zip(found.estimate.names, np.sqrt(np.diag(found.estimate.covariance)), strict=True))
    assert abs(names["K"] - GAIN) < 4.0 * spread["K"]
    assert abs(names["L"] - LATE) < 4.0 * spread["L"]
    lags = np.array([2.0 * names["zeta"] * names["T"], names["T"] ** 2])
    np.testing.assert_allclose(lags, [LAG + SECOND, LAG * SECOND], rtol=0.1)


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_correlated_noise_is_not_taken_for_white(seed):
    found = explore_records([heater(seed)], step=STEP)
    is_the_heater(found)
    assert found.slopes is None
    assert found.wanders == (False,)


@pytest.mark.slow
@pytest.mark.parametrize("a_degree_an_hour", [1.0, -0.3])
def test_a_drift_is_no_slow_pole(a_degree_an_hour):
    u, y = heater(1)
    drift = a_degree_an_hour * STEP / 3600.0
    found = explore_records([(u, y + drift * np.arange(len(y))[:, None])], step=STEP)
    is_the_heater(found)
    assert found.slopes == pytest.approx([drift], abs=0.05 / 720.0)


@pytest.mark.parametrize("seed", [3, pytest.param(1, marks=pytest.mark.slow)])
def test_the_slope_of_a_line_does_not_depend_on_another(seed):
    """By least squares: a line that is added to the data is added to what is found."""
    u, y = heater(seed)
    line = 0.002 * np.arange(len(y))[:, None]
    with_line, without = lines_of([(u, y + line)]), lines_of([(u, y)])
    assert with_line.slopes - without.slopes == pytest.approx([0.002], abs=1e-6)


def test_only_outputs_that_drift_lose_a_line():
    one, two = heater(3), heater(4)
    y = np.column_stack([one[1], two[1]])
    y[:, 1] += 0.002 * np.arange(len(y))
    records = [(np.column_stack([one[0], two[0]]), y)]
    lines = lines_of(records).beyond(np.array([0.2, 0.2]), len(y))
    assert lines.slopes == pytest.approx([0.0, 0.002], abs=2e-4)
    assert lines.slopes[0] == 0.0


def test_the_line_of_a_long_record_is_told_by_its_means():
    """Means over stretches keep a line; the plant is sampled so fast that they tell it as well."""
    u, y = heater(5, 12_000)
    line = 5e-4 * np.arange(len(y))[:, None]
    with_line, without = lines_of([(u, y + line)]), lines_of([(u, y)])
    assert with_line.slopes - without.slopes == pytest.approx([5e-4], rel=1e-3)
    assert np.abs(without.slopes) * len(y) < without.scatter


def test_many_short_records_tell_no_line():
    u, y = heater(6, 4800)
    parts = [(u[i : i + 6], y[i : i + 6]) for i in range(0, len(y), 6)]
    lines = lines_of(parts)
    assert lines.beyond(lines.scatter, 6).slopes == pytest.approx([0.0])


@pytest.mark.slow
def test_a_long_record_that_drifts_is_explained_as_one_that_does_not():
    u, y = heater(1, 40_008)
    drift = 6.0 / len(y)
    level = explore_records([(u, y)], step=STEP)
    even = explore_records([(u, y + drift * np.arange(len(y))[:, None])], step=STEP)
    assert level.slopes is None
    assert even.slopes == pytest.approx([drift], rel=0.02)
    scatter = np.sqrt(np.diag(level.estimate.covariance))
    assert np.all(np.abs(even.estimate.theta - level.estimate.theta) < 2.0 * scatter)
