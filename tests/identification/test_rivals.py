"""Minima that explain the data nearly as well as the best one are found where the record leaves them."""

from functools import cache

import numpy as np
import pytest
import scipy.optimize
import scipy.signal

from inputdesign_cli.compute.time_limit import watching
from inputdesign_cli.identification import identify
from inputdesign_cli.plant import ContinuousModel, SampledModel

SAMPLES, VARIANCE = 2000, 0.1
GAIN, TIME_CONSTANT, DEAD_TIME = 1.0, 4.0, 3.0
T = np.arange(SAMPLES)
# The fast sine is the same after 2 pi / 0.9 = 7 samples, and the slow one hardly tells a delay of 7.
TWO_SINES = 0.1 * np.sin(0.01 * T) + np.sin(0.9 * T)
BINARY = np.repeat(np.random.default_rng(3).choice([-1.0, 1.0], SAMPLES // 5), 5)
SIGNALS = {"sines": TWO_SINES, "binary": BINARY}
SEEDS = pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (1, 2))])


def plainly(theta, u):
    """K e^(-Ls) / (T s + 1) on held inputs: the step response between the samples."""
    gain, time_constant, dead_time = theta
    whole, part = divmod(dead_time, 1.0)
    a = np.exp(-1.0 / time_constant)
    first = gain * (1.0 - np.exp(-(1.0 - part) / time_constant))
    taps = np.concatenate([np.zeros(int(whole) + 1), [first, gain * (1.0 - a) - first]])
    return scipy.signal.lfilter(taps, [1.0, -a], u)


@cache
def estimated(kind, seed):
    u = SIGNALS[kind]
    y = plainly((GAIN, TIME_CONSTANT, DEAD_TIME), u)
    y = y + np.sqrt(VARIANCE) * np.random.default_rng(seed).normal(size=SAMPLES)
    entries = [((np.array(p),),) for p in ([GAIN], [1.0, TIME_CONSTANT])]
    model = ContinuousModel.monic(*entries, np.array([[VARIANCE]]), delay=((np.array([DEAD_TIME]),),))
    found = identify(SampledModel(model, 1.0), u[:, None], y[:, None], 1.0, start=model.theta, rest=True)
    return found, y


def of_s(theta):
    """(K, T, L) of K / T over s + 1 / T, late by L."""
    b, a, dead_time = theta
    return b / a, 1.0 / a, dead_time


@SEEDS
def test_a_dead_time_is_known_up_to_the_period_of_a_sine(seed):
    found, y = estimated("sines", seed)
    assert found.search.rivals
    left = [
        scipy.optimize.least_squares(
            lambda theta: y - plainly(theta, TWO_SINES), of_s(theta), x_scale=(0.1, 0.5, 0.1)
        )
        for theta in (found.theta, found.search.rivals[0].theta)
    ]
    periods = abs(left[1].x[2] - left[0].x[2]) / (2.0 * np.pi / 0.9)
    assert round(periods) >= 1
    assert periods == pytest.approx(round(periods), abs=0.1)
    # Both are minima of the plain sum of squares, and so far apart in -2 log likelihood.
    assert found.search.rivals[0].excess == pytest.approx(
        SAMPLES * np.log(left[1].cost / left[0].cost), abs=0.02
    )


@pytest.mark.slow
@SEEDS
def test_a_rich_record_leaves_no_rival(seed):
    assert estimated("binary", seed)[0].search.rivals == ()


@pytest.mark.slow
def test_the_search_tells_how_far_it_is():
    told = []
    with watching(told.append):
        found, _ = estimated.__wrapped__("binary", 0)
    (tried,) = [one for one in told if one.what == "starting points tried"]
    # All but the given one are made from the data, and tried together.
    assert found.search.starts == tried.of + 1
    assert told[-1].what == "starting points followed to a minimum"
