"""Fixtures shared by the tests of several tasks."""

from importlib import import_module

import clarabel
import pytest

from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.text_formats import csv_text
from tests.support.heater import heater


@pytest.fixture
def write(tmp_path):
    """Writes columns as a CSV file and returns its path."""

    def written(columns, name="data.csv"):
        path = tmp_path / name
        path.write_text(csv_text(Table(columns)), encoding="utf-8")
        return path

    return written


@pytest.fixture
def heater_record(tmp_path):
    """Writes a record of the heater."""

    def written(name, *args, **kwargs):
        columns, path = heater(*args, **kwargs), tmp_path / name
        rows = zip(*columns.values(), strict=True)
        text = "".join(",".join(map(repr, map(float, row))) + "\n" for row in rows)
        path.write_text(",".join(columns) + "\n" + text)
        return path

    return written


class Clock:
    """Replaces the module time; only the tests advance it."""

    def __init__(self):
        self.now = 100.0

    def monotonic(self):
        return self.now


@pytest.fixture
def slow_solver(monkeypatch):
    """The time limits of the solver's calls, each of which takes three seconds of a simulated clock."""
    clock, given, make = Clock(), [], clarabel.DefaultSolver

    def slow(*arguments):
        given.append(arguments[-1].time_limit)
        clock.now += 3.0
        return make(*arguments)

    monkeypatch.setattr(import_module("inputdesign_cli.compute.time_limit"), "time", clock)
    monkeypatch.setattr(clarabel, "DefaultSolver", slow)
    return given
