"""Commands in an empty folder, with stand-ins for their computations."""

from importlib import import_module
from unittest.mock import Mock

import numpy as np
import pytest

from inputdesign_cli import questions, specification
from inputdesign_cli.outcome.results import Results, Table
from tests.support.command_line import RESULT
from tests.support.commands import caller
from tests.support.outcomes import typed


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run `idesign` in an empty folder: its exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    return caller(monkeypatch, capsys)


@pytest.fixture
def verbs(monkeypatch):
    """Stand-ins for the verbs of the package; `calls` keeps their arguments."""
    calls = []

    class Stated:
        asks_for_design, figures = True, None

        def __init__(self, path):
            self.stem = path.stem

        def to_yaml(self):
            return "title: x\n"

    def load_spec(path, overrides, **_):
        calls.append((path, list(overrides)))
        return Stated(path)

    def results(spec):
        return Results(typed(RESULT), "title: x\n", tables={"signal": Table({"u1": np.zeros(3)})})

    monkeypatch.setattr(specification, "load_spec", load_spec)
    monkeypatch.setattr(import_module("inputdesign_cli.questions"), "load_spec", load_spec)
    for verb in ("solve", "analyse"):
        monkeypatch.setattr(questions, verb, results)
    monkeypatch.setattr(questions, "validate", lambda spec: None)
    return calls


@pytest.fixture
def failing(monkeypatch, verbs):
    return lambda error: monkeypatch.setattr(questions, "solve", Mock(side_effect=error))
