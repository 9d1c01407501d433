"""The output that is to be expected of a record, and the noise about it, against plain filters and draws."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.outcome.text_formats import csv_text
from tests.support.pages import LOOP, SPEC

NOISE = "noise={C: [1, -0.4], D: [1, -0.9], variance: 0.25}"


def predicted(more="", *overrides):
    found = solve(parse_spec(SPEC % more, overrides=list(overrides)))
    table = found.tables["predicted_output"]
    assert csv_text(table).startswith("time_s,y1,y1_noise_deviation")
    return found.signal[:, 0], table.columns["y1"], table.columns["y1_noise_deviation"]


def test_the_output_is_that_of_the_plant_from_rest():
    u, y, _ = predicted()
    np.testing.assert_allclose(y, scipy.signal.lfilter([0, 1], [1, -0.5], u), atol=1e-12)


def test_in_a_loop_it_is_what_r_causes():
    r, y, _ = predicted(LOOP)
    np.testing.assert_allclose(y, scipy.signal.lfilter([0, 1], [1, -0.4], r), atol=1e-12)


def test_noise_that_settles_has_its_variance_from_the_start():
    _, _, deviation = predicted("", NOISE)
    # An ARMA(1, 1): variance (1 + c^2 + 2 a c) / (1 - a^2), here with pole 0.9 and zero 0.4.
    expected = 0.25 * (1 + 0.4**2 - 2 * 0.9 * 0.4) / (1 - 0.9**2)
    np.testing.assert_allclose(deviation**2, expected, rtol=1e-6)


def test_noise_in_a_loop_is_what_is_left_of_it():
    _, _, deviation = predicted(LOOP, NOISE)
    # y = S H e with S = (1 - 0.5 q^-1) / (1 - 0.4 q^-1).
    draws = np.random.default_rng(3).standard_normal((4000, 300)) * 0.5
    left = scipy.signal.lfilter(np.convolve([1, -0.5], [1, -0.4]), np.convolve([1, -0.4], [1, -0.9]), draws)
    assert np.std(left[:, -1]) == pytest.approx(deviation[-1], rel=0.05)


def test_noise_that_drifts_grows_with_the_root_of_time():
    _, _, deviation = predicted("", "noise={drift: true, variance: 0.04}")
    np.testing.assert_allclose(deviation, 0.2 * np.sqrt(np.arange(1.0, deviation.size + 1)), rtol=1e-9)


@pytest.mark.parametrize(("offset", "levels"), [("40", True), ("0", False), (None, False)])
def test_only_an_operating_point_makes_the_input_stand_at_levels(offset, levels):
    found = solve(parse_spec(SPEC % "", overrides=[f"signal.offset={offset}"] if offset else []))
    assert found.curves["signal"].levels == levels
