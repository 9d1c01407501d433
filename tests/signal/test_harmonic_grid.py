"""Harmonics that are measured, and those that stay silent."""

import numpy as np
import pytest

from inputdesign_cli.signal.harmonic_grid import (
    HarmonicGrid,
    TooFewHarmonicsError,
    harmonics_between,
    nearest_harmonics,
    thinned,
)


@pytest.mark.parametrize("period", [64, 65, 1000, 997])
@pytest.mark.parametrize("odd", [False, True])
@pytest.mark.parametrize("lines", [1, 2, 7, 15])
def test_so_many_harmonics_rise_inside_the_band(period, odd, lines):
    band = (0.05, 2.9)
    found = harmonics_between(period, band, lines, odd=odd)
    assert found.size == lines
    assert np.all(np.diff(found) > 0)
    w = 2 * np.pi * found / period
    assert band[0] * (1 - 1e-9) <= w[0]
    assert w[-1] <= band[1] * (1 + 1e-9)
    assert not odd or np.all(found % 2 == 1)


def test_lines_are_even_in_the_logarithm_where_the_period_resolves_them():
    found = harmonics_between(10**6, (0.01, 1.0), 21, odd=False)
    assert np.diff(np.log(found)) == pytest.approx(np.log(100.0) / 20, rel=1e-2)


def test_all_harmonics_stand_where_no_number_is_asked_for():
    assert harmonics_between(10, (0.0, np.pi), None, odd=False).tolist() == [1, 2, 3, 4]
    assert harmonics_between(10, (0.0, np.pi), None, odd=True).tolist() == [1, 3]


def test_a_band_without_enough_harmonics_says_how_many_there_are():
    with pytest.raises(TooFewHarmonicsError) as caught:
        harmonics_between(100, (0.1, 0.3), 5, odd=False)
    assert caught.value.there == 3  # 2, 3 and 4 times 2 pi / 100


def test_frequencies_move_to_the_nearest_harmonic():
    w = 2 * np.pi / 100
    assert nearest_harmonics(100, w * np.array([0.6, 2.4, 2.6]), odd=False).tolist() == [1, 2, 3]
    assert nearest_harmonics(100, w * np.array([1.9, 2.1, 48.9]), odd=True).tolist() == [1, 3, 49]


def test_one_of_each_group_is_left_out_and_watched():
    candidates = np.arange(1, 49, 2)
    kept = thinned(candidates, 4, np.random.default_rng(3))
    missing = np.setdiff1d(candidates, kept)
    assert missing.size == 6
    assert np.all((missing - 1) // 8 == np.arange(6))
    grid = HarmonicGrid.of(100, kept, watched=True)
    everything = np.sort(np.concatenate([grid.excited, grid.odd, grid.even]))
    assert everything.tolist() == list(range(kept[0], kept[-1] + 1))
    assert np.all(grid.odd % 2 == 1)
    assert np.all(grid.even % 2 == 0)
