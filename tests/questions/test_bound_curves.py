"""What bound.csv and its figure show of a design: where each entry binds, at frequencies that lie apart."""

from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import load_spec, parse_spec, solve
from inputdesign_cli.questions.common.spectrum import axis, distinct

SPECS = Path(__file__).parents[2] / "specs"


@pytest.fixture(
    scope="module", params=["first_order", pytest.param("two_by_two_loop", marks=pytest.mark.slow)]
)
def design(request):
    return solve(load_spec(SPECS / f"{request.param}.yaml"))


def test_an_entry_is_active_where_its_own_bound_touches(design):
    marked = 0
    for panel in design.curves["bound"].panels:
        ratio = panel.r_u / panel.r_adm
        assert np.all(np.interp(panel.active, panel.frequency, ratio) > 0.999)
        marked += panel.active.size
        assert (panel.active.size > 0) == (ratio.max() > 0.9999)
    assert marked >= 1


def test_frequencies_are_told_once(design):
    table = design.tables["bound"].columns
    w = next(iter(table.values()))
    assert np.all(np.diff(w) > 1e-10 * w[1:])
    active = np.array(design.result["model_error"]["active_frequencies"])
    assert np.all(np.diff(active) > 1e-4 * np.pi)


def test_an_axis_ends_where_the_band_does():
    near = np.pi * (1.0 + np.array([-1e-15, -1e-12]))
    w = axis(0.0, np.pi, np.concatenate([near, [0.5, 0.5 * (1 + 1e-14)]]))
    assert w[-1] == np.pi
    assert np.all(np.diff(w) > 1e-10 * w[1:])
    assert np.sum(np.abs(w - 0.5) < 1e-10) == 1


@pytest.mark.parametrize("unit", [1.0, 1e-6, 1e6])
def test_a_cluster_is_one_frequency_in_any_unit(unit):
    w = unit * np.array([0.0, 1e-9, 0.2, 0.20001, 3.0])
    assert distinct(w, 3.0 * unit) == pytest.approx(unit * np.array([0.0, 0.2, 3.0]))


def test_a_record_stands_beside_a_design_per_sample():
    """What is known per sample does not shrink with the length of the record that shows it."""
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
