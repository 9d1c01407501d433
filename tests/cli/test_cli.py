"""What commands print, and how they end: exit codes, and what goes to which stream."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from inputdesign_cli import questions
from inputdesign_cli.errors import DataError, InaccurateError, InfeasibleError, OutputError, SpecError
from inputdesign_cli.outcome.results import Results
from tests.support.command_line import RESULT, diagnostic
from tests.support.outcomes import typed
from tests.support.processes import running


@pytest.mark.parametrize("verb", ["solve", "analyse"])
def test_a_run_is_written_and_summarised(run, verbs, tmp_path, verb):
    code, out, err = run(verb, "specs/first.yaml", "--set", "a.b=1", "--set", "c={d: 2}")
    assert (code, err) == (0, "")
    assert verbs == [(Path("specs/first.yaml"), ["a.b=1", "c={d: 2}"])]
    assert {p.name for p in (tmp_path / "runs" / "first").iterdir()} == {
        "spec.yaml",
        "signal.csv",
        "result.json",
    }
    for part in ("First-order system", "0.258498", "1.705495", "6.6 times", "0.192547", "gap below 1e-6"):
        assert part in out
    for part in ("3.142 rad/s", "500 samples", "2.94", "1.02", "runs/first"):
        assert part in out


@pytest.mark.parametrize("verb", ["solve", "analyse"])
def test_json_is_the_result_and_nothing_else(run, verbs, tmp_path, verb):
    code, out, err = run(verb, "first.yaml", "--json", "-o", tmp_path / "here")
    assert (code, err) == (0, "")
    assert out == (tmp_path / "here" / "result.json").read_text()
    assert json.loads(out)["objective"] == RESULT["objective"]


def test_quiet_prints_nothing(run, verbs):
    assert run("solve", "first.yaml", "--quiet") == (0, "", "")
    assert run("validate", "first.yaml", "--quiet") == (0, "", "")


def test_the_summary_of_a_result_with_nothing_in_it(run, verbs, monkeypatch):
    bare = Results(typed({"format": 1, "objective": {"kind": "D", "value": 59.2, "upper_bound": 59.3}}), "")
    monkeypatch.setattr(questions, "solve", lambda spec: bare)
    code, out, err = run("solve", "a.yaml")
    assert (code, err) == (0, "")
    assert "log det M" in out
    assert "gets above 59.3" in out


@pytest.mark.parametrize(
    ("error", "code"),
    [(SpecError, 2), (DataError, 2), (OutputError, 2), (InfeasibleError, 3), (InaccurateError, 4)],
)
def test_errors_have_their_exit_codes(run, failing, error, code):
    failing(error(diagnostic()))
    ended, out, err = run("solve", "a.yaml")
    assert ended == code
    assert out == ""
    for part in ("a.yaml:3:7", "some-code", "the plant is unstable", "move its pole"):
        assert part in err
    assert "\x1b" not in err


def test_with_json_errors_are_data_too(run, failing):
    failing(InfeasibleError([diagnostic("one"), diagnostic("two")]))
    code, out, err = run("solve", "a.yaml", "--json")
    assert code == 3
    errors = json.loads(out)["errors"]
    assert [error["code"] for error in errors] == ["one", "two"]
    assert "the plant is unstable" in err


def test_nothing_is_written_when_a_design_fails(run, failing, tmp_path):
    failing(InfeasibleError(diagnostic()))
    run("solve", "a.yaml")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupt(run, failing):
    failing(KeyboardInterrupt())
    assert run("solve", "a.yaml") == (130, "", "interrupted\n")


@pytest.mark.parametrize("debug", ["", "1"])
def test_an_unexpected_error_asks_to_be_reported(run, failing, monkeypatch, debug):
    monkeypatch.setenv("IDESIGN_DEBUG", debug)
    failing(ZeroDivisionError("division by zero"))
    code, out, err = run("solve", "a.yaml")
    assert (code, out) == (70, "")
    assert "internal error: ZeroDivisionError: division by zero" in err
    assert "report" in err
    assert ("Traceback" in err) == bool(debug)


@pytest.mark.parametrize(
    "arguments",
    [
        ["solve"],
        ["solve", "a.yaml", "--sett", "x=1"],
        ["design"],
        ["init", "--kind", "sideways"],
        ["check", "--junit"],
    ],
)
def test_wrong_usage_ends_with_2(run, verbs, arguments):
    code, out, err = run(*arguments)
    assert (code, out) == (2, "")
    assert "Error: " in err


def test_a_destination_that_is_a_file(run, verbs, tmp_path):
    (tmp_path / "taken").write_text("mine")
    code, _, err = run("solve", "a.yaml", "-o", "taken")
    assert code == 2
    assert "taken" in err


def test_a_closed_pipe_is_no_error():
    command = [sys.executable, "-m", "inputdesign_cli", "init"]
    with running(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait() == 141
