"""Silent lines: of noise alone the probability is uniform, drifts do not speak, nonlinearities do."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli.identification import silent_in
from inputdesign_cli.identification.silent_lines import silent_lines


def odd_multisine(rng, period, times):
    t = np.arange(period * times)
    phases = rng.uniform(0, 2 * np.pi, 20)
    lines = np.arange(1, 80, 4)  # 1, 5, 9, ..: odd harmonics 3, 7, .. are silent
    return np.cos(2 * np.pi * np.outer(t, lines) / period + phases).sum(axis=1)[:, None] / 4


def test_of_coloured_noise_alone_the_probability_is_uniform():
    rng = np.random.default_rng(0)
    found = []
    for _ in range(150):
        v = scipy.signal.lfilter([1.0], [1.0, -0.95], rng.standard_normal(6 * 256 + 500))[500:]
        Y = np.fft.rfft(v.reshape(6, 256), axis=1)[None, :, 2:120:2, None]
        found.append(silent_lines(Y).probability[0])
    assert np.mean(found) == pytest.approx(0.5, abs=0.1)
    assert 0.03 < np.mean(np.array(found) < 0.1) < 0.2


@pytest.mark.parametrize(
    ("bent", "speaks"),
    [(lambda u: u, set()), (lambda u: u + 0.1 * u**2, {"even"}), (lambda u: u + 0.1 * u**3, {"odd"})],
)
def test_the_degree_is_told(bent, speaks):
    rng = np.random.default_rng(1)
    u = odd_multisine(rng, 256, 6)
    y = scipy.signal.lfilter([0, 0.5], [1, -0.6], bent(u[:, 0])) + 0.1 * rng.standard_normal(len(u))
    found = silent_in(u, y[:, None])
    assert {kind for kind, one in found.items() if one.probability[0] < 0.01} == speaks


def test_the_level_beyond_the_noise_is_told():
    rng = np.random.default_rng(2)
    u = odd_multisine(rng, 256, 8)
    more = 0.05 * np.sqrt(2) * np.cos(2 * np.pi * 10 * np.arange(len(u)) / 256)[:, None]
    found = silent_in(u, u + more + 0.05 * rng.standard_normal(u.shape))
    assert found["even"].rms[0] == pytest.approx(0.05, rel=0.3)


def test_a_drift_does_not_speak():
    rng = np.random.default_rng(3)
    u = odd_multisine(rng, 256, 6)
    y = u + 0.01 * np.arange(len(u))[:, None] + 0.1 * rng.standard_normal(u.shape)
    assert all(one.probability[0] > 0.01 for one in silent_in(u, y).values())


def test_inputs_that_do_not_repeat_say_nothing():
    rng = np.random.default_rng(4)
    assert silent_in(rng.standard_normal((500, 1)), rng.standard_normal((500, 1))) == {}
    assert silent_in(rng.standard_normal((500, 2)), rng.standard_normal((500, 1))) == {}
