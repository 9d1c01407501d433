"""`idesign sweep` and `idesign report`: their output, files and exit codes."""

import json
from types import SimpleNamespace

import pytest

from inputdesign_cli.cli.options import error_codes, spec_keys
from inputdesign_cli.cli.sweep import pace
from inputdesign_cli.compute.executor import ONE_THREAD
from tests.support.sweep_files import SPEC


@pytest.fixture
def run(run, monkeypatch, tmp_path):
    """Run `idesign` in a folder with a spec: its exit code, stdout and stderr."""
    (tmp_path / "small.yaml").write_text(SPEC)
    for name in ONE_THREAD:
        monkeypatch.setenv(name, "1")
    return run


def test_a_sweep_is_run_resumed_and_reported(run, tmp_path):
    settings = ["--set", "experiment.samples=50,60", "--set", "spectrum.order=-1,1"]
    code, out, err = run("sweep", "small.yaml", *settings, "--dry-run")
    assert (code, err) == (0, "")
    assert "4 points: 4 pending" in out
    assert not (tmp_path / "runs").exists()
    code, out, err = run("sweep", "small.yaml", *settings)
    assert (code, err) == (0, "")
    for part in ("4: 2 invalid, 2 optimal", "[out-of-range]", "--set spectrum.order=-1", "runs/small-sweep"):
        assert part in out
    code, out, _ = run("sweep", "small.yaml", *settings, "--dry-run", "--json")
    assert [point["status"] for point in json.loads(out)] == ["failed", "done", "failed", "done"]
    assert json.loads(out)[1]["settings"] == {"experiment.samples": "50", "spectrum.order": "1"}
    code, out, _ = run("sweep", "small.yaml", *settings, "--json")
    assert (code, json.loads(out)["statuses"]) == (0, {"invalid": 2, "optimal": 2})
    assert run("sweep", "small.yaml", *settings, "--quiet") == (0, "", "")
    code, out, err = run("report", "runs/small-sweep")
    assert (code, out, err) == (0, "runs/small-sweep/report.html\n", "")
    assert (tmp_path / "runs" / "small-sweep" / "report.html").read_text().startswith("<!DOCTYPE html>")
    run("report", "runs/small-sweep", "-o", "page.html", "--quiet")
    assert (tmp_path / "page.html").exists()


def test_a_sweep_without_any_result_ends_as_its_first_failure(run):
    setting = "accuracy.model_error={table: a.csv},{table: b.csv}"
    code, out, err = run("sweep", "small.yaml", "--set", setting)
    assert code == 2
    assert "2: 2 invalid" in out
    assert "data-unreadable" in err


def test_fail_fast_ends_with_the_code_of_the_failure(run):
    code, out, err = run("sweep", "small.yaml", "--set", "spectrum.order=1,-1,2", "--fail-fast")
    assert (code, out) == (2, "")
    assert "out-of-range" in err
    assert "(at --set spectrum.order=-1)" in err


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ([], "sweep-empty"),
        (["--set", "spectrum.order=1,2", "--set", "noise.variance=1,2,3", "--zip"], "sweep-lengths"),
        (["--set", "spectrum.order=1,2", "-o", "small.yaml"], "output-not-a-directory"),
        (["--set", "spectrum.order=1,2", "-o", "."], "output-not-a-sweep"),
    ],
)
def test_errors_of_a_sweep_are_reported_before_anything_is_written(run, tmp_path, arguments, code):
    ended, out, err = run("sweep", "small.yaml", *arguments)
    assert (ended, out) == (2, "")
    assert code in err
    assert [path.name for path in tmp_path.iterdir()] == ["small.yaml"]


def test_the_pace_of_a_sweep_counts_only_points_that_were_computed_now():
    progress = lambda *counts: SimpleNamespace(  # noqa: E731
        **dict(zip(("total", "passed", "computed", "failed"), counts, strict=True))
    )
    assert pace(progress(100, 50, 25, 0), 5.0) == "50/100  5 points/s  0:00:10 left"
    assert pace(progress(100, 50, 25, 3), 5.0).endswith("left  3 without a result")
    assert pace(progress(10, 0, 0, 0), 0.0) == "0/10"


def test_completion_knows_codes_and_keys():
    assert ("sweep-empty", "The sweep varies nothing") in error_codes("sweep-")
    assert spec_keys("experiment.sa") == ["experiment.samples="]
    assert "accuracy.model_error.relative=" in spec_keys("accuracy.")
    assert spec_keys("spectrum.order=") == []
    assert spec_keys("spectrum.type=f") == ["spectrum.type=fir", "spectrum.type=free"]
    assert spec_keys("accuracy.criterion=") == [f"accuracy.criterion={letter}" for letter in "DAET"]
    assert len(spec_keys("spectrum.order")) == 1
