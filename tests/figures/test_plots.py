"""Each figure shows its curves, leaves no global state, and copes with what designs produce."""

import struct
import sys
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from inputdesign_cli.figures.plots import draw, draw_all
from inputdesign_cli.runs.curves import (
    BoundCurves,
    BoundPanel,
    DirectionCurves,
    Ellipse,
    EllipseCurves,
    ErrorBandCurves,
    ErrorBandPanel,
    ErrorCurves,
    FitCurves,
    FitPanel,
    LossCurves,
    MomentsCurves,
    NyquistCurves,
    OptimalityCurves,
    OrderCurves,
    PredictedPanel,
    ResidualCurves,
    ResponseCurves,
    ResponsePanel,
    SignalCurves,
    SpectrumCurves,
)
from inputdesign_cli.runs.results import Results

W = np.geomspace(1e-3, np.pi, 200)
Z = np.exp(-1j * W)
G = np.abs(3.6 * Z / (1 - 0.7 * Z))
DENSITY = 0.03 + 2.5 * np.exp(-((W / 0.22) ** 2))
PAIR = DENSITY[:, None, None] * np.array([[1.0, 0.9j], [-0.9j, 1.0]])


def bound(*panels):
    return BoundCurves(tuple(panels))


def one_input(values, *more, **settings):
    """Curves of the spectrum of one input from real values (n,)."""
    return SpectrumCurves(W, values[:, None, None], *more, **settings)


def lines(frequencies, powers, **settings):
    """Curves of sinusoids of one input."""
    power = np.array(powers)[:, None, None]
    return SpectrumCurves(np.array(frequencies), power, lines=True, **settings)


def correlations(p, r):
    lags = np.arange(1, 21)
    values = 0.1 * np.cos(np.arange(20 * p * (p + r)).reshape(20, p, p + r))
    return ResidualCurves(lags, values[:, :, :p], lags, values[:, :, p:], 0.1, 0.5, 0.7)


T = np.arange(500.0)
FIT = FitPanel(np.sin(T), np.sin(T) + 0.1, np.sin(T) - 0.1, 83.2)
BANDS = ErrorBandPanel(W, {0.05: 0.1 * G, 0.5: 0.2 * G, 0.95: 0.4 * G}, 0.5 * G, 0.6 * G)

SEEN = ResponsePanel(W, 1.1 / (1 + 1j * W), 0.01 * W, 1 / (1 + 1j * W))

CURVES = {
    "bound": bound(BoundPanel(W, 0.008 * G, G, 0.01 * G, 0.01 * G, np.array([0.5, np.pi]))),
    "bound beside white": bound(
        BoundPanel(
            W, 0.008 * G, G, 0.01 * G, 0.01 * G, r_u_equal=0.03 * G, white_labels=("white, 4 × the cost", "w")
        )
    ),
    "bound without a target": bound(BoundPanel(W, 0.008 * G, G)),
    "bound with a gap in r_adm": bound(BoundPanel(W, 0.008 * G, G, np.where(W < 1, 0.01 * G, -1.0))),
    "spectrum": one_input(DENSITY, 1.7),
    "spectrum with zeros": one_input(1e4 * np.maximum(np.cos(20 * W), 0.0) / W**2, 1.0),
    "spectrum with its record": one_input(
        DENSITY, 1.7, record=(DENSITY * (1 + 0.2 * np.sin(90 * W)))[:, None]
    ),
    "bound with its record": bound(BoundPanel(W, 0.008 * G, G, 0.01 * G, r_u_record=0.009 * G)),
    "limited signal": SignalCurves(np.arange(50.0), {"u1": 3 + np.sin(np.arange(50.0))}, {"u1": (1.5, 4.5)}),
    "predicted signal": SignalCurves(
        np.arange(50.0),
        {"u1": 3 + np.sin(np.arange(50.0))},
        {"u1": (1.5, 4.5)},
        {"u1": "valve (%)"},
        (PredictedPanel("y1", T[:50], np.sqrt(T[:50]), (-60.0, 60.0), "level (m)"),),
    ),
    "lines": lines([0.1553], [0.1925], white=1.7, band=(1e-3, np.pi)),
    "lines in a loop": lines([0.02, 0.1], [0.1, 0.2], symbol="r"),
    "matrix": SpectrumCurves(W, PAIR, 1.7),
    "matrix of lines": SpectrumCurves(W[::20], PAIR[::20], lines=True),
    "matrix with zeros": SpectrumCurves(W, PAIR * np.maximum(np.cos(20 * W), 0.0)[:, None, None]),
    "directions": DirectionCurves(W, np.stack([G, 0.01 * G], 1), np.stack([DENSITY, W], 1), 1.7),
    "directions of lines": DirectionCurves(W, np.stack([G, 0.01 * G], 1), np.stack([G, W], 1), lines=True),
    "loss": LossCurves({"design": W, "white": 2 * W}, {"design": 1.0}),
    "nyquist": NyquistCurves(W, 0.8 * Z**2 / (1 - Z), 0.1 + 0 * W, 0.5, W[150:151]),
    "nyquist without a bound": NyquistCurves(W, 0.8 * Z**2 / (1 - Z), 0.1 + 0 * W),
    "optimality": OptimalityCurves(W, 1 / (1 + np.log(W / 0.1553) ** 2), np.array([0.1553])),
    "matrix of one direction": SpectrumCurves(W, PAIR * np.array([[1, 1e-14], [1e-14, 1]]), symbol="r"),
    "matrix with a peak": SpectrumCurves(W, PAIR / (1e-4 + (W - 1) ** 2)[:, None, None]),
    "one line of channels": SpectrumCurves(np.array([0.3]), PAIR[:1], lines=True),
    "bounds of entries": bound(
        BoundPanel(W, 0.008 * G, G, 0.01 * G, entry=(0, 1)), BoundPanel(W, 0.008 * G, G, entry=(1, 0))
    ),
    "error bands": ErrorBandCurves((BANDS,), "design", 100),
    "error bands of entries": ErrorBandCurves((replace(BANDS, entry=(0, 0)), replace(BANDS, entry=(1, 0)))),
    "fit": FitCurves(T, (FIT,)),
    "fit of two outputs": FitCurves(T, (FIT, FitPanel(T, T + 1, output=1))),
    "residuals": correlations(1, 1),
    "residuals of two outputs": correlations(2, 1),
    "ellipses": EllipseCurves(
        tuple(
            Ellipse(("b1", f"a{i}"), np.array([1.0, i]), np.array([[2.0, 1.0], [1.0, 1.0]]), np.eye(2))
            for i in range(4)
        )
    ),
    "signal": SignalCurves(np.arange(50.0), {"u1": np.sin(np.arange(50.0))}),
    "long signal": SignalCurves(np.arange(3000.0), {f"u{i}": np.sin(np.arange(3000.0)) for i in range(1, 7)}),
    "error": ErrorCurves(W, 0.2 + 0 * W, 1 / W, 0.5 + 2 / W, (1.0, 1.2), 1.2),
    "error without a target": ErrorCurves(W, 0.2 + 0 * W, 1 / W, 0.5 + 2 / W, (1.0, 1.2)),
    "moments": MomentsCurves(np.eye(3), 1),
    "many moments": MomentsCurves(np.eye(12), 4, np.array([0.0, 2.8]), np.array([1.0, 0.3])),
    "response without a model": ResponseCurves((SEEN,)),
    "responses of entries": ResponseCurves((replace(SEEN, entry=(0, 0)), replace(SEEN, entry=(1, 0)))),
    "structures": OrderCurves({"ARX": (T[2:8], 10 * T[2:8]), "OE": (T[2:4], 11 * T[2:4])}, (3.0, 33.0), 1),
    "constant signal": SignalCurves(np.arange(5.0), {"r1": np.ones(5)}),
}


@pytest.fixture
def page(monkeypatch):
    """The figure that was drawn last, instead of its pixels."""
    kept = []
    monkeypatch.setattr(FigureCanvasAgg, "print_png", lambda canvas, file: kept.append(canvas.figure))
    return lambda curves, unit="s": (draw(curves, unit), kept[-1])[1]


def lines_by_label(axes):
    handles, labels = axes.get_legend_handles_labels()
    return dict(zip(labels, handles, strict=True))


@pytest.mark.parametrize("name", CURVES)
def test_a_png_of_the_promised_size(name):
    data = draw(CURVES[name])
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    width, height = struct.unpack(">II", data[16:24])
    assert width == 1050
    assert 675 <= height <= 1050


def test_no_global_state():
    def state():
        # Reading the backend would choose one.
        settings = {key: mpl.rcParams[key] for key in mpl.rcParams if key != "backend"}
        return settings, "matplotlib.pyplot" in sys.modules

    before = state()
    draw(CURVES["bound"])
    assert state() == before


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


def test_the_loop_has_a_disc_where_it_is_limited_and_keeps_off_a_circle(page):
    (axes,) = page(CURVES["nyquist"]).axes
    (discs,) = axes.collections
    near = Z[150]
    centre = 0.8 * near**2 / (1 - near)
    offsets = discs.get_offsets()
    assert np.hypot(offsets[:, 0] - centre.real, offsets[:, 1] - centre.imag).min() < 1e-9
    np.testing.assert_allclose(discs.get_widths(), 0.2)
    assert [circle.get_radius() for circle in axes.patches] == [0.5, 0.5]
    assert not page(CURVES["nyquist without a bound"]).axes[0].patches


def test_only_what_is_there_is_in_the_legend(page):
    (axes,) = page(CURVES["bound without a target"]).axes
    assert list(lines_by_label(axes)) == ["r_u, design", "|G|"]


def test_the_unit_of_time_is_on_the_axis(page):
    assert "rad/min" in page(CURVES["spectrum"], "min").axes[0].get_xlabel()
    assert "(min)" in page(CURVES["signal"], "min").axes[0].get_xlabel()


def test_the_spectrum_beside_the_white_level(page):
    (axes,) = page(CURVES["spectrum"]).axes
    lines = lines_by_label(axes)
    np.testing.assert_array_equal(lines["Φᵤ, design"].get_ydata(), DENSITY)
    assert set(lines["Φᵤ, white"].get_ydata()) == {1.7}
    assert axes.get_yscale() == "linear"


def test_the_entries_stand_where_the_plant_has_them_and_others_stay_empty(page):
    *panels, below = page(CURVES["bounds of entries"]).axes
    titles = {axes.get_subplotspec().num1: axes.get_title(loc="left") for axes in panels}
    assert titles == {1: "G₁₂", 2: "G₂₁"}
    first, second = panels
    np.testing.assert_array_equal(lines_by_label(first)["r_adm, admitted"].get_ydata(), 0.01 * G)
    assert "r_adm, admitted" not in lines_by_label(second)
    assert list(lines_by_label(below)) == ["G12: up to 0.8", "limit"]


def test_a_single_output_has_its_residuals_below_and_two_outputs_a_panel_each(page):
    upper, lower = page(CURVES["fit"]).axes
    assert "simulated from u (fit 83.2 %)" in lines_by_label(upper)
    np.testing.assert_allclose(lower.lines[0].get_ydata(), -0.1)
    panels = page(CURVES["fit of two outputs"]).axes
    assert [axes.get_title(loc="left") for axes in panels] == ["y1, fit 83.2 %", "y2"]


def test_residuals_have_a_column_for_everything_that_they_are_compared_with(page):
    assert [axes.get_title() for axes in page(CURVES["residuals"]).axes] == ["with residual 1", "with u1"]
    titles = [axes.get_title() for axes in page(CURVES["residuals of two outputs"]).axes]
    assert titles == ["with residual 1", "with residual 2", "with u1", "", "", ""]


def test_a_spectrum_over_decades_is_logarithmic_and_not_endless(page):
    (axes,) = page(CURVES["spectrum with zeros"]).axes
    low, high = axes.get_ylim()
    assert axes.get_yscale() == "log"
    assert 1.0 < np.log10(high / low) < 7.0


def test_lines_stand_as_stems_of_their_power(page):
    (axes,) = page(CURVES["lines"]).axes
    (stems,) = axes.collections
    np.testing.assert_allclose(stems.get_segments(), [[[0.1553, 0.0], [0.1553, 0.1925]]])
    assert "0.1925" in stems.get_label()


def test_a_long_record_shows_its_beginning_and_the_histogram_of_all(page):
    figure = page(CURVES["long signal"])
    record, histogram = figure.axes[:2]
    assert "first 1000 of 3000 samples, 4 of 6 channels" in figure.axes[6].get_xlabel()
    assert record.lines[0].get_xdata().size == 1000
    assert sum(bar.get_width() for bar in histogram.patches) == pytest.approx(100.0)


def test_what_is_applied_is_held_and_stands_over_what_it_causes(page):
    figure = page(CURVES["predicted signal"])
    record, _, below, _ = figure.axes
    assert record.lines[0].get_drawstyle() == "steps-post"
    assert (record.get_ylabel(), below.get_ylabel()) == ("valve (%)", "level (m)")
    band = below.collections[0].get_paths()[0].vertices
    np.testing.assert_allclose([band[:, 1].min(), band[:, 1].max()], [-1.0, 49.0 + 2.0 * 7.0], atol=1e-9)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == [
        "to be applied, held between samples",
        "limits",
        "± 2 standard deviations of noise since the start",
        "predicted output, from rest",
    ]


NAMES = [r"$\frac{1}{0", "$$", "$x$", r"\$", "_u", "100 %", "{}", "日本", "a_b^c", "&<b>", "{0}", "°C"]


def test_names_and_units_are_drawn_as_they_are():
    """Warnings are errors in these tests: letters that the font lacks cause none."""
    wave, long = np.sin(np.arange(50.0)), ["w" * 40, "$" * 40]
    for names in (*zip(*[iter(NAMES)] * 4, strict=True), long):
        labels = {f"u{i}": f"{name} ({name})" for i, name in enumerate(names)}
        assert draw(SignalCurves(T[:50], dict.fromkeys(labels, wave), labels=labels))
    for name in (NAMES[0], NAMES[7], *long):
        assert draw(FitCurves(T, (replace(FIT, label=name),) * 2), "s", "svg")
    assert draw(bound(BoundPanel(W, 0.008 * G, G, names=" → ".join(long))))


@pytest.mark.parametrize("name", CURVES)
def test_no_text_of_a_figure_is_a_formula(name, page):
    texts = [text for text in page(CURVES[name]).findobj(Text) if text.get_text()]
    assert not [text.get_text() for text in texts if text.get_parse_math() or "$" in text.get_text()]


@pytest.mark.parametrize("name", CURVES)
def test_no_curve_lies_under_a_legend(name, page):
    figure = page(CURVES[name])
    figure.canvas.draw()
    for axes in figure.axes:
        legend = axes.get_legend()
        if legend:
            assert legend.get_window_extent().y0 >= axes.get_window_extent().y1
            assert legend.get_window_extent().x1 <= figure.bbox.x1


def test_a_spectrum_of_no_lines_is_an_empty_page():
    """What a design is that needs no excitation."""
    nothing = SpectrumCurves(np.zeros(0), np.zeros((0, 1, 1)), lines=True, band=(0.0, 1.0))
    assert draw(nothing).startswith(b"\x89PNG")


def test_entries_that_coincide_share_a_curve_and_rounding_has_none(page):
    above, _ = page(CURVES["matrix of one direction"]).axes
    assert list(lines_by_label(above)) == ["|Φ₁₁| = |Φ₂₂|"]
    assert [axes.get_xscale() for axes in page(CURVES["matrix"]).axes] == ["log", "log"]


def test_the_certificate_says_what_it_means(page):
    figure = page(CURVES["optimality"])
    assert "no other spectrum can do better" in figure.get_suptitle()


def test_where_runs_leave_what_is_admitted_is_marked(page):
    kept, missed = page(CURVES["error bands"]).axes[0], replace(BANDS, r_adm=np.where(W < 1, G, 0.3 * G))
    assert not any("leave" in label for label in lines_by_label(kept))
    (axes,) = page(ErrorBandCurves((missed,), "design", 100)).axes
    (marked,) = [part for label, part in lines_by_label(axes).items() if "leave r_adm" in label]
    assert marked.get_paths()[0].vertices[:, 0].min() >= 0.99
    assert lines_by_label(axes)["r_adm, admitted"].get_linestyle() == "--"


@pytest.mark.parametrize(("kind", "begins"), [("svg", b"<?xml"), ("pdf", b"%PDF"), ("png", b"\x89PNG")])
def test_figures_come_in_the_format_that_is_asked_for_and_the_same_each_time(kind, begins):
    results = Results({}, "", curves={"bound": CURVES["bound"]})
    drawn = draw_all(results, kind)
    assert list(drawn) == [f"bound.{kind}"]
    assert drawn[f"bound.{kind}"].startswith(begins)
    assert draw_all(results, kind) == drawn


def test_numbers_stand_under_the_lowest_panel_only(page):
    narrow = BoundPanel(
        W[120:150], G[120:150], G[120:150], 2 * G[120:150]
    )  # within a decade, minor ticks too
    figure = page(bound(narrow))
    figure.canvas.draw()
    above, below = figure.axes
    assert not any(text.get_visible() and text.get_text() for text in above.get_xticklabels(which="both"))
    assert any(text.get_visible() and text.get_text() for text in below.get_xticklabels(which="both"))
