"""Nothing of what a run holds is left out of a figure, and no two things in it look alike."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from matplotlib.figure import Figure

from inputdesign_cli.figures.sweep import draw_trade
from inputdesign_cli.figures.sweep_table import Trade
from inputdesign_cli.outcome.curves import BoundCurves, BoundPanel, OrderCurves, ResponseCurves
from tests.support.curves import SEEN, G, W, lines_by_label

SIZES = np.array([2.0, 4.0])


def looks(line):
    return line.get_color(), str(line.get_linestyle()), line.get_marker(), line._dash_pattern[1]


def apart(lines):
    return len({str(looks(line)) for line in lines}) == len(lines)


@pytest.mark.parametrize("families", [1, 6, 8, 20])
def test_every_family_is_drawn_and_told_apart(page, families):
    fits = {f"F{n}": (SIZES, np.array([90.0 - n, 80.0 - n])) for n in range(families)}
    (axes,) = (figure := page(OrderCurves(fits, (2.0, 90.0), "OE"))).axes
    named = {line.get_label(): line for line in axes.lines}
    assert set(named) == {*fits, "chosen: OE"}
    for family, (sizes, fit) in fits.items():
        np.testing.assert_array_equal(named[family].get_xydata(), np.column_stack([sizes, fit]))
    assert apart(list(named.values()))
    assert {text.get_text() for text in figure.legends[0].get_texts()} == set(named)


def test_fits_that_are_drawn_elsewhere_are_told(page):
    told = [
        page(OrderCurves({"OE": (SIZES, np.array([90.0, low]))}, (2.0, 90.0), "OE")).axes[0].get_ylabel()
        for low in (10.0, -500.0)
    ]
    assert ["-20" in label for label in told] == [False, True]


def test_every_amplitude_of_a_trade_is_drawn():
    page = Figure()
    texts = tuple(map(str, range(9)))
    draw_trade(Trade(SIZES, "s", texts, np.arange(18.0).reshape(9, 2) + 1.0, False), page)
    (axes,) = page.axes
    drawn = lines_by_label(axes)
    assert {f"amplitude {text}" for text in texts} <= set(drawn)
    assert apart(list(drawn.values()))


@pytest.mark.slow
def test_ratios_of_nine_entries_are_told_apart(page):
    panels = tuple(
        BoundPanel(W, 0.008 * G, G, 0.01 * G, entry=entry) for entry in product(range(3), repeat=2)
    )
    below = page(BoundCurves(panels)).axes[-1]
    drawn = lines_by_label(below)
    assert len(drawn) == 10  # the limit
    assert apart(list(drawn.values()))


def test_the_sign_of_every_gain_is_seen(page):
    """Of G and of -G the magnitudes are the same, and the phases are half a turn apart."""
    panels = tuple(
        replace(SEEN, G=s * SEEN.G, model=s * SEEN.model, entry=(0, j)) for j, s in enumerate((1, -1))
    )
    drawn = lines_by_label(page(ResponseCurves(panels)).axes[-1])
    assert list(drawn) == ["G₁₁", "G₁₂"]
    one, other = (line.get_ydata() for line in drawn.values())
    np.testing.assert_allclose(np.abs(other - one), 180.0)
    np.testing.assert_allclose(one, np.degrees(np.angle(SEEN.model)), atol=1e-9)
