"""Spikes, frozen sensors and signals logged late are found; noise and rounding are no faults."""

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings, strategies as st

from inputdesign_cli.identification import identify
from inputdesign_cli.identification.faults import frozen, period_spikes, resolution_of, shifted, spikes
from inputdesign_cli.identification.periodic_response import Periods
from inputdesign_cli.plant import PolynomialModel, Rational, TransferMatrix

# Resolution over the standard deviation of white e; None: no rounding.
STEPS = (None, 0.1, 0.5, 1.0, 2.0, 5.0, 20.0)
SAMPLES = 400


def record(seed, step, stuck=0):
    """u and y of a fast or a slow plant, with white or coloured noise, and a model of its structure."""
    rng = np.random.default_rng([seed, 5])
    pole, colour = ((0.5, 0.0), (0.98, 0.0), (0.9, 0.8), (0.98, 0.9))[seed % 4]
    held = (1, 8, 25)[seed % 3]
    u = np.repeat(rng.choice([-1.0, 1.0], SAMPLES // held + 1), held)[:SAMPLES]
    e = rng.laplace(size=SAMPLES + 200) / np.sqrt(2) if seed % 5 == 0 else rng.standard_normal(SAMPLES + 200)
    y = 10.0 * scipy.signal.lfilter([0, 1.0 - pole], [1, -pole], u)
    y += scipy.signal.lfilter([1.0], [1.0, -colour], e)[200:] + 30.0
    y = y if step is None else np.round(y / step) * step
    start = SAMPLES // 3
    y[start : start + stuck] = y[start]
    model = PolynomialModel.single([0.0, 0.1], F=[1.0, -0.9], D=[1.0, -0.5] if colour else [1.0])
    return u[:, None], y[:, None], model


def seen(u, y, model):
    found = identify(model, u, y)
    held = np.concatenate([[[False]], y[1:] == y[:-1]])
    return frozen(
        held,
        resolution_of(y),
        u,
        found.errors,
        y - found.simulation.outputs,
        found.simulation.outputs,
        found.lengths,
    )


@pytest.mark.slow
@pytest.mark.parametrize("steps", [STEPS[:1], STEPS[1:]], ids=["noise", "rounded"])
def test_at_most_one_of_a_thousand_records_is_called_frozen(steps):
    assert sum(bool(seen(*record(seed, steps[seed % len(steps)]))) for seed in range(1000)) <= 1


@pytest.mark.first(3)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("step", "stuck"), [(None, 12), (0.5, 40), (0.7, 60)])
def test_a_frozen_stretch_is_found_where_it_is(step, stuck, seed):
    u, y, model = record(seed, step, stuck)
    start = SAMPLES // 3
    if np.any(np.diff(u[start : start + stuck - 1], axis=0)):
        ((output, ((first, last),)),) = seen(u, y, model).items()
        assert (output, first <= start) == (0, True)
        assert last + 1 >= start + stuck


@pytest.mark.parametrize("step", [None, 0.1, 5.0])
def test_the_resolution_of_a_rounded_record_is_found(step):
    x = np.random.default_rng(0).standard_normal((2000, 1)) * 3.0
    if step is None:
        assert resolution_of(x)[0] < 0.1 * np.std(x)
        return
    rounded = np.round(x / step) * step
    rounded[[100, 900]] += 0.37 * step  # filled in by hand
    rounded[40] = np.nan
    assert step * (1 - 1e-9) <= resolution_of(rounded)[0] <= max(1.0 + 1e-9, 0.3 / step) * step


def test_without_noise_or_moves_of_the_input_no_stretch_is_called_frozen():
    y = np.repeat(np.random.default_rng(1).standard_normal(20), 10)[:, None]
    held = np.concatenate([[[False]], y[1:] == y[:-1]])
    still, zero = np.ones_like(y), np.zeros_like(y)
    noise = np.random.default_rng(2).standard_normal(y.shape)
    assert frozen(held, np.array([1e-3]), still, noise, noise, zero, [200]) == {}
    assert frozen(held, np.array([1e-3]), noise, zero, zero, zero, [200]) == {}
    assert len(frozen(held, np.array([1e-3]), noise, noise, noise, zero, [200])[0]) == 20


def test_flicker_of_the_last_digit_of_an_input_is_no_move():
    """A plant at rest under a measured input: neither moves but for the last digit of the input."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(0.0, 10.0, 20), 30)[:, None]
    y = scipy.signal.lfilter([0.3], [1, -0.7], u[:, 0])[:, None]
    y[::30] += rng.standard_normal((20, 1))  # disturbances come at the steps only
    held = np.concatenate([[[False]], np.abs(y[1:] - y[:-1]) < 0.01])
    flicker = u + 0.01 * rng.integers(0, 2, u.shape)
    errors = rng.standard_normal(u.shape)
    seen = [
        frozen(held, np.array([0.01]), v, errors, errors, 0.0 * y, [600]) for v in (flicker, 10.0 * flicker)
    ]
    assert seen == [{}, {}]
    moved = u + rng.uniform(-2.0, 2.0, u.shape)
    assert frozen(held, np.array([0.01]), moved, errors, errors, 0.0 * y, [600])


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    scale=st.floats(-100, 100),
    where=st.sets(st.integers(0, 199), min_size=1, max_size=8),
    size=st.floats(20, 1e12),
)
def test_spikes_are_found_whatever_the_unit(seed, scale, where, size):
    """One spike of twenty deviations in 200 samples has more than half of the squares: 400 of 400 + 200."""
    rng = np.random.default_rng(seed)
    e = rng.normal(size=(200, 2))
    assert spikes(e) == []
    e[sorted(where), 1] += size * rng.choice([-1.0, 1.0], len(where)) * (1.0 + rng.random(len(where)))
    (found,) = spikes(10.0**scale * e)
    assert (found.output, set(found.samples)) == (1, where)
    rest = np.delete(e[:, 1], sorted(where))
    assert found.share == pytest.approx(1 - np.sum(rest**2) / np.sum(e[:, 1] ** 2), rel=1e-9)


@pytest.mark.parametrize("kind", ["normal", "laplace", "uniform", "logistic"])
@pytest.mark.parametrize("samples", [20, 100, 3000])
def test_noise_is_no_spike(kind, samples):
    rng = np.random.default_rng(7)
    assert not any(spikes(getattr(rng, kind)(size=(samples, 1))) for _ in range(300))


def test_frequent_outliers_and_constant_signals_are_no_spikes():
    e = np.random.default_rng(0).normal(size=(100, 1))
    e[:30:4] += 1e3  # eight of a hundred: an event, or a model that is wrong
    assert spikes(e) == []
    assert spikes(np.zeros((50, 1))) == []


@settings(deadline=None, max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    blocks=st.integers(1, 2),
    repeats=st.integers(1, 2),
    skip=st.integers(0, 1),
    where=st.sets(st.integers(0, 399), min_size=1, max_size=2),
    drift=st.floats(-10, 10),
)
def test_spikes_are_found_in_any_periodic_output(seed, blocks, repeats, skip, where, drift):
    """Spikes in the transient do not count. The noise is bounded, so that none is a spike by chance."""
    rng = np.random.default_rng(seed)
    periods, samples = Periods(100, blocks=blocks, skip=skip), blocks * 600
    y = np.concatenate([np.tile(100.0 * rng.standard_normal(100), samples // 100) for _ in range(1)])
    y = np.tile(y, repeats) + rng.uniform(-1.0, 1.0, samples * repeats)
    y += np.repeat(drift * np.arange(samples * repeats // 100), 100)
    assert period_spikes(y[:, None], periods, repeats=repeats) == []
    at = sorted(100 * skip + x for x in where)
    y[at] += 200.0
    transient = {x for x in at if blocks == 2 and 600 <= x < 700 and skip}
    (found,) = period_spikes(y[:, None], periods, repeats=repeats)
    assert set(found.samples) == set(at) - transient


PI = TransferMatrix.build([[[0.6, -0.4]]], [[[1.0, -1.0]]])
GAIN = TransferMatrix.build([[[0.5]]], [[[1.0]]])


def loop(controller, samples=300, level=0.0, seed=0):
    """u, y, r of y(t) = 0.8 y(t-1) + 0.5 u(t-1) + e(t) under u = r - C y, by its recursions."""
    rng = np.random.default_rng(seed)
    p, q = controller.numerator[0, 0], controller.denominator[0]
    r, e = rng.choice([-1.0, 1.0], samples), 0.3 * rng.standard_normal(samples)
    u, y, c = np.zeros(samples), np.zeros(samples), np.zeros(samples)
    for t in range(samples):
        y[t] = 0.8 * y[t - 1] + 0.5 * u[t - 1] + e[t] if t else e[t]
        past = sum(p[k] * y[t - k] for k in range(len(p)) if k <= t)
        c[t] = past - sum(q[k] * c[t - k] for k in range(1, len(q)) if k <= t)
        u[t] = r[t] - c[t]
    return u[:, None] + level, y[:, None] + 2.0 * level, r[:, None]


@pytest.mark.parametrize("controller", [PI, GAIN], ids=["PI", "gain"])
@pytest.mark.parametrize("level", [0.0, 50.0])
def test_signals_logged_in_time_obey_the_controller(controller, level):
    u, y, r = loop(controller, level=level)
    assert shifted(controller, u, y, r, [len(u)]) == []
    # Rounding, and a controller that differs a little from the spec, are no shift.
    assert shifted(controller, np.round(u, 1), np.round(y, 1), r, [len(u)]) == []
    assert shifted(controller.scaled(Rational.build([1.2])), u, y, r, [len(u)]) == []


@pytest.mark.parametrize("controller", [PI, GAIN], ids=["PI", "gain"])
@pytest.mark.parametrize(("letter", "lag"), [("u", 1), ("u", 2), ("u", -1), ("y", 1), ("r", -1)])
def test_a_signal_that_was_logged_at_another_time_is_found(controller, letter, lag):
    signals = dict(zip("uyr", loop(controller, level=50.0), strict=True))
    signals[letter] = np.roll(signals[letter], lag, axis=0)
    for lengths in ([300], [120, 180]):
        (found,) = shifted(controller, signals["u"], signals["y"], signals["r"], lengths)
        assert (found.letter, found.lag) == (letter, lag)
        assert found.then < 1e-6 or lengths != [300]
        assert found.left > 0.1


def test_each_input_is_tested_by_its_own_control_law():
    """Two loops side by side: the second input alone is late."""
    C = TransferMatrix.build([[[0.6, -0.4], [0.0]], [[0.0], [0.6, -0.4]]], [[[1.0, -1.0]] * 2] * 2)
    one, two = loop(PI, seed=1), loop(PI, seed=2)
    u, y, r = (np.column_stack([a, b]) for a, b in zip(one, two, strict=True))
    assert shifted(C, u, y, r, [300]) == []
    u[:, 1] = np.roll(u[:, 1], 1)
    (found,) = shifted(C, u, y, r, [300])
    assert (found.letter, found.channel, found.lag) == ("u", 1, 1)


def test_short_records_show_no_shift():
    u, y, r = loop(PI, samples=20)
    assert shifted(PI, np.roll(u, 1), y, r, [20]) == []
