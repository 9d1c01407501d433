"""Laws of all figures: they leave no global state, hide no curve, and take names as they are."""

import re
import struct
import sys
from dataclasses import replace
from functools import cache
from itertools import combinations, pairwise, product

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from inputdesign_cli.figures.estimates import draw_campaign
from inputdesign_cli.figures.plots import draw, draw_all, figure, painter
from inputdesign_cli.figures.readings import readings
from inputdesign_cli.figures.style import TYPE_SIZE, log_axes, painted, rendered
from inputdesign_cli.figures.sweep import draw_trade
from inputdesign_cli.figures.sweep_table import Trade
from inputdesign_cli.outcome.curves import (
    BoundCurves,
    BoundPanel,
    CampaignCurves,
    FitCurves,
    NyquistCurves,
    OrderCurves,
    PredictedPanel,
    ResponseCurves,
    RunCurves,
    SignalCurves,
)
from inputdesign_cli.outcome.results import Results
from tests.support.curves import CURVES, FIT, SEEN, G, T, W, bound, lines_by_label, one_input
from tests.support.outcomes import typed

WAVE = np.sin(0.1 * T)
# Numbers of the first height of a panel that are narrower than those of the last one.
SKEW = np.where(WAVE < 0, 0.0419, 0.0344) * WAVE
QUIET = (PredictedPanel("u1", 1.7 * WAVE, 0 * T, applied=True), PredictedPanel("y1", SKEW, 0 * T))
LONG = {"u1": "w" * 30 + " (km/h)", "u2": "heating of the hall behind the door (%)"}
UNUSUAL = {
    "many entries": BoundCurves(
        tuple(BoundPanel(W, 0.008 * G, G, 0.01 * G, entry=entry) for entry in product(range(8), repeat=2))
    ),
    "one long row": BoundCurves(tuple(BoundPanel(W, 0.008 * G, G, entry=(0, j)) for j in range(5))),
    "quiet output": SignalCurves(T, {"r1": 1.1 * WAVE}, predicted=QUIET),
    "long names": SignalCurves(T, {"u1": WAVE, "u2": WAVE}, labels=LONG),
    "full legend": bound(
        BoundPanel(W, 0.00816 * G, G, 0.01 * G, r_u_record=0.00836 * G, r_u_equal=0.0191 * G)
    ),
}


@cache
def drawn(name, width="page"):
    """The picture of curves and its figure; drawn once for all tests."""
    found = []
    return rendered(painter((CURVES | UNUSUAL)[name]), width=width, seen=found.append), found[0]


def test_drawing_changes_no_global_state():
    def state():
        # Reading the backend would choose one.
        settings = {key: mpl.rcParams[key] for key in mpl.rcParams if key != "backend"}
        return settings, "matplotlib.pyplot" in sys.modules

    before = state()
    draw(CURVES["bound"])
    assert state() == before


def test_the_unit_of_time_is_on_the_axis(page):
    assert "rad/min" in page(CURVES["spectrum"], "min").axes[0].get_xlabel()
    assert "(min)" in page(CURVES["signal"], "min").axes[0].get_xlabel()


NAMES = [r"$\frac{1}{0", "$$", "$x$", r"\$", "_u", "100 %", "{}", "日本", "a_b^c", "&<b>", "{0}", "°C"]


def test_names_and_units_are_drawn_as_they_are():
    """Warnings are errors in these tests: letters that the font lacks cause none."""
    formulas, others = (" ".join(n for n in NAMES if ("$" in n) is holds) for holds in (True, False))
    wave, long = np.sin(np.arange(50.0)), ["w" * 40, "$" * 40]
    for names in ((formulas, others, *NAMES[3:5]), long):
        labels = {f"u{i}": f"{name} ({name})" for i, name in enumerate(names)}
        assert draw(SignalCurves(T[:50], dict.fromkeys(labels, wave), labels=labels))
    assert draw(FitCurves(T, (replace(FIT, label=NAMES[7]), replace(FIT, label=long[1]))), "s", "svg")
    assert draw(bound(BoundPanel(W, 0.008 * G, G, names=" → ".join(long))))


@pytest.mark.parametrize("width", ["column", "page"])
def test_a_label_wider_than_the_page_leaves_room_for_the_axes(width):
    """The legend of a fan had the parameters of a plant in one line, and the axes were a strip beside it."""
    fan, found = CURVES["fan"], []
    wide = replace(fan, active={", ".join(["plant 31", *["time_constant 4.32e+03"] * 4]): fan.nominal})
    rendered(painter(wide), width=width, seen=found.append)
    (axes,) = found[0].axes
    assert axes.get_position().width > 0.7


@pytest.mark.first(12)
@pytest.mark.parametrize("name", CURVES)
def test_a_png_has_its_size_one_text_size_and_no_legend_over_a_curve(name):
    """Panels side by side share the label of one; only the symbols r_u and r_adm are typeset."""
    data, figure = drawn(name)
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    assert width == 1050
    assert 675 <= height <= 1050
    shown = [axes for axes in figure.axes if axes.axison and not axes.images]
    for axes in shown:
        row = [one for one in shown if np.isclose(one.get_position().y0, axes.get_position().y0)]
        assert any(one.get_ylabel() for one in row) or axes.get_title(), name
    texts = [text for text in figure.findobj(Text) if text.get_text()]
    formulas = {found for text in texts for found in re.findall(r"\S*\$\S*", text.get_text())}
    assert {found.strip("(),:") for found in formulas} <= {"r$_{u}$", "r$_{adm}$"}
    assert {text.get_fontsize() for text in texts if text.get_text().strip()} == {TYPE_SIZE}
    for axes in figure.axes:
        legend = axes.get_legend()
        if legend:
            assert legend.get_window_extent().y0 >= axes.get_window_extent().y1
            assert legend.get_window_extent().x1 <= figure.bbox.x1


# The test before has drawn the pages.
LAID_OUT = [("bound beside white", "phone"), ("predicted signal", "column")]
LAID_OUT += [(name, width) for name in UNUSUAL for width in ("page", "column")]
LAID_OUT += [(name, width) for width in ("page", "column", "phone") for name in CURVES]


@pytest.mark.first(24)
@pytest.mark.parametrize(("name", "width"), dict.fromkeys(LAID_OUT))
def test_no_text_leaves_the_page_or_lies_on_another(name, width):
    _, figure = drawn(name, width)
    renderer = figure.canvas.get_renderer()
    texts = [(t.get_text(), t.get_window_extent(renderer)) for t in headings(figure)]
    (left, bottom), (right, top) = figure.bbox.padded(1.0).min, figure.bbox.padded(1.0).max
    for text, box in texts:
        assert left <= box.x0, text
        assert box.x1 <= right, text
        assert bottom <= box.y0, text
        assert box.y1 <= top, text
    for (text, box), (other, its) in combinations(texts, 2):
        assert overlap(box, its) <= 2.0, (text, other)
    for axes in figure.axes:
        for axis, side in ((axes.xaxis, "x"), (axes.yaxis, "y")):
            low, high = sorted(axis.get_view_interval())
            ticks = [
                tick for tick in axis.get_ticklabels(which="both") if tick.get_visible() and tick.get_text()
            ]
            ticks = [tick for tick in ticks if low <= tick.get_position()["xy".index(side)] <= high]
            ends = sorted(
                getattr(tick.get_window_extent(renderer), f"interval{side}").tolist() for tick in ticks
            )
            assert all(one[1] < other[0] for one, other in pairwise(ends)), (side, ticks)


@pytest.mark.parametrize(("low", "high"), [(0.031, 0.19), (0.02, 0.9), (0.41, 0.72), (0.04, 30.0)])
def test_a_logarithmic_axis_has_two_numbers_or_more(low, high):
    page = painted(lambda page: log_axes(page.subplots(), "y"))
    page.axes[0].set_ylim(low, high)
    page.draw_without_rendering()
    ticks = page.axes[0].yaxis.get_ticklabels(which="both")
    assert sum(low <= tick.get_position()[1] <= high and bool(tick.get_text()) for tick in ticks) >= 2


def test_no_power_of_ten_stands_over_the_axis_where_the_legend_is(page):
    axes = page(one_input(1e-18 * np.ones_like(W), 2e-18)).axes[0]
    assert not axes.yaxis.get_offset_text().get_visible()
    assert "2e-18" in [tick.get_text() for tick in axes.get_yticklabels()]


def test_names_along_an_axis_are_no_numbers():
    categories = painted(lambda page: page.subplots().barh(["designed", "white"], [1.0, 6.6])).axes[0]
    categories.figure.draw_without_rendering()
    assert [tick.get_text() for tick in categories.get_yticklabels()] == ["designed", "white"]


def headings(page):
    """Titles, labels of axes and of legends: all text but numbers along the axes."""
    labels = [text for legend in page.legends for text in legend.get_texts()]
    labels += [text for text in (page._suptitle, page._supxlabel, page._supylabel) if text]
    for axes in page.axes:
        labels += axes.get_legend().get_texts() if axes.get_legend() else []
        labels += [axes.title, axes._left_title, axes._right_title, axes.xaxis.label, axes.yaxis.label]
    return [text for text in labels if text.get_text().strip() and text.get_visible()]


def overlap(one, other):
    """The overlap of two boxes in pixels, across or down, whichever is less."""
    both = Bbox.intersection(one, other)
    return min(both.width, both.height) if both else 0.0


def test_a_single_sample_is_a_dot(page):
    drawn = page(SignalCurves(T[:1], {"u1": np.array([0.3])}))
    (line,) = drawn.axes[0].lines
    assert line.get_marker() == "o"


@pytest.mark.parametrize(("kind", "begins"), [("svg", b"<?xml"), ("pdf", b"%PDF"), ("png", b"\x89PNG")])
def test_figures_come_in_the_format_that_is_asked_for_and_the_same_each_time(kind, begins):
    results = Results(typed({}), "", curves={"signal": CURVES["signal"]})
    drawn = draw_all(results, kind)
    assert list(drawn) == [f"signal.{kind}"]
    assert drawn[f"signal.{kind}"].startswith(begins)
    assert draw_all(results, kind) == drawn


def test_files_for_papers_keep_their_text():
    """A PDF has TrueType fonts (no Type 3), an SVG has letters, and a given spectrum is labelled as given."""
    curves = replace(CURVES["spectrum"], label="given")
    assert b"/Subtype /Type3" not in (pdf := draw(curves, "s", "pdf"))
    assert b"/FontFile2" in pdf
    svg = draw(curves, "s", "svg").decode()
    assert ">Φᵤ, given<" in svg
    assert "design" not in svg


def test_a_notebook_shows_a_figure_before_pyplot_is_imported():
    results = Results(typed({}), "", curves={"bound": CURVES["bound"]})
    assert figure(results, "bound")._repr_png_().startswith(b"\x89PNG")


def test_a_limiting_frequency_far_outside_does_not_push_the_axes_aside():
    """Integral action takes C G to infinity at frequency zero; a warning would be an error here."""
    frequency = np.geomspace(1e-3, np.pi, 300)
    L = 0.05 / (1j * frequency)
    curves = NyquistCurves(frequency, L, 0.1 * np.abs(L), limiting=frequency[[0, 200]], circle=0.5)
    assert draw(curves).startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("curves", "labels"),
    [
        (
            ResponseCurves(tuple(replace(SEEN, entry=entry) for entry in product(range(2), repeat=2))),
            [*(f"{entry}, magnitude" for entry in ("G₁₁", "G₁₂", "G₂₁", "G₂₂")), "phase (degrees)"],
        ),
        (
            FitCurves(T, (replace(FIT, label="level (m)"), replace(FIT, output=1))),
            ["y1, level (m)", "y2, output"],
        ),
    ],
)
def test_readings_of_values_name_their_panel_and_axis(curves, labels):
    found = []
    rendered(painter(curves), seen=lambda page: found.extend(readings(page)))
    assert [panel["y"] for panel in found] == labels


@pytest.mark.parametrize("most", [1.02, 1.1, 1.64, 3.0, 7.0, 30.0, 2000.0])
def test_the_axis_of_the_worst_ratio_of_a_campaign_has_at_least_three_numbers(most):
    ratios = np.array([most, np.sqrt(most), 0.99])
    curves = CampaignCurves(np.array([10.0, 20.0, 30.0]), ratios, np.array([1.0, 2.0, 3.0]), 500)

    def paint(page: Figure) -> None:
        draw_campaign(page, curves, "s")

    upper = painted(paint).axes[0]
    upper.figure.canvas.draw()
    low, high = upper.get_ylim()
    labels = [tick for tick in upper.get_yticklabels() if tick.get_text()]
    shown = [tick for tick in labels if low <= tick.get_position()[1] <= high]
    assert len(shown) >= 3
    assert len({tick.get_text() for tick in shown}) == len(shown)
    assert [float(tick.get_text()) for tick in shown] == pytest.approx([t.get_position()[1] for t in shown])


SIZES = np.array([2.0, 4.0])
NINE = BoundCurves(
    tuple(BoundPanel(W, 0.008 * G, G, 0.01 * G, entry=entry) for entry in product(range(3), repeat=2))
)


def looks(line):
    return line.get_color(), str(line.get_linestyle()), line.get_marker(), line._dash_pattern[1]


def apart(lines):
    return len({str(looks(line)) for line in lines}) == len(lines)


@pytest.mark.parametrize("families", [1, 6, 8, 20])
def test_every_family_of_structures_is_drawn_in_its_own_style(page, families):
    fits = {f"F{n}": (SIZES, np.array([90.0 - n, 80.0 - n])) for n in range(families)}
    (axes,) = (figure := page(OrderCurves(fits, (2.0, 90.0)))).axes
    named = lines_by_label(axes)
    assert set(named) == {*fits, "chosen, fit 90 %"}
    for n, family in enumerate(fits):
        np.testing.assert_array_equal(named[family].get_ydata(), [n or 0.01, 10.0 + n])
    assert apart(list(named.values()))
    assert {text.get_text() for text in figure.legends[0].get_texts()} == set(named)


def test_distances_to_the_best_fit_are_logarithmic_and_the_worst_is_shown(page):
    (axes,) = page(OrderCurves({"OE": (np.arange(4.0), np.array([95.0, 94.9, 94.0, -1e9]))}, (0, 95))).axes
    shown = axes.transAxes.inverted().transform(axes.transData.transform(axes.lines[0].get_xydata()))[:, 1]
    assert np.all(np.diff(shown) < -0.2)
    assert np.all((shown > 0.0) & (shown < 1.0))


def test_ratios_of_runs_are_drawn_as_a_cumulative_distribution(page):
    """The curve at the limit is the share of runs that meet it; an input without runs is left out."""
    ratios = {"one_shot": np.array([1.2, 0.8, 1.1, 0.9]), "none": np.zeros(0), "single": np.array([0.7])}
    (axes,) = page(RunCurves(ratios, limit=1.0)).axes
    drawn = lines_by_label(axes)
    assert list(drawn) == ["one shot: mean 1", "single: mean 0.7", "what is asked"]
    x, share = drawn["one shot: mean 1"].get_data()
    assert share[np.searchsorted(x, 1.0) - 1] == 50.0
    assert share[-1] == 100.0


@pytest.mark.parametrize("curves", [CURVES["fan"], NINE], ids=["fan", "nine entries"])
def test_every_line_has_its_own_name_and_style(page, curves):
    """A fan of plants has five lines; nine entries of a plant have one each, beside the limit."""
    drawn = lines_by_label(page(curves).axes[-1])
    assert len(drawn) == (5 if curves is CURVES["fan"] else 10)
    assert apart(list(drawn.values()))
    if curves is CURVES["fan"]:
        np.testing.assert_array_equal(drawn["largest of 2 plants"].get_ydata(), 0.5 * G)


def test_every_amplitude_of_a_trade_is_drawn():
    page = Figure()
    names = {f"amplitude {number}" for number in range(9)}
    draw_trade(Trade(SIZES, "s", {name: SIZES + n for n, name in enumerate(names)}, False), page)
    (axes,) = page.axes
    drawn = lines_by_label(axes)
    assert names <= set(drawn)
    assert apart(list(drawn.values()))


def test_a_figure_that_a_run_lacks_is_refused_with_the_names_of_the_others():
    results = Results(typed({}), "", curves={name: CURVES[name] for name in ("bound", "signal")})
    with pytest.raises(KeyError, match=r"'foo'.*bound, signal"):
        figure(results, "foo")


def test_the_phase_shows_the_sign_of_every_gain(page):
    """G and -G have the same magnitude, and their phases are half a turn apart."""
    panels = tuple(
        replace(SEEN, G=s * SEEN.G, model=s * SEEN.model, entry=(0, j)) for j, s in enumerate((1, -1))
    )
    drawn = lines_by_label(page(ResponseCurves(panels)).axes[-1])
    assert list(drawn) == ["G₁₁", "G₁₂"]
    one, other = (line.get_ydata() for line in drawn.values())
    np.testing.assert_allclose(np.abs(other - one), 180.0)
    np.testing.assert_allclose(one, np.degrees(np.angle(SEEN.model)), atol=1e-9)
