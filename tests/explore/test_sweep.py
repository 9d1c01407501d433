"""Regressions over delays and orders find delays, poles, noise and drifts of simulated plants."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore.drift import levelled, slopes_of
from inputdesign_cli.explore.joint import explore_records
from inputdesign_cli.explore.relation import autoregression
from inputdesign_cli.explore.sweep import Regressed, delay_ranges, noise_model, sweep, whitened, whitening
from tests.explore.plants import column, held, with_noise
from tests.support.loops import loop, pid


def record(rng, delay, samples=400, ratio=10.0, F=(1.0, -0.85)):
    u = held(rng, samples)
    x = scipy.signal.lfilter(np.concatenate([np.zeros(delay), [0.15, 0.05]]), F, u)
    return column(u, with_noise(rng, x, ratio))


def test_a_long_regression_whitens_the_noise_of_a_loop():
    """A is that of the noise, [1, -0.9], to four deviations, without a model of the plant."""
    A = autoregression([loop(2, pid(0.4, 0.012), steps=1.0, pole=0.95, delay=31, held=200, samples=1600)])
    np.testing.assert_allclose(A, np.append([1.0, -0.9], np.zeros(A.size - 2)), atol=0.15)


@pytest.mark.parametrize("delay", [1, 4, 9, 17, 90])
def test_the_delay_of_a_lag_is_found_at_ten_decibels(delay):
    for seed in range(2):
        swept = sweep([record(np.random.default_rng(seed), delay)], 1)
        assert abs(swept.by_order[1].delays[0] - delay) <= 1


def test_the_best_delay_has_the_loss_of_an_exhaustive_search():
    one = record(np.random.default_rng(9), 7)
    losses = [Regressed([one], 1).output_error((d,)).loss for d in range(30)]
    assert sweep([one], 1).by_order[1].loss <= min(losses) * 1.001


def test_each_of_two_inputs_has_its_own_delay():
    rng = np.random.default_rng(2)
    u = np.stack([held(rng, 800), held(rng, 800, 9)], axis=1)
    x = scipy.signal.lfilter([0, 0, 0.2], [1, -0.8], u[:, 0])
    x += scipy.signal.lfilter([0] * 12 + [-0.3], [1, -0.8], u[:, 1])
    found = sweep([(u, with_noise(rng, x, 30.0)[:, None])], 1).by_order[1]
    assert found.delays == pytest.approx((2, 12), abs=1)


def test_poles_of_a_second_order_are_found_in_several_records():
    rng, F = np.random.default_rng(3), [1.0, -1.5, 0.7]
    parts = [record(rng, 3, F=F, ratio=100.0) for _ in range(3)]
    swept = sweep(parts, 4)
    np.testing.assert_allclose(swept.by_order[2].F, F, atol=0.03)
    assert swept.best.order in (2, 3)
    left = sum(e @ e for e in Regressed(parts, 2).errors(swept.by_order[2])) / 1200
    assert left == pytest.approx(swept.by_order[2].loss)


def test_an_autoregression_makes_records_white():
    e = np.random.default_rng(5).standard_normal(4000)
    v = scipy.signal.lfilter([1.0], [1.0, -1.2, 0.5], e)
    np.testing.assert_allclose(whitening([v[:2000], v[2000:]])[:3], [1.0, -1.2, 0.5], atol=0.06)
    ((_, left),) = whitened([column(np.zeros(4000), v)], np.array([1.0, -1.2, 0.5]))
    np.testing.assert_allclose(left[:, 0], e[2:], atol=1e-9)


@pytest.mark.parametrize(("C", "D"), [([1.0], [1.0]), ([1.0, 0.5], [1.0, -0.9])])
def test_orders_of_the_noise_are_found(C, D):
    v = scipy.signal.lfilter(C, D, np.random.default_rng(6).standard_normal(4000))
    found = noise_model([v])
    for polynomial, expected in zip(found, (C, D), strict=True):
        assert len(polynomial) == len(expected)
        np.testing.assert_allclose(polynomial, expected, atol=0.07)


@pytest.mark.parametrize("seeds", [5, pytest.param(10, marks=pytest.mark.slow)])
def test_the_confidence_range_of_a_delay_contains_it(seeds):
    inside = 0
    for seed in range(seeds):
        one = record(np.random.default_rng(seed), 5, ratio=2.0)
        ((low, high),) = delay_ranges([one], sweep([one], 1).by_order[1], least=0, most=60)
        inside += low <= 5 <= high
    assert inside >= 0.8 * seeds


def drifting(seed, slope, samples=1600, pole=0.92):
    """Return two records of steps of a slow lag; the drift continues through the gap between them."""
    rng = np.random.default_rng(seed)
    u = held(rng, samples, 100, (-3.0, -1.0, 2.0, 4.0))
    x = scipy.signal.lfilter([0.0] * 7 + [0.034], [1.0, -0.98], u)
    v = scipy.signal.lfilter([0.04], [1.0, -pole], rng.standard_normal(samples))
    y = x + v + slope * np.arange(samples)
    return [column(u[at], y[at]) for at in (slice(0, samples // 2), slice(samples // 2 + 200, samples))]


@pytest.mark.first(2)
@pytest.mark.parametrize("slope", [1e-3, 0.0, -1e-3])
def test_the_slope_of_one_line_through_all_records_is_found(slope):
    """Noise of a power of 0.25 at low frequencies gives the slope a deviation of 6.4e-5."""
    parts = drifting(1, slope)
    found = slopes_of(parts)
    assert found == pytest.approx([slope], abs=3 * 6.4e-5)
    level = levelled(parts, found)
    left = slopes_of(level)
    assert left == pytest.approx([0.0], abs=3 * 6.4e-5)


def short(records, samples):
    """Records that are too short to be whitened."""
    rng = np.random.default_rng(3)
    noise = scipy.signal.lfilter([1.0], [1.0, -1.6, 0.8], rng.standard_normal((records, samples)), axis=1)
    return [column(rng.choice([-1.0, 1.0], samples), 0.1 * e) for e in noise]


def test_slopes_of_records_shorter_than_the_memory_of_noise_are_finite():
    assert np.all(np.isfinite(slopes_of(short(4, 12))))


@pytest.mark.slow
def test_records_shorter_than_the_memory_of_noise_have_a_model():
    assert np.all(np.isfinite(explore_records(short(50, 19)).estimate.theta))


def test_random_walks_are_seldom_taken_for_a_line():
    """A random walk rises by many times as much as stationary noise would allow."""
    lines = 0
    for seed in range(5):
        rng = np.random.default_rng(seed)
        u = held(rng, 600, 20)
        y = scipy.signal.lfilter([0, 0.1], [1, -0.9], u) + np.cumsum(0.02 * rng.standard_normal(600))
        lines += bool(slopes_of([column(u, y)])[0])
    assert lines <= 1
