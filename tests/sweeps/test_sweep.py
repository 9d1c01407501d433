"""A sweep runs every point once, notes what fails, and never mixes with anything else; also from Python."""

import hashlib
import itertools
import json
import multiprocessing
import pkgutil
import subprocess
import sys

import numpy as np
import pandas
import pytest

import inputdesign_cli
from inputdesign_cli import load_spec, parse_spec, questions, sweep
from inputdesign_cli.compute.processes import Processes
from inputdesign_cli.errors import DataError, Diagnostic, InfeasibleError, OutputError, SpecError
from inputdesign_cli.figures.sweep_table import read_sweep
from inputdesign_cli.specification import Sweep
from inputdesign_cli.sweeps.plan import Axis, Grid, build_grid, build_plan, parse_settings
from inputdesign_cli.sweeps.points import Layout
from inputdesign_cli.sweeps.running import Row, list_points, scalars, table_lines
from tests.support.processes import running
from tests.support.sweep_files import SPEC, rows, run_sweep, timeless_files, timeless_rows


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
    solve = questions.solve
    monkeypatch.setattr(questions, "solve", lambda s: solve(s.with_(**{"experiment.samples": 6})))
    assert run_sweep(spec, ["experiment.samples=6,7"], directory=out, rerun_failed=True).failures == 0
    assert list((out / "failures").iterdir()) == []


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


HOLD = """
import sys, time
from pathlib import Path
from inputdesign_cli.sweeps.points import opened
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


def test_no_public_name_is_that_of_a_module():
    """A module that is imported takes the place of the function of its name."""
    modules = {module.name for module in pkgutil.iter_modules(inputdesign_cli.__path__)}
    assert modules & {name for name in inputdesign_cli.__all__ if name != "__version__"} == set()


def test_a_file_and_a_spec_give_the_same_frame(spec, stub, tmp_path):
    varied = {"experiment.samples": np.array([10, 20]), "spectrum.order": "0:2:1"}
    frames = [
        sweep(str(spec), ["experiment.samples=10,20", "spectrum.order=0:2:1"]),
        sweep(spec, varied),
        sweep(load_spec(spec), varied),
        sweep(parse_spec(SPEC + "sweep: {set: {experiment.samples: [10, 20], spectrum.order: '0:2:1'}}")),
    ]
    for frame in frames:
        assert isinstance(frame, pandas.DataFrame)
        pandas.testing.assert_frame_equal(frame.drop(columns="time_s"), frames[0].drop(columns="time_s"))
        assert "run" not in frame
    expected = [100 / n + 1 / (1 + m) for n in (10, 20) for m in (0, 1, 2)]
    np.testing.assert_allclose(frames[0]["objective.value"], expected)


def test_a_spec_names_files_from_its_folder(tmp_path, stub, monkeypatch):
    text = SPEC.replace("{relative: 0.1}", "{table: r.csv}")
    (tmp_path / "r.csv").write_text("frequency,r_adm\n0.1,1\n3.2,1\n")
    stated = parse_spec(text, folder=tmp_path)
    monkeypatch.chdir("/")
    first = sweep(stated, "experiment.samples=10,20", directory=tmp_path / "out")
    assert list(first["status"]) == ["optimal", "optimal"]
    (tmp_path / "r.csv").write_text("frequency,r_adm\n0.1,2\n3.2,1\n")
    sweep(stated, "experiment.samples=10,20", directory=tmp_path / "out")
    assert stub == [10, 20, 10, 20]


def test_a_directory_keeps_the_runs(spec, stub, tmp_path):
    out = tmp_path / "out"
    for _ in range(2):
        frame = sweep(spec, {"experiment.samples": [10, 20]}, directory=out)
    assert stub == [10, 20]
    assert list(frame["run"]) == [row["run"] for row in rows(out)]
    assert all((out / run).is_dir() for run in frame["run"])


def test_points_without_a_result_are_rows(spec, stub):
    frame = sweep(spec, {"experiment.samples": [6, 7, 9]})
    assert list(frame["status"]) == ["optimal", "infeasible", "error"]
    assert np.isfinite(frame["objective.value"]).tolist() == [True, False, False]


def test_nothing_to_vary_is_an_error(spec, stub):
    for settings in ((), {}, {"experiment.samples": 5}):
        with pytest.raises(SpecError):
            sweep(spec, settings)
    assert stub == []


def texts(*settings):
    fixed, axes = parse_settings(settings)
    return fixed, {axis.key: axis.texts for axis in axes}


@pytest.mark.parametrize(
    ("setting", "values"),
    [
        ("a=1,2,3", ("1", "2", "3")),
        ("a= 1 , 2", ("1", "2")),
        ("a=0:40:5", ("0", "5", "10", "15", "20", "25", "30", "35", "40")),
        ("a=0:0.3:0.1", ("0", "0.1", "0.2", "0.3")),
        ("a=0:1:0.4", ("0", "0.4", "0.8")),
        ("a=3:1:-1", ("3", "2", "1")),
        ("a=1e-3:2e-3:1e-3", ("0.001", "0.002")),
        ("a=100:300:100", ("100", "200", "300")),
        ("a={type: white},{type: fir, order: 3}", ("{type: white}", "{type: fir, order: 3}")),
        ("a=[1, -0.5],[1, -0.6]", ("[1, -0.5]", "[1, -0.6]")),
        ("a='x, y',\"z\"", ("'x, y'", '"z"')),
        ("a=it's,b", ("it's", "b")),
    ],
)
def test_values_of_a_setting(setting, values):
    assert texts(setting) == ([], {"a": values})


def test_a_single_value_holds_for_all_points():
    assert texts("a=1", "b=[1, 2]", "c=1,2", "d=x = y") == (["a=1", "b=[1, 2]", "d=x = y"], {"c": ("1", "2")})


@pytest.mark.parametrize(
    ("setting", "code"),
    [("a=0:40", "bad-range"), ("a=0:40:0", "bad-range"), ("a=0:40:-1", "bad-range"),
     ("a=0:1:1e-9", "bad-range"), ("a=nan:4:1", "bad-range"), ("a=0:.inf:1", "bad-range"),
     ("a=0:4:-Infinity", "bad-range"), ("a=1,,2", "bad-override"), ("a=1,2 a=3,4", "sweep-twice")],
)  # fmt: skip
def test_bad_settings(setting, code):
    with pytest.raises(SpecError) as caught:
        parse_settings(setting.split())
    assert caught.value.diagnostics[0].code == code


@pytest.mark.parametrize("lengths", [(1,), (3, 1), (2, 4, 3), (1, 2, 1, 2)])
def test_a_grid_is_the_product_of_its_axes(lengths):
    axes = [Axis(f"k{i}", tuple(map(str, range(n)))) for i, n in enumerate(lengths)]
    assert list(Grid(tuple(axes))) == list(itertools.product(*(axis.texts for axis in axes)))


def test_a_zipped_grid_goes_side_by_side():
    grid = build_grid(None, [Axis("a", ("1", "2")), Axis("b", ("3", "4"))], zipped=True)
    assert list(grid) == [("1", "3"), ("2", "4")]
    assert grid.overrides(grid[1]) == ["a=2", "b=4"]


@pytest.mark.parametrize(
    ("axes", "zipped", "code"),
    [
        ([], False, "sweep-empty"),
        ([Axis("a", ("1", "2")), Axis("b", ("3",) * 3)], True, "sweep-lengths"),
        ([Axis("a", ("1",) * 1001), Axis("b", ("1",) * 1000)], False, "sweep-too-large"),
    ],
)
def test_grids_that_are_refused(axes, zipped, code):
    with pytest.raises(SpecError) as caught:
        build_grid(None, axes, zipped=zipped)
    assert caught.value.diagnostics[0].code == code


BLOCK = {"set": {"a": [1, "white", {"type": "fir"}], "b": "0:0.2:0.1"}}


def test_the_block_of_a_spec_and_the_command_line():
    block = Sweep.model_validate(BLOCK)
    grid = build_grid(block, [], zipped=False)
    assert [axis.texts for axis in grid.axes] == [("1", "white", '{"type": "fir"}'), ("0", "0.1", "0.2")]
    replaced = build_grid(block, [Axis("a", ("7", "8")), Axis("c", ("x", "y"))], zipped=False)
    assert {axis.key: axis.texts for axis in replaced.axes} == {
        "a": ("7", "8"), "b": ("0", "0.1", "0.2"), "c": ("x", "y")
    }  # fmt: skip
    assert build_grid(Sweep.model_validate(grid.block()), [], zipped=False) == grid


GOOD = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 1}\naccuracy: {model_error: {relative: 0.01}}\n"


@pytest.mark.parametrize(
    ("block", "code", "key"),
    [
        ("sweep: {set: {a.b: 3}}\n", "wrong-shape", "sweep.set.a.b"),
        ("sweep: {set: {a.b: []}}\n", "wrong-shape", "sweep.set.a.b"),
        ("sweep: {set: {a.b: 0:4}}\n", "bad-range", "sweep.set.a.b"),
        ("sweep: {set: [1, 2]}\n", "wrong-shape", "sweep.set"),
        ("sweep: {zip: true}\n", "missing-key", "sweep.set"),
        ("sweep: {sett: {a: [1]}}\n", "unknown-key", "sweep.sett"),
    ],
)
def test_a_bad_block_is_a_complaint_of_the_spec(block, code, key):
    with pytest.raises(SpecError) as caught:
        parse_spec(GOOD + block, "x.yaml")
    diagnostic = caught.value.diagnostics[0]
    assert diagnostic.code == code
    assert diagnostic.key == key
    assert diagnostic.location.line == 4
