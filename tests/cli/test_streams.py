"""Streams that are closed, full or cut off, and signals: a clear line and an exit code, never a traceback."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from inputdesign_cli.cli import terminal as terminal_module
from inputdesign_cli.cli.terminal import aligned, colourful, computing, status
from inputdesign_cli.compute.time_limit import Counted, report_progress
from tests.support.processes import running

ROOT = Path(__file__).parents[2]
SPEC = ROOT / "specs" / "first_order_given.yaml"
IDESIGN = f"{sys.executable} -m inputdesign_cli"


def shell(command, folder, **environment):
    """The exit code and standard error of a command in `bash`."""
    ended = subprocess.run(
        ["bash", "-c", f"set -o pipefail; {command}"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert "Traceback" not in ended.stderr
    return ended.returncode, ended.stderr


FAILS = [
    (">&-", 2, "error: standard output cannot be written"),
    (">/dev/full", 2, "error: standard output cannot be written"),
    ("| head -c 0", 141, ""),
    ("2>&-", 0, ""),
    ("2>/dev/full", 0, ""),
    ("<&-", 0, ""),
]


@pytest.mark.first(5)
@pytest.mark.parametrize(
    ("command", "stream", "code", "said"),
    [
        *((command, *fails) for command in ("--help", "explain yaml-syntax") for fails in FAILS),
        *((f"validate --json {SPEC}", *fails) for fails in FAILS[1:3]),
    ],
)
def test_failing_streams_end_a_command_with_a_code_and_one_line(tmp_path, command, stream, code, said):
    ended, told = shell(f"{IDESIGN} {command} {stream}", tmp_path)
    assert ended == code
    assert told.startswith(said)
    assert len(told.splitlines()) == bool(said)


@pytest.mark.first(1)
@pytest.mark.parametrize(("streams", "code"), [(">&- 2>&- <&-", 2), ("-q >&-", 0)])
def test_a_closed_stream_never_becomes_a_file_of_the_run(tmp_path, streams, code):
    assert shell(f"{IDESIGN} analyse {SPEC} -o r --no-figures {streams}", tmp_path)[0] == code
    assert (tmp_path / "r" / "result.json").read_text().startswith("{")


@pytest.mark.first(1)
@pytest.mark.parametrize(("verb", "ended"), [("analyse", 2), ("validate", 0)])
def test_a_removed_current_folder_stops_commands_that_write(tmp_path, verb, ended):
    code, told = shell(f"mkdir gone; cd gone; rmdir ../gone; {IDESIGN} {verb} {SPEC}", tmp_path)
    assert (code, "the current folder has been removed" in told) == (ended, ended == 2)


@pytest.mark.slow
def test_a_command_works_without_a_writable_home(tmp_path):
    assert shell(f"{IDESIGN} analyse {SPEC} -q", tmp_path, HOME="/proc/nowhere", MPLCONFIGDIR="") == (0, "")


START = "from inputdesign_cli.__main__ import main; print(flush=True); main()"


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]
)
def test_signals_end_a_command_whenever_they_come(tmp_path, number, code):
    """They may come during imports; Python itself needs some hundredths of a second before that."""
    codes = set()
    for delay in (0.05, 0.4):
        command = [sys.executable, "-c", START, "simulate", SPEC, "-o", "r"]
        command += ["--set", "simulation={runs: 1000000}"]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        with running(command, cwd=tmp_path, **pipes) as process:
            process.stdout.readline()
            time.sleep(delay)
            process.send_signal(number)
            _, told = process.communicate(timeout=60)
        assert "Traceback" not in told, told
        codes.add(process.returncode)
    # Before the handlers stand, a signal ends the process by itself; a shell shows the same code.
    assert codes <= {code, -number}
    assert not (tmp_path / "r").exists()


PROGRAM = """
import signal, sys, time
import inputdesign_cli.__main__ as command, inputdesign_cli.cli as cli
from inputdesign_cli.cli.terminal import guarded

_, number, where = sys.argv
sys.argv = sys.argv[:1]

class Finalised:
    def __del__(self):
        signal.raise_signal(int(number))

class Attribute:
    def __set_name__(self, owner, name):
        signal.raise_signal(int(number))

def work():
    try:
        {}
        time.sleep(20)
    finally:
        print("tidied up")

def run():
    cli.terminal.prepare_signals()
    cli.typer.run(guarded(work)) if where == "guarded" else work()

cli.main = run
command.main()
"""
# A signal that comes while an object is finalised, while an import swallows it, while a class is made.
WORK = ("Finalised()", "import dropping", 'type("Made", (), dict(attribute=Attribute()))')


@pytest.mark.first(4)
@pytest.mark.parametrize("work", WORK, ids=["finalised", "dropped", "wrapped"])
@pytest.mark.parametrize("where", ["guarded", "outside"])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_is_neither_lost_nor_a_fault_whatever_python_does_meanwhile(
    tmp_path, number, code, where, work
):
    swallowed = f"try:\n    signal.raise_signal({int(number)})\nexcept BaseException:\n    pass\n"
    (tmp_path / "dropping.py").write_text(f"import signal\n{swallowed}")
    command = [sys.executable, "-c", PROGRAM.format(work), str(int(number)), where]
    paths = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=paths)
    assert (done.returncode, "Traceback" in done.stderr, "internal" in done.stderr) == (code, False, False)
    assert done.stdout == "tidied up\n"


def test_file_names_that_are_not_utf_8_cause_no_internal_error(tmp_path, run):
    """Escapes stand for the bytes of such a name in files that are written."""
    name = os.fsdecode(b"\xff\xfe.yaml")
    (tmp_path / name).write_text((ROOT / "specs" / "first_order_given.yaml").read_text())
    assert run("analyse", name, "-q", "--no-figures", "-o", "run") == (0, "", "")
    assert json.loads((tmp_path / "run" / "result.json").read_text())["made_from"] == [f"../{name}"]
    assert shell(f"{IDESIGN} report '{name}' -q", tmp_path)[0] == 2


class Shown:
    def __init__(self):
        self.text = ""

    def isatty(self):
        return True

    def write(self, text):
        self.text += text

    def flush(self):
        pass


def shown_by(monkeypatch):
    """A terminal in place of standard error."""
    monkeypatch.setenv("TERM", "xterm")
    shown = Shown()
    monkeypatch.setattr(sys, "stderr", shown)
    return shown


def test_a_long_computation_shows_its_progress(monkeypatch):
    terminal = shown_by(monkeypatch)
    with computing("log.csv", quiet=False):
        report_progress(Counted("starting points tried", 3, 30))
        time.sleep(0.3)
    assert "log.csv: computing ..." in terminal.text
    assert "3 of 30" not in terminal.text, "there is no need to say so at once"
    monkeypatch.setattr(terminal_module, "_PATIENCE", 0.0)
    with computing("log.csv", quiet=False):
        report_progress(Counted("starting points tried", 3, 30))
        time.sleep(0.3)
    assert "log.csv: starting points tried: 3 of 30 ..." in terminal.text
    terminal.text = ""
    with computing("log.csv", quiet=True):
        report_progress(Counted("starting points tried", 3, 30))
    assert terminal.text == ""


@pytest.mark.parametrize(
    ("variables", "expected"),
    [({}, True), ({"NO_COLOR": "1"}, False), ({"NO_COLOR": ""}, True), ({"TERM": "dumb"}, False)],
)
def test_no_color_and_dumb_terminals_switch_colours_off(monkeypatch, variables, expected):
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert colourful(Shown()) is expected


def test_progress_is_shown_on_a_terminal_alone_and_cleared(monkeypatch, tmp_path, capsys):
    with (tmp_path / "log").open("w") as file:
        assert not colourful(file)
    with status("working", quiet=False):
        pass
    assert capsys.readouterr() == ("", "")
    terminal = shown_by(monkeypatch)
    with status("[working] on it", quiet=False):
        pass
    assert "[working] on it" in terminal.text
    assert terminal.text.endswith("\x1b[2K")


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
