"""Sensors that stand still are seen; rounding, whatever its step, is not taken for that."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.identification import frozen, identify, resolution_of
from inputdesign_cli.plant import PolynomialModel

# Steps of rounding over the standard deviation of white e; None: as it is.
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
    one = np.ones(1)
    D = np.array([1.0, -0.5]) if colour else one
    plant = (((np.array([0.0, 0.1]),),), (one,), ((np.array([1.0, -0.9]),),))
    return u[:, None], y[:, None], PolynomialModel(*plant, (one,), (D,), np.eye(1))


def seen(u, y, model):
    found = identify(model, u, y)
    held = np.concatenate([[[False]], y[1:] == y[:-1]])
    return frozen(
        held, resolution_of(y), u, found.errors, y - found.simulated, found.simulated, found.lengths
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "step",
    [step if step in (None, 0.5, 5.0) else pytest.param(step, marks=pytest.mark.slow) for step in STEPS],
)
def test_a_sensor_that_moves_is_not_frozen(step):
    assert [seed for seed in range(4) if seen(*record(seed, step))] == []


@pytest.mark.slow
@pytest.mark.parametrize("steps", [STEPS[:1], STEPS[1:]], ids=["noise", "rounded"])
def test_at_most_one_of_a_thousand_records_is_called_frozen(steps):
    assert sum(bool(seen(*record(seed, steps[seed % len(steps)]))) for seed in range(1000)) <= 1


@pytest.mark.first(1)
@pytest.mark.parametrize(("step", "stuck", "seeds"), [(None, 12, 8), (0.5, 40, 8), (0.7, 60, 8)])
def test_a_frozen_stretch_is_found_where_it_is(step, stuck, seeds):
    for seed in range(seeds):
        u, y, model = record(seed, step, stuck)
        start = SAMPLES // 3
        if not np.any(np.diff(u[start : start + stuck - 1], axis=0)):
            continue
        (found,) = seen(u, y, model)
        assert found.output == 0
        assert found.first <= start
        assert found.first + found.length >= start + stuck


@pytest.mark.parametrize("step", [None, 0.1, 5.0])
def test_a_step_of_rounding_is_that_of_the_record(step):
    x = np.random.default_rng(0).standard_normal((2000, 1)) * 3.0
    if step is None:
        assert resolution_of(x)[0] < 0.1 * np.std(x)
        return
    rounded = np.round(x / step) * step
    rounded[[100, 900]] += 0.37 * step  # filled in by hand
    rounded[40] = np.nan
    assert step * (1 - 1e-9) <= resolution_of(rounded)[0] <= max(1.0 + 1e-9, 0.3 / step) * step


def test_without_noise_or_without_an_input_that_moves_nothing_is_said():
    y = np.repeat(np.random.default_rng(1).standard_normal(20), 10)[:, None]
    held = np.concatenate([[[False]], y[1:] == y[:-1]])
    still, zero = np.ones_like(y), np.zeros_like(y)
    noise = np.random.default_rng(2).standard_normal(y.shape)
    assert frozen(held, np.array([1e-3]), still, noise, noise, zero, [200]) == []
    assert frozen(held, np.array([1e-3]), noise, zero, zero, zero, [200]) == []
    assert len(frozen(held, np.array([1e-3]), noise, noise, noise, zero, [200])) == 20


def test_an_input_that_rests_and_flickers_does_not_move():
    """A plant at rest under a measured input: neither moves but for the last digit of the input."""
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(0.0, 10.0, 20), 30)[:, None]
    y = scipy.signal.lfilter([0.3], [1, -0.7], u[:, 0])[:, None]
    y[::30] += rng.standard_normal((20, 1))  # what happens, happens at the steps
    held = np.concatenate([[[False]], np.abs(y[1:] - y[:-1]) < 0.01])
    flicker = u + 0.01 * rng.integers(0, 2, u.shape)
    errors = rng.standard_normal(u.shape)
    seen = [
        frozen(held, np.array([0.01]), v, errors, errors, 0.0 * y, [600]) for v in (flicker, 10.0 * flicker)
    ]
    assert seen == [[], []]
    moved = u + rng.uniform(-2.0, 2.0, u.shape)
    assert frozen(held, np.array([0.01]), moved, errors, errors, 0.0 * y, [600])
