"""The loop with the discs of the data, against its own polynomials and the margin that is asked."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve
from tests.support.pages import LOOP, SPEC

MARGIN = [
    "accuracy.model_error={sensitivity: {controller: {numerator: [0.2], denominator: [1, -1]}, max_db: 6}, "
    "confidence: 0.9, band: [0.01, 3.14]}"
]


def test_the_discs_touch_the_circle_that_is_to_be_kept_and_no_more():
    table = solve(parse_spec(SPEC % "", overrides=MARGIN)).tables["nyquist"].columns
    z = np.exp(-1j * table["frequency_rad_per_s"])
    loop = 0.2 / (1 - z) * z / (1 - 0.5 * z)
    np.testing.assert_allclose(table["CG_re"] + 1j * table["CG_im"], loop, rtol=1e-9, atol=1e-12)
    left = np.abs(1.0 + loop) - table["radius"]
    np.testing.assert_allclose(table["distance_kept"], 10 ** (-6 / 20))
    assert left.min() == pytest.approx(10 ** (-6 / 20), rel=1e-6)


def test_the_loop_of_the_experiment_has_discs_of_its_own_error():
    found = solve(parse_spec(SPEC % LOOP))
    table, bound = found.tables["nyquist"].columns, found.bound
    assert "distance_kept" not in table
    radius = np.interp(bound["frequency_rad_per_s"], table["frequency_rad_per_s"], table["radius"])
    np.testing.assert_allclose(radius, 0.1 * bound["r_u"], rtol=1e-3)


def test_without_a_loop_there_is_none():
    assert "nyquist" not in solve(parse_spec(SPEC % "")).curves
