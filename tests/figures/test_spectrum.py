"""Spectra of one input and of several, and the certificate of a design."""

import numpy as np

from inputdesign_cli.figures.plots import draw
from inputdesign_cli.outcome.curves import SpectrumCurves
from tests.support.curves import CURVES, DENSITY, lines_by_label


def test_the_spectrum_beside_the_white_level(page):
    (axes,) = page(CURVES["spectrum"]).axes
    lines = lines_by_label(axes)
    np.testing.assert_array_equal(lines["Φᵤ, design"].get_ydata(), DENSITY)
    assert set(lines["Φᵤ, white"].get_ydata()) == {1.7}
    assert axes.get_yscale() == "linear"


def test_a_spectrum_over_decades_is_logarithmic_and_not_endless(page):
    (axes,) = page(CURVES["spectrum with zeros"]).axes
    low, high = axes.get_ylim()
    assert axes.get_yscale() == "log"
    assert 1.0 < np.log10(high / low) < 7.0


def test_lines_stand_as_stems_of_their_power(page):
    (axes,) = page(CURVES["lines"]).axes
    (stems,) = axes.collections
    np.testing.assert_allclose(stems.get_segments(), [[[0.1553, 0.0], [0.1553, 0.1925]]])
    assert any("0.1925" in label for label in lines_by_label(axes))


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
