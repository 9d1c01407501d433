"""Relays are told by the noise that switches them, late inputs by outputs that know of their jumps."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore import answers_output, early_answers
from inputdesign_cli.explore.unstable import unstable_pole

A, B = [1, -0.95], [0, 0, 0, 0, 0.1]


def switched(rng, samples, low, high):
    """An input of two levels that someone switches after any time."""
    signs = np.concatenate([np.full(rng.integers(low, high), (-1.0) ** i) for i in range(samples)])
    return signs[:samples]


def thermostat(rng, samples=900, sign=1.0):
    """u (n, 1), y (n, 1): a lag with dead time, held within a band about a set point that moves at times."""
    level = np.repeat(rng.uniform(0.5, 1.5, samples // 100 + 1), 100)
    u, y, x, on = np.zeros(samples), np.zeros(samples), np.zeros(samples), 1.0
    for t in range(samples):
        x[t] = 0.95 * x[t - 1] + 0.1 * u[t - 4] if t >= 4 else 0.0
        y[t] = x[t] + 0.03 * rng.standard_normal()
        on = 0.0 if y[t] > level[t] + 0.1 else 1.0 if y[t] < level[t] - 0.1 else on
        u[t] = on
    return u[:, None], sign * y[:, None]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_thermostat_is_a_loop(sign):
    seen = [answers_output([thermostat(np.random.default_rng(seed), sign=sign)]) for seed in range(8)]
    assert np.mean([[j for j, _ in found] == [0] for found in seen]) >= 0.75


@pytest.mark.parametrize("late", [5, 8])
@pytest.mark.parametrize("gain", [1.0, -3.0])
def test_an_input_that_is_logged_late_is_told_with_its_lead(late, gain):
    """The plant answers after four samples: what is logged later than that comes after the answer."""
    rng = np.random.default_rng(2)
    u = switched(rng, 600, 5, 40)
    y = gain * scipy.signal.lfilter(B, A, u) + 0.1 * rng.standard_normal(600)
    logged = np.concatenate([np.full(late, u[0]), u[:-late]])
    (found,) = early_answers([(logged[:, None], y[:, None])])
    assert (found.input, found.output, found.samples) == (0, 0, late - 4)
    assert early_answers([(u[:, None], y[:, None])]) == []


@pytest.mark.parametrize("held", [(5, 6), (4, 30), (20, 21), (1, 8)])
def test_an_input_that_someone_switches_answers_nothing(held):
    """A clock, a PRBS or any times; the plant acts late, at once, or against its gain, and bends."""
    for seed, (b, bend) in enumerate([(B, 0.0), ([0.5, 0.2], 0.0), ([-0.3, 0.6], 0.0), (B, 0.4)]):
        rng = np.random.default_rng(seed)
        u = switched(rng, 900, *held) * np.where(
            held == (5, 6), rng.choice([-1.0, 1.0], 900 // 5).repeat(5), 1.0
        )
        x = scipy.signal.lfilter(b, A, u)
        y = x + bend * x**2 + 0.1 * x.std() * rng.standard_normal(900)
        record = [(u[:, None], y[:, None])]
        assert answers_output(record) == []
        assert early_answers(record) == []


@pytest.mark.parametrize(
    ("A", "controller"),
    [
        ([1, -1.1], [2.0, 0.0]),
        ([1, 1.1], [-2.0, 0.0]),
        ([1, -1.6, 1.1], [1.0, -2.0]),
        ([1, -0.9], [2.0, 0.0]),
        ([1, -1.4, 0.6], [1.0, 0.0]),
    ],
)
def test_a_pole_outside_the_circle_is_told_where_it_is(A, controller):
    """A x = 0.2 u(t - 1) under u = r - C y; the last two plants are stable."""
    rng = np.random.default_rng(4)
    r, y, u, x = switched(rng, 500, 1, 6), np.zeros(500), np.zeros(500), np.zeros(500)
    for t in range(2, 500):
        x[t] = 0.2 * u[t - 1] - sum(a * x[t - lag] for lag, a in enumerate(A[1:], start=1))
        y[t] = x[t] + 0.05 * rng.standard_normal()
        u[t] = r[t] - controller[0] * y[t] - controller[1] * y[t - 1]
    found = unstable_pole([(u[:, None], y[:, None])], 0)
    radius = np.max(np.abs(np.roots(A)))
    if radius < 1.0:
        assert found is None
    else:
        assert found.radius == pytest.approx(radius, abs=4.0 * found.deviation + 2e-3)
        assert found.denominator == pytest.approx(A, abs=0.02)


def levels(rng, n, low, high):
    """An input at any level, held for `low` to `high` samples."""
    return np.repeat(rng.uniform(-1.0, 1.0, n), rng.integers(low, high + 1, n))[:n]


@pytest.mark.parametrize("late", [3, 4])
@pytest.mark.parametrize("gain", [2.0, -2.0])
def test_an_input_of_many_levels_that_is_logged_late_is_told(late, gain):
    """The plant answers after one sample, so that the output moves late - 1 samples before the log does."""
    seen = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        u = levels(rng, 600, 7, 29)
        y = gain * scipy.signal.lfilter([0.0, 0.1], [1.0, -0.9], u) + 0.2 * rng.standard_normal(600)
        assert early_answers([(u[:, None], y[:, None])]) == []
        logged = np.concatenate([np.full(late, u[0]), u[:-late]])
        seen += early_answers([(logged[:, None], y[:, None])])
    assert len(seen) >= 5
    assert max(found.samples for found in seen) <= late - 1


@pytest.mark.parametrize("bend", [0.0, 0.5])
def test_inputs_in_loops_or_that_bend_a_plant_are_not_logged_late(bend):
    for seed in range(6):
        rng = np.random.default_rng(seed)
        r = levels(rng, 800, 20, 50)
        u, y, x, total = np.zeros(800), np.zeros(800), 0.0, 0.0
        for k in range(800):
            y[k] = x + bend * np.tanh(x) ** 2 + 0.05 * rng.standard_normal()
            total += 0.05 * (r[k] - y[k])
            u[k] = 0.5 * (r[k] - y[k]) + total
            x = 0.9 * x + 0.2 * u[k]
        assert early_answers([(u[:, None], y[:, None])]) == []
        many = np.sin(np.outer(np.arange(800.0), [0.03, 0.11, 0.17])).sum(axis=1)
        x = scipy.signal.lfilter([0.0, 0.2], [1.0, -0.9], many)
        y = x + bend * x**2 + 0.05 * rng.standard_normal(800)
        assert early_answers([(many[:, None], y[:, None])]) == []
