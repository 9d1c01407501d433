"""Exit codes of commands, and the text that they print to each stream."""

from __future__ import annotations

import json
import os
import signal
from pathlib import Path

import clarabel
import pytest
from typer.testing import CliRunner

from inputdesign_cli.cli import app
from inputdesign_cli.errors import DataError, InaccurateError, InfeasibleError, OutputError, SpecError
from tests.support.command_line import RESULT, diagnostic


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
    for part in ("First-order system", "0.258498", "1.705495", "0.192547", "3.142 rad/s", "2.94", "1.02"):
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


@pytest.mark.parametrize(
    ("error", "code"),
    [(SpecError, 2), (DataError, 2), (OutputError, 2), (InfeasibleError, 3), (InaccurateError, 4)],
)
def test_errors_have_their_exit_codes_and_nothing_is_written(run, failing, error, code, tmp_path):
    failing(error(diagnostic()))
    ended, out, err = run("solve", "a.yaml")
    assert (ended, out) == (code, "")
    assert list(tmp_path.iterdir()) == []
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


def test_an_interrupt_ends_with_130(run, failing):
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


SPEC = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {C: [1, -0.9], variance: 1.0}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.01, alpha: 2.45}}
spectrum: {type: fir, order: 20}
"""


@pytest.fixture
def interrupted(run, monkeypatch, tmp_path):
    """Solve with signals that come while the solver is called for the second time: exit code, stderr."""
    (tmp_path / "spec.yaml").write_text(SPEC)
    make = clarabel.DefaultSolver

    def call(*numbers, options=()):
        calls = []

        def solver(*arguments):
            calls.append(1)
            if len(calls) == 2:
                for number in numbers:
                    os.kill(os.getpid(), number)
            return make(*arguments)

        monkeypatch.setattr(clarabel, "DefaultSolver", solver)
        before = signal.getsignal(signal.SIGINT)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            code, _, said = run("solve", "spec.yaml", "--no-figures", *options)
        finally:
            signal.signal(signal.SIGINT, before)
        return code, said

    return call


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupted_run_writes_the_best_design_so_far_on_request(interrupted, tmp_path, number, code):
    ended, said = interrupted(number, options=["--keep-partial"])
    assert (ended, "what is known so far" in said) == (code, True)
    result = json.loads((tmp_path / "runs" / "spec" / "result.json").read_text())
    assert (result["status"], result["solver"]["ended_by"]) == ("gap_open", "the interrupt")
    assert 0.0 < result["objective"]["lower_bound"] < result["objective"]["value"]
    assert (tmp_path / "runs" / "spec" / "spectrum.csv").exists()


def test_a_second_interrupt_ends_at_once_and_without_the_option_one_does(interrupted, tmp_path):
    code, _ = interrupted(signal.SIGINT, signal.SIGINT, options=["--keep-partial"])
    assert code == 130
    assert interrupted(signal.SIGINT) == (130, "interrupted\n")
    assert not (tmp_path / "runs").exists()


SMALL = "plant: {B: [0, 0.2], F: [1, -0.8]}\nnoise: {variance: 0.01}\nexperiment: {samples: 90}\n"
ACCURACY = "accuracy: {model_error: {relative: 0.5}}\n"
COMMANDS = {
    "identify": lambda data, spec: ["identify", data, "--spec", spec],
    "assess": lambda data, spec: ["assess", spec, data],
    "explore": lambda data, spec: ["explore", data],
    "validate": lambda data, spec: ["explore", data, "--validate", spec],
}
WRONG = {
    ("--columns", "u1=nope"): "no column for nope (u1)",
    ("--columns", "u1=99"): "no column for 99 (u1)",
    ("--columns", "time=nope"): "no column for nope (time)",
    ("--columns", "u1=2,y1=2"): "u1 and y1 are the same column",
    ("--columns", "u1=2,u=3"): "u1 stands there twice",
    ("--columns", "valve=2"): "'valve' is no channel",
    ("--columns", "u0=2"): "'u0' is no channel",
    ("--columns", "u1"): "is not of the form",
    ("--sample-time", "0"): "positive number",
    ("--sample-time", "nan"): "positive number",
    ("--sample-time", "1e-300"): "1e-300",
    ("--time-unit", "ns"): "'ns' is not one of 's', 'ms'",
    ("--skip", "-1"): "greater than or equal to 0",
    ("--skip", "80"): "mind --skip and --range",
    ("--skip", "99999999999999999999"): "mind --skip and --range",
    ("--range", "60:10"): "before it begins",
    ("--range", "100:200"): "its times run from 0 to 79",
    ("--range", "5"): "is not of the form FROM:TO",
    ("--range", "nan:"): "is not of the form FROM:TO",
    ("--detrend", "cubic"): "'cubic' is not one of 'none', 'constant'",
    ("--without", "90-99"): "has no row from 90 to 99",
    ("--without", "20:30"): "which file 30 are rows of is not clear",
    ("--without", "20-"): "names no rows: write 183-240",
    ("--without", " "): "names no rows",
    ("--without", "-4"): "names no rows",
    ("--without", "30-20"): "write 20-30?",
    ("--without", "other.csv:3"): "which file 3 are rows of is not clear",
    ("--without", "1-999"): "--without leaves no row",
}


@pytest.fixture
def files(tmp_path):
    (tmp_path / "log.csv").write_text("time,u,y\n" + "".join(f"{k},{k % 3},{k * k % 7}\n" for k in range(80)))
    (tmp_path / "s.yaml").write_text(SMALL + ACCURACY)
    return str(tmp_path / "log.csv"), str(tmp_path / "s.yaml")


# All commands share one reader: each is tested with a quarter of the options, and with one common option.
EVERY = [*zip(WRONG, 7 * [*COMMANDS], strict=True), *((("--columns", "u1=nope"), one) for one in COMMANDS)]


@pytest.mark.parametrize(("option", "command"), dict.fromkeys(EVERY))
def test_wrong_options_for_records_are_refused_with_the_reason(option, command, files):
    done = CliRunner().invoke(app, [*COMMANDS[command](*files), *option, "--no-output"])
    assert done.exit_code == 2, done.output
    assert WRONG[option] in " ".join(done.stderr.replace("│", "").split())
    assert "nope=" not in done.stderr


def test_a_sweep_reads_standard_input(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    text = SMALL + ACCURACY + "spectrum: {type: fir, order: 3}\n"
    command = ["sweep", "-", "--set", "spectrum.order=2,3", "--quiet"]
    done = CliRunner().invoke(app, command, input=text)
    assert done.exit_code == 0, done.output
    assert json.loads((tmp_path / "runs" / "stdin-sweep" / "sweep.json").read_text())["points"] == 2


@pytest.mark.parametrize(
    ("command", "said"),
    [
        (["watch", "-"], ["standard input"]),
        (["explore", "-"], ["standard input"]),
        (["explore", "data.csv", "--spec", "s.yaml", "--validate", "m.yaml"], ["--spec"]),
        (["explore", "data.csv", "--operating-point", "u1=4"], ["--spec"]),
        (["identify", "data.csv"], ["--spec", "idesign explore DATA"]),
    ],
)
def test_a_refused_command_names_what_is_needed_instead(run, tmp_path, command, said):
    (tmp_path / "data.csv").write_text("u1,y1\n0,0\n1,1\n")
    code, out, err = run(*command)
    assert (code, out) == (2, "")
    assert all(part in err for part in said)
