"""The spectrum that solve wrote, given back as a table, meets what it was designed for."""

from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli import analyse, load_spec, parse_spec, solve
from inputdesign_cli.outcome.text_formats import csv_text
from inputdesign_cli.specification.yaml.plain import to_yaml
from inputdesign_cli.specification.yaml.reader import read
from inputdesign_cli.spectrum import TabulatedSpectrum

SPECS = Path(__file__).parents[2] / "specs"
# Those whose design is a density that just meets what is asked.
DENSITIES = (
    *("application", "first_order", "weighted_variance"),
    *(pytest.param(name, marks=pytest.mark.slow) for name in ("flexible_transmission", "motor_loop")),
    *(pytest.param(name, marks=pytest.mark.slow) for name in ("two_by_two_arx", "two_by_two_loop")),
)
_OF_THE_DESIGN = ("limits", "simulation", "objective", "solver", "uncertainty", "campaign")


def given_back(spec, table):
    """What analyse says of a table in place of the design of a shipped spec."""
    stated = {
        key: value for key, value in read(spec.read_text(), "spec").data.items() if key not in _OF_THE_DESIGN
    }
    stated["spectrum"] = {"given": {"type": "table", "file": str(table)}}
    return analyse(parse_spec(to_yaml(stated), str(spec), folder=spec.parent)).result


@pytest.mark.first(1)
@pytest.mark.parametrize("name", DENSITIES)
def test_what_solve_wrote_is_met_and_a_thousandth_less_is_missed(name, tmp_path):
    spec, path = SPECS / f"{name}.yaml", tmp_path / "spectrum.csv"
    table = solve(load_spec(spec)).tables["spectrum"]
    path.write_text(csv_text(table))
    found = given_back(spec, path)
    assert found["status"] == "met"
    ratio = found.get("model_error", {}).get("worst_ratio", 1.0)
    if ratio > 1.0 + 1e-9:
        assert found["findings"][0]["code"] == "met-within-table"
    head, *rows = path.read_text().splitlines()
    scaled = [0.999 if column.startswith("phi") else 1.0 for column in head.split(",")]
    cells = [[float(cell) * s for cell, s in zip(row.split(","), scaled, strict=True)] for row in rows]
    path.write_text("\n".join([head, *(",".join(map(repr, row)) for row in cells)]) + "\n")
    assert given_back(spec, path)["status"] == "missed"


@pytest.mark.parametrize("rows", [40, 41])
def test_what_a_table_misses_is_of_the_size_of_the_errors_between_its_rows(rows):
    """Of exp(w) the interpolation misses h^2/8 exp(w) in the middle, every second row four times that."""
    w = np.linspace(0.0, 3.0, rows)
    spectrum = TabulatedSpectrum(w, np.exp(w)[:, None, None].astype(complex))
    added = (spectrum.raised(0.25).phi - spectrum.phi)[1:-1, 0, 0].real
    expected = (w[1] ** 2 / 8.0 * np.exp(w))[1:-1]
    inner = slice(1, -2)
    assert np.all(added[inner] >= 0.8 * expected[inner])
    assert np.all(added[inner] <= 2.4 * expected[inner])


def test_a_flat_spectrum_misses_nothing():
    flat = TabulatedSpectrum.white(np.array([1.0]), (0.0, 3.0))
    assert np.array_equal(flat.raised(0.5).phi, flat.phi)
