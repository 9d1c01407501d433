"""The command line: exit codes, what goes to which stream, and help for everything."""

import json
import runpy
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import typer

import inputdesign_cli
from inputdesign_cli import specification, tasks
from inputdesign_cli.cli import app, main
from inputdesign_cli.cli.init import KINDS
from inputdesign_cli.cli.terminal import aligned, colourful, status
from inputdesign_cli.errors import (
    DataError,
    Diagnostic,
    InaccurateError,
    InfeasibleError,
    Location,
    OutputError,
    SpecError,
)
from inputdesign_cli.runs.results import Results, Table

ROOT = Path(inputdesign_cli.__file__).parents[1]
GROUP = typer.main.get_command(app)
COMMANDS = dict(GROUP.commands)

RESULT = {
    "format": 1,
    "title": "First-order system",
    "objective": {
        "kind": "least_cost",
        "value": 0.258498,
        "lower_bound": 0.2584979,
        "relative_gap": 1e-7,
        "any_spectrum_bound": 0.192547,
    },
    "cost": 0.258498,
    "power": {"input": [0.258498], "output": [3.5], "excitation": [0.258498]},
    "model_error": {"worst_ratio": 1.0, "worst_frequency": 3.14159, "alpha": 2.45},
    "spectrum": {"type": "fir"},
    "baseline": {"white": {"cost": 1.705495, "ratio": 6.597711}},
    "signal": {"samples": 500, "power": [0.26], "peak": [1.5], "crest_factor": [2.94], "worst_ratio": 1.02},
}


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run `idesign` in an empty folder: its exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["idesign", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return ended.value.code or 0, out, err

    return call


@pytest.fixture
def verbs(monkeypatch):
    """Stand-ins for the verbs of the package; `calls` keeps what they were called with."""
    calls = []

    def load_spec(path, overrides, **_):
        calls.append((path, list(overrides)))
        return path

    def results(spec):
        return Results(RESULT, "title: x\n", tables={"signal": Table({"u1": np.zeros(3)})})

    monkeypatch.setattr(specification, "load_spec", load_spec)
    monkeypatch.setattr("inputdesign_cli.sweep.verbs.load_spec", load_spec)
    for verb in ("solve", "analyse"):
        monkeypatch.setattr(tasks, verb, results)
    monkeypatch.setattr(tasks, "validate", lambda spec: None)
    return calls


@pytest.fixture
def failing(monkeypatch, verbs):
    def install(error, verb="solve"):
        def fail(spec):
            raise error

        monkeypatch.setattr(tasks, verb, fail)

    return install


def diagnostic(code="some-code"):
    place = Location("a.yaml", 3, 7, "plant: {F: [1, -1.7]}")
    return Diagnostic(code, "the plant is unstable", "move its pole", "plant.F", place)


# What is printed, and where ----------------------------------------------------------------------


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
    for part in ("First-order system", "0.258498", "1.705495", "6.6 times", "0.192547", "1.0e-07"):
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
    bare = Results({"format": 1, "objective": {"kind": "D", "value": 59.2, "upper_bound": 59.3}}, "")
    monkeypatch.setattr(tasks, "solve", lambda spec: bare)
    code, out, err = run("solve", "a.yaml")
    assert (code, err) == (0, "")
    assert "log det M" in out
    assert "gets above 59.3" in out


# How commands end ---------------------------------------------------------------------------------


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
    process = subprocess.Popen(
        [sys.executable, "-m", "inputdesign_cli", "init"], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    process.stdout.close()
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait() == 141


# Terminals ----------------------------------------------------------------------------------------


class Terminal:
    def __init__(self):
        self.text = ""

    def isatty(self):
        return True

    def write(self, text):
        self.text += text

    def flush(self):
        pass


@pytest.mark.parametrize(
    ("variables", "expected"),
    [({}, True), ({"NO_COLOR": "1"}, False), ({"NO_COLOR": ""}, True), ({"TERM": "dumb"}, False)],
)
def test_no_color(monkeypatch, variables, expected):
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert colourful(Terminal()) is expected


def test_no_colour_in_files(tmp_path):
    with (tmp_path / "log").open("w") as file:
        assert not colourful(file)


def test_progress_goes_to_terminals_only(monkeypatch, capsys):
    with status("working", quiet=False):
        pass
    assert capsys.readouterr() == ("", "")
    monkeypatch.setenv("TERM", "xterm")
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with status("[working] on it", quiet=False):
        pass
    assert "[working] on it" in terminal.text
    assert terminal.text.endswith("\x1b[2K"), "the line is cleared"
    terminal.text = ""
    with status("working", quiet=True):
        pass
    assert terminal.text == ""


def test_columns_are_aligned():
    assert aligned([("a", "1"), ("bcd", "22")], right=[1]) == ["a     1", "bcd  22"]
    assert aligned([("漢", "[x]"), ("bcd", "y")]) == ["漢   [x]", "bcd  y"]


def test_lines_break_on_a_terminal_and_nowhere_else(monkeypatch):
    rows = [("note", "one two three " * 10)]
    assert len(aligned(rows, wrap=True)) == 1
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "40")
    lines = aligned(rows, wrap=True)
    assert max(map(len, lines)) <= 40
    assert all(line.startswith("      ") for line in lines[1:])


# The commands -------------------------------------------------------------------------------------


def test_validate_reports_all_files_at_once(run, verbs, monkeypatch):
    def validate(spec):
        if spec.stem != "good":
            raise SpecError(diagnostic(spec.stem))

    monkeypatch.setattr(tasks, "validate", validate)
    code, out, err = run("validate", "bad.yaml", "good.yaml", "worse.yaml")
    assert code == 2
    assert out == "good.yaml: valid\n"
    assert "bad" in err
    assert "worse" in err
    code, out, _ = run("validate", "bad.yaml", "good.yaml", "worse.yaml", "--json")
    assert [error["code"] for error in json.loads(out)["errors"]] == ["bad", "worse"]
    code, out, _ = run("validate", "good.yaml", "--json")
    assert (code, json.loads(out)) == (0, {"valid": ["good.yaml"]})


GOLDEN = """\
runs:
  - name: white
    spec: a.yaml
    quantities:
      - {path: objective.value, label: power, expected: 0.2585, absolute: 1e-4, why: w, source: closed form}
      - {path: cost, expected: %s, absolute: 1e-4, why: digits, source: "paper, Section 1"}
"""


def test_check_passes(run, verbs, tmp_path):
    (tmp_path / "golden").mkdir()
    (tmp_path / "golden" / "g.yaml").write_text(GOLDEN % "0.2585")
    code, out, err = run("check")
    assert (code, err) == (0, "")
    assert "2 of 2 quantities agree" in out
    assert "FAILS" not in out
    for part in ("g: white", "power", "0.258498", "0.2585", "-2.0e-06", "1.0e-04", "paper, Section 1"):
        assert part in out
    assert verbs == [(Path("golden/a.yaml"), [])]


def test_check_fails_with_1(run, verbs, tmp_path):
    (tmp_path / "g.yaml").write_text(GOLDEN % "0.3")
    code, out, _ = run("check", "g.yaml", "--junit", "report.xml")
    assert code == 1
    assert "1 of 2 quantities agree" in out
    root = ElementTree.parse(tmp_path / "report.xml").getroot()
    assert root.tag == "testsuites"
    (suite,) = root
    for counted in (root, suite):
        assert [counted.get(name) for name in ("tests", "failures", "errors")] == ["2", "1", "0"]
    times = [float(case.get("time")) for case in suite]
    assert sum(times) == pytest.approx(float(root.get("time")), abs=2e-3)
    failed = [case.get("name") for case in suite if case.find("failure") is not None]
    assert failed == ["white: cost (paper, Section 1)"]
    code, out, err = run("check", "g.yaml", "--json")
    assert (code, err) == (1, "")
    content = json.loads(out)
    assert content["passed"] is False
    assert [row["passed"] for row in content["rows"]] == [True, False]


def test_check_of_an_infeasible_run_says_why(run, failing, tmp_path):
    (tmp_path / "g.yaml").write_text(GOLDEN % "0.2585")
    failing(InfeasibleError(diagnostic()))
    code, out, _ = run("check", "g.yaml")
    assert code == 1
    assert out.count("the plant is unstable") == 2


def test_check_without_golden_files(run, monkeypatch, tmp_path):
    monkeypatch.setattr(sys.modules["inputdesign_cli.cli.check"], "shipped", lambda: tmp_path / "nowhere")
    code, _, err = run("check", "--junit", "report.xml")
    assert code == 2
    assert "golden/*.yaml" in err
    root = ElementTree.parse(tmp_path / "report.xml").getroot()
    assert (root.tag, root.get("errors"), root.get("tests")) == ("testsuites", "1", "1")
    assert root.find("testsuite/testcase/error").get("type") == "golden-missing"


@pytest.mark.parametrize(
    "text", ["runs: []\n", "runs:\n", "{}\n", "runs: [{name: a, spec: a.yaml, quantities: []}]\n"]
)
def test_a_golden_file_that_compares_nothing_fails(run, verbs, tmp_path, text):
    (tmp_path / "g.yaml").write_text(text)
    assert run("check", "g.yaml", "--junit", "report.xml")[0] == 2
    assert ElementTree.parse(tmp_path / "report.xml").getroot().get("errors") == "1"


def test_golden_files_come_with_the_package(run, verbs, monkeypatch, tmp_path):
    (tmp_path / "shipped" / "golden").mkdir(parents=True)
    (tmp_path / "shipped" / "golden" / "g.yaml").write_text(GOLDEN % "0.2585")
    monkeypatch.setattr(sys.modules["inputdesign_cli.cli.check"], "shipped", lambda: tmp_path / "shipped")
    code, out, _ = run("check")
    assert code == 0
    assert "2 of 2 quantities agree" in out


def test_nothing_is_written_with_no_output(run, verbs, tmp_path):
    code, out, err = run("solve", "a.yaml", "--json", "--no-output")
    assert (code, err) == (0, "")
    assert json.loads(out)["objective"] == RESULT["objective"]
    code, out, err = run("solve", "a.yaml", "--no-output")
    assert "0.258498" in out
    assert "files" not in out
    assert run("solve", "a.yaml", "--no-output", "-o", "x")[0] == 2
    assert list(tmp_path.iterdir()) == []


def test_examples_are_listed_and_copied_once(run, tmp_path):
    code, out, _ = run("examples")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == sorted(
        p.stem for p in (ROOT / "specs").glob("*.yaml")
    )
    assert run("examples", "first_order", "-o", "mine") == (0, "mine/first_order.yaml\n", "")
    copied = tmp_path / "mine" / "first_order.yaml"
    assert copied.read_text() == (ROOT / "specs" / "first_order.yaml").read_text()
    copied.write_text("mine")
    assert run("examples", "first_order.yaml", "-o", "mine")[0] == 2
    assert copied.read_text() == "mine"
    code, _, err = run("examples", "frist_order")
    assert code == 2
    assert 'did you mean "first_order"' in err


def test_init_writes_once(run, tmp_path):
    assert run("init", "mine.yaml") == (0, "", "")
    text = (tmp_path / "mine.yaml").read_text()
    assert run("init") == (0, text, "")
    assert text.startswith("# yaml-language-server: $schema=idesign.schema.json\n")
    assert json.loads((tmp_path / "idesign.schema.json").read_text())["$id"].startswith("urn:")
    (tmp_path / "idesign.schema.json").write_text("mine")
    (tmp_path / "mine.yaml").write_text("changed")
    code, _, err = run("init", "mine.yaml")
    assert code == 2
    assert "--force" in err
    assert (tmp_path / "mine.yaml").read_text() == "changed"
    assert run("init", "mine.yaml", "--force")[0] == 0
    assert (tmp_path / "idesign.schema.json").read_text() == "mine"
    assert (tmp_path / "mine.yaml").read_text() == text


@pytest.mark.parametrize("kind", KINDS)
def test_starter_specs_are_valid_and_explained(run, tmp_path, kind):
    assert run("init", "--kind", kind, "a.yaml")[0] == 0
    spec = inputdesign_cli.load_spec(tmp_path / "a.yaml", [])
    assert (spec.experiment.controller is not None) == (kind == "closed-loop")
    assert (spec.sweep is not None) == (kind == "sweep")
    assert (tmp_path / "a.yaml").read_text().count("#") > 8


@pytest.mark.parametrize(
    ("arguments", "nearest"),
    [(("init", "--kind", "closd-loop"), "closed-loop"), (("sweep", "a", "--verb", "slove"), "solve")],
)
def test_an_unknown_word_is_refused_in_plain_words(run, arguments, nearest):
    code, _, err = run(*arguments)
    assert code == 2
    assert f'did you mean "{nearest}"?' in " ".join(err.split())
    assert "Value error" not in err


def test_explain(run):
    code, out, _ = run("explain")
    assert code == 0
    for name in (line.split()[0] for line in out.splitlines()):
        ended, text, _ = run("explain", name)
        assert ended == 0
        assert len(text) > 40
    code, _, err = run("explain", "no-such-code")
    assert code == 2
    assert "no-such-code" in err


def test_schema(run):
    code, out, err = run("schema")
    assert (code, err) == (0, "")
    assert set(json.loads(out)["properties"]) >= {"plant", "experiment", "accuracy", "spectrum"}


def test_version(run):
    assert run("--version") == (0, f"idesign {inputdesign_cli.__version__}\n", "")


# Help ---------------------------------------------------------------------------------------------


def test_help_imports_nothing_heavy():
    code = (
        "import sys; sys.argv = ['idesign', '--help']\n"
        "from inputdesign_cli.cli import main\n"
        "try: main()\n"
        "except SystemExit: print(*sorted(sys.modules), file=sys.stderr)\n"
    )
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in ended.stderr.split()}
    heavy = {"numpy", "scipy", "cvxpy", "clarabel", "matplotlib", "pydantic", "yaml", "control", "rich"}
    assert "typer" in loaded
    assert loaded & heavy == set()


def test_every_command_of_the_contract_so_far_is_there():
    wanted = {"solve", "analyse", "sweep", "report", "validate", "check", "init", "schema", "explain"}
    assert set(COMMANDS) >= wanted


@pytest.mark.parametrize("name", COMMANDS)
def test_everything_is_documented(name, run):
    command = COMMANDS[name]
    assert len(command.help) > 20
    for parameter in command.params:
        assert parameter.help, parameter.name
    code, out, err = run(name, "--help")
    assert (code, err) == (0, "")
    for parameter in command.params:
        for option in parameter.opts if parameter.param_type_name == "option" else ():
            assert option in out


@pytest.mark.parametrize("name", ["solve", "analyse"])
def test_the_options_that_are_everywhere(name):
    options = {option for parameter in COMMANDS[name].params for option in parameter.opts}
    assert {"--set", "-o", "--output", "--json", "--quiet"} <= options


def test_the_page_about_the_command_line_is_up_to_date():
    page = runpy.run_path(str(ROOT / "docs" / "make_cli_page.py"))["page"]()
    assert (ROOT / "docs" / "cli.md").read_text(encoding="utf-8") == page, "run `make docs`"
