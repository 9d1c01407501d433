"""Frequency responses from periodic inputs, their standard deviations, and drifts of the outputs."""

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings, strategies as st

from inputdesign_cli.identification.periodic_response import (
    Periods,
    excited_harmonics,
    line_of_periods,
    period_drift,
    periodic_response,
)


def blocks(G, rng, periods, times):
    """Inputs (N, 2) in two blocks with opposite signs in the second input, and steady outputs (N, p)."""
    T, L = periods.period, len(G)
    k = np.arange(1, L + 1)
    phases = rng.uniform(0, 2 * np.pi, (2, L))
    u, y = [], []
    for sign in (1.0, -1.0):
        U = np.stack([np.exp(1j * phases[0]), sign * 2.0 * np.exp(1j * phases[1])], axis=1)
        turn = np.exp(2j * np.pi * np.outer(np.arange(T * times), k) / T)
        u.append(2 * (turn @ U).real)
        y.append(2 * (turn @ np.einsum("lpr,lr->lp", G, U)).real)
    return np.concatenate(u), np.concatenate(y), k


def test_two_inputs_are_separated_exactly_by_two_blocks():
    rng, periods = np.random.default_rng(0), Periods(32, blocks=2, skip=1)
    G = rng.standard_normal((10, 3, 2)) + 1j * rng.standard_normal((10, 3, 2))
    u, y, k = blocks(G, rng, periods, 3)
    assert excited_harmonics(u, periods).tolist() == k.tolist()
    found = periodic_response(u, y, periods, k)
    assert pytest.approx(G, abs=1e-12) == found.G
    assert found.deviation.max() < 1e-12
    assert found.freedom == 2


def test_inputs_in_phase_have_no_separate_responses():
    periods = Periods(32, blocks=2)
    u = np.cos(2 * np.pi * 3 * np.arange(128) / 32)[:, None] * np.array([1.0, 2.0])
    assert periodic_response(u, u, periods, np.array([3])) is None


def test_the_standard_deviations_agree_with_many_simulated_records():
    rng, periods = np.random.default_rng(1), Periods(16, blocks=2, skip=0)
    G = rng.standard_normal((4, 1, 2)) + 1j * rng.standard_normal((4, 1, 2))
    u, y, k = blocks(G, rng, periods, 5)
    records = [periodic_response(u, y + 0.3 * rng.standard_normal(y.shape), periods, k) for _ in range(1000)]
    scatter = np.std([one.G for one in records], axis=0)
    said = np.sqrt(np.mean([one.deviation**2 for one in records], axis=0))
    assert said == pytest.approx(scatter, rel=0.06)
    # 2 sigma^2 / (N p) with p = 2 |U|^2 the power of a sinusoid of amplitude 2 |U|.
    assert scatter[:, 0, 0] == pytest.approx(np.full(4, 0.3 / np.sqrt(160)), rel=0.06)
    assert scatter[:, 0, 1] == pytest.approx(np.full(4, 0.15 / np.sqrt(160)), rel=0.06)
    noise = np.mean([one.noise for one in records], axis=0)
    assert noise == pytest.approx(np.full((4, 1), 0.09), rel=0.05)


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
def test_a_polynomial_drift_is_recovered_from_any_periodic_output(seed, degree, blocks, skip, repeats, unit):
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
def test_noise_is_hardly_ever_taken_for_a_drift(past):
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


def test_the_drift_line_has_the_slope_of_a_regression_of_period_means():
    y = np.random.default_rng(3).standard_normal((530, 1)).cumsum(axis=0)
    means = y[30:, 0].reshape(5, PERIOD).mean(axis=1)
    slope = np.polyfit(PERIOD * np.arange(5.0), means, 1)[0]
    line = line_of_periods(y, Periods(PERIOD))[:, 0]
    assert np.diff(line) == pytest.approx(np.full(529, slope), rel=1e-9)
