"""`idesign wizard`, without a terminal and in one, and with answers in a file."""

import io
import os
import pty
import re
import select
import subprocess
import sys
import time
from itertools import pairwise

import pytest
import yaml

from inputdesign_cli.errors import SpecError
from inputdesign_cli.wizard.questions import KEYS, read_answers
from tests.wizard.test_faults import GOOD

ANSWERS = [
    "plant=gain 2, time constant 180 s, dead time 25 s",
    "wish=own loop with 6 dB, Kp 1.5, Ti 180",
    "range=plus/minus 5 around 40",
    "time=20 min",
    "noise=resolution 0.1",
]


# Typed answers, by a part of the question: bad ones first. Control-U deletes the default.
TYPED = [
    ("know of the plant", "a kettle"),
    ("know of the plant", "gain 2, time constant 180 s, dead time 25 s"),
    ("model for", "PI loop"),
    ("model for", "own loop with 6 dB, Kp 1.5, Ti 180"),
    ("input move?", "plus/minus 5 around 40"),
    ("How much time", "\x15soon"),
    ("How much time", "\x1520 min"),
    ("how far the output", ""),
    ("noise of the output", ""),
    ("noise of the output", "resolution 0.1"),
    ("Does the output drift", ""),
    ("open loop, or under", "\x15open"),
    ("hardware apply", ""),
    ("keep each position", ""),
    ("which steps", "\x15square"),
    ("which steps", ""),
    ("where it began", ""),
    ("called", ""),
    ("Design the experiment now", "n"),
]


class Terminal:
    """A command in a pseudo-terminal, and the text that it has shown there."""

    def __init__(self, folder, *command):
        ours, theirs = pty.openpty()
        ends = {"stdin": theirs, "stdout": theirs, "stderr": theirs}
        self.process = subprocess.Popen(command, cwd=folder, env={**os.environ, "TERM": "xterm"}, **ends)
        os.close(theirs)
        self.end, self.shown, self.seen = ours, "", 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        os.close(self.end)

    def wait_for(self, part, patience=60.0):
        """Read until the part is shown, after the part that was waited for before."""
        latest = time.monotonic() + patience
        while part not in self.shown[self.seen :]:
            assert select.select([self.end], [], [], latest - time.monotonic())[0], f"{part}: {self.shown}"
            try:
                text = os.read(self.end, 65536).decode(errors="replace")
            except OSError:  # the other end is closed
                text = ""
            assert text, f"{part}: {self.shown}"
            self.shown += re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", text)
            if "\x1b[6n" in text:  # where is the cursor?
                self.type("\x1b[1;1R")
        self.seen = self.shown.index(part, self.seen) + len(part)

    def type(self, text):
        os.write(self.end, text.encode())


@pytest.mark.slow
def test_in_a_terminal_a_bad_answer_is_asked_again(tmp_path):
    with Terminal(tmp_path, sys.executable, "-m", "inputdesign_cli", "wizard") as terminal:
        for part, text in TYPED:
            terminal.wait_for(part)
            terminal.type(f"{text}\r")
        assert terminal.process.wait(60) == 0
    assert terminal.shown.count("error[bad-answer]") == 5
    written = yaml.safe_load((tmp_path / "experiment.yaml").read_text())
    assert (written["limits"]["duration"], written["signal"]["offset"]) == (1200, 40)


@pytest.mark.first(1)
@pytest.mark.parametrize("key", ["\x03", "\x04"])
def test_control_c_and_d_end_the_questions(key, tmp_path):
    with Terminal(tmp_path, sys.executable, "-m", "inputdesign_cli", "wizard") as terminal:
        terminal.wait_for("know of the plant?")
        terminal.type(key)
        terminal.wait_for("interrupted")
        assert terminal.process.wait(60) == 130
    assert not list(tmp_path.iterdir())


def test_without_a_terminal_missing_answers_are_an_error(run, tmp_path, monkeypatch):
    """Lines of standard input that end too early are an error, too."""
    code, out, err = run("wizard")
    assert (code, out) == (2, "")
    assert "no-terminal" in err
    monkeypatch.setattr("sys.stdin", io.StringIO("gain 2, time constant 180 s\n"))
    code, _, err = run("wizard")
    assert (code, "(wish)" in err) == (2, True)
    assert not (tmp_path / "experiment.yaml").exists()


def test_answers_make_a_spec_that_is_accepted(run, tmp_path):
    options = [part for text in ANSWERS for part in ("--answer", text)]
    code, out, err = run("wizard", *options, "-o", "mine.yaml")
    assert (code, err) == (0, "")
    assert "mine.yaml: written" in out
    text = (tmp_path / "mine.yaml").read_text()
    assert "filtered noise of order 20: at the plant above no spectrum gains more than" in text
    assert yaml.safe_load(text)["accuracy"]["loop"]["controller"]["pid"] == {"Kp": 1.5, "Ti": 180}
    assert run("validate", "mine.yaml")[0] == 0
    code, _, err = run("wizard", *options, "-o", "mine.yaml")
    assert (code, "output-exists" in err) == (2, True)
    code, _, err = run("wizard", *options, "-o", "other.yaml", "--answer", "time=soon")
    assert (code, "bad-answer" in err, "How much time" in err) == (2, True, True)


SENTENCE = (
    "Own loop with 6 dB, Kp 1.5, Ti 180; gain 2 degC/%, time constant 180 s, dead time 25 s, "
    "valve 40 +- 5 %, 20 min, noise of 0.1 degC, white"
)


@pytest.mark.slow
def test_a_missing_folder_is_refused_before_any_question(run, tmp_path, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO("no\n"))
    code, _, err = run("wizard", SENTENCE, "-o", "new/mine.yaml")
    assert (code, err.count("error[output-not-writable]")) == (2, 1)
    assert sys.stdin.readline() == "no\n"


def test_specs_of_one_name_in_two_folders_have_separate_runs(run, tmp_path, monkeypatch):
    monkeypatch.setattr("inputdesign_cli.wizard.composing.with_spectrum", lambda draft, solve: draft)
    monkeypatch.setattr("inputdesign_cli.wizard.solving.verdict", lambda *_: [])
    for folder in ("tank", "room"):
        (tmp_path / folder).mkdir()
        code, _, err = run(
            *("wizard", SENTENCE, "-o", f"{folder}/mine.yaml", "--solve", "-a", "hold=no", "-a", "return=no"),
            *("-a", "converter=no", "-a", "time=10 min"),
        )
        assert code == 0, err
        assert (tmp_path / "runs" / f"{folder}_mine" / "signal.csv").is_file()


def test_a_pipe_answers_as_a_terminal_does(run, tmp_path, monkeypatch):
    """A wrong line ends the wizard, as later lines answer other questions; defaults fill missing lines."""
    monkeypatch.setattr("inputdesign_cli.wizard.composing.with_spectrum", lambda draft, solve: draft)
    monkeypatch.setattr("sys.stdin", io.StringIO("soon\n1 min\n"))
    code, out, err = run("wizard", SENTENCE, "-o", "mine.yaml")
    assert (code, err.count("error[bad-answer]")) == (2, 1)
    assert not (tmp_path / "mine.yaml").exists()
    monkeypatch.setattr("sys.stdin", io.StringIO("converter: steps of 0.1\n60000 ms\n"))
    code, out, err = run("wizard", SENTENCE, "-o", "mine.yaml")
    assert (code, err.count("error[bad-answer]")) == (0, 0)
    assert "How long must the actuator keep each position? (Enter: no) 60000 ms" in err
    assert "mine.yaml: written" in out
    written = yaml.safe_load((tmp_path / "mine.yaml").read_text())
    assert written["channels"] == {"u1": {"name": "valve", "unit": "%"}, "y1": {"unit": "degC"}}
    assert (written["signal"]["hold"], written["limits"]["duration"]) == (12, 1200)
    assert written["signal"]["quantisation"] == {"bits": 10, "range": 51.2}
    assert run("validate", "mine.yaml")[0] == 0


def test_a_trade_off_is_a_sweep_with_a_table(run, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})  # no other processes
    spec = (
        "plant: {B: [0, 1], F: [1, -0.8]}\nnoise: {variance: 1}\nexperiment: {samples: 40}\n"
        "accuracy: {standard_deviation: {b1: 0.5}}\nlimits: {amplitude: 2}\n"
        "spectrum: {type: multisine, lines: 8}\nsignal: {candidates: 1}\n"
    )
    (tmp_path / "small.yaml").write_text(spec)
    command = ("solve", "small.yaml", "--fast", "--no-figures", "--figure-format", "svg", "--trade")
    code, out, _ = run(*command, "samples,amplitude")
    assert (code, "trade.svg" in out) == (0, True)
    rows = [line.split() for line in out.split("error / asked")[1].splitlines()[:4]]
    assert rows[0] == ["10", "s", "20", "s", "40", "s", "80", "s"]
    cells = {row[1]: [float(cell) for cell in row[2:]] for row in rows[1:]}
    assert list(cells) == ["1.0", "2.0", "4.0"]
    # Errors fall with time and with amplitude.
    assert all(a > b for row in cells.values() for a, b in pairwise(row))
    assert all(a > b > c for a, b, c in zip(*cells.values(), strict=True))
    for words in ("colour", "", "samples,"):
        code, _, err = run("solve", "small.yaml", "--trade", words)
        assert (code, "neither samples nor amplitude" in err) == (2, True)
    (tmp_path / "free.yaml").write_text(spec.replace("limits: {amplitude: 2}\n", ""))
    code, _, err = run("solve", "free.yaml", "--trade", "samples")
    assert (code, "error[needs-limits] --trade" in err) == (2, True)
    assert not (tmp_path / "runs" / "free").exists()
    drawn = {path.name for path in (tmp_path / "runs" / "small-trade").iterdir() if path.stem != "sweep"}
    assert {"trade.svg", "curves.svg"} <= drawn
    assert not any(name.endswith((".png", ".pdf")) for name in drawn)


def test_the_spec_does_not_overwrite_the_file_of_answers(run, tmp_path):
    answers = tmp_path / "a.yaml"
    text = "".join(f"{key}: {told}\n" for key, told in (one.split("=", 1) for one in ANSWERS))
    answers.write_text(text)
    code, _, err = run("wizard", "--answers", answers, "-o", answers, "--overwrite", "--no-solve")
    assert code == 2
    assert "holds the answers" in err
    assert answers.read_text() == text


@pytest.mark.parametrize("key", KEYS)
def test_a_wrong_answer_in_a_file_is_reported_with_its_line(run, tmp_path, key):
    file = tmp_path / "a.yaml"
    said = {name: text for name, text in GOOD.items() if name != key} | {key: "a kettle"}
    file.write_text("".join(f'{name}: "{text}"\n' for name, text in said.items()))
    code, _, err = run("wizard", "--answers", file, "-o", tmp_path / "s.yaml", "--no-solve")
    assert code == 2
    assert err.startswith(f"{file}:{list(said).index(key) + 1}:{len(key) + 3}: error[")
    assert f"({key})" in err


@pytest.mark.parametrize(
    ("text", "line", "told"),
    [
        *((f"\n{key}: {value}\n", 2, f"the answer to {key} is a (list|mapping)")
          for key in KEYS for value in ("[1, 2]", "{a: 1}", "[]")),
        *((text, 1, "a mapping of questions") for text in ("", "- a\n", "text\n")),
        ("plant: heater\nplnat: heater\n", 2, "plnat"),
    ],
)  # fmt: skip
def test_malformed_files_of_answers_are_refused_with_the_line(tmp_path, text, line, told):
    file = tmp_path / "a.yaml"
    file.write_text(text)
    with pytest.raises(SpecError, match=told) as error:
        read_answers(file)
    place = error.value.diagnostics[0].location
    assert (place.file, place.line) == (str(file), line)


def test_missing_answers_are_reported_for_the_file_and_options_without_a_line(run, tmp_path):
    file = tmp_path / "a.yaml"
    command = ("wizard", "--answers", file, "-o", tmp_path / "s.yaml", "--no-solve")
    file.write_text("plant: heater\n")
    code, _, err = run(*command)
    assert code == 2
    assert err.startswith(f"{file}:1:1: error[bad-answer] What is the model for? (wish)")
    file.write_text("".join(f'{name}: "{text}"\n' for name, text in GOOD.items()))
    code, _, err = run(*command, "-a", "time=never")
    assert code == 2
    assert err.startswith("error[bad-answer] How much time is there? (time)")
