"""What a cube changes of a response, told by silent lines: against plants whose change is known."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.identification.cubes import cubes
from inputdesign_cli.identification.periodic_response import Periods, periodic_response

PERIOD, TIMES = 400, 9
ODD = np.arange(1, 100, 2)
SILENT = ODD[2::4]
LINES = np.setdiff1d(ODD, SILENT)


def low_peaks():
    """A period of random phases of which the lowest peak of many tries is left: little crest factor."""
    rng = np.random.default_rng(0)
    t = np.arange(PERIOD)
    phases = 2.0 * np.pi * rng.uniform(size=(200, LINES.size))
    phases[0] = -np.pi * np.arange(LINES.size) ** 2 / LINES.size
    tries = np.cos(2.0 * np.pi * t[:, None, None] * LINES / PERIOD + phases).sum(axis=2)
    best = tries[:, np.argmin(np.abs(tries).max(axis=0))]
    return best / best.std()


def plant(u, late=0):
    return scipy.signal.lfilter(np.r_[np.zeros(1 + late), 0.5], [1.0, -0.6], u, axis=0)


def response(harmonics, late=0):
    z = np.exp(-2j * np.pi * harmonics / PERIOD)
    return (0.5 * z ** (1 + late) / (1.0 - 0.6 * z))[:, None, None]


def measured(y, seed, size=0.05, late=0, rough=1.0):
    u = np.tile(low_peaks(), TIMES)[:, None]
    y = y[:, None] + size * np.random.default_rng(seed).standard_normal((len(y), 1))
    periods = Periods(PERIOD, skip=1)
    found = periodic_response(u, y, periods, LINES)
    model = rough * response(LINES, late), rough * response(SILENT, late)
    return cubes(found, u, y, periods, SILENT, model, np.ones((SILENT.size, 1)))


def truth(y, late=0):
    """The change at the lines without noise: of the last period over that of the linear plant."""
    linear = plant(np.tile(low_peaks(), TIMES), late)
    last = [np.fft.rfft(one[-PERIOD:])[LINES] for one in (y, linear)]
    return np.abs((last[0] / last[1] - 1.0) * response(LINES, late)[:, 0, 0])


@pytest.mark.parametrize(
    ("late", "rough"), [(0, 1.0), (0, 3.0), (12, 1.0)], ids=["plant", "model off", "dead time"]
)
def test_the_change_by_a_cube_of_the_input_is_told(late, rough):
    u = np.tile(low_peaks(), TIMES)
    y = plant(u + 0.03 * u**3, late)
    found = measured(y, 1, size=0.02, late=late, rough=rough)
    assert found.source.tolist() == [0]
    assert found.probability[0] < 1e-3
    assert found.error[:, 0, 0] == pytest.approx(truth(y, late), rel=0.25)


def test_the_change_by_a_cube_of_the_output_is_told():
    x = plant(np.tile(low_peaks(), TIMES))
    y = x - 0.02 * x**3
    found = measured(y, 2, size=0.003)
    assert found.source.tolist() == [-1]
    assert found.error[:, 0, 0] == pytest.approx(truth(y), rel=0.3, abs=0.1 * truth(y).max())


def test_a_level_of_the_input_is_no_part_of_the_cube():
    u = np.tile(low_peaks(), TIMES)
    y = plant(u + 0.03 * u**3)
    periods, level = Periods(PERIOD, skip=1), 40.0
    noisy = y[:, None] + 0.02 * np.random.default_rng(1).standard_normal((len(y), 1))
    both = []
    for offset in (0.0, level):
        signals = u[:, None] + offset, noisy + 1.25 * offset
        found = periodic_response(*signals, periods, LINES)
        model = response(LINES), response(SILENT)
        both.append(cubes(found, *signals, periods, SILENT, model, np.ones((SILENT.size, 1))).error)
    assert both[1] == pytest.approx(both[0], rel=1e-6)


@pytest.mark.slow
def test_of_noise_alone_the_probability_is_not_small_too_often():
    """0.1 where the two cubes were independent, less as they are not."""
    y = plant(np.tile(low_peaks(), TIMES))
    found = np.array([measured(y, 100 + seed).probability[0] for seed in range(200)])
    assert 0.02 < np.mean(found < 0.1) < 0.14


def test_which_of_two_inputs_is_cubed_is_told():
    one = np.tile(low_peaks(), TIMES)
    other = np.roll(one, 37)
    first, second = np.concatenate([one, one]), np.concatenate([other, -other])
    y = plant(first) + plant(second + 0.03 * second**3, late=1)
    linear = plant(first) + plant(second, late=1)
    u, periods = np.stack([first, second], axis=1), Periods(PERIOD, blocks=2, skip=1)
    noise = 0.02 * np.random.default_rng(3).standard_normal((len(y), 1))
    model = [np.concatenate([response(at), response(at, late=1)], axis=2) for at in (LINES, SILENT)]
    measured_one = periodic_response(u, y[:, None] + noise, periods, LINES)
    shape = np.ones((SILENT.size, 1))
    found = cubes(measured_one, u, y[:, None] + noise, periods, SILENT, tuple(model), shape)
    G, G_linear = (periodic_response(u, at[:, None] + 1e-9 * noise, periods, LINES).G for at in (y, linear))
    assert found.source.tolist() == [1]
    assert found.error[:, 0, 1] == pytest.approx(np.abs(G - G_linear)[:, 0, 1], rel=0.3)
    assert np.all(found.error[:, 0, 0] < 0.3 * found.error[:, 0, 1].max())
