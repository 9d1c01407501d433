"""Help for everything, that imports nothing heavy, and the page made of it."""

import runpy
import subprocess
import sys
from pathlib import Path

import pytest
import typer

import inputdesign_cli
from inputdesign_cli.cli import app

ROOT = Path(inputdesign_cli.__file__).parents[1]
GROUP = typer.main.get_command(app)
COMMANDS = dict(GROUP.commands)


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
