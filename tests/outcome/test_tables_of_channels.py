"""Names of parameters of several channels hold commas, and tables keep them whole."""

import csv

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, strategies as st

from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.text_formats import csv_columns, csv_text
from tests.support.commands import caller

ROBUST = """
plant:
  A: [[1, -0.7], [1, 0.4]]
  B: [[[0, 1.0], [0, -0.5]], [[0, 0.6], [0, 1.2]]]
noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}
experiment: {samples: 120}
accuracy: {model_error: {relative: 0.3}}
spectrum: {type: fir, order: 2}
signal: {candidates: 2}
simulation: {runs: 4}
uncertainty: {scenarios: 3, fresh: 20, intervals: {"a1[1]": [-0.72, -0.68], "b1[2,2]": [1.1, 1.3]}}
"""
ENTRIES = {"a1[1]", "a1[2]", "b1[1,1]", "b1[1,2]", "b1[2,1]", "b1[2,2]"}


def tables(directory):
    """The header and the rows of each table of a run, by its name."""
    found = {}
    for path in directory.glob("*.csv"):
        with path.open(newline="") as file:
            header, *rows = csv.reader(file)
        found[path.name] = header, rows
    return found


@pytest.mark.first(1)
@pytest.mark.parametrize("verb", ["solve", "simulate", "campaign"])
def test_rows_have_as_many_fields_as_the_header(monkeypatch, capsys, tmp_path, verb):
    monkeypatch.chdir(tmp_path)
    run = caller(monkeypatch, capsys)
    (tmp_path / "s.yaml").write_text(ROBUST + "campaign: {block: 60}\n" * (verb == "campaign"))
    assert run(verb, "s.yaml", "-o", "out", "--no-figures")[0] == 0
    if verb == "campaign":
        _, rows = tables(tmp_path / "out")["signal.csv"]
        part = np.array(rows, dtype=float)
        moved = part[:, 1:] @ [[1.0, 0.6], [-0.5, 1.2]]
        moved = np.vstack([np.zeros(2), moved[:-1]]) + np.random.default_rng(1).normal(size=(len(part), 2))
        lags = ([1, -0.7], [1, 0.4])
        y = np.column_stack([scipy.signal.lfilter([1], lags[i], moved[:, i]) for i in range(2)])
        np.savetxt(
            "r.csv", np.column_stack([part, y]), delimiter=",", header="time_s,u1,u2,y1,y2", comments=""
        )
        assert run("next", "out", "r.csv", "--no-figures")[0] == 0
    found = tables(tmp_path / "out")
    assert {"solve": "scenarios.csv", "simulate": "signal.csv", "campaign": "rounds.csv"}[verb] in found
    for name, (header, rows) in found.items():
        assert {len(row) for row in rows} == {len(header)}, name
        assert len(set(header)) == len(header), name
    for name in {"scenarios.csv", "rounds.csv"} & set(found):
        assert set(found[name][0]) >= ENTRIES


@given(st.lists(st.text(st.characters(codec="utf-8"), min_size=1), min_size=1, max_size=5, unique=True))
def test_any_name_is_read_back(names):
    table = Table({name: np.array([i, 0.5]) for i, name in enumerate(names)})
    found = csv_columns(csv_text(table).encode())
    assert list(found) == names
    assert [values[0] for values in found.values()] == list(range(len(names)))
