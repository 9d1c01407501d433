"""A sweep runs every point once, records failures, and never mixes with other files; also from Python."""

import hashlib
import itertools
import json
import multiprocessing
import pkgutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas
import pytest

import inputdesign_cli
from inputdesign_cli import load_spec, parse_spec, questions, sweep
from inputdesign_cli.compute.processes import Processes
from inputdesign_cli.errors import DataError, Diagnostic, InfeasibleError, OutputError
from inputdesign_cli.figures.sweep_table import SweepAxis, read_sweep
from inputdesign_cli.specification import Sweep
from inputdesign_cli.sweeps.plan import Grid, build_grid, build_plan, parse_settings, trade_plan
from inputdesign_cli.sweeps.points import Layout
from inputdesign_cli.sweeps.running import row_of, scalars, table_lines
from tests.support.processes import running
from tests.support.refusals import refused
from tests.support.sweep_files import SPEC, rows, run_sweep, timeless_files, timeless_rows

TWO = ["experiment.samples=10,20"]


def column(directory, name):
    return [row[name] for row in rows(directory)]


def test_every_point_is_a_row_and_a_run(spec, stub, drawn, tmp_path):
    seen, out = [], tmp_path / "out"
    settings = ["experiment.samples=10,20", "spectrum.order=0:2:1"]
    done = run_sweep(spec, settings, directory=out, watch=lambda p: seen.append((p.passed, p.computed)))
    assert (done.statuses, seen) == ({"optimal": 6}, [(i, i) for i in range(1, 7)])
    table = rows(out)
    points = [(row["experiment.samples"], row["spectrum.order"]) for row in table]
    assert points == list(itertools.product(("10", "20"), "012"))
    assert float(table[0]["objective.value"]) == 11.0
    assert float(table[5]["power.input[0]"]) == 5.0 + 1.0 / 3.0
    for row in table:
        result = json.loads((out / row["run"] / "result.json").read_text())
        assert result["objective"]["value"] == float(row["objective.value"])
        text = (out / row["run"] / "spec.yaml").read_text()
        assert (f"order: {row['spectrum.order']}" in text, "sweep" in text) == (True, False)
        assert float(row["time_s"]) >= 0
    kept = {"sweep.csv", "sweep.json", "sweep.yaml", "points", "curves.png", "map.png", ".lock", ".process"}
    assert {path.name for path in out.iterdir()} == kept


def test_points_with_a_result_are_not_computed_again(spec, stub, tmp_path):
    """A second call, the written spec and equal values compute nothing; a wider sweep adds points."""
    out = tmp_path / "out"
    run_sweep(spec, [*TWO, "noise.variance=2"], directory=out)
    before = timeless_files(out)
    assert run_sweep(spec, [*TWO, "noise.variance=2"], directory=out).computed == 0
    assert run_sweep(out / "sweep.yaml", directory=out).computed == 0
    assert timeless_files(out) == before
    assert run_sweep(spec, ["experiment.samples=10,20,30", "noise.variance=2"], directory=out).computed == 1
    assert (stub, column(out, "experiment.samples")) == ([10, 20, 30], ["10", "20", "30"])
    assert run_sweep(spec, ["experiment.samples=7e1,70.0,70"], directory=tmp_path / "x").computed == 1


def test_failures_are_rows_with_reasons(spec, stub, tmp_path):
    out, settings = tmp_path / "out", ["experiment.samples=6,7,8,9,-1,10"]
    done = run_sweep(spec, settings, directory=out)
    statuses = ["optimal", "infeasible", "inaccurate", "error", "invalid", "optimal"]
    codes = ["", "not-supported", "gap-not-closed", "internal-error", "out-of-range", ""]
    assert (column(out, "status"), column(out, "code")) == (statuses, codes)
    assert column(out, "reason")[1] == "seven is too few"
    assert "ZeroDivisionError: nine" in column(out, "reason")[3]
    assert done.failures == 4
    assert isinstance(done.first_failure, InfeasibleError)
    assert "--set experiment.samples=7" in done.first_failure.diagnostics[0].message
    again = run_sweep(spec, settings, directory=out)
    assert (again.computed, again.failures) == (0, 4)
    assert run_sweep(spec, settings, directory=out, rerun_failed=True).computed == 4
    assert stub == [6, 7, 8, 9, 10, 7, 8, 9]


def test_a_failure_that_is_mended_leaves_no_trace(spec, stub, tmp_path, monkeypatch):
    out, settings, solve = tmp_path / "out", ["experiment.samples=6,7"], questions.solve
    run_sweep(spec, settings, directory=out)
    monkeypatch.setattr(questions, "solve", lambda s: solve(s.with_(**{"experiment.samples": 6})))
    assert run_sweep(spec, settings, directory=out, rerun_failed=True).failures == 0
    assert list((out / "failures").iterdir()) == []


def test_fail_fast_stops_and_keeps_the_finished_points(spec, stub, tmp_path):
    out = tmp_path / "out"
    for _ in range(2):
        with pytest.raises(InfeasibleError):
            run_sweep(spec, ["experiment.samples=6,7,10"], directory=out, fail_fast=True)
        assert column(out, "status") == ["optimal", "infeasible", "pending"]
    assert stub == [6, 7]


def test_an_interrupt_leaves_a_table(spec, stub, tmp_path):
    def stop(progress):
        if progress.passed == 2:
            raise KeyboardInterrupt

    out, settings = tmp_path / "out", ["experiment.samples=10,20,30"]
    with pytest.raises(KeyboardInterrupt):
        run_sweep(spec, settings, directory=out, watch=stop)
    assert column(out, "status") == ["optimal", "optimal", "pending"]
    assert run_sweep(spec, settings, directory=out).computed == 1


def test_an_edited_data_file_is_another_point(tmp_path, stub, monkeypatch):
    """This holds for a spec in a file and for one in memory, which names files from its folder."""
    text, table, out = SPEC.replace("{relative: 0.1}", "{table: r.csv}"), tmp_path / "r.csv", tmp_path / "out"
    (tmp_path / "t.yaml").write_text(text)
    stated = parse_spec(text, folder=tmp_path)
    monkeypatch.chdir("/")
    for limit, computed in ((1, 2), (2, 4)):
        table.write_text(f"frequency,r_adm\n0.1,{limit}\n3.2,1\n")
        for _ in range(2):
            assert list(sweep(stated, TWO, directory=out)["status"]) == ["optimal", "optimal"]
        assert len(stub) == computed
    assert run_sweep(tmp_path / "t.yaml", TWO, directory=tmp_path / "file").computed == 2
    table.write_text("frequency,r_adm\n0.1,3\n3.2,1\n")
    assert run_sweep(tmp_path / "t.yaml", TWO, directory=tmp_path / "file").computed == 2


def test_swept_texts_are_no_formulas(spec, stub, tmp_path):
    out, titles = tmp_path / "out", ["=1+1", "+x", "-y", "@z", "-0.5", "'=1"]
    run_sweep(spec, [f"title={','.join(titles)}"], directory=out)
    assert column(out, "title") == ["'=1+1", "'+x", "'-y", "'@z", "-0.5", "''=1"]
    assert read_sweep(out).columns["title"] == titles


HOLD = """
import sys, time
from pathlib import Path
from inputdesign_cli.sweeps.points import opened
with opened(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_a_directory_is_swept_by_one_process_at_a_time(spec, stub, tmp_path):
    """Half-written files of a killed process are removed."""
    out = tmp_path / "out"
    with running([sys.executable, "-c", HOLD, str(out)], stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout.readline() == "held\n"
        found = refused(run_sweep, spec, TWO, kind=OutputError, directory=out)
        assert found[0].code == "sweep-locked"
        assert f"process {holder.pid}" in found[0].message
    (out / "points" / ".abc.partial-1").mkdir(parents=True)
    (out / ".sweep.csv.partial-1").write_text("half")
    (out / "sweep.json").write_text("{")  # it had begun
    assert run_sweep(spec, TWO, directory=out).computed == 2
    assert not list(out.rglob(".*partial*"))


def test_the_table_holds_short_lists_and_the_fewest_digits():
    """0.1 and a third in the digits of Python, a whole number without its point."""
    result = {"a": [1.0, 2.0], "moments": {"R": [[1.0, 2.0]], "c": list(range(9))}, "solver": {"n": 1}}
    assert scalars(result) == {"a[0]": 1.0, "a[1]": 2.0, "moments.R[0][0]": 1.0, "moments.R[0][1]": 2.0}
    result = {"status": "optimal", "a": 0.1, "b": 1 / 3, "c": 2.0, "n": 7}
    head, row = table_lines(["samples"], [(("100",), row_of("0", result))])
    found = dict(zip(head.strip().split(","), row.strip().split(","), strict=True))
    assert [found[name] for name in "abcn"] == ["0.1", "0.3333333333333333", "2", "7"]


@pytest.mark.slow
def test_two_processes_give_the_results_of_one(spec, tmp_path):
    settings = ["experiment.samples=50,100,-1", "spectrum.order=1,2"]
    run_sweep(spec, settings, directory=tmp_path / "one")
    run_sweep(spec, settings, directory=tmp_path / "two", executor=Processes(2))
    assert timeless_rows(tmp_path / "one") == timeless_rows(tmp_path / "two")
    assert timeless_files(tmp_path / "one") == timeless_files(tmp_path / "two")
    assert multiprocessing.active_children() == []


def test_a_full_disc_ends_the_sweep(spec, stub, tmp_path, monkeypatch):
    def full(layout, key, files):
        raise OutputError(Diagnostic("output-full", "no space"))

    monkeypatch.setattr(Layout, "adopt", full)
    with pytest.raises(OutputError):
        run_sweep(spec, TWO, directory=tmp_path / "out")
    assert column(tmp_path / "out", "status") == ["pending", "pending"]


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
    """Parent folders, absolute paths, texts and incomplete runs are refused."""
    outside = {
        n.format(outside=tmp_path) if isinstance(n, str) else n: content for n, content in files.items()
    }
    assert refused(Layout(tmp_path / "out").adopt, "k", outside, kind=DataError)[0].code == "worker-answer"
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


def test_no_public_function_has_the_name_of_a_module():
    """An imported module would replace a function of the same name."""
    modules = {module.name for module in pkgutil.iter_modules(inputdesign_cli.__path__)}
    assert modules & {name for name in inputdesign_cli.__all__ if name != "__version__"} == set()


def test_a_file_and_a_spec_give_the_same_frame(spec, stub, tmp_path):
    varied = {"experiment.samples": np.array([10, 20]), "spectrum.order": "0:2:1"}
    frames = [
        sweep(str(spec), ["experiment.samples=10,20", "spectrum.order=0:2:1"]),
        sweep(load_spec(spec), varied),
        sweep(parse_spec(SPEC + "sweep: {set: {experiment.samples: [10, 20], spectrum.order: '0:2:1'}}")),
    ]
    for frame in frames:
        pandas.testing.assert_frame_equal(frame.drop(columns="time_s"), frames[0].drop(columns="time_s"))
        assert "run" not in frame
    expected = [100 / n + 1 / (1 + m) for n in (10, 20) for m in (0, 1, 2)]
    np.testing.assert_allclose(frames[0]["objective.value"], expected)
    del stub[:]
    for _ in range(2):  # a directory keeps the runs
        frame = sweep(spec, {"experiment.samples": [6, 7, 9]}, directory=tmp_path / "out")
    assert stub == [6, 7, 9]
    assert list(frame["run"].fillna("")) == column(tmp_path / "out", "run")
    assert list(frame["status"]) == ["optimal", "infeasible", "error"]
    assert np.isfinite(frame["objective.value"]).tolist() == [True, False, False]


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
def test_a_setting_is_split_into_its_values(setting, values):
    """A single value holds for all points."""
    single = ["b=1", "c=[1, 2]", "d=x = y"]
    assert parse_settings([*single, setting]) == (single, [SweepAxis("a", values)])


@pytest.mark.parametrize(
    ("settings", "code"),
    [("a=0:40", "bad-range"), ("a=0:40:0", "bad-range"), ("a=0:40:-1", "bad-range"),
     ("a=0:1:1e-9", "bad-range"), ("a=nan:4:1", "bad-range"), ("a=0:.inf:1", "bad-range"),
     ("a=0:4:-Infinity", "bad-range"), ("a=1,,2", "bad-override"), ("a=1,2 a=3,4", "sweep-twice"),
     ("", "sweep-empty"), ("a=5", "sweep-empty"), ("title=x,y experiment.samples=1,2,3", "sweep-lengths"),
     ('noise={"variance":1},{"variance":2} noise.variance=3', "sweep-twice"),
     ("title=0:1000:1 experiment.samples=1:1000:1", "sweep-too-large"), ("spectrum.ordr=1,2", "unknown-key"),
     ("verb=divine", "not-supported")],
)  # fmt: skip
def test_invalid_sweeps_are_refused_before_anything_is_computed(settings, code, spec, stub):
    """Lists of different lengths are refused in a zipped sweep only."""
    verb, zipped = ("divine" if "divine" in settings else "solve"), code == "sweep-lengths"
    found = refused(build_plan, spec, settings.split() if verb == "solve" else TWO, verb=verb, zipped=zipped)
    assert (found[0].code, stub) == (code, [])


@pytest.mark.parametrize("lengths", [(1,), (3, 1), (2, 4, 3), (1, 2, 1, 2)])
def test_a_grid_is_the_product_of_its_axes(lengths):
    axes = [SweepAxis(f"k{i}", tuple(map(str, range(n)))) for i, n in enumerate(lengths)]
    assert Grid(tuple(axes)).points == list(itertools.product(*(axis.values for axis in axes)))


def test_a_zipped_grid_takes_values_side_by_side():
    grid = build_grid(None, [SweepAxis("a", ("1", "2")), SweepAxis("b", ("3", "4"))], zipped=True)
    assert grid.points == [("1", "3"), ("2", "4")]
    assert grid.overrides(1) == ["a=2", "b=4"]


def test_settings_of_the_command_line_replace_settings_of_the_sweep_block():
    block = Sweep.model_validate({"set": {"a": [1, "white", {"type": "fir"}], "b": "0:0.2:0.1"}})
    grid = build_grid(block, [], zipped=False)
    assert [axis.values for axis in grid.axes] == [("1", "white", '{"type": "fir"}'), ("0", "0.1", "0.2")]
    replaced = build_grid(block, [SweepAxis("a", ("7", "8")), SweepAxis("c", ("x", "y"))], zipped=False)
    found = {axis.key: axis.values for axis in replaced.axes}
    assert found == {"a": ("7", "8"), "b": ("0", "0.1", "0.2"), "c": ("x", "y")}
    assert build_grid(Sweep.model_validate(grid.block()), [], zipped=False) == grid
    text = SPEC + "sweep: {set: {spectrum.order: '2:4:2', experiment.samples: [10, 20]}}\n"
    plan = build_plan(Path("x.yaml"), ["spectrum.order=3"], text=text)
    assert plan.grid.axes == (SweepAxis("experiment.samples", ("10", "20")),)
    assert plan.draft.spec(plan.grid.overrides(0)).spectrum.order == 3


def test_a_trade_starts_from_the_changed_spec_and_ignores_its_sweep_block(tmp_path):
    file, changes = tmp_path / "x.yaml", ["experiment.samples=8", "limits.input_power=1"]
    file.write_text(SPEC + "sweep: {set: {spectrum.order: [2, 4]}}\n")
    plan = trade_plan(file, load_spec(file, changes), ["samples"], changes, None)
    assert plan.grid.axes == (SweepAxis("experiment.samples", ("2", "4", "8", "16")),)
    for words in (["samples"], ["amplitude"]):
        (found,) = refused(trade_plan, file, load_spec(file), words, (), None)
        assert (found.code, found.key, found.location.file) == ("needs-limits", "limits", str(file))


@pytest.mark.parametrize(
    ("block", "code", "key"),
    [
        ("set: {a.b: 3}", "wrong-shape", "sweep.set.a.b"),
        ("set: {a.b: []}", "wrong-shape", "sweep.set.a.b"),
        ("set: {a.b: 0:4}", "bad-range", "sweep.set.a.b"),
        ("set: [1, 2]", "wrong-shape", "sweep.set"),
        ("zip: true", "missing-key", "sweep.set"),
        ("sett: {a: [1]}", "unknown-key", "sweep.sett"),
    ],
)
def test_errors_in_a_sweep_block_are_reported_with_key_and_line(block, code, key):
    diagnostic = refused(parse_spec, f"{SPEC}sweep: {{{block}}}\n", "x.yaml")[0]
    assert (diagnostic.code, diagnostic.key, diagnostic.location.line) == (code, key, 8)
