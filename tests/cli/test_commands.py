"""Commands that design nothing: validate, check, examples, init, explain, schema, help."""

import json
import runpy
import subprocess
import sys
from pathlib import Path
from typing import get_args
from xml.etree import ElementTree

import pytest
import typer

import inputdesign_cli
from inputdesign_cli import questions
from inputdesign_cli.cli import app
from inputdesign_cli.cli.reference import Kind
from inputdesign_cli.diagnostics import explanation
from inputdesign_cli.errors import InfeasibleError, SpecError
from inputdesign_cli.findings import explanations
from tests.support.command_line import RESULT, diagnostic

ROOT = Path(inputdesign_cli.__file__).parents[1]


def test_validate_reports_all_files_at_once(run, verbs, monkeypatch):
    def validate(spec):
        if spec.stem != "good":
            raise SpecError(diagnostic(spec.stem))

    monkeypatch.setattr(questions, "validate", validate)
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


def test_check_passes_if_all_quantities_agree(run, verbs, tmp_path):
    (tmp_path / "golden").mkdir()
    (tmp_path / "golden" / "g.yaml").write_text(GOLDEN % "0.2585")
    code, out, err = run("check")
    assert (code, err) == (0, "")
    assert "FAILS" not in out
    for part in ("2 of 2", "g: white", "power", "0.258498", "0.2585", "-2.0e-06", "1.0e-04"):
        assert part in out
    assert verbs == [(Path("golden/a.yaml"), [])]


def test_check_ends_with_1_if_a_quantity_disagrees(run, verbs, tmp_path):
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


@pytest.mark.parametrize("name", ["own", "own.yaml"])
def test_check_takes_golden_files_of_the_package_by_name(name, run, verbs, monkeypatch, tmp_path):
    (tmp_path / "package" / "golden").mkdir(parents=True)
    (tmp_path / "package" / "golden" / "own.yaml").write_text(GOLDEN % "0.2585")
    monkeypatch.setattr(sys.modules["inputdesign_cli.cli.reference"], "shipped", lambda: tmp_path / "package")
    code, out, _ = run("check", name)
    assert (code, "2 of 2 quantities agree" in out) == (0, True)
    code, _, err = run("check", "other.yaml")
    assert code == 2
    assert "there is no golden file other.yaml" in err
    assert "the package has own" in err


def test_check_without_golden_files_is_an_error(run, monkeypatch, tmp_path):
    monkeypatch.setattr(sys.modules["inputdesign_cli.cli.reference"], "shipped", lambda: tmp_path / "nowhere")
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


@pytest.mark.parametrize("kind", get_args(Kind))
def test_starter_specs_are_valid_and_explained(run, tmp_path, kind):
    assert run("init", "--kind", kind, "a.yaml")[0] == 0
    spec = inputdesign_cli.load_spec(tmp_path / "a.yaml", [])
    assert (spec.experiment.controller is not None) == (kind == "closed-loop")
    assert (spec.sweep is not None) == (kind == "sweep")
    assert (tmp_path / "a.yaml").read_text().count("#") > 8


def test_explain_lists_and_explains_every_code(run):
    code, out, _ = run("explain")
    assert code == 0
    names = [line.split()[0] for line in out.splitlines() if not line.startswith(" ")]
    assert set(names) == set(explanations())
    assert all(len(explanation(name, explanations())) > 40 for name in names)
    for name in (names[0], "yaml-syntax"):
        assert run("explain", name) == (0, explanation(name, explanations()) + "\n", "")
    code, out, _ = run("explain", "--all")
    assert code == 0
    assert all(explanation(name, explanations()) in out for name in names)
    code, _, err = run("explain", "no-such-code")
    assert code == 2
    assert "no-such-code" in err


def test_schema_and_version_are_printed(run):
    code, out, err = run("schema")
    assert (code, err) == (0, "")
    assert set(json.loads(out)["properties"]) >= {"plant", "experiment", "accuracy", "spectrum"}
    assert run("--version") == (0, f"idesign {inputdesign_cli.__version__}\n", "")


GROUP = typer.main.get_command(app)
COMMANDS = dict(GROUP.commands)


HELP = """
from inputdesign_cli.cli import main
sys.argv = ['idesign', '--help']
try: main()
except SystemExit: pass
"""
SMALL = "load_spec('specs/first_order.yaml', ['spectrum.order=2'])"
DESIGN = f"from inputdesign_cli import load_spec, solve; solve({SMALL})"


@pytest.mark.parametrize(
    ("code", "heavy"),
    [
        (HELP, "numpy scipy cvxpy clarabel matplotlib pydantic yaml control rich"),
        ("import inputdesign_cli.specification", "scipy control cvxpy matplotlib typer"),
        (DESIGN, "scipy.signal scipy.stats cvxpy matplotlib"),
    ],
    ids=["help", "specification", "a small design"],
)
def test_commands_import_no_package_that_they_do_not_need(code, heavy):
    code = f"import sys\n{code}\nprint(*sorted(sys.modules), file=sys.stderr)\n"
    command = [sys.executable, "-c", code]
    ended = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
    loaded = set(ended.stderr.split())
    assert {"inputdesign_cli"} <= loaded
    assert loaded & set(heavy.split()) == set()


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_and_option_is_documented(name, run):
    command = COMMANDS[name]
    assert len(command.help) > 20
    for parameter in command.params:
        assert parameter.help, parameter.name
    code, out, err = run(name, "--help")
    assert (code, err) == (0, "")
    for parameter in command.params:
        for option in parameter.opts if parameter.param_type_name == "option" else ():
            assert option in out


def test_the_page_about_the_command_line_is_up_to_date():
    page = runpy.run_path(str(ROOT / "docs" / "make_cli_page.py"))["page"]()
    assert (ROOT / "docs" / "cli.md").read_text(encoding="utf-8") == page, "run `make docs`"
