"""Signals that agree though neither moves the other, beside plants that answer their inputs."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.explore import unhelpful
from inputdesign_cli.plant import PolynomialModel
from tests.explore.test_one_line import cycles

RECORDS = 20


def held(rng, samples, every):
    return np.repeat(rng.standard_normal(samples // every + 1), every)[:samples]


def lag(gain, delay=1, pole=0.9):
    one = (np.ones(1),)
    B = np.concatenate([np.zeros(delay), [gain * (1.0 - pole)]])
    return PolynomialModel(((B,),), one, ((np.array([1.0, -pole]),),), one, one, np.eye(1))


def nearest(u, y):
    """The lag of unit gain, scaled so that its simulation is nearest to y."""
    answer = scipy.signal.lfilter([0.0, 0.1], [1.0, -0.9], u - u.mean())
    return lag(float(answer @ (y - y.mean()) / (answer @ answer)))


def wandering(rng):
    return np.cumsum(held(rng, 600, 10)), np.cumsum(rng.standard_normal(600))


def rising(rng):
    line = np.linspace(0.0, 8.0, 600)
    noise = scipy.signal.lfilter([1.0], [1.0, -0.8], 0.5 * rng.standard_normal(600))
    return line + rng.standard_normal(600), 2.0 * line + noise


def daily(rng):
    noise = scipy.signal.lfilter([1.0], [1.0, -0.7], 0.2 * rng.standard_normal(700))
    t = 2.0 * np.pi * np.arange(700) / 96.0
    return cycles(rng, period=96.0, noise=0.2), 3.0 * np.sin(t) + 0.8 * np.sin(2.0 * t + 1.0) + noise


@pytest.mark.parametrize(("make", "least"), [(wandering, 19), (rising, 19), (daily, 14)])
def test_signals_that_agree_by_chance_help_nothing(make, least):
    """Of 20 pairs one may help at the level of the test; a model that is scaled to them simulates a part.

    Within a cycle the rest of the input tells, which may be said to move the output by less than its noise.
    """
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
def test_a_plant_that_answers_is_helped(make, colour):
    """Noise white, coloured, and a random walk."""
    for seed in range(RECORDS):
        rng = np.random.default_rng(seed)
        u = make(rng)
        noise = scipy.signal.lfilter([1.0], [1.0, -colour], 0.02 * rng.standard_normal(u.size))
        y = scipy.signal.lfilter([0.0, 0.2], [1.0, -0.9], u) + noise
        assert unhelpful(lag(2.0), [(u[:, None], y[:, None])]) == []


def test_what_cannot_be_compared_is_not_told():
    """Records shorter than what a comparison needs, and a model whose simulation is infinite."""
    short = np.random.default_rng(1).standard_normal((10, 1))
    assert unhelpful(lag(1.0), [(short, short)]) == []
    long = np.random.default_rng(1).standard_normal((600, 1))
    assert unhelpful(lag(1.0, pole=1e3), [(long, long)]) == []
