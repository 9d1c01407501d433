"""Figures of errors and r_adm, spectra, signals, fits and residuals of records, studies and the loop."""

from dataclasses import replace

import numpy as np
import pytest

from inputdesign_cli.figures.plots import draw
from inputdesign_cli.outcome.curves import BoundPanel, ErrorBandCurves, FitCurves, FitPanel, SpectrumCurves
from inputdesign_cli.questions.assessment.outcome import fit_to_log
from inputdesign_cli.records import Record
from tests.support.curves import BANDS, CURVES, DENSITY, G, W, Z, bound, lines_by_label


def legend_of(figure):
    (legend,) = [*figure.legends, *(axes.get_legend() for axes in figure.axes if axes.get_legend())]
    return [text.get_text() for text in legend.get_texts()]


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


def test_the_bound_beside_white_excitation_spans_the_errors_and_not_the_gain(page):
    above, below = page(CURVES["bound beside white"]).axes
    assert {"r_u, w", "r_u, white, 4 × the cost"} <= set(lines_by_label(above))
    np.testing.assert_allclose(lines_by_label(below)["w: up to 3"].get_ydata(), 3.0)
    low, high = above.get_ylim()
    assert low > 0.5 * (0.008 * G).min()
    assert high < 2.0 * (0.03 * G).max()


@pytest.mark.parametrize(
    ("panel", "scale", "lowest", "highest"),
    [
        # Ratios far beyond the limit do not squeeze the others.
        (BoundPanel(W, 0.008 * G, G, 0.01 * G, r_u_equal=3.0 * G), "linear", -1e-9, 10.0),
        # On a linear axis with the limit in it, ratios far below would be one flat line.
        (BoundPanel(W, 0.0002 * G * (1 + W), G, 0.01 * G), "log", 0.01, 10.0),
    ],
)
def test_ratios_keep_their_shape_far_from_the_limit(page, panel, scale, lowest, highest):
    _, below = page(bound(panel)).axes
    low, high = below.get_ylim()
    assert below.get_yscale() == scale
    assert lowest < low < 1.0 < high < highest


def test_each_entry_has_the_panel_of_its_row_and_column_and_others_stay_empty(page):
    *panels, below = page(CURVES["bounds of entries"]).axes
    titles = {axes.get_subplotspec().num1: axes.get_title(loc="left") for axes in panels}
    assert titles == {1: "G₁₂", 2: "G₂₁"}
    first, second = panels
    np.testing.assert_array_equal(lines_by_label(first)["r_adm, admitted"].get_ydata(), 0.01 * G)
    assert "r_adm, admitted" not in lines_by_label(second)
    assert list(lines_by_label(below)) == ["G12: up to 0.8", "limit"]


def test_only_the_lowest_panel_has_numbers_on_its_frequency_axis(page):
    narrow = BoundPanel(
        W[120:150], G[120:150], G[120:150], 2 * G[120:150]
    )  # within a decade, minor ticks too
    figure = page(bound(narrow))
    above, below = figure.axes
    assert not any(text.get_visible() and text.get_text() for text in above.get_xticklabels(which="both"))
    assert any(text.get_visible() and text.get_text() for text in below.get_xticklabels(which="both"))


def test_the_spectrum_is_drawn_beside_the_level_of_white_excitation(page):
    (axes,) = page(CURVES["spectrum"]).axes
    lines = lines_by_label(axes)
    np.testing.assert_array_equal(lines["Φᵤ, design"].get_ydata(), DENSITY)
    assert set(lines["Φᵤ, white"].get_ydata()) == {1.7}
    assert axes.get_yscale() == "linear"


def test_a_spectrum_over_decades_has_a_logarithmic_axis_of_limited_range(page):
    (axes,) = page(CURVES["spectrum with zeros"]).axes
    low, high = axes.get_ylim()
    assert axes.get_yscale() == "log"
    assert 1.0 < np.log10(high / low) < 7.0


def test_spectral_lines_are_drawn_as_stems_of_their_power(page):
    (axes,) = page(CURVES["lines"]).axes
    (stems,) = axes.collections
    np.testing.assert_allclose(stems.get_segments(), [[[0.1553, 0.0], [0.1553, 0.1925]]])
    assert any("0.1925" in label for label in lines_by_label(axes))


@pytest.mark.parametrize(("lines", "inputs"), [(0, 1), (0, 2), (5, 2)])
def test_a_spectrum_without_power_is_drawn_as_an_empty_page(lines, inputs):
    """A design that needs no excitation has this spectrum."""
    w, none = np.linspace(0.1, 1.0, lines), np.zeros((lines, inputs, inputs))
    nothing = SpectrumCurves(w, none, lines=not lines, band=(0.0, 1.0))
    assert draw(nothing).startswith(b"\x89PNG")


def test_coinciding_entries_have_different_dashes_and_rounding_errors_no_curve(page):
    above, _ = page(CURVES["matrix of one direction"]).axes
    drawn = lines_by_label(above)
    assert list(drawn) == ["|Φ₁₁|", "|Φ₂₂|"]
    assert len({str(line._dash_pattern) for line in drawn.values()}) == 2
    assert [axes.get_xscale() for axes in page(CURVES["matrix"]).axes] == ["log", "log"]


def test_lines_that_coincide_are_seen_through_each_other_and_an_eigenvalue_of_zero_has_no_name(page):
    """Two inputs in phase: all entries are the same, and one direction has all power."""
    lines = SpectrumCurves(np.array([0.2, 1.0]), np.ones((2, 2, 2)), lines=True)
    above, below = page(lines).axes
    sizes = [line.get_markersize() for line in lines_by_label(above).values()]
    assert len(sizes) == 3
    assert sizes == sorted(set(sizes), reverse=True)
    assert list(lines_by_label(below)) == ["λ₁"]


def test_a_long_record_shows_its_beginning_and_the_histogram_of_all(page):
    figure = page(CURVES["long signal"])
    record, histogram = figure.axes[:2]
    assert "first 1000 of 3000 samples, 4 of 6 channels" in figure.axes[6].get_xlabel()
    assert record.lines[0].get_xdata().size == 1000
    assert sum(bar.get_width() for bar in histogram.patches) == pytest.approx(100.0)


@pytest.mark.parametrize("begin", [0, 2000])
def test_a_long_fit_is_shown_whole_and_closely_where_the_output_moves(page, begin):
    y, time = np.zeros(9000), np.arange(9000.0)
    y[begin : begin + 400] = np.sin(time[:400])
    y[5000:5002] = 3.0, np.nan  # a spike, and a sample that is not known
    above, residuals, closer = page(FitCurves(time, (FitPanel(y, y, y),))).axes
    for axes in (above, residuals):
        assert axes.get_xlim() == (0.0, 8999.0)
    x, values = above.lines[0].get_data()
    assert x.size < 4000
    assert {5000.0, 5001.0} < set(x)
    assert np.nanmax(values) == 3.0
    assert f"samples {begin + 1} to {begin + 400} of 9000" in closer.get_xlabel()
    np.testing.assert_array_equal(closer.lines[0].get_ydata(), y[begin : begin + 400])


def test_gaps_of_a_record_and_samples_left_out_of_the_estimate_are_marked(page):
    time = np.r_[0:100.0, 100:200.0, 400:500.0]
    y = np.sin(time)
    panel = FitPanel(y, y + 0.1, y - 0.1, label="level (m)", left_out=np.ones(50))
    figure = page(FitCurves(time, (panel,), (100, 100, 100), np.r_[200:230.0, 600:620.0]))
    for axes in figure.axes:
        (gap,) = axes.patches
        assert (gap.get_x(), gap.get_width()) == (199.0, 201.0)
        (border,) = [line for line in axes.lines if line.get_transform() != axes.transData]
        assert border.get_xdata()[0] == 99.5
        assert axes.get_xlim() == (0.0, 619.0)
    dots = lines_by_label(figure.axes[0])["left out"]
    np.testing.assert_array_equal(dots.get_xdata(), np.r_[200:230.0, 600:620.0])
    assert "not in the estimate" in legend_of(figure)


@pytest.mark.parametrize(
    ("column", "files", "label", "left"),
    [("TIC [°C]", 1, "TIC [°C]", [4, 5, 6]), ("y", 1, "", [4, 5, 6]), ("2", 2, "", [])],
)
def test_a_fit_to_a_log_has_its_column_name_and_the_samples_left_out(column, files, label, left):
    """Several files may have the same times: samples left out of them are not drawn."""
    time = np.arange(10.0)
    log = Record(time[:, None], -time[:, None], None, time, (10,), (("a", 10),), names={"y1": column})
    used = log.at(np.r_[0:4, 7:10], (4, 3))
    log = replace(log, files=(("a", 5), ("b", 5))[:files])
    y = used.y[:, 0]
    found = fit_to_log(FitCurves(used.time, (FitPanel(y, y),), used.lengths), log, used)
    assert found.panels[0].label == label
    assert found.left_out.tolist() == left
    assert not left or (-found.panels[0].left_out).tolist() == left


@pytest.mark.parametrize(
    ("stated", "shown"), [("level (m)", "level (m)"), ("(m)", "y₁(t) (m)"), ("", "output")]
)
def test_a_fit_names_its_output_where_only_a_unit_is_known(page, stated, shown):
    y = np.sin(np.arange(50.0))
    axes = page(FitCurves(np.arange(50.0), (FitPanel(y, y, y, label=stated),))).axes
    assert axes[0].get_ylabel() == shown


def test_the_applied_signal_is_held_and_drawn_above_the_predicted_output(page):
    figure = page(CURVES["predicted signal"])
    record, _, below, _ = figure.axes
    assert record.lines[0].get_drawstyle() == "steps-post"
    assert (record.get_ylabel(), below.get_ylabel()) == ("valve (%)", "level (m)")
    band = below.collections[0].get_paths()[0].vertices
    np.testing.assert_allclose([band[:, 1].min(), band[:, 1].max()], [-1.0, 49.0 + 2.0 * 7.0], atol=1e-9)
    assert len(legend_of(figure)) == 4


def test_a_single_output_has_its_residuals_below_and_two_outputs_a_panel_each(page):
    upper, lower = page(CURVES["fit"]).axes
    # A model with white noise predicts what it simulates: the dashes show the curve below.
    assert lines_by_label(upper)["simulated from u (fit 83.2 %)"].get_linestyle() == "--"
    np.testing.assert_allclose(lower.lines[0].get_ydata(), -0.1)
    panels = page(CURVES["fit of two outputs"]).axes
    assert [axes.get_title(loc="left") for axes in panels] == ["y1, fit 83.2 %", "y2"]


@pytest.mark.first(4)
@pytest.mark.parametrize("outputs", [1, 2])
@pytest.mark.parametrize("lengths", [(), (500,), (240, 260), (100, 150, 250)])
def test_no_curve_goes_from_one_record_to_the_next(page, lengths, outputs):
    """Between two records every curve has a gap, and their border is marked there; no sample is lost."""
    y = np.arange(500.0)
    figure = page(FitCurves(y, (FitPanel(y, y + 5.0, y - 5.0, 80.0),) * outputs, lengths))
    begins = np.cumsum(lengths)[:-1]
    for axes in figure.axes:
        curves = [line for line in axes.lines if line.get_transform() == axes.transData]
        for x, values in (line.get_data() for line in curves):
            assert np.isnan(x).sum() == np.isnan(values).sum() == len(begins)
            np.testing.assert_array_equal(x[~np.isnan(values)], y)
            np.testing.assert_array_equal(x[np.flatnonzero(np.isnan(values)) + 1], begins)
        marks = [line.get_xdata()[0] for line in axes.lines if line not in curves]
        np.testing.assert_array_equal(marks, begins - 0.5)
    assert ("another record begins" in legend_of(figure)) == bool(len(begins))


def test_residuals_have_a_column_for_each_signal_they_are_correlated_with(page):
    assert [axes.get_title() for axes in page(CURVES["residuals"]).axes] == ["with residual 1", "with u1"]
    titles = [axes.get_title() for axes in page(CURVES["residuals of two outputs"]).axes]
    assert titles == ["with residual 1", "with residual 2", "with u1", "", "", ""]


def test_frequencies_at_which_simulated_runs_exceed_r_adm_are_marked(page):
    kept, missed = page(CURVES["error bands"]).axes[0], replace(BANDS, r_adm=np.where(W < 1, G, 0.3 * G))
    assert not any("leave" in label for label in lines_by_label(kept))
    (axes,) = page(ErrorBandCurves((missed,), "design", 100)).axes
    (marked,) = [part for label, part in lines_by_label(axes).items() if "leave r_adm" in label]
    assert marked.get_paths()[0].vertices[:, 0].min() >= 0.99
    assert lines_by_label(axes)["r_adm, admitted"].get_linestyle() == "--"


def test_the_nyquist_plot_has_discs_of_uncertainty_and_the_circle_to_avoid(page):
    (axes,) = page(CURVES["nyquist"]).axes
    *discs, shade, circle = axes.patches
    near = Z[150]
    centre = 0.8 * near**2 / (1 - near)
    assert min(np.hypot(*np.subtract(disc.center, (centre.real, centre.imag))) for disc in discs) < 1e-9
    assert {disc.get_radius() for disc in discs} == {0.1}
    assert (shade.get_radius(), circle.get_radius()) == (0.5, 0.5)
    unbounded = page(CURVES["nyquist without a bound"]).axes[0].patches
    assert {disc.get_radius() for disc in unbounded} == {0.1}


@pytest.mark.parametrize(("levels", "label"), [(False, "level (m)"), (True, "Δ level (m)")])
def test_levels_and_deviations_have_different_labels(page, levels, label):
    """The operating point of the input is known, and that of the output is not."""
    axes = page(replace(CURVES["predicted signal"], levels=levels)).axes
    assert [one.get_ylabel() for one in axes if one.get_ylabel()] == ["valve (%)", label]
