"""A sweep of small designs, and a stand-in for the solver."""

import importlib
from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli.errors import Diagnostic, InaccurateError, InfeasibleError
from inputdesign_cli.outcome.results import Results, Table
from tests.support.outcomes import typed
from tests.support.sweep_files import SPEC

DRAW = "inputdesign_cli.figures.sweep.draw_sweep"


@pytest.fixture(autouse=True)
def undrawn(monkeypatch):
    """Leave the figures of sweeps out."""
    real = importlib.import_module("inputdesign_cli.figures.sweep").draw_sweep
    monkeypatch.setattr(DRAW, lambda *_: [])
    return real


@pytest.fixture
def drawn(undrawn, monkeypatch):
    """Draw the figures after all."""
    monkeypatch.setattr(DRAW, undrawn)


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
        return Results(typed(result), spec.to_yaml(), tables={"signal": Table({"u1": np.arange(3.0)})})

    monkeypatch.setattr("inputdesign_cli.questions.solve", solve)
    return calls
