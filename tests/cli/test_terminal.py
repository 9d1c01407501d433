"""Colours, progress and columns: on terminals, and nowhere else."""

import sys
import time

import pytest

from inputdesign_cli.cli import terminal as terminal_module
from inputdesign_cli.cli.terminal import aligned, colourful, computing, status
from inputdesign_cli.compute.watching import Counted, tell


class Terminal:
    def __init__(self):
        self.text = ""

    def isatty(self):
        return True

    def write(self, text):
        self.text += text

    def flush(self):
        pass


def test_a_long_computation_tells_how_far_it_is(monkeypatch):
    monkeypatch.setenv("TERM", "xterm")
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with computing("log.csv", quiet=False):
        tell(Counted("starting points tried", 3, 30))
        time.sleep(0.3)
    assert "log.csv: computing ..." in terminal.text
    assert "3 of 30" not in terminal.text, "there is no need to tell at once"
    monkeypatch.setattr(terminal_module, "_PATIENCE", 0.0)
    with computing("log.csv", quiet=False):
        tell(Counted("starting points tried", 3, 30))
        time.sleep(0.3)
    assert "log.csv: starting points tried: 3 of 30 ..." in terminal.text
    terminal.text = ""
    with computing("log.csv", quiet=True):
        tell(Counted("starting points tried", 3, 30))
    assert terminal.text == ""


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
