"""Signals of two and three levels, shift registers, converters, chosen lines."""

import numpy as np
import pytest

from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.signal.levels import few_levels
from inputdesign_cli.signal.lines import grid_lines
from inputdesign_cli.signal.multisine import multisine_record
from inputdesign_cli.signal.prbs import pseudo_random, register_length
from inputdesign_cli.signal.settings import Quantiser
from inputdesign_cli.signal.sinusoids import select
from inputdesign_cli.spectrum import FirBasis
from tests.support.signals import COLOURED, block_spectrum, of_two_inputs, periodogram


def rng(seed=0):
    return np.random.default_rng(seed)


def design(period):
    return grid_lines(of_two_inputs(2 * np.pi * np.arange(period // 2 + 1) / period), period, 1.0)


@pytest.mark.parametrize(("kind", "values"), [("binary", {-1.0, 1.0}), ("ternary", {-1.0, 0.0, 1.0})])
def test_levels_of_one_input_and_their_spectrum(kind, values):
    """Few levels only, and a spectrum nearer to the wanted one than that of the signs of noise."""
    samples = 512
    lines = grid_lines(FirBasis(1, 3).density(COLOURED, 2 * np.pi * np.arange(257) / samples), samples, 1.0)
    power = lines.totals

    def misfit(x):
        found = np.sqrt(periodogram(x))
        wanted = np.sqrt(power)
        return 1 - (found @ wanted) ** 2 / (found @ found) / (wanted @ wanted)

    record = few_levels(lines, samples, rng(), kind_of(kind).nearest)[:, 0]
    assert set(np.unique(np.sign(record))) <= values
    assert np.unique(np.abs(record[record != 0.0])).size == 1
    signs = [
        misfit(np.sign(multisine_record(lines, samples, rng(seed), "orthogonal")[:, 0])) for seed in range(10)
    ]
    assert misfit(record) < 0.35 * min(signs)


@pytest.mark.parametrize(("kind", "number"), [("binary", 2), ("ternary", 3)])
@pytest.mark.parametrize("samples", [480, 481])
def test_few_levels_at_several_inputs(kind, number, samples):
    """Levels of the powers of the inputs, and a matrix spectrum nearer than that of clipped multisines."""
    lines = design(240)
    record = few_levels(lines, samples, rng(), kind_of(kind).nearest)
    assert record.shape == (samples, 2)
    assert all(np.unique(column).size == number for column in record.T)
    np.testing.assert_allclose(np.mean(record[:480] ** 2, axis=0), lines.mean_squares, rtol=0.01)
    wanted = of_two_inputs(2 * np.pi * np.arange(121) / 240)

    def error(x):
        return np.linalg.norm(block_spectrum(x[:480], 2) - wanted) / np.linalg.norm(wanted)

    def signs(seed):
        return np.sign(multisine_record(lines, 480, rng(seed), "orthogonal")) * np.sqrt(lines.mean_squares)

    assert error(record) < 0.8 * min(error(signs(seed)) for seed in range(5))


@pytest.mark.parametrize("bits", [2, 5, 9])
def test_maximum_length_sequences_are_white(bits):
    """Circular autocorrelations of -1/n at every lag."""
    n = 2**bits - 1
    x = pseudo_random(bits, n, rng())
    found = np.fft.irfft(np.abs(np.fft.rfft(x)) ** 2, n) / n
    np.testing.assert_allclose(found[1:], -1 / n, atol=1e-12)
    assert register_length(n) == bits
    np.testing.assert_array_equal(pseudo_random(bits, 2 * n, rng())[n:], x)


@pytest.mark.parametrize("chosen", ["odd", 8, (1, 5, 9, 20)])
def test_selected_lines_keep_the_power_and_exclude_the_others(chosen):
    power = grid_lines(FirBasis(1, 3).density(COLOURED, 2 * np.pi * np.arange(33) / 64), 64, 1.0).totals
    gathered = select(power, chosen)
    assert gathered.sum() == pytest.approx(power.sum(), rel=1e-12)
    used = np.flatnonzero(gathered)
    if chosen == "odd":
        assert set(used) == set(range(1, 33, 2))
    else:
        assert used.size == (8 if chosen == 8 else 4)


def test_quantiser():
    converter = Quantiser(bits=3, span=4.0, offset=1.4)  # values -4, -3, .., 3
    assert converter.step == 1.0
    assert converter.operating_point == 1.0
    np.testing.assert_array_equal(converter.steps(np.array([-9.0, -0.4, 0.6, 9.0])), [-5, 0, 1, 2])
    assert converter.reach() == 2.0
