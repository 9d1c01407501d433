"""The comparator says what agrees, what does not and why; a bad golden file is explained."""

import math
from itertools import product
from pathlib import Path
from unittest.mock import Mock

import pytest

from inputdesign_cli.errors import InfeasibleError, SpecError, bad_spec
from inputdesign_cli.outcome.golden import compare, load_golden
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.questions import execute
from tests.support.outcomes import typed
from tests.support.refusals import refused

SHIPPED = sorted((Path(__file__).parents[2] / "golden").glob("*.yaml"))

GOOD = """\
title: Two runs
runs:
  - name: one
    spec: a.yaml
    quantities:
      - {path: objective.value, expected: 2, absolute: 1e-3, why: rounding, source: closed form}
      - path: "power.input[1]"
        label: second power
        expected: -4.0
        relative: 1.0e-2
        why: printed with two digits
        source: paper, Section 9
  - name: two
    spec: sub/b.yaml
    command: analyse
    overrides: [experiment.samples=10, "spectrum={type: white}"]
    quantities:
      - {path: cost, expected: 1, absolute: 0.5, why: w, source: s}
"""


def written(tmp_path, text):
    path = tmp_path / "g.yaml"
    path.write_text(text)
    return path


def diagnostics(tmp_path, text):
    return refused(load_golden, written(tmp_path, text))


def test_rows_compare_with_the_tolerance(tmp_path):
    golden = load_golden(written(tmp_path, GOOD))
    results = {
        "one": {"objective": {"value": 2.0009}, "power": {"input": [0.0, -4.05]}},
        "two": {"cost": 1.5},
    }
    rows = compare(golden, results)
    assert [row.passed for row in rows] == [True, False, True]
    assert rows[0].deviation == pytest.approx(9e-4)
    assert rows[1].deviation == pytest.approx(-0.05)
    assert rows[1].as_dict()["source"] == "paper, Section 9"


@pytest.mark.parametrize(
    ("results", "notes"),
    [
        ({}, ["the run has no result"] * 3),
        (
            {"one": {"objective": 5, "power": {"input": [1.0]}}, "two": InfeasibleError([])},
            ["the result has no objective.value", "the result has no power.input[1]", ""],
        ),
        (
            {"one": {"objective": {"value": "x"}, "power": {"input": [0, None]}}, "two": {"cost": math.nan}},
            ["objective.value is not a number", "power.input[1] is not a number", ""],
        ),
    ],
)
def test_a_missing_or_non_numeric_quantity_does_not_pass(tmp_path, results, notes):
    rows = compare(load_golden(written(tmp_path, GOOD)), results)
    assert [row.note for row in rows] == notes
    assert not any(row.passed for row in rows)


def test_execute_runs_the_verb_and_keeps_infeasible_apart_from_a_bad_spec(tmp_path, monkeypatch):
    monkeypatch.setattr("inputdesign_cli.questions.load_spec", lambda path, more: [str(path), *more])
    verb = lambda spec: Results(typed({"spec": spec}), resolved_spec="")  # noqa: E731
    monkeypatch.setattr("inputdesign_cli.questions.analyse", verb)
    golden = load_golden(written(tmp_path, GOOD))
    one, two = golden.runs
    expected = [str(tmp_path / "sub" / "b.yaml"), "experiment.samples=10", "spectrum={type: white}"]
    assert execute(golden, two)["spec"] == expected
    infeasible = InfeasibleError([])
    monkeypatch.setattr("inputdesign_cli.questions.solve", Mock(side_effect=[infeasible, bad_spec("x", "y")]))
    assert execute(golden, one) is infeasible
    with pytest.raises(SpecError):
        execute(golden, one)


@pytest.mark.parametrize(
    ("old", "new", "line", "key"),
    [
        ("expected: 2,", "expected: two,", 6, "runs[0].quantities[0].expected"),
        ("expected: 2,", "expected: .nan,", 6, "runs[0].quantities[0].expected"),
        ("absolute: 1e-3", "absolute: -1e-3", 6, "runs[0].quantities[0].absolute"),
        ("absolute: 1e-3, ", "", 6, "runs[0].quantities[0]"),
        ("why: rounding, ", "", 6, "runs[0].quantities[0].why"),
        ("absolute: 1e-3", "absolute: 1e-3, relative: 1", 6, "runs[0].quantities[0]"),
        ("label: second", "lable: second", 8, "runs[0].quantities[1].lable"),
        ('"power.input[1]"', '"power..input"', 7, "runs[0].quantities[1].path"),
        ("command: analyse", "command: divine", 15, "runs[1].command"),
        ("name: two", "name: one", 13, "runs[1].name"),
        ("spec: sub/b.yaml", "spec: []", 14, "runs[1].spec"),
        ("overrides: [", "overrides: [[1], ", 16, "runs[1].overrides[0]"),
        ("title: Two runs", "title: Two runs\ntitle: again", 2, "title"),
    ],
)
def test_complaints_name_the_line_and_the_key(tmp_path, old, new, line, key):
    assert old in GOOD
    (diagnostic,) = diagnostics(tmp_path, GOOD.replace(old, new))
    assert diagnostic.key == key
    assert diagnostic.location.file == str(tmp_path / "g.yaml")
    assert diagnostic.location.line == line
    assert diagnostic.location.text == GOOD.replace(old, new).splitlines()[line - 1]


@pytest.mark.parametrize("text", ["", "- a", "runs: 5", "runs: [", "runs:\n\t- x", "runs: [5]"])
def test_malformed_golden_files_are_refused(tmp_path, text):
    assert diagnostics(tmp_path, text)


def test_the_shipped_files_are_sound():
    """A recomputed figure beside a printed one lies within the tolerance of the printed one."""
    pairs = 0
    for path in SHIPPED:
        golden = load_golden(path)
        for run in golden.runs:
            assert golden.spec_of(run).is_file()
            assert run.quantities
            for one, other in product(run.quantities, repeat=2):
                assert one.why
                assert one.source == "closed form" or one.source.startswith(("paper, ", "independent"))
                if one.source.startswith("paper") and other.path == one.path and other is not one:
                    assert abs(other.expected - one.expected) <= one.tolerance
                    pairs += 1
        if path.stem == "flexible_transmission":
            assert "reconstruction" in golden.title
            assert all("reconstruction" in q.name for run in golden.runs for q in run.quantities)
    assert pairs >= 7


def test_a_spec_in_place_of_a_golden_file_is_recognised():
    for spec in sorted((Path(__file__).parents[2] / "specs").glob("*.yaml"))[::5]:
        (one,) = refused(load_golden, spec)
        assert one.code == "golden-is-spec"
        assert f"`idesign validate {spec}`" in one.hint
