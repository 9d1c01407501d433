"""Inputs of one sinusoid and a little noise, beside inputs that tell more."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore import one_line


def cycles(rng, period=90.0, samples=700, noise=0.1):
    """Of one period, some more or less noise beside it."""
    phase = rng.uniform(0.0, 2.0 * np.pi)
    return np.sin(2.0 * np.pi * np.arange(samples) / period + phase) + noise * rng.standard_normal(samples)


@pytest.mark.parametrize("seed", range(5))
def test_two_signals_that_share_a_period_tell_one_line(seed):
    rng = np.random.default_rng(seed)
    share = one_line([(cycles(rng)[:, None], 3.0 + 2.0 * cycles(rng, noise=0.05)[:, None])])
    assert share == pytest.approx(0.5 / 0.51, abs=0.01)


@pytest.mark.parametrize("seed", range(5))
def test_a_plant_that_the_noise_moves_is_told_by_it(seed):
    rng = np.random.default_rng(seed)
    u = cycles(rng)
    y = scipy.signal.lfilter([0, 0.5], [1, -0.5], u) + 0.02 * rng.standard_normal(u.size)
    assert one_line([(u[:, None], y[:, None])]) is None


@pytest.mark.parametrize(
    "make",
    [
        lambda rng: np.repeat(rng.choice([-1.0, 1.0], 70), 10),
        lambda rng: (np.arange(700) > 200).astype(float),
        lambda rng: np.cumsum(rng.standard_normal(700)),
        lambda rng: np.sin(0.05 * np.arange(700)) + np.sin(0.2 * np.arange(700)),
    ],
    ids=["switched", "a step", "wandering", "two lines"],
)
def test_other_inputs_are_no_line_though_nothing_answers_them(make):
    for seed in range(5):
        rng = np.random.default_rng(seed)
        assert one_line([(make(rng)[:, None], rng.standard_normal((700, 1)))]) is None
