"""The errors of the design against what is admitted, in panels of entries."""

import numpy as np
import pytest

from inputdesign_cli.outcome.curves import BoundPanel
from tests.support.curves import CURVES, G, W, bound, lines_by_label


def test_bound_shows_every_error_and_marks_the_limiting_frequencies(page):
    above, below = page(CURVES["bound"]).axes
    lines = lines_by_label(above)
    np.testing.assert_array_equal(lines["r_u, design"].get_ydata(), 0.008 * G)
    np.testing.assert_array_equal(lines["r_u, white"].get_ydata(), 0.01 * G)
    np.testing.assert_array_equal(lines["r_adm, admitted"].get_ydata(), 0.01 * G)
    z = np.exp(-0.5j)
    expected = 0.008 * abs(3.6 * z / (1 - 0.7 * z))
    assert lines["limiting frequencies"].get_xdata()[0] == 0.5
    assert lines["limiting frequencies"].get_ydata()[0] == pytest.approx(expected, rel=1e-3)
    assert (above.get_xscale(), above.get_yscale()) == ("log", "log")
    ratios = lines_by_label(below)
    np.testing.assert_allclose(ratios["design: up to 0.8"].get_ydata(), 0.8)
    assert set(ratios["limit"].get_ydata()) == {1.0}
    assert below.get_yscale() == "linear"


def test_bound_shows_the_range_of_the_errors_not_that_of_the_gain(page):
    above, _ = page(CURVES["bound beside white"]).axes
    low, high = above.get_ylim()
    assert low > 0.5 * (0.008 * G).min()
    assert high < 2.0 * (0.03 * G).max()


def test_bound_tells_how_far_white_excitation_of_the_same_cost_misses(page):
    above, below = page(CURVES["bound beside white"]).axes
    assert {"r_u, w", "r_u, white, 4 × the cost"} <= set(lines_by_label(above))
    np.testing.assert_allclose(lines_by_label(below)["w: up to 3"].get_ydata(), 3.0)


def test_a_ratio_far_beyond_the_limit_does_not_squeeze_the_others(page):
    curves = bound(BoundPanel(W, 0.008 * G, G, 0.01 * G, r_u_equal=3.0 * G))
    _, below = page(curves).axes
    assert below.get_ylim()[1] < 10.0


def test_only_what_is_there_is_in_the_legend(page):
    (axes,) = page(CURVES["bound without a target"]).axes
    assert list(lines_by_label(axes)) == ["r_u, design", "|G|"]


def test_the_entries_stand_where_the_plant_has_them_and_others_stay_empty(page):
    *panels, below = page(CURVES["bounds of entries"]).axes
    titles = {axes.get_subplotspec().num1: axes.get_title(loc="left") for axes in panels}
    assert titles == {1: "G₁₂", 2: "G₂₁"}
    first, second = panels
    np.testing.assert_array_equal(lines_by_label(first)["r_adm, admitted"].get_ydata(), 0.01 * G)
    assert "r_adm, admitted" not in lines_by_label(second)
    assert list(lines_by_label(below)) == ["G12: up to 0.8", "limit"]


def test_numbers_stand_under_the_lowest_panel_only(page):
    narrow = BoundPanel(
        W[120:150], G[120:150], G[120:150], 2 * G[120:150]
    )  # within a decade, minor ticks too
    figure = page(bound(narrow))
    above, below = figure.axes
    assert not any(text.get_visible() and text.get_text() for text in above.get_xticklabels(which="both"))
    assert any(text.get_visible() and text.get_text() for text in below.get_xticklabels(which="both"))


def test_ratios_far_below_the_limit_keep_their_shape(page):
    """On a linear axis with the limit in it they would be one flat line."""
    _, below = page(bound(BoundPanel(W, 0.0002 * G * (1 + W), G, 0.01 * G))).axes
    assert below.get_yscale() == "log"
    low, high = below.get_ylim()
    assert low > 0.01
    assert high > 1.0
