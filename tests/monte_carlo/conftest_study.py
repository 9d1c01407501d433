"""A spec that is solved in milliseconds, and a stand-in for the solver that needs none."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import inputdesign_cli
from inputdesign_cli.errors import Diagnostic, InaccurateError, InfeasibleError
from inputdesign_cli.runs.results import Results, Table

SPEC = """\
title: A small design
plant: {B: [0, 1], F: [1, -0.5]}
noise: {variance: 1}
experiment: {samples: 100}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 2}
signal: {type: multisine, candidates: 1, seed: 1}
"""


@pytest.fixture
def spec(tmp_path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(SPEC)
    return path


@pytest.fixture
def stub(monkeypatch):
    """`solve` answers at once: infeasible for 7 samples, inaccurate for 8, broken for 9."""
    calls = []

    def solve(spec):
        samples = spec.experiment.samples
        calls.append(samples)
        if samples == 7:
            raise InfeasibleError(Diagnostic("not-supported", "seven is too few"))
        if samples == 8:
            raise InaccurateError(Diagnostic("gap-not-closed", "eight is odd"))
        if samples == 9:
            raise ZeroDivisionError("nine")
        order = spec.spectrum.order if hasattr(spec.spectrum, "order") else 0
        value = 100.0 / samples + 1.0 / (1 + order)
        result = {
            "format": 1,
            "status": "optimal",
            "objective": {"kind": "least_cost", "value": value, "any_spectrum_bound": 50.0 / samples},
            "power": {"input": [value]},
            "baseline": {"white": {"cost": 3 * value}},
        }
        return Results(result, spec.to_yaml(), tables={"signal": Table({"u1": np.arange(3.0)})})

    monkeypatch.setitem(vars(inputdesign_cli), "solve", solve)
    return calls


def rows(directory: Path) -> list[dict[str, str]]:
    """The table of a sweep."""
    with (directory / "sweep.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def timeless_rows(directory: Path) -> list[dict[str, str]]:
    return [{name: cell for name, cell in row.items() if name != "time_s"} for row in rows(directory)]


def timeless_files(directory: Path) -> dict[str, object]:
    """Every file of every point, without the times that computing took."""
    found: dict[str, object] = {}
    for path in sorted(directory.glob("points/*/*")) + sorted(directory.glob("failures/*")):
        if path.suffix == ".json":
            content = json.loads(path.read_text())
            del content["timing_s"]
            found[str(path.relative_to(directory))] = content
        else:
            found[str(path.relative_to(directory))] = path.read_bytes()
    return found
