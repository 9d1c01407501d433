"""Figures by a second process: the same files, and none lost when it fails."""

import os
import pickle
import subprocess
import sys

import pytest

import inputdesign_cli
from inputdesign_cli.figures import second_process as module
from inputdesign_cli.figures.plots import draw_all
from inputdesign_cli.figures.second_process import second_process

SPEC = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {variance: 1.0}
experiment: {samples: 100}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 2}
"""
SCRIPT = """
import os, pickle, signal, sys
from inputdesign_cli import parse_spec, solve
from inputdesign_cli.figures.second_process import second_process
os.sched_getaffinity = lambda _: {0, 1}
with second_process(wanted=True) as drawing:
    assert drawing._process is not None
    if sys.argv[2] == "killed":
        os.kill(drawing._process.pid, signal.SIGKILL)
    drawn = drawing.draw_all(solve(parse_spec(sys.argv[1])), "png")
    assert ("matplotlib" in sys.modules) == (sys.argv[2] == "killed")
assert drawing._process.poll() is not None
sys.stdout.buffer.write(pickle.dumps(drawn))
"""


@pytest.mark.parametrize("fate", ["alive", "killed"])
def test_figures_are_those_that_are_drawn_here(fate, tmp_path):
    # A module of the user's own of the same name must not be taken for ours.
    (tmp_path / "numpy.py").write_text("raise SystemExit('wrong numpy')\n")
    command = [sys.executable, "-P", "-c", SCRIPT, SPEC, fate]
    done = subprocess.run(command, capture_output=True, cwd=tmp_path, check=True, timeout=120)
    results = inputdesign_cli.solve(inputdesign_cli.parse_spec(SPEC))
    assert pickle.loads(done.stdout) == draw_all(results)


@pytest.mark.parametrize(("processors", "begun"), [(1, False), (2, True), (8, True)])
def test_it_begins_where_there_is_another_processor(processors, begun, monkeypatch):
    started = []
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(processors)))
    monkeypatch.setattr(module.sys, "modules", {})
    monkeypatch.setattr(module.subprocess, "Popen", lambda *_, **__: started.append(1))
    with second_process(wanted=True):
        assert bool(started) == begun


def test_nothing_begins_where_no_figures_are_wanted(monkeypatch):
    monkeypatch.setattr(module.subprocess, "Popen", lambda *_, **__: pytest.fail("begun"))
    with second_process(wanted=False):
        pass
