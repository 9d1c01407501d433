"""The pairs of parameters whose confidence ellipses are drawn."""

from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import analyse, load_spec, solve
from inputdesign_cli.figures.estimates import boundary

SPECS = Path(__file__).parents[2] / "specs"


def shown(outcome):
    return [pair.names for pair in outcome.curves["ellipses"].pairs]


def test_chosen_pairs_have_the_blocks_of_the_covariance():
    pairs = 'report={ellipses: [["b2[2,1]", "a1[2]"], ["b1[1,1]", "b1[2,2]"]]}'
    outcome = analyse(load_spec(SPECS / "two_by_two_given.yaml", [pairs]))
    assert shown(outcome) == [("b2[2,1]", "a1[2]"), ("b1[1,1]", "b1[2,2]")]
    P = np.asarray(outcome.result["information"]["covariance"])
    names = outcome.result["information"]["parameters"]
    at = [names.index("b2[2,1]"), names.index("a1[2]")]
    ellipse = outcome.curves["ellipses"].pairs[0]
    np.testing.assert_allclose(ellipse.covariance, P[np.ix_(at, at)], rtol=1e-12)
    np.testing.assert_allclose(ellipse.center, [0.2, 0.4])


def test_one_channel_shows_ellipses_when_they_are_asked_for():
    plain = solve(load_spec(SPECS / "first_order.yaml"))
    assert "ellipses" not in plain.curves
    asked = ["report.ellipses=[[b1, f1]]"]
    assert shown(solve(load_spec(SPECS / "first_order.yaml", asked))) == [("b1", "f1")]
    assert shown(analyse(load_spec(SPECS / "first_order_given.yaml", asked))) == [("b1", "f1")]


@pytest.mark.parametrize("apart", [1.0, 1e-9, 0.0, -1e-17])
@pytest.mark.parametrize("scale", [1.0, 1e-12, 1e9])
def test_the_boundary_is_that_of_the_region_though_parameters_are_told_together(apart, scale):
    """Points on it have the chi-squared quantile in the covariance; a singular one leaves a line."""
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
