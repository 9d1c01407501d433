"""Spurious relations between signals, unstable plants, and inputs that excite too little."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore.relation import left_of_inputs, order_of_excitation, unhelpful, unstable_pole
from inputdesign_cli.plant import PolynomialModel


def cycles(rng, period=90.0, samples=700, noise=0.1):
    """Return a sinusoid with some noise."""
    phase = rng.uniform(0.0, 2.0 * np.pi)
    return np.sin(2.0 * np.pi * np.arange(samples) / period + phase) + noise * rng.standard_normal(samples)


def switched(rng, samples, low, high):
    """Return an input (samples,) of +-1 that switches after random times."""
    signs = np.concatenate([np.full(rng.integers(low, high), (-1.0) ** i) for i in range(samples)])
    return signs[:samples]


RECORDS = 20


def lag(gain, delay=1, pole=0.9):
    return PolynomialModel.single([*np.zeros(delay), gain * (1.0 - pole)], F=[1.0, -pole])


def nearest(u, y):
    """The lag of unit gain, scaled so that its simulation is nearest to y."""
    answer = scipy.signal.lfilter([0.0, 0.1], [1.0, -0.9], u - u.mean())
    return lag(float(answer @ (y - y.mean()) / (answer @ answer)))


def wandering(rng):
    return np.cumsum(np.repeat(rng.standard_normal(60), 10)), np.cumsum(rng.standard_normal(600))


def rising(rng):
    line = np.linspace(0.0, 8.0, 600)
    noise = scipy.signal.lfilter([1.0], [1.0, -0.8], 0.5 * rng.standard_normal(600))
    return line + rng.standard_normal(600), 2.0 * line + noise


@pytest.mark.parametrize(("make", "least"), [(wandering, 19), (rising, 19)])
def test_inputs_that_agree_by_chance_do_not_improve_the_prediction(make, least):
    """One of 20 pairs may help at the level of the test; the gain of the model is fitted to each pair."""
    told = 0
    for seed in range(RECORDS):
        u, y = make(np.random.default_rng(seed))
        told += unhelpful(nearest(u, y), [(u[:, None], y[:, None])]) == [0]
    assert told >= least


def prbs(rng):
    return np.repeat(rng.choice([-1.0, 1.0], 200), 3)


def two_steps(rng):
    return np.repeat([0.0, 1.0, 0.3], 200) + 0.0 * rng.random()


def smooth(rng):
    t = np.arange(600)
    return sum(np.sin(w * t + rng.uniform(0.0, 6.0)) for w in (0.02, 0.05, 0.11, 0.19, 0.31, 0.47, 0.83))


@pytest.mark.parametrize("make", [prbs, two_steps, smooth, cycles])
@pytest.mark.parametrize("colour", [0.0, 0.9, 1.0])
def test_an_input_with_an_effect_improves_the_prediction(make, colour):
    """The noise is white, coloured, or a random walk."""
    for seed in range(RECORDS):
        rng = np.random.default_rng(seed)
        u = make(rng)
        noise = scipy.signal.lfilter([1.0], [1.0, -colour], 0.02 * rng.standard_normal(u.size))
        y = scipy.signal.lfilter([0.0, 0.2], [1.0, -0.9], u) + noise
        assert unhelpful(lag(2.0), [(u[:, None], y[:, None])]) == []


def test_inputs_of_short_records_and_infinite_simulations_are_not_judged():
    """The records are too short for a comparison, or the model is one whose simulation is infinite."""
    short = np.random.default_rng(1).standard_normal((10, 1))
    assert unhelpful(lag(1.0), [(short, short)]) == []
    long = np.random.default_rng(1).standard_normal((600, 1))
    assert unhelpful(lag(1.0, pole=1e3), [(long, long)]) == []


def test_n_sinusoids_are_persistently_exciting_of_order_2n():
    t = np.arange(400.0)
    u = sum(np.sin(2.0 * np.pi * k / 400.0 * t + k) for k in (25, 70, 130))
    assert order_of_excitation([(u[:, None], u[:, None])]) == 6
    noise = np.random.default_rng(1).standard_normal((400, 1))
    assert order_of_excitation([(noise, noise)], most=20) == 20


@pytest.mark.parametrize("digits", [5, 8, 15])
def test_an_incomplete_period_does_not_raise_the_order_of_excitation(digits):
    """Neither the mean of a sinusoid that ends within a period nor rounding errors are excitation."""
    u = np.round(np.sin(0.3 * np.arange(790.0) + 1.0) + 5.0, digits)[:, None]
    assert order_of_excitation([(u, u)]) == 2


@pytest.mark.parametrize("at", [12, 60, 150])
def test_the_order_of_excitation_of_a_step_is_the_samples_before_it(at):
    """It is also limited by the samples after the step."""
    u = (np.arange(200) >= at)[:, None].astype(float)
    assert order_of_excitation([(u, u)]) == min(at, 50)


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
def test_a_pole_outside_the_unit_circle_is_located(A, controller):
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
        pole, deviation = found
        assert abs(pole) == pytest.approx(radius, abs=4.0 * deviation + 2e-3)
        assert np.min(np.abs(np.roots(A) - pole)) < 0.02


@pytest.mark.parametrize("deviation", [0.02, 0.3, 1.0])
def test_the_share_of_an_input_that_another_does_not_explain_is_found(deviation):
    """u2(t) = u1(t - 3) + s e(t), both white: s^2 / (1 + s^2) of its power is its own."""
    rng = np.random.default_rng(1)
    one = rng.standard_normal(20_000)
    other = np.roll(one, 3) + deviation * rng.standard_normal(one.size)
    _, left = left_of_inputs([(np.column_stack([one, other]), one[:, None])])
    assert left == pytest.approx(deviation**2 / (1.0 + deviation**2), rel=0.05)


def test_no_part_of_independent_inputs_is_explained_by_others():
    u = np.random.default_rng(2).standard_normal((20_000, 3))
    assert left_of_inputs([(u, u)]) == pytest.approx([1.0] * 3, abs=0.01)
    assert left_of_inputs([(u[:, :1], u)]) == [1.0]
    assert left_of_inputs([(u[:5], u[:5])]) == [1.0] * 3
