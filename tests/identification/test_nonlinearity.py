"""Power at silent lines shows nonlinearities, not noise or drifts; cubes give the change of G."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.identification import silent_in
from inputdesign_cli.identification.nonlinearity import cubes, silent_lines
from inputdesign_cli.identification.periodic_response import Periods, periodic_response


def odd_multisine(rng, period, times):
    t = np.arange(period * times)
    phases = rng.uniform(0, 2 * np.pi, 20)
    lines = np.arange(1, 80, 4)  # 1, 5, 9, ..: odd harmonics 3, 7, .. are silent
    return np.cos(2 * np.pi * np.outer(t, lines) / period + phases).sum(axis=1)[:, None] / 4


def test_for_coloured_noise_alone_the_probability_is_uniform():
    rng = np.random.default_rng(0)
    found = []
    for _ in range(150):
        v = scipy.signal.lfilter([1.0], [1.0, -0.95], rng.standard_normal(6 * 256 + 500))[500:]
        Y = np.fft.rfft(v.reshape(6, 256), axis=1)[None, :, 2:120:2, None]
        found.append(silent_lines(Y).probability[0])
    assert np.mean(found) == pytest.approx(0.5, abs=0.1)
    assert 0.03 < np.mean(np.array(found) < 0.1) < 0.2


@pytest.mark.parametrize(
    ("bent", "drift", "speaks"),
    [
        (lambda u: u, 0.0, set()),
        (lambda u: u, 0.01, set()),
        (lambda u: u + 0.1 * u**2, 0.0, {"even"}),
        (lambda u: u + 0.1 * u**3, 0.0, {"odd"}),
    ],
)
def test_even_and_odd_nonlinearities_are_distinguished_and_drifts_ignored(bent, drift, speaks):
    rng = np.random.default_rng(1)
    u = odd_multisine(rng, 256, 6)
    y = scipy.signal.lfilter([0, 0.5], [1, -0.6], bent(u[:, 0])) + 0.1 * rng.standard_normal(len(u))
    found = silent_in(u, (y + drift * np.arange(len(u)))[:, None])
    assert {kind for kind, one in found.items() if one.probability[0] < 0.01} == speaks


def test_the_rms_of_distortions_beyond_the_noise_is_found():
    rng = np.random.default_rng(2)
    u = odd_multisine(rng, 256, 8)
    more = 0.05 * np.sqrt(2) * np.cos(2 * np.pi * 10 * np.arange(len(u)) / 256)[:, None]
    found = silent_in(u, u + more + 0.05 * rng.standard_normal(u.shape))
    assert found["even"].rms[0] == pytest.approx(0.05, rel=0.3)


def test_inputs_that_do_not_repeat_have_no_silent_lines():
    rng = np.random.default_rng(4)
    assert silent_in(rng.standard_normal((500, 1)), rng.standard_normal((500, 1))) == {}
    assert silent_in(rng.standard_normal((500, 2)), rng.standard_normal((500, 1))) == {}


PERIOD, TIMES = 400, 9
ODD = np.arange(1, 100, 2)
SILENT = ODD[2::4]
LINES = np.setdiff1d(ODD, SILENT)


def low_peaks():
    """One period (PERIOD,) of a multisine of low crest factor, the best of 200 choices of the phases."""
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


def measured(y, seed, size=0.05, late=0, rough=1.0, level=0.0):
    u = np.tile(low_peaks(), TIMES)[:, None] + level
    y = y[:, None] + 1.25 * level + size * np.random.default_rng(seed).standard_normal((len(y), 1))
    periods = Periods(PERIOD, skip=1)
    found = periodic_response(u, y, periods, LINES)
    model = rough * response(LINES, late), rough * response(SILENT, late)
    return cubes(found, u, y, periods, SILENT, model, np.ones((SILENT.size, 1)))


def truth(y, late=0):
    """The size of the change of G at the lines without noise, from the last periods of y and of the plant."""
    linear = plant(np.tile(low_peaks(), TIMES), late)
    last = [np.fft.rfft(one[-PERIOD:])[LINES] for one in (y, linear)]
    return np.abs((last[0] / last[1] - 1.0) * response(LINES, late)[:, 0, 0])


@pytest.mark.parametrize(
    ("late", "rough"), [(0, 1.0), (0, 3.0), (12, 1.0)], ids=["plant", "model off", "dead time"]
)
def test_the_change_of_g_by_a_cube_of_the_input_is_found(late, rough):
    u = np.tile(low_peaks(), TIMES)
    y = plant(u + 0.03 * u**3, late)
    found = measured(y, 1, size=0.02, late=late, rough=rough)
    assert found.source.tolist() == [0]
    assert found.probability[0] < 1e-3
    assert found.error[:, 0, 0] == pytest.approx(truth(y, late), rel=0.25)


def test_the_change_of_g_by_a_cube_of_the_output_is_found():
    x = plant(np.tile(low_peaks(), TIMES))
    y = x - 0.02 * x**3
    found = measured(y, 2, size=0.003)
    assert found.source.tolist() == [-1]
    assert found.error[:, 0, 0] == pytest.approx(truth(y), rel=0.3, abs=0.1 * truth(y).max())


def test_the_level_of_the_input_does_not_enter_its_cube():
    u = np.tile(low_peaks(), TIMES)
    y = plant(u + 0.03 * u**3)
    plain, about = (measured(y, 1, size=0.02, level=level).error for level in (0.0, 40.0))
    assert about == pytest.approx(plain, rel=1e-6)


@pytest.mark.slow
def test_for_noise_alone_small_probabilities_are_rare():
    """The share below 0.1 is 0.1 if the two cubes are independent, and less since they are not."""
    y = plant(np.tile(low_peaks(), TIMES))
    found = np.array([measured(y, 100 + seed).probability[0] for seed in range(200)])
    assert 0.02 < np.mean(found < 0.1) < 0.14


def test_the_one_of_two_inputs_that_is_cubed_is_found():
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
