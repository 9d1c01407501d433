"""A sweep that is killed again and again comes to the same end as one that is left alone."""

import os
import random
import signal
import subprocess
import sys
import time

import pytest

from tests.support.processes import running
from tests.support.sweep_files import timeless_files, timeless_rows


def command(spec, out, points):
    settings = ["--set", f"experiment.samples=51:{50 + points}:1", "--set", "spectrum.order=1,-1,3"]
    return [sys.executable, "-m", "inputdesign_cli", "sweep", str(spec), *settings, "-j", "2", "-o", str(out)]


def whole_points(out):
    """The results that count: half-written runs have names that begin with a dot."""
    return [path for path in out.glob("points/*/result.json") if not path.parent.name.startswith(".")]


def kill_at_random(spec, out, points, kills, seed):
    """Start the sweep `kills` times and kill it each time; how many points stood at each kill."""
    rng = random.Random(seed)
    stood = []
    for kill in range(kills):
        with running(command(spec, out, points), start_new_session=True) as process:
            begun = time.monotonic()
            before = len(whole_points(out))
            # Some kills hit the start; the others come at a random moment after a first new point.
            if kill % 4:
                while len(whole_points(out)) <= before and process.poll() is None:
                    time.sleep(0.005)
                    assert time.monotonic() < begun + 60
                time.sleep(rng.uniform(0.0, 0.12))
            else:
                time.sleep(rng.uniform(0.05, 0.8))
            if kill % 2:
                os.killpg(process.pid, signal.SIGKILL)
            else:
                process.kill()  # its workers must find out by themselves
        stood.append(len(whole_points(out)))
    return stood


@pytest.mark.slow
def test_an_interrupt_from_the_terminal_ends_everything_in_order(spec, tmp_path):
    out = tmp_path / "out"
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with running(command(spec, out, 200), start_new_session=True, **pipes) as process:
        while not whole_points(out):
            time.sleep(0.01)
        os.killpg(process.pid, signal.SIGINT)
        stdout, stderr = process.communicate(timeout=30)
    assert process.returncode == 130
    assert stdout == ""
    assert stderr == f"what is done is in {out}; the same command finishes the rest\ninterrupted\n"
    statuses = {row["status"] for row in timeless_rows(out)}
    assert {"pending", "optimal"} <= statuses


@pytest.mark.slow
@pytest.mark.parametrize(
    ("points", "kills"), [(5, 3), pytest.param(120, 20, marks=pytest.mark.slow)], ids=["few", "twenty"]
)
def test_a_killed_sweep_is_finished_by_the_same_command(spec, tmp_path, points, kills):
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    stood = kill_at_random(spec, killed, points, kills, seed=1)
    assert stood[0] < 2 * points, "the first kill came too late to test anything"
    assert stood == sorted(stood)
    times = {path: path.stat().st_mtime_ns for path in whole_points(killed)}
    subprocess.run([*command(spec, killed, points), "--quiet"], check=True)
    assert all(path.stat().st_mtime_ns == time for path, time in times.items()), "a point was computed twice"
    subprocess.run([*command(spec, whole, points), "--quiet"], check=True)
    assert timeless_rows(killed) == timeless_rows(whole)
    assert len(timeless_rows(whole)) == 3 * points
    assert timeless_files(killed) == timeless_files(whole)
    assert {p.name for p in killed.rglob("*")} == {p.name for p in whole.rglob("*")}
