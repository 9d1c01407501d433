"""The figures of a sweep, and their content."""

from itertools import pairwise

import numpy as np
import pytest

from inputdesign_cli.figures.style import painted, rendered
from inputdesign_cli.figures.sweep import draw_sweep, sweep_figures
from inputdesign_cli.figures.sweep_table import SweepAxis, SweepContent, SweepTable


def table(axes, values, *, zipped=False, floor=None, kind="least_cost"):
    keys = list(axes)
    columns = {key: list(texts) for key, texts in axes.items()}
    columns |= {"status": ["x"] * len(values), "objective.value": [str(v) for v in values]}
    columns["objective.kind"] = [kind] * len(values)
    if floor is not None:
        columns["objective.any_spectrum_bound"] = [str(f) for f in floor]
    listed = tuple(SweepAxis(key, tuple(axes[key])) for key in keys)
    return SweepTable(SweepContent(verb="solve", axes=listed, zip=zipped), columns)


N = "experiment.samples"
M = "spectrum.order"


@pytest.mark.parametrize(
    ("given", "names"),
    [
        (table({N: "123"}, [3, 2, 1]), ["curves"]),
        (table({N: "1122", M: "1212"}, [4, 3, 2, 1]), ["curves", "map"]),
        (table({"spectrum": "aabb", M: "1212"}, [4, 3, 2, 1]), ["curves"]),
        (table({"spectrum": "ab"}, [4, 3]), []),
        (table({N: "12", M: "12"}, [4, 3], zipped=True), ["curves"]),
        (table({N: "1122", M: "1212", "x": "1122"}, [4, 3, 2, 1]), ["curves"]),
        (table({N: "12", M: "12", "x": "12", "z": "12"}, [4, 3]), []),
        (table({N: "12"}, ["", ""]), []),
        (table({N: "12"}, [4, ""]), []),
        (table({N: "11", M: "12"}, [4, 3]), ["curves"]),
    ],
)
def test_a_sweep_has_the_figures_that_suit_it(given, names, tmp_path):
    assert [path.stem for path in draw_sweep(given, tmp_path)] == names
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in tmp_path.iterdir())


def pages(given):
    return [painted(make) for _, make in sweep_figures(given)]


def test_cost_against_samples_is_sorted_logarithmic_and_has_its_floor():
    """Every point has a tick, unless points are too close, and a point without a result has a cross."""
    given = table({N: ["1000", "250", "500", "800"]}, [1.0, 40.0, 2.0, ""], floor=[0.5, 20.0, 1.0, 0.7])
    (page,) = pages(given)
    axes = page.axes[0]
    curve, floor = (line for line in axes.lines if len(line.get_xdata()) == 4)
    assert list(curve.get_xdata()) == list(axes.get_xticks()) == [250.0, 500.0, 800.0, 1000.0]
    assert [list(line.get_xdata()) for line in axes.lines if line.get_marker() == "x"] == [[800.0]]
    assert page.get_suptitle() == f"best: {N} = 1000"
    np.testing.assert_array_equal(curve.get_ydata(), [40.0, 2.0, np.nan, 1.0])
    assert list(floor.get_ydata()) == [20.0, 1.0, 0.7, 0.5]
    assert (axes.get_xscale(), axes.get_yscale()) == ("log", "log")


def test_the_name_of_the_floor_has_the_colour_of_no_curve():
    """The floors of all orders coincide: the last one would be seen, and the first one named."""
    given = table({M: "112233", N: "121212"}, [4, 3, 2, 1, 4, 2], floor=[0.5] * 6)
    axes = pages(given)[0].axes[0]
    floor, *designs = axes.get_legend().legend_handles
    assert "floor" in axes.get_legend().texts[0].get_text()
    assert floor.get_color() not in {design.get_color() for design in designs}


def test_the_map_has_a_cell_for_each_point():
    given = table({N: ["10", "10", "9", "9"], M: ["1", "2", "1", "2"]}, [1.0, 2.0, 3.0, ""])
    page = pages(given)[-1]
    texts = {(t.get_position(), t.get_text()) for t in page.axes[0].texts}
    assert texts == {((0.5, 0.5), "3"), ((1.5, 0.5), "none"), ((0.5, 1.5), "1"), ((1.5, 1.5), "2")}


@pytest.mark.parametrize("width", ["page", "column", "phone"])
def test_numbers_of_a_map_do_not_lie_on_each_other(width):
    keys = [f"{1000.25 + n}" for n in range(18)]
    given = table({N: keys * 2, M: ["1"] * 18 + ["2"] * 18}, [*map(float, range(1, 37))])
    seen = []
    rendered(dict(sweep_figures(given))["map"], width=width, seen=seen.append)
    for axis in (seen[0].axes[0].xaxis, seen[0].axes[0].yaxis):
        boxes = [tick.get_window_extent() for tick in axis.get_ticklabels() if tick.get_text()]
        assert len(boxes) > 1
        assert all(not one.overlaps(other) for one, other in pairwise(boxes))


def test_a_criterion_has_a_ceiling_and_its_own_white_value():
    given = table({M: ["0", "4", "8"]}, [3.0, 4.0, 4.5], floor=[4.7] * 3, kind="D")
    assert given.best == ("objective.value", f"{M} = 8")
    given.columns["objective.upper_bound"] = ["3.0", "4.0", "4.5"]
    given.columns["baseline.white.cost"] = ["1.0"] * 3
    given.columns["baseline.white.value"] = ["3.0"] * 3
    (page,) = pages(given)
    axes = page.axes[0]
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["design", "ceiling: any spectrum", "white excitation"]
    drawn = [list(line.get_ydata()) for line in axes.lines]
    assert [3.0] * 3 in drawn
    assert [1.0] * 3 not in drawn
    assert axes.get_yscale() == "linear"
    assert 2.5 < axes.get_ylim()[0] < 3.0


def test_shortest_experiments_are_compared_with_the_samples_that_white_needs():
    given = table({M: ["0", "5"]}, [852.7, 194.8], floor=[96.3] * 2, kind="shortest_experiment")
    given.columns["baseline.white.cost"] = ["1.0"] * 2
    given.columns["baseline.white.samples"] = ["853"] * 2
    (page,) = pages(given)
    assert [853.0, 853.0] in [list(line.get_ydata()) for line in page.axes[0].lines]


THREE = [("R_1_1", [1.0, 5.0, ""]), ("R_1_2", [1.0, 5.0, ""]), ("R_2_2", [1.0, 5.5, ""])]
VANISHING = [("R_1_1", [1.0, 9.0]), ("R_1_2", [0.0, -2.0]), ("R_2_2", [1.0, 9.0])]
TEN = [(f"R_{i}_{j}", [1.0, 2.0]) for i in range(1, 5) for j in range(i, 5)]


@pytest.mark.parametrize(
    ("alphas", "entries", "trace", "labels", "scale", "marked"),
    [
        (["0", "0.9", "1"], THREE, [2.0, 21.0, ""], ["R₁₁", "R₁₂", "R₂₂"], "log", [[1.0]]),
        (["0", "1"], VANISHING, [2.0, 40.0], ["R₁₁", "R₁₂", "R₂₂"], "linear", []),
        (["0", "1"], TEN, [4.0, 8.0], ["R₁₁", "R₂₂", "R₃₃", "R₄₄"], None, []),
    ],
)
def test_moments_are_drawn_over_the_parameter(alphas, entries, trace, labels, scale, marked):
    """Infeasible points are marked; only the diagonal of a large matrix of moments is drawn."""
    given = table({"accuracy.mean_squared_error.neglected_norm": alphas}, trace)
    given.columns.update({f"moments.entries.{name}": [str(v) for v in column] for name, column in entries})
    given.columns["moments.trace"] = [str(v) for v in trace]
    assert [name for name, _ in sweep_figures(given)] == ["curves", "moments"]
    axes = pages(given)[-1].axes[0]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [*labels, "trace R"]
    assert scale in (None, axes.get_yscale())
    assert [list(line.get_xdata()) for line in axes.lines if line.get_marker() == "x"] == marked


def test_three_keys_have_a_panel_for_each_value_of_the_third_and_name_the_best_point():
    points = [(n, m, x) for n in ("10", "20", "40") for m in ("1", "2") for x in ("a", "b")]
    values = [float(len(points) - i) for i in range(len(points))]
    given = table(dict(zip((N, M, "x"), map(list, zip(*points, strict=True)), strict=True)), values)
    (page,) = pages(given)
    titles = [axes.get_title(loc="left") for axes in page.axes]
    assert titles == ["x = a", "x = b"]
    drawn = [line for line in page.axes[0].lines if len(line.get_xdata()) == 3]
    assert [list(line.get_ydata()) for line in drawn] == [[12.0, 8.0, 4.0], [10.0, 6.0, 2.0]]
    legend = page.legends[0]
    assert legend.get_title().get_text() == f"best: {N} = 40, {M} = 2, x = b"


def test_points_that_are_too_close_do_not_all_have_a_tick():
    (close,) = pages(table({M: ["1", "1.01", "40"]}, [3.0, 2.0, 1.0]))
    assert 1.01 not in list(close.axes[0].get_xticks())


def test_a_long_title_has_several_lines_within_the_page():
    """The title of three keys with long names once exceeded the edge of a narrow page."""
    keys = ("spectrum.order", "experiment.samples", "noise.variance")
    points = [(n, m, x) for n in ("10", "20", "40") for m in ("1", "2") for x in ("1", "3")]
    given = table(
        dict(zip(keys, map(list, zip(*points, strict=True)), strict=True)), [*map(float, range(12, 0, -1))]
    )
    seen = []
    for _, make in sweep_figures(given):
        rendered(make, "svg", width="phone", seen=seen.append)
    (page,) = seen
    title = page.legends[0].get_title()
    assert "\n" in title.get_text()
    assert title.get_window_extent().x1 <= page.bbox.x1
