"""Drifts beside inputs that repeat: polynomials come back, noise is none, and no shape of a period is one."""

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings, strategies as st

from inputdesign_cli.identification.periodic_response import Periods, line_of_periods, period_drift

PERIOD = 100


@settings(deadline=None, max_examples=20)
@given(
    seed=st.integers(0, 2**32 - 1),
    degree=st.integers(0, 3),
    blocks=st.integers(1, 2),
    skip=st.integers(0, 1),
    repeats=st.integers(1, 2),
    unit=st.sampled_from([1e-3, 1.0, 3600.0]),
)
def test_a_polynomial_comes_back_whatever_the_period_holds(seed, degree, blocks, skip, repeats, unit):
    rng = np.random.default_rng(seed)
    periods, samples = Periods(PERIOD, blocks=blocks, skip=skip), 6 * PERIOD * blocks
    shape = rng.standard_normal(PERIOD)
    x = np.linspace(-1.0, 1.0, samples)
    true = np.polynomial.legendre.legval(x, np.r_[0.0, np.zeros(max(degree - 1, 0)), 5.0][: degree + 1])
    one = 3.0 + np.tile(shape, 6 * blocks) + true
    y = np.tile(one + 1e-6 * rng.standard_normal(samples), repeats)[:, None]
    time = unit * np.tile(np.arange(float(samples)), repeats)
    found = period_drift(y, time, periods, np.array([1e-4]), repeats=repeats)
    if degree == 0:
        assert found is None
        return
    assert found.degree.tolist() == [degree]
    off = found.curve[:samples, 0] - true
    assert np.ptp(off) < 1e-2


@pytest.mark.parametrize("past", [0.0, 0.8])
def test_noise_is_hardly_ever_a_drift(past):
    rng = np.random.default_rng(1)
    level, found = 1.0 / (1.0 - past) ** 2, 0
    for _ in range(400):
        v = scipy.signal.lfilter([1.0], [1.0, -past], rng.standard_normal((900, 2)), axis=0)[100:]
        drift = period_drift(v, np.arange(800.0), Periods(PERIOD), np.full(2, level))
        found += drift is not None
    assert found <= 1


def test_only_the_output_that_drifts_is_changed():
    y = 0.1 * np.random.default_rng(2).standard_normal((800, 2))
    y[:, 1] += np.linspace(0.0, 4.0, 800)
    found = period_drift(y, np.arange(800.0), Periods(PERIOD), np.full(2, 0.01))
    assert found.degree.tolist() == [0, 1]
    assert np.all(found.curve[:, 0] == 0.0)
    assert np.ptp(found.curve[:, 1]) == pytest.approx(4.0, rel=0.05)


def test_the_line_of_the_periods_is_that_of_their_means():
    y = np.random.default_rng(3).standard_normal((530, 1)).cumsum(axis=0)
    means = y[30:, 0].reshape(5, PERIOD).mean(axis=1)
    slope = np.polyfit(PERIOD * np.arange(5.0), means, 1)[0]
    line = line_of_periods(y, Periods(PERIOD))[:, 0]
    assert np.diff(line) == pytest.approx(np.full(529, slope), rel=1e-9)
