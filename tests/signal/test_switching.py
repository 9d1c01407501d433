"""Signals of ramps between two levels: their shape, and the search for better times to switch."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from inputdesign_cli.compute.time_limit import time_limit
from inputdesign_cli.information import FiniteRecord
from inputdesign_cli.signal.constraints import largest_move, ramped
from inputdesign_cli.signal.evaluation import Target
from inputdesign_cli.signal.generator import SignalGenerator
from inputdesign_cli.signal.limits import Bounds
from inputdesign_cli.signal.lines import DesignedSpectrum
from inputdesign_cli.signal.selection import best_record, better_switching
from inputdesign_cli.signal.settings import Quantiser, SignalSettings
from inputdesign_cli.spectrum import FirBasis


@pytest.mark.parametrize("rate", [0.3, 0.5, 3.0])
def test_far_switches_make_a_trapezoid(rate):
    """Straight lines between the corners: a switch at t leads to the other level 2 / rate samples after."""
    switches, level = [0, 13, 40, 71], 1.0
    values, corners, heights = np.empty(90), [-1.0], [0.0]
    for at in switches:
        values[at:] = level
        corners += [at - 1.0, at - 1.0 + (level - heights[-1]) * level / rate]
        heights += [heights[-1], level]
        level = -level
    expected = np.interp(np.arange(90), [*corners, 90.0], [*heights, heights[-1]])
    np.testing.assert_allclose(ramped(values, rate), expected, atol=1e-12)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.floats(0.01, 5.0))
def test_slow_records_are_followed_as_they_are_and_others_at_full_speed(seed, rate):
    values = np.random.default_rng(seed).normal(size=60)
    found = ramped(values, rate)
    assert largest_move(found) <= rate * (1 + 1e-12)
    moves = np.abs(np.diff(found, prepend=0.0))
    assert np.all((found == values) | (moves >= rate * (1 - 1e-9)))
    np.testing.assert_array_equal(ramped(0.999 * found, rate), 0.999 * found)


def test_the_search_finds_switches_that_are_known():
    """Of all signals of two levels the sign of a sinusoid has the largest product with it."""
    wave = np.sin(2 * np.pi * (np.arange(60) + 0.5) / 20)
    best = np.abs(wave).sum()
    start = np.where(np.random.default_rng(0).random((60, 1)) < 0.5, -2.0, 2.0)

    def figure(values):
        return 2.0 - float(wave @ values[:, 0]) / (2.0 * best) + 1e-12

    found = better_switching(start, figure, np.random.default_rng(1), 5000)
    np.testing.assert_array_equal(found[:, 0], 2.0 * np.sign(wave))


def test_the_search_keeps_what_is_best_and_ends_where_it_is_enough():
    rng, start, asked = np.random.default_rng(2), np.ones((30, 2)), []

    def figure(values):
        asked.append(values)
        return 3.0 - float(np.mean(values[:, 1] < 0.0)) * 4.0

    found = better_switching(start, figure, rng, 300, 1.0)
    assert figure(found) == min(map(figure, list(asked))) <= 1.0
    assert set(np.unique(found)) <= {-1.0, 1.0}
    first = len(asked)
    better_switching(found, figure, rng, 300, 1.0)
    assert len(asked) == first + 1
    np.testing.assert_array_equal(start, 1.0)


def test_a_pace_that_does_not_lead_there_ends_the_search_and_so_does_its_time():
    start, asked = np.ones((40, 1)), []

    def figure(values):
        asked.append(values)
        return 2.0 - 1e-4 * len(asked)

    better_switching(start, figure, np.random.default_rng(3), 600, 1.0)
    assert len(asked) == 101
    better_switching(start, figure, np.random.default_rng(3), 600)
    assert len(asked) == 101 + 601
    with time_limit(0.0):
        assert better_switching(start, figure, np.random.default_rng(3), 600) is start


@pytest.mark.parametrize("quantiser", [None, Quantiser(5, 0.8)], ids=["plain", "converter"])
@pytest.mark.parametrize(("periods", "hold"), [(1, 1), (2, 1), (1, 2)])
def test_every_sample_is_at_a_level_or_moves_at_the_rate(first_order, quantiser, periods, hold):
    """With the limits exact, whatever the converter; the height is the largest that they leave."""
    experiment = replace(first_order, samples=240)
    spectrum = DesignedSpectrum.of(FirBasis(1, 2), np.array([1.0, 0.7, 0.3]), inputs=1)
    settings = SignalSettings("slewed", periods=periods, hold=hold, candidates=1, most_candidates=1)
    bounds = Bounds(
        amplitude=np.array([0.72]),
        rate=np.array([0.32]),
        quantisers=() if quantiser is None else (quantiser,),
    )
    generator = SignalGenerator(spectrum, settings, 240)
    plant = FiniteRecord(experiment, 240)
    target = Target(lambda M: 1e6 / np.sqrt(np.trace(M)), meets=True)  # out of reach
    record = best_record(generator, plant, target, bounds)
    assert not record.met
    u = record.samples[::hold, 0]
    np.testing.assert_array_equal(np.repeat(u, hold), record.samples[:, 0])
    step = 0.05 if quantiser is not None else None
    most, fastest = (0.72, 0.32) if step is None else (0.7, 0.3)
    moves = np.abs(np.diff(u, prepend=0.0))
    assert np.abs(u).max() <= 0.72
    assert moves.max() <= 0.32
    levels = np.isclose(np.abs(u), most, rtol=1e-9)
    assert levels.any()
    assert np.all(levels | np.isclose(moves, fastest, rtol=1e-9))
    if step is not None:
        np.testing.assert_allclose(u / step, np.rint(u / step), atol=1e-9)
