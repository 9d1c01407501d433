"""A sweep runs every point once, notes what fails, and never mixes with anything else."""

import hashlib
import json
import multiprocessing
import subprocess
import sys

import pytest

from inputdesign_cli.compute.processes import Processes
from inputdesign_cli.errors import DataError, InfeasibleError, OutputError, SpecError
from inputdesign_cli.figures.sweep_table import read_sweep
from inputdesign_cli.sweeps.layout import Layout
from inputdesign_cli.sweeps.plan import build_plan
from inputdesign_cli.sweeps.running import list_points
from inputdesign_cli.sweeps.table import Row, scalars, table_lines
from tests.support.processes import running
from tests.support.sweep_files import rows, run_sweep, timeless_files, timeless_rows


def test_every_point_is_a_row_and_a_run(spec, stub, tmp_path):
    seen = []
    out = tmp_path / "out"
    done = run_sweep(
        spec,
        ["experiment.samples=10,20", "spectrum.order=0:2:1"],
        directory=out,
        watch=lambda p: seen.append((p.passed, p.computed)),
    )
    assert done.statuses == {"optimal": 6}
    table = rows(out)
    assert [(r["experiment.samples"], r["spectrum.order"]) for r in table] == [
        (n, m) for n in ("10", "20") for m in ("0", "1", "2")
    ]
    assert float(table[0]["objective.value"]) == 11.0
    assert float(table[5]["power.input[0]"]) == 5.0 + 1.0 / 3.0
    assert all(float(row["time_s"]) >= 0 for row in table)
    for row in table:
        run = out / row["run"]
        result = json.loads((run / "result.json").read_text())
        assert result["objective"]["value"] == float(row["objective.value"])
        assert f"order: {row['spectrum.order']}" in (run / "spec.yaml").read_text()
        assert "sweep" not in (run / "spec.yaml").read_text()
    assert {p.name for p in out.iterdir()} == {
        "sweep.csv", "sweep.json", "sweep.yaml", "points", "curves.png", "map.png", ".lock", ".process"
    }  # fmt: skip
    assert seen == [(i, i) for i in range(1, 7)]


def test_a_second_call_computes_nothing_and_a_wider_one_the_rest(spec, stub, tmp_path):
    out = tmp_path / "out"
    run_sweep(spec, ["experiment.samples=10,20"], directory=out)
    before = timeless_files(out)
    assert run_sweep(spec, ["experiment.samples=10,20"], directory=out).computed == 0
    assert timeless_files(out) == before
    assert run_sweep(spec, ["experiment.samples=10,20,30"], directory=out).computed == 1
    assert stub == [10, 20, 30]
    assert [row["experiment.samples"] for row in rows(out)] == ["10", "20", "30"]


def test_the_sweep_is_repeated_by_its_own_spec(spec, stub, tmp_path):
    out = tmp_path / "out"
    run_sweep(spec, ["experiment.samples=10,20", "noise.variance=2"], directory=out)
    assert run_sweep(out / "sweep.yaml", directory=out).computed == 0


def test_points_that_say_the_same_are_computed_once(spec, stub, tmp_path):
    done = run_sweep(spec, ["experiment.samples=10,10.0,1e1"], directory=tmp_path / "out")
    assert (stub, done.statuses) == ([10], {"optimal": 3})


def test_failures_are_rows_with_reasons(spec, stub, tmp_path):
    out = tmp_path / "out"
    done = run_sweep(spec, ["experiment.samples=6,7,8,9,-1,10"], directory=out)
    table = rows(out)
    assert [row["status"] for row in table] == [
        "optimal", "infeasible", "inaccurate", "error", "invalid", "optimal"
    ]  # fmt: skip
    assert [row["code"] for row in table] == [
        "", "not-supported", "gap-not-closed", "internal-error", "out-of-range", ""
    ]  # fmt: skip
    assert table[1]["reason"] == "seven is too few"
    assert "ZeroDivisionError: nine" in table[3]["reason"]
    assert done.failures == 4
    assert isinstance(done.first_failure, InfeasibleError)
    assert "--set experiment.samples=7" in done.first_failure.diagnostics[0].message
    assert stub == [6, 7, 8, 9, 10]
    again = run_sweep(spec, ["experiment.samples=6,7,8,9,-1,10"], directory=out)
    assert (again.computed, again.failures) == (0, 4)
    retried = run_sweep(spec, ["experiment.samples=6,7,8,9,-1,10"], directory=out, rerun_failed=True)
    assert retried.computed == 4
    assert stub[5:] == [7, 8, 9]


def test_a_failure_that_is_mended_leaves_no_trace(spec, stub, tmp_path, monkeypatch):
    out = tmp_path / "out"
    run_sweep(spec, ["experiment.samples=6,7"], directory=out)
    from inputdesign_cli import questions

    solve = questions.solve
    monkeypatch.setattr(questions, "solve", lambda s: solve(s.model_copy(update={"experiment": six(s)})))
    assert run_sweep(spec, ["experiment.samples=6,7"], directory=out, rerun_failed=True).failures == 0
    assert list((out / "failures").iterdir()) == []


def six(spec):
    return spec.experiment.model_copy(update={"samples": 6})


def test_fail_fast_stops_and_keeps_what_is_done(spec, stub, tmp_path):
    out = tmp_path / "out"
    for _ in range(2):
        with pytest.raises(InfeasibleError):
            run_sweep(spec, ["experiment.samples=6,7,10"], directory=out, fail_fast=True)
        assert [row["status"] for row in rows(out)] == ["optimal", "infeasible", "pending"]
    assert stub == [6, 7]


def test_an_interrupt_leaves_a_table(spec, stub, tmp_path):
    def stop(progress):
        if progress.passed == 2:
            raise KeyboardInterrupt

    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        run_sweep(spec, ["experiment.samples=10,20,30"], directory=out, watch=stop)
    assert [row["status"] for row in rows(out)] == ["optimal", "optimal", "pending"]
    assert run_sweep(spec, ["experiment.samples=10,20,30"], directory=out).computed == 1


def test_a_misspelt_key_is_refused_before_anything_is_written(spec, stub, tmp_path):
    with pytest.raises(SpecError) as caught:
        run_sweep(spec, ["spectrum.ordr=1,2"], directory=tmp_path / "out")
    assert caught.value.diagnostics[0].code == "unknown-key"
    assert not (tmp_path / "out").exists()


def test_a_verb_that_is_not_there_is_refused(spec, tmp_path):
    with pytest.raises(SpecError) as caught:
        run_sweep(spec, ["experiment.samples=1,2"], directory=tmp_path / "out", verb="divine")
    assert caught.value.diagnostics[0].code == "not-supported"
    assert not (tmp_path / "out").exists()


def test_an_edited_data_file_is_another_point(tmp_path, stub):
    spec = tmp_path / "t.yaml"
    spec.write_text(
        "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 1}\naccuracy: {model_error: {table: r.csv}}\n"
    )
    (tmp_path / "r.csv").write_text("frequency,r_adm\n0.1,1\n3.2,1\n")
    setting = ["experiment.samples=10,20"]
    assert run_sweep(spec, setting, directory=tmp_path / "out").computed == 2
    assert run_sweep(spec, setting, directory=tmp_path / "out").computed == 0
    (tmp_path / "r.csv").write_text("frequency,r_adm\n0.1,2\n3.2,1\n")
    assert run_sweep(spec, setting, directory=tmp_path / "out").computed == 2


def test_swept_texts_are_no_formulas(spec, stub, tmp_path):
    out, titles = tmp_path / "out", ["=1+1", "+x", "-y", "@z", "-0.5", "'=1"]
    run_sweep(spec, [f"title={','.join(titles)}"], directory=out)
    assert [row["title"] for row in rows(out)] == ["'=1+1", "'+x", "'-y", "'@z", "-0.5", "''=1"]
    assert read_sweep(out).columns["title"] == titles


def test_listing_writes_nothing(spec, stub, tmp_path):
    out = tmp_path / "out"
    listed = list(list_points(build_plan(spec, ["experiment.samples=6,7"]), out))
    assert [point.status for point in listed] == ["pending", "pending"]
    assert not out.exists()
    run_sweep(spec, ["experiment.samples=6,7"], directory=out)
    listed = list(list_points(build_plan(spec, ["experiment.samples=6,7,8"]), out))
    assert [point.status for point in listed] == ["done", "failed", "pending"]
    assert (out / "points" / listed[0].key / "result.json").is_file()


def test_other_peoples_directories_are_left_alone(spec, stub, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "notes.txt").write_text("mine")
    with pytest.raises(OutputError) as caught:
        run_sweep(spec, ["experiment.samples=10,20"], directory=tmp_path / "out")
    assert caught.value.diagnostics[0].code == "output-not-a-sweep"
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["notes.txt"]
    with pytest.raises(OutputError) as caught:
        run_sweep(spec, ["experiment.samples=10,20"], directory=spec)
    assert caught.value.diagnostics[0].code == "output-not-a-directory"


HOLD = """
import sys, time
from pathlib import Path
from inputdesign_cli.sweeps.layout import opened
with opened(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_a_directory_is_swept_by_one_process_at_a_time(spec, stub, tmp_path):
    out = tmp_path / "out"
    with running([sys.executable, "-c", HOLD, str(out)], stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        with pytest.raises(OutputError) as caught:
            run_sweep(spec, ["experiment.samples=10,20"], directory=out)
        assert caught.value.diagnostics[0].code == "sweep-locked"
        assert f"process {holder.pid}" in caught.value.diagnostics[0].message
    assert run_sweep(spec, ["experiment.samples=10,20"], directory=out).computed == 2


def test_what_a_killed_process_left_half_written_is_removed(spec, stub, tmp_path):
    out = tmp_path / "out"
    run_sweep(spec, ["experiment.samples=10,20"], directory=out)
    (out / "points" / ".abc.partial-1").mkdir()
    (out / ".sweep.csv.partial-1").write_text("half")
    run_sweep(spec, ["experiment.samples=10,20"], directory=out)
    assert not list(out.rglob(".*partial*"))


def test_the_table_holds_short_lists_and_no_long_ones():
    result = {
        "a": [1.0, 2.0],
        "moments": {"R": [[1.0, 2.0], [2.0, 3.0]], "c": list(range(9))},
        "solver": {"n": 1},
    }
    assert scalars(result) == {
        "a[0]": 1.0, "a[1]": 2.0, "moments.R[0][0]": 1.0, "moments.R[0][1]": 2.0,
        "moments.R[1][0]": 2.0, "moments.R[1][1]": 3.0,
    }  # fmt: skip


def test_a_number_has_the_fewest_digits_that_can_be_read_back():
    """0.1 and a third in the digits of Python, a whole number without its point."""
    result = {"status": "optimal", "a": 0.1, "b": 1 / 3, "c": 2.0, "n": 7}
    head, row = table_lines(["samples"], [(("100",), Row.of("0", result))])
    found = dict(zip(head.strip().split(","), row.strip().split(","), strict=True))
    assert [found[name] for name in "abcn"] == ["0.1", "0.3333333333333333", "2", "7"]


@pytest.mark.slow
def test_processes_give_what_one_process_gives(spec, tmp_path):
    settings = ["experiment.samples=50,100,-1", "spectrum.order=1,2"]
    run_sweep(spec, settings, directory=tmp_path / "one")
    run_sweep(spec, settings, directory=tmp_path / "two", executor=Processes(2))
    assert timeless_rows(tmp_path / "one") == timeless_rows(tmp_path / "two")
    assert timeless_files(tmp_path / "one") == timeless_files(tmp_path / "two")
    assert multiprocessing.active_children() == []


def test_a_full_disc_ends_the_sweep(spec, stub, tmp_path, monkeypatch):
    def full(outcome, directory, figures):
        from inputdesign_cli.errors import Diagnostic

        raise OutputError(Diagnostic("output-full", "no space"))

    monkeypatch.setattr("inputdesign_cli.outcome.run_directory.write_run", full)
    with pytest.raises(OutputError):
        run_sweep(spec, ["experiment.samples=10,20"], directory=tmp_path / "out")
    assert [row["status"] for row in rows(tmp_path / "out")] == ["pending", "pending"]


@pytest.mark.parametrize(
    "files",
    [
        {"../../stray": b"x", "result.json": b"{}"},
        {"{outside}/stray": b"x", "result.json": b"{}"},
        {"..": b"x", "result.json": b"{}"},
        {"result.json": "text"},
        {"spec.yaml": b""},
        {3: b"", "result.json": b"{}"},
    ],
)
def test_a_worker_writes_nothing_but_the_files_of_a_run(tmp_path, files):
    """Nor where its name is an absolute path."""
    answered = {
        name.replace("{outside}", str(tmp_path)) if isinstance(name, str) else name: content
        for name, content in files.items()
    }
    layout = Layout(tmp_path / "out")
    with pytest.raises(DataError) as refused:
        layout.adopt("k", answered)
    assert refused.value.diagnostics[0].code == "worker-answer"
    assert list(tmp_path.iterdir()) == []


def test_a_layout_reads_results_before_failures(tmp_path):
    layout = Layout(tmp_path)
    assert layout.read("k") is None
    failure = dict.fromkeys(("status", "code", "message", "hint", "key"), "x")
    layout.write_failure("k", failure)
    assert layout.read("k") == failure
    result = {"format": 1, "spec_sha256": hashlib.sha256(b"").hexdigest()}
    layout.adopt("k", {"spec.yaml": b"", "result.json": json.dumps(result).encode()})
    assert layout.read("k") == result
