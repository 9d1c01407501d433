"""Options about data that say nothing sensible get an error that says how to mend them, in every command."""

import json

import pytest
from typer.testing import CliRunner

from inputdesign_cli.cli import app

SPEC = "plant: {B: [0, 0.2], F: [1, -0.8]}\nnoise: {variance: 0.01}\nexperiment: {samples: 90}\n"
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
    ("--skip", "80"): "--skip 80 leaves them all out",
    ("--skip", "99999999999999999999"): "leaves them all out",
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
    (tmp_path / "s.yaml").write_text(SPEC + ACCURACY)
    return str(tmp_path / "log.csv"), str(tmp_path / "s.yaml")


@pytest.mark.parametrize("option", WRONG, ids=" ".join)
@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_wrong_is_said(command, option, files):
    done = CliRunner().invoke(app, [*COMMANDS[command](*files), *option, "--no-output"])
    assert done.exit_code == 2, done.output
    assert WRONG[option] in " ".join(done.stderr.replace("│", "").split())
    assert "nope=" not in done.stderr


def test_a_sweep_reads_standard_input(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    text = SPEC + ACCURACY + "spectrum: {type: fir, order: 3}\n"
    command = ["sweep", "-", "--set", "spectrum.order=2,3", "--quiet"]
    done = CliRunner().invoke(app, command, input=text)
    assert done.exit_code == 0, done.output
    assert json.loads((tmp_path / "runs" / "stdin-sweep" / "sweep.json").read_text())["points"] == 2


@pytest.mark.parametrize("command", [["watch", "-"], ["explore", "-"]])
def test_what_does_not_read_standard_input_says_so(command):
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 2
    assert "standard input" in done.stderr


def test_identify_without_a_spec_names_what_needs_none(run, tmp_path):
    (tmp_path / "data.csv").write_text("u1,y1\n0,0\n1,1\n")
    code, out, err = run("identify", "data.csv")
    assert (code, out) == (2, "")
    assert "--spec" in err
    assert "idesign explore DATA" in err
