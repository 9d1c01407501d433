"""A pipe in place of a file of the user is not waited for; every place that opens a file is known."""

import ast
import os
import shutil
import signal
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from inputdesign_cli.errors import DataError, IdesignError, OutputError
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.run_directory import read_run, write_run
from tests.support.campaigns import SPEC
from tests.support.commands import caller
from tests.support.outcomes import typed
from tests.support.sweep_files import run_sweep
from tests.test_architecture import FILES, ROOT, tree_of

OPENING = {"open", "read_text", "read_bytes", "fdopen", "mmap", "fromfile", "loadtxt", "genfromtxt", "cmp"}
# The files that open others without `read_regular`: how often, and why nothing waits there.
OPENED = {
    "regular_file.py": (2, "the function itself"),
    "diagnostics.py": (1, "a file of the package"),
    "cli/options.py": (1, "a file of the package"),
    "cli/reference.py": (2, "files of the package"),
    "cli/terminal.py": (3, "the null device and the standard streams"),
    "outcome/run_files.py": (1, "files that were just written into a folder of its own"),
    "outcome/run_directory.py": (1, "a new file, which has the name of the process"),
    "report/sources.py": (1, "a file of the package"),
    "wizard/questions.py": (1, "a file of the package"),
}
# Functions of ours with one of these names read by `read_regular`.
OURS = {"inputdesign_cli.specification.yaml.files"}


def opened(path: Path) -> int:
    """How often a file of the package opens another one."""
    if not any(name in path.read_text(encoding="utf-8") for name in OPENING):
        return 0  # most files: they need not be parsed
    tree = tree_of(path)
    ours = {
        alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module in OURS
        for alias in node.names
    }
    called = [node.func for node in ast.walk(tree) if isinstance(node, ast.Call)]
    names = [f.attr for f in called if isinstance(f, ast.Attribute)]
    names += [f.id for f in called if isinstance(f, ast.Name) and f.id not in ours]
    return sum(name in OPENING for name in names)


def test_every_place_that_opens_a_file_is_known():
    found = {path.relative_to(ROOT).as_posix(): opened(path) for path in FILES}
    assert {name: times for name, times in found.items() if times} == {
        name: times for name, (times, _) in OPENED.items()
    }


@contextmanager
def in_time(seconds: float = 20.0):
    """Fail in place of waiting for ever."""

    def end(*_):
        raise AssertionError("something waits for a pipe")

    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def piped(path: Path) -> None:
    path.unlink(missing_ok=True)
    os.mkfifo(path)


KEPT = [
    "result.json", "spec.yaml", "signal.csv", "plan_01.csv", "record_01.csv", "record_01_as_given.csv",
    "model_01.yaml", "rounds.csv", "figures.json", ".lock",
]  # fmt: skip


@pytest.mark.first(5)
@pytest.mark.parametrize("name", KEPT)
def test_a_pipe_in_a_campaign_is_not_waited_for(campaigns, tmp_path, monkeypatch, capsys, name):
    shutil.copytree(campaigns / "once", tmp_path / "c")
    piped(tmp_path / "c" / name)
    monkeypatch.chdir(tmp_path)
    run = caller(monkeypatch, capsys)
    for command in (["next", "c", campaigns / "r2.csv", "--no-figures"], ["status", "c"], ["report", "c"]):
        with in_time():
            code, _, err = run(*command)
        assert code in (0, 2), err
        assert "Traceback" not in err


def a_run() -> Results:
    return Results(typed({"format": 1, "title": "one", "status": "optimal"}), "title: one\n")


@pytest.mark.parametrize(
    "name", ["result.json", "spec.yaml", "signal.csv", "report.html", "figures.json", ".run.lock"]
)
def test_a_pipe_in_a_run_is_not_waited_for(tmp_path, name):
    write_run(a_run(), tmp_path / "a")
    piped(tmp_path / "a" / name)
    with in_time():
        for use in (lambda: write_run(a_run(), tmp_path / "a"), lambda: read_run(tmp_path / "a")):
            with suppress(DataError, OutputError):
                use()
    assert name != ".run.lock" or read_run(tmp_path / "a")["title"] == "one"


@pytest.mark.parametrize(
    "name", [".lock", ".process", "sweep.json", "sweep.csv", "sweep.yaml", "result.json", "failure"]
)
def test_a_pipe_in_a_sweep_is_not_waited_for(tmp_path, monkeypatch, name):
    monkeypatch.setattr("inputdesign_cli.questions.solve", lambda spec: a_run())
    spec = tmp_path / "s.yaml"
    spec.write_text(SPEC.split("campaign:")[0])
    out = tmp_path / "out"
    run_sweep(spec, ["experiment.samples=100,200"], directory=out)
    key = min(path.name for path in (out / "points").iterdir())
    (out / "failures").mkdir(exist_ok=True)
    place = {"result.json": f"points/{key}/result.json", "failure": f"failures/{key}.json"}
    piped(out / place.get(name, name))
    with in_time(), suppress(IdesignError):
        run_sweep(spec, ["experiment.samples=100,200"], directory=out)
