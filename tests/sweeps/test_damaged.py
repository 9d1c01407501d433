"""Results of an earlier call are checked before they are used; another sweep does not replace them."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time

import pytest

from inputdesign_cli.errors import DataError, OutputError
from inputdesign_cli.report.render import report_text
from inputdesign_cli.sweeps.plan import build_plan
from inputdesign_cli.sweeps.running import list_points
from tests.support.processes import running
from tests.support.sweep_files import SPEC, rows, run_sweep, timeless_files, timeless_rows

SETTINGS = ["experiment.samples=60,80"]


@pytest.fixture(scope="module")
def designed(tmp_path_factory):
    """A sweep of real designs."""
    folder = tmp_path_factory.mktemp("swept")
    (folder / "small.yaml").write_text(SPEC)
    run_sweep(folder / "small.yaml", SETTINGS, directory=folder / "out")
    return folder / "out"


@pytest.fixture
def swept(spec, designed, tmp_path):
    """A copy of the sweep of real designs, and the folder of its first point."""
    out = shutil.copytree(designed, tmp_path / "out")
    return out, out / rows(out)[0]["run"]


def edited(**changes):
    def edit(run):
        result = json.loads((run / "result.json").read_text())
        result["objective"] |= changes
        (run / "result.json").write_text(json.dumps(result))

    return edit


DAMAGES = {
    "an infinite value": edited(value=float("inf")),
    "cut": lambda run: (run / "result.json").write_bytes((run / "result.json").read_bytes()[:300]),
    "empty": lambda run: (run / "result.json").write_bytes(b""),
    "no result": lambda run: (run / "result.json").write_text('{"format": 1}'),
    "a list": lambda run: (run / "result.json").write_text("[1]"),
    "another spec": lambda run: (run / "spec.yaml").write_text("plant: {B: [0, 1]}\n"),
    "a file that is gone": lambda run: (run / "spectrum.csv").unlink(),
}


@pytest.mark.first(1)
@pytest.mark.parametrize("name", DAMAGES)
def test_a_damaged_point_is_computed_again_and_reported(name, swept, spec):
    out, run = swept
    whole, table = timeless_files(out), timeless_rows(out)
    DAMAGES[name](run)
    statuses = [point.status for point in list_points(build_plan(spec, SETTINGS), out)]
    assert statuses == ["damaged", "done"]
    with pytest.raises(DataError, match=run.name):
        report_text(out)
    done = run_sweep(spec, SETTINGS, directory=out)
    assert (done.computed, len(done.damaged)) == (1, 1)
    assert run.name in done.damaged[0]
    assert timeless_files(out) == whole
    assert timeless_rows(out) == table
    assert run_sweep(spec, SETTINGS, directory=out).damaged == []


def test_the_run_of_another_point_is_not_accepted(swept, spec):
    out, run = swept
    whole = timeless_files(out)
    shutil.rmtree(run)
    shutil.copytree(out / rows(out)[1]["run"], run)
    assert run_sweep(spec, SETTINGS, directory=out).computed == 1
    assert timeless_files(out) == whole


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"status": "optimal", "code": "x"}', "null"])
def test_a_damaged_failure_is_computed_again(content, spec, stub, tmp_path):
    out, settings = tmp_path / "out", ["experiment.samples=7,10"]
    run_sweep(spec, settings, directory=out)
    whole = timeless_files(out)
    (failure,) = (out / "failures").iterdir()
    failure.write_text(content)
    done = run_sweep(spec, settings, directory=out)
    assert (done.computed, len(done.damaged)) == (1, 1)
    assert failure.name in done.damaged[0]
    assert timeless_files(out) == whole
    assert "seven is too few" in str(done.first_failure)


def test_a_damaged_point_that_is_not_reached_has_no_row(spec, stub, tmp_path):
    out = tmp_path / "out"
    run_sweep(spec, ["experiment.samples=10,20"], directory=out)
    edited(value=float("inf"))(out / rows(out)[1]["run"])
    with pytest.raises(Exception, match="seven"):
        run_sweep(spec, ["experiment.samples=7,20"], directory=out, fail_fast=True)
    assert [row["status"] for row in rows(out)] == ["infeasible", "pending"]


@pytest.mark.first(2)
@pytest.mark.parametrize("change", ["spec", "title", "keys", "more keys", "verb"])
def test_another_sweep_replaces_a_sweep_only_with_overwrite(change, spec, stub, tmp_path):
    out = tmp_path / "out"
    run_sweep(spec, ["experiment.samples=10,20"], directory=out)
    other = tmp_path / "other.yaml"
    changes = ("small", "large") if change == "title" else ("variance: 1", "variance: 2")
    other.write_text(spec.read_text().replace(*changes))
    before = {name: (out / name).read_bytes() for name in ("sweep.csv", "sweep.yaml", "sweep.json")}
    arguments = {
        "spec": {"spec": other},
        "title": {"spec": other},
        "keys": {"settings": ["spectrum.order=0,1"]},
        "more keys": {"settings": ["experiment.samples=10,20", "spectrum.order=0,1"]},
        "verb": {"verb": "analyse"},
    }[change]
    arguments = {"spec": spec, "settings": ["experiment.samples=10,20"], **arguments}
    with pytest.raises(OutputError, match="would lose its table") as caught:
        run_sweep(**arguments, directory=out)
    assert "--overwrite" in caught.value.diagnostics[0].hint
    assert {name: (out / name).read_bytes() for name in before} == before
    run_sweep(**arguments, directory=out, overwrite=True)
    assert (out / "sweep.csv").read_bytes() != before["sweep.csv"]


def test_a_sweep_goes_on_from_a_copy_of_its_spec_and_an_edited_spec_replaces_it(spec, stub, tmp_path):
    out = tmp_path / "out"
    run_sweep(spec, ["experiment.samples=10,20"], directory=out)
    copy = tmp_path / "copy.yaml"
    shutil.copy(spec, copy)
    assert run_sweep(copy, ["experiment.samples=10,20,30"], directory=out).computed == 1
    copy.write_text(copy.read_text().replace("variance: 1", "variance: 2"))
    for computed, replaced in ((3, True), (0, False)):
        done = run_sweep(copy, ["experiment.samples=10,20,30"], directory=out)
        assert (done.computed, done.replaced) == (computed, replaced)


def command(spec, out, points):
    settings = ["--set", f"experiment.samples=51:{50 + points}:1", "--set", "spectrum.order=1,-1,3"]
    return [sys.executable, "-m", "inputdesign_cli", "sweep", str(spec), *settings, "-j", "2", "-o", str(out)]


def whole_points(out):
    """The results that count: half-written runs have names that begin with a dot."""
    return [path for path in out.glob("points/*/result.json") if not path.parent.name.startswith(".")]


def kill_at_random(spec, out, points, kills, seed):
    """Start the sweep `kills` times and kill it each time; return the number of points at each kill."""
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
                process.kill()  # its workers must notice that
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
@pytest.mark.parametrize(("points", "kills"), [(5, 3), (120, 20)], ids=["few", "twenty"])
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
