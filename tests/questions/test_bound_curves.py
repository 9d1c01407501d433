"""Curves of a design: bound.csv, the loop with its discs, ellipses, white noise of equal cost, the output."""

from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import analyse, load_spec, parse_spec, solve
from inputdesign_cli.figures.estimates import boundary
from inputdesign_cli.outcome.text_formats import csv_text
from inputdesign_cli.questions.common.bound_curves import axis, distinct
from tests.support.pages import LOOP, SPEC

SPECS = Path(__file__).parents[2] / "specs"


@pytest.fixture(
    scope="module", params=["first_order", pytest.param("two_by_two_loop", marks=pytest.mark.slow)]
)
def design(request):
    return solve(load_spec(SPECS / f"{request.param}.yaml"))


def test_frequencies_are_marked_active_where_r_u_touches_r_adm(design):
    marked = 0
    for panel in design.curves["bound"].panels:
        ratio = panel.r_u / panel.r_adm
        assert np.all(np.interp(panel.active, panel.frequency, ratio) > 0.999)
        marked += panel.active.size
        assert (panel.active.size > 0) == (ratio.max() > 0.9999)
    assert marked >= 1


def test_a_frequency_axis_ends_with_the_band_and_has_no_near_duplicates():
    near = np.pi * (1.0 + np.array([-1e-15, -1e-12]))
    w = axis(0.0, np.pi, np.concatenate([near, [0.5, 0.5 * (1 + 1e-14)]]))
    assert w[-1] == np.pi
    assert np.all(np.diff(w) > 1e-10 * w[1:])
    assert np.sum(np.abs(w - 0.5) < 1e-10) == 1


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e6])
def test_clustered_frequencies_become_one_in_any_unit(unit):
    w = unit * np.array([0.0, 1e-9, 0.2, 0.20001, 3.0])
    assert distinct(w, 3.0 * unit) == pytest.approx(unit * np.array([0.0, 0.2, 3.0]))


def test_the_error_of_a_record_is_scaled_to_a_design_per_sample():
    """The error for one sample does not shrink with the length of the record."""
    text = """
plant: {B: [0, 1], F: [1, -0.5]}
noise: {variance: 1}
limits: {input_power: 1}
accuracy: {criterion: D}
spectrum: {type: white}
signal: {samples: 4000, candidates: 1, seed: 1}
"""
    (panel,) = solve(parse_spec(text)).curves["bound"].panels
    assert panel.r_u_record / panel.r_u == pytest.approx(np.ones(panel.r_u.size), abs=0.1)


MARGIN = [
    "accuracy.model_error={sensitivity: {controller: {numerator: [0.2], denominator: [1, -1]}, max_db: 6}, "
    "confidence: 0.9, band: [0.01, 3.14]}"
]


def test_the_uncertainty_discs_touch_the_circle_of_the_required_sensitivity():
    table = solve(parse_spec(SPEC % "", overrides=MARGIN)).tables["nyquist"].columns
    z = np.exp(-1j * table["frequency_rad_per_s"])
    loop = 0.2 / (1 - z) * z / (1 - 0.5 * z)
    np.testing.assert_allclose(table["CG_re"] + 1j * table["CG_im"], loop, rtol=1e-9, atol=1e-12)
    left = np.abs(1.0 + loop) - table["radius"]
    np.testing.assert_allclose(table["distance_kept"], 10 ** (-6 / 20))
    assert left.min() == pytest.approx(10 ** (-6 / 20), rel=1e-6)


def shown(outcome):
    return [pair.names for pair in outcome.curves["ellipses"].pairs]


def test_ellipses_of_chosen_pairs_have_the_blocks_of_the_covariance():
    pairs = 'report={ellipses: [["b2[2,1]", "a1[2]"], ["b1[1,1]", "b1[2,2]"]]}'
    outcome = analyse(load_spec(SPECS / "two_by_two_given.yaml", [pairs]))
    assert shown(outcome) == [("b2[2,1]", "a1[2]"), ("b1[1,1]", "b1[2,2]")]
    P = np.asarray(outcome.result["information"]["covariance"])
    names = outcome.result["information"]["parameters"]
    at = [names.index("b2[2,1]"), names.index("a1[2]")]
    ellipse = outcome.curves["ellipses"].pairs[0]
    np.testing.assert_allclose(ellipse.covariance, P[np.ix_(at, at)], rtol=1e-12)
    np.testing.assert_allclose(ellipse.center, [0.2, 0.4])
    one = solve(load_spec(SPECS / "first_order.yaml", ["report.ellipses=[[b1, f1]]"]))
    assert shown(one) == [("b1", "f1")]


@pytest.mark.parametrize("apart", [1.0, 1e-9, 0.0, -1e-17])
@pytest.mark.parametrize("scale", [1.0, 1e-12, 1e9])
def test_an_ellipse_has_the_chi_squared_radius_even_for_a_singular_covariance(apart, scale):
    """Its points x have x^T C^-1 x = the 95 % quantile of chi-squared; a singular C gives a line."""
    C = np.array([[1.0, scale], [scale, scale**2 * (1.0 + apart)]])
    points = boundary(np.zeros(2), C, 0.95)
    assert np.all(np.isfinite(points))
    radius = np.sqrt(-2.0 * np.log(0.05))
    # Farthest along each axis: radius times its standard deviation.
    reach = np.abs(points).max(axis=1)
    np.testing.assert_allclose(reach, radius * np.sqrt(np.diag(C)), rtol=1e-2)
    if apart == 1.0:
        sizes = np.sqrt(np.diag(C))[:, None]
        inverse = np.linalg.inv(C / (sizes * sizes.T))
        lengths = np.einsum("in,ij,jn->n", points / sizes, inverse, points / sizes)
        np.testing.assert_allclose(lengths, radius**2, rtol=1e-9)


PRIOR = ", prior: {information: [[30.0, 2.0], [2.0, 20.0]]}"
SHORTEST = ["objective=shortest_experiment", "limits={input_power: 0.7}"]


@pytest.mark.parametrize(("more", "asked"), [("", []), (LOOP, []), (PRIOR, []), ("", SHORTEST)])
def test_the_curve_of_white_noise_has_the_cost_or_the_length_of_the_design(more, asked):
    found = solve(parse_spec(SPEC % more, overrides=asked))
    white, samples = found.result["baseline"]["white"], found.result["samples"]
    power = white["power"]["excitation"][0] / (1.0 if asked else white["ratio"])
    given = f"spectrum={{given: {{type: white, power: {power!r}}}}}"
    plain = ["limits=null", "objective=null", f"experiment.samples={samples}", given]
    expected = np.array(analyse(parse_spec(SPEC % more, overrides=plain)).bound["r_u"])
    np.testing.assert_allclose(found.bound["r_u_equal"][[0, -1]], expected[[0, -1]], rtol=1e-6)
    if not asked:
        assert (found.bound["r_u_equal"] / found.bound["r_adm"]).max() > 1.0


NOISE = "noise={C: [1, -0.4], D: [1, -0.9], variance: 0.25}"
# y = S H e with S = (1 - 0.5 q^-1) / (1 - 0.4 q^-1).
DRAWS = np.random.default_rng(3).standard_normal((4000, 300)) * 0.5
LEFT = scipy.signal.lfilter(np.convolve([1, -0.5], [1, -0.4]), np.convolve([1, -0.4], [1, -0.9]), DRAWS)


@pytest.mark.parametrize(
    ("more", "noise", "pole", "expected", "rtol"),
    [
        # An ARMA(1, 1): variance (1 + c^2 + 2 a c) / (1 - a^2), here with pole 0.9 and zero 0.4.
        ("", NOISE, 0.5, np.sqrt(0.25 * (1 + 0.4**2 - 2 * 0.9 * 0.4) / (1 - 0.9**2)), 1e-6),
        (LOOP, NOISE, 0.4, np.std(LEFT[:, -1]), 0.05),
        ("", "noise={drift: true, variance: 0.04}", 0.5, 0.2 * np.sqrt(np.arange(1.0, 101.0)), 1e-9),
    ],
    ids=["settled", "in a loop", "drifting"],
)
def test_the_predicted_output_is_the_response_from_rest_with_its_deviation(more, noise, pole, expected, rtol):
    """In a loop y is the response to r, and the noise is S H e."""
    found = solve(parse_spec(SPEC % more, overrides=[noise]))
    table, u = found.tables["predicted_output"], found.signal[:, 0]
    assert csv_text(table).startswith("time_s,y1,y1_noise_deviation")
    np.testing.assert_allclose(table.columns["y1"], scipy.signal.lfilter([0, 1], [1, -pole], u), atol=1e-12)
    deviation = table.columns["y1_noise_deviation"]
    if more:  # u = r - C y holds for the noise as well
        np.testing.assert_allclose(table.columns["u1"], u - 0.1 * table.columns["y1"], atol=1e-12)
        np.testing.assert_allclose(table.columns["u1_noise_deviation"], 0.1 * deviation, rtol=1e-12)
    last = deviation[-1:] if rtol > 0.01 else deviation
    np.testing.assert_allclose(last, np.broadcast_to(expected, last.shape), rtol=rtol)


@pytest.mark.parametrize(("offset", "levels"), [("40", True), ("0", False), (None, False)])
def test_the_input_is_drawn_at_levels_only_about_an_operating_point(offset, levels):
    """Without a loop there is no Nyquist curve, and within limits no white noise of equal cost."""
    limited = ["objective=best_accuracy", "limits={input_power: 0.7}"]
    found = solve(
        parse_spec(SPEC % "", overrides=[*limited, *([f"signal.offset={offset}"] if offset else [])])
    )
    assert found.curves["signal"].levels == levels
    assert not {"nyquist", "ellipses"} & found.curves.keys()
    assert "r_u_equal" not in found.bound
