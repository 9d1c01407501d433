"""A run directory is whole or absent, and never a mixture of two runs."""

import errno
import hashlib
import json
import os
import pathlib
import platform
import subprocess
import sys
from contextlib import suppress
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest

from inputdesign_cli.errors import DataError, OutputError
from inputdesign_cli.outcome.curves import OptimalityCurves, SignalCurves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.run_directory import read_run, write_bytes, write_run
from tests.support.outcomes import typed
from tests.support.processes import running
from tests.support.refusals import refused

SPECS = Path(__file__).parents[2] / "specs"
FILES = ["spec.yaml", "signal.csv", "optimality.csv", "signal.png", "optimality.png", "figures.json"]


def a_run(mark: str, *, optimality: bool = False) -> Results:
    """A small run whose files all carry its mark."""
    number = float(len(mark))
    curves = {"signal": SignalCurves(np.arange(4.0), {"u1": np.array([1.0, -1.0, 1.0, -1.0]) * number})}
    tables = {"signal": Table({"time_s": np.arange(4.0), "u1": np.full(4, number)})}
    if optimality:
        w = np.array([0.1, 1.0, 3.0])
        curves["optimality"] = OptimalityCurves(w, np.array([0.5, 1.0, 0.5]), np.array([1.0]))
        tables["optimality"] = Table({"frequency_rad_per_s": w, "ratio": curves["optimality"].ratio})
    return Results(
        typed({"format": 1, "title": mark, "objective": {"kind": "least_cost", "value": np.float64(number)}}),
        resolved_spec=f"title: {mark}\n",
        tables=tables,
        curves=curves,
    )


def write_with_figures(results, directory):
    """Write a run with placeholders for its figures."""
    return write_run(results, directory, {f"{stem}.png": b"drawn" for stem in results.curves})


def marks(directory) -> set[str]:
    """The marks of the runs that the text files of a directory belong to."""
    found = set()
    for name in ("spec.yaml", "result.json", "signal.csv"):
        if (directory / name).exists():
            text = (directory / name).read_text()
            found |= {mark for mark in ("first", "second") if mark in text or f",{len(mark)}\n" in text}
    return found


def names(directory) -> set[str]:
    return {path.name for path in directory.iterdir()}


def test_a_run_is_read_as_it_was_written_with_its_files_its_software_and_its_spec(tmp_path):
    target = tmp_path / "runs" / "a"
    paths = write_with_figures(a_run("first", optimality=True), target)
    assert [path.name for path in paths] == [*FILES, "result.json"]
    assert names(target) == {path.name for path in paths}
    assert names(tmp_path / "runs") == {"a"}
    assert (target / "signal.png").read_bytes() == b"drawn"
    result = read_run(target)
    assert result["title"] == "first"
    assert result["objective"] == {"kind": "least_cost", "value": 5.0}
    assert result["files"] == FILES
    assert result["spec_sha256"] == hashlib.sha256((target / "spec.yaml").read_bytes()).hexdigest()
    assert result["environment"]["python"] == platform.python_version()
    assert result["environment"]["numpy"] == metadata.version("numpy")
    assert set(result["environment"]) >= {"platform", "idesign", "scipy", "cvxpy", "clarabel"}


def test_a_run_replaces_the_files_of_the_earlier_run_and_no_file_of_the_user(tmp_path):
    write_with_figures(a_run("first", optimality=True), tmp_path / "a")
    (tmp_path / "a" / "notes.txt").write_text("mine")
    (tmp_path / "a" / "photo.png").write_text("mine")
    (tmp_path / "a" / "data").mkdir()
    write_with_figures(a_run("second"), tmp_path / "a")
    run = {"spec.yaml", "signal.csv", "signal.png", "figures.json", "result.json"}
    assert names(tmp_path / "a") == run | {"notes.txt", "photo.png", "data"}
    assert (tmp_path / "a" / "notes.txt").read_text() == "mine"
    assert (tmp_path / "a" / "photo.png").read_text() == "mine"
    assert marks(tmp_path / "a") == {"second"}


@pytest.mark.parametrize(
    ("there", "target", "code"),
    [
        ("spec.yaml", ".", "output-not-a-run"),
        ("a", "a", "output-not-a-directory"),
        ("a", "a/b", "output-not-writable"),
    ],
)
def test_a_file_of_the_user_is_never_overwritten(tmp_path, there, target, code):
    (tmp_path / there).write_text("mine")
    found = refused(write_with_figures, a_run("first"), tmp_path / target, kind=OutputError)
    assert found[0].code == code
    assert code != "output-not-a-run" or there in found[0].message
    assert names(tmp_path) == {there}
    assert (tmp_path / there).read_text() == "mine"


def contents(directory) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in directory.iterdir()}


OPERATIONS = [
    *((pathlib.Path, name) for name in ("write_bytes", "rename", "replace", "mkdir")),
    (os, "fsync"),
]


def sabotaged(write, failing, error):
    """Write while one operation on files fails; return the number of operations that were begun."""
    count = 0

    def wrapped(original):
        def operation(*args, **kwargs):
            nonlocal count
            count += 1
            if count == failing:
                raise error
            return original(*args, **kwargs)

        return operation

    with pytest.MonkeyPatch.context() as patch:
        for owner, name in OPERATIONS:
            patch.setattr(owner, name, wrapped(getattr(owner, name)))
        write()
    return count


ERRORS = [
    (OSError(errno.ENOSPC, "No space left on device"), OutputError),
    (PermissionError(errno.EACCES, "Permission denied"), OutputError),
    (KeyboardInterrupt(), KeyboardInterrupt),
]
CODES = {errno.ENOSPC: "output-full", errno.EACCES: "output-not-writable"}


@pytest.mark.parametrize(("error", "raised"), ERRORS, ids=["full", "denied", "interrupted"])
def test_a_failure_at_any_step_of_a_new_run_leaves_nothing(tmp_path, error, raised):
    steps = sabotaged(lambda: write_run(a_run("first"), tmp_path / "probe"), -1, error)
    assert steps > 6
    for step in range(1, steps):
        place = tmp_path / f"step{step}"
        place.mkdir()
        with pytest.raises(raised) as caught:
            sabotaged(lambda place=place: write_run(a_run("first"), place / "a"), step, error)
        if raised is OutputError:
            assert caught.value.diagnostics[0].code == CODES[error.errno]
        assert names(place) == set(), step


@pytest.mark.parametrize(("error", "raised"), ERRORS, ids=["full", "denied", "interrupted"])
def test_a_failure_at_any_step_of_a_single_file_keeps_the_old_one(tmp_path, error, raised):
    (tmp_path / "old.csv").write_bytes(b"old")
    (tmp_path / "link.csv").symlink_to(tmp_path / "old.csv")
    for step in (1, 2):
        with pytest.raises(raised):
            sabotaged(lambda: write_bytes(tmp_path / "link.csv", b"new"), step, error)
        assert contents(tmp_path) == {"old.csv": b"old", "link.csv": b"old"}
    write_bytes(tmp_path / "link.csv", b"new")
    assert contents(tmp_path) == {"old.csv": b"new", "link.csv": b"new"}
    os.mkfifo(tmp_path / "pipe")
    reading = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    write_bytes(tmp_path / "pipe", b"new")
    assert os.read(reading, 9) == b"new"
    os.close(reading)


@pytest.mark.first(2)
@pytest.mark.parametrize(("error", "raised"), ERRORS, ids=["full", "denied", "interrupted"])
def test_a_failure_at_any_step_of_a_replacement_keeps_a_whole_run(tmp_path, error, raised):
    write_with_figures(a_run("first", optimality=True), tmp_path / "probe")
    steps = sabotaged(lambda: write_run(a_run("second"), tmp_path / "probe"), -1, error)
    assert steps > 12
    old = tmp_path / "a"
    write_with_figures(a_run("first", optimality=True), old)
    (old / "notes.txt").write_text("mine")
    before = contents(old)
    outcomes = []
    for step in range(1, steps + 1):
        with suppress(raised):
            sabotaged(lambda: write_run(a_run("second"), old), step, error)
        assert names(tmp_path) == {"a", "probe"}, step
        outcomes.append(contents(old) == before)
        if not outcomes[-1]:
            assert step == steps  # what fails after the last move
            assert marks(old) == {"second"}
            assert (old / "notes.txt").read_text() == "mine"
    assert outcomes.count(True) > 8


@pytest.mark.first(1)
@pytest.mark.parametrize("users", ["folder", "plain"])
def test_whenever_the_writer_is_killed_the_next_call_finds_a_whole_run(tmp_path, users):
    command = [sys.executable, "-m", "tests.support.killed_writer", str(tmp_path), users]
    ended = subprocess.run(command, cwd=SPECS.parent, capture_output=True, text=True, timeout=100)
    assert ended.returncode == 0, ended.stderr
    left = [json.loads(line) for line in ended.stdout.splitlines()]
    assert len(left) > 20
    for kill in left:
        assert kill["then"] in ("first", "second"), kill
        assert kill["at_once"] != "mixed", kill
        assert "error" not in kill
        assert (kill["strange"], kill["in_the_end"], kill["notes"]) == ([], "second", "mine"), kill
    assert {kill["then"] for kill in left} == {"first", "second"}
    # At some moments there is no run until the next call; otherwise this test would prove nothing.
    assert "none" in {kill["at_once"] for kill in left}


def test_a_nan_in_the_result_raises_an_error_and_writes_nothing(tmp_path):
    bad = Results(typed({"format": 1, "value": np.nan}), resolved_spec="")
    with pytest.raises(ValueError, match=r"result\.value"):
        write_with_figures(bad, tmp_path / "a")
    assert names(tmp_path) == set()


@pytest.mark.parametrize(
    ("files", "code"),
    [
        ({}, "run-missing"),
        ({"result.json": "{"}, "run-unreadable"),
        ({"result.json": "[]"}, "run-unreadable"),
        ({"result.json": "[" * 100_000}, "run-unreadable"),
        ({"result.json": '{"format": 1, "files": [1, null]}'}, "run-unreadable"),
        ({"result.json": '{"format": 1, "files": 7}'}, "run-unreadable"),
        ({"result.json": json.dumps({"format": 1, "files": ["x" * 300]})}, "run-unreadable"),
        ({"result.json": json.dumps({"format": 1, "files": ["\ud800"]})}, "run-unreadable"),
        ({"result.json": '{"format": %s}' % ("1" * 10_000)}, "run-unreadable"),
        ({"result.json": '{"format": 1, "files": ["spec.yaml"]}'}, "run-incomplete"),
    ],
)
def test_read_run_refuses_missing_broken_and_incomplete_runs(tmp_path, files, code):
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    assert refused(read_run, tmp_path, kind=DataError)[0].code == code
    if not files:
        assert refused(read_run, tmp_path / "nowhere", kind=DataError)[0].code == code


@pytest.mark.parametrize("name", ["../precious.txt", "{}/precious.txt", "..", ".", "", "a/b", "x\0y", 7])
def test_a_record_that_names_files_elsewhere_moves_none(tmp_path, name):
    precious = tmp_path / "precious.txt"
    precious.write_text("mine")
    target = tmp_path / "a"
    target.mkdir()
    listed = name.format(tmp_path) if isinstance(name, str) else name
    record = {"format": 1, "files": [listed]}
    (target / "result.json").write_text(json.dumps(record))
    # As if a writer had been killed in the middle, too.
    for part in ("new", "old"):
        (target / ".run.partial" / part).mkdir(parents=True)
        (target / ".run.partial" / part / "result.json").write_text(json.dumps(record))
    found = refused(write_run, a_run("first"), target, kind=(OutputError, DataError))
    assert found[0].code == "output-not-a-run"
    with pytest.raises(DataError):
        read_run(target)
    assert precious.read_text() == "mine"


def test_links_in_a_run_directory_are_not_followed(tmp_path):
    (tmp_path / "elsewhere" / "new").mkdir(parents=True)
    (tmp_path / "elsewhere" / "new" / "result.json").write_text("mine")
    (tmp_path / "a").mkdir()
    for name in (".run.partial", "signal.csv"):
        (tmp_path / "a" / name).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OutputError):
        write_run(a_run("first"), tmp_path / "a")
    assert (tmp_path / "elsewhere" / "new" / "result.json").read_text() == "mine"


def test_the_report_of_the_earlier_run_is_removed(tmp_path):
    write_run(a_run("first"), tmp_path / "a")
    page = '<html><head><meta name="generator" content="idesign 0.1.0"></head></html>'
    (tmp_path / "a" / "report.html").write_text(page)
    write_run(a_run("second"), tmp_path / "a")
    assert "report.html" not in names(tmp_path / "a")
    (tmp_path / "a" / "report.html").write_text("<html>mine</html>")
    write_run(a_run("first"), tmp_path / "a")
    assert (tmp_path / "a" / "report.html").read_text() == "<html>mine</html>"


def test_a_linked_run_directory_stays_a_link_and_the_current_folder_is_kept(tmp_path, monkeypatch):
    (tmp_path / "disc").mkdir()
    (tmp_path / "a").symlink_to(tmp_path / "disc")
    write_run(a_run("first"), tmp_path / "a")
    assert (tmp_path / "a").is_symlink()
    assert names(tmp_path / "disc") == {"spec.yaml", "signal.csv", "figures.json", "result.json"}
    monkeypatch.chdir(tmp_path / "disc")
    write_run(a_run("second"), pathlib.Path())
    assert pathlib.Path.cwd() == tmp_path / "disc"
    assert marks(pathlib.Path()) == {"second"}


# Names that Python on Windows does not have.
BARE = """
import os, signal, sys
for name in ("fcntl", "resource", "pwd", "grp", "termios", "pty", "tty", "posix_ipc"):
    sys.modules[name] = None
for name in ("SIGHUP", "SIGALRM", "SIGKILL", "SIGUSR1", "SIGUSR2", "SIGPIPE", "SIGCHLD", "SIGQUIT", "SIGSTOP",
             "SIGCONT", "setitimer", "alarm", "pause", "ITIMER_REAL", "pthread_sigmask"):
    delattr(signal, name)
for name in ("fork", "forkpty", "getuid", "geteuid", "getgid", "getegid", "killpg", "setsid", "mkfifo",
             "sched_getaffinity", "O_NONBLOCK", "O_NOFOLLOW", "O_DIRECTORY", "O_CLOEXEC", "fchmod", "chown"):
    delattr(os, name)
from inputdesign_cli.__main__ import main
"""
DESIGN = BARE + "sys.argv[0] = 'idesign'\nmain()\n"


WRITE = f"""{BARE}
from pathlib import Path
from inputdesign_cli.errors import OutputError
from inputdesign_cli.outcome import run_files
run_files._PATIENCE = 0.2
try:
    with run_files.workplace(Path(sys.argv[1])):
        print("free", flush=True)
        sys.stdin.read()
except OutputError as error:
    print(error.diagnostics[0].code)
"""


def python(program: str, *arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", program, *map(str, arguments)],
        cwd=cwd, input="", capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


@pytest.mark.slow
def test_a_spec_is_solved_twice_into_one_directory(tmp_path):
    for _ in range(2):
        done = python(
            DESIGN, "solve", SPECS / "first_order.yaml", "-o", tmp_path / "run", "--no-figures", cwd=tmp_path
        )
        assert done.returncode == 0, done.stderr
    assert "result.json" in os.listdir(tmp_path / "run")
    assert os.listdir(tmp_path) == ["run"]


def test_two_writers_of_one_directory_exclude_each_other(tmp_path):
    target = tmp_path / "run"
    command = [sys.executable, "-c", WRITE, str(target)]
    with running(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "free\n"
        assert python(WRITE, target, cwd=tmp_path).stdout == "output-busy\n"
        holder.communicate("")
        assert python(WRITE, target, cwd=tmp_path).stdout == "free\n"
