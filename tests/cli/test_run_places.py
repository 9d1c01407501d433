"""Folders of runs: no run is lost to a run of another spec, and an edited spec is not overwritten."""

import hashlib
import io
import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from inputdesign_cli import questions
from inputdesign_cli.cli.options import Into
from inputdesign_cli.cli.run import Place
from inputdesign_cli.errors import OutputError
from inputdesign_cli.figures import plots
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.run_directory import Origin, check_place, write_run
from tests.support.outcomes import typed
from tests.support.refusals import code_of

SPEC = """\
title: {}
plant: {{B: [0, 1], F: [1, -0.5]}}
noise: {{variance: 1}}  # by hand
experiment: {{samples: 100}}
spectrum: {{given: {{type: white, power: 1.0}}}}
"""


@pytest.fixture
def analyse(run):
    """`idesign analyse ..`: its exit code and the code of its error."""

    def call(*arguments):
        code, out, err = run("analyse", *arguments, "--no-figures", "--json")
        return code, json.loads(out)["errors"][0]["code"] if code and out else err[-200:] if code else ""

    return call


def write(path, title):
    path.parent.mkdir(exist_ok=True)
    path.write_text(SPEC.format(title))
    return path


def test_two_specs_of_one_name_do_not_share_a_directory(analyse, tmp_path):
    one, two = write(tmp_path / "one" / "a.yaml", "one"), write(tmp_path / "two" / "a.yaml", "two")
    assert analyse(one) == (0, "")
    first = (tmp_path / "runs" / "a" / "result.json").read_bytes()
    assert analyse(two) == (2, "output-other-run")
    assert (tmp_path / "runs" / "a" / "result.json").read_bytes() == first
    assert analyse(two, "--overwrite") == (0, "")
    assert analyse(one) == (2, "output-other-run")


def test_a_changed_or_moved_spec_replaces_its_own_run(analyse, tmp_path, monkeypatch):
    spec = write(tmp_path / "p" / "a.yaml", "one")
    assert analyse(spec) == (0, "")
    write(spec, "edited")
    assert analyse(spec, "--set", "experiment.samples=200") == (0, "")
    (tmp_path / "link").symlink_to(tmp_path / "p")
    assert analyse("link/a.yaml") == (0, "")
    assert analyse(spec, "-o", tmp_path / "p" / "run") == (0, "")
    (tmp_path / "p").rename(tmp_path / "moved")
    monkeypatch.chdir(tmp_path / "moved")
    write(tmp_path / "moved" / "a.yaml", "edited in its new place")
    assert analyse("a.yaml", "-o", "run") == (0, "")


def test_a_run_without_a_record_of_its_spec_is_kept(analyse, tmp_path):
    spec = write(tmp_path / "a.yaml", "one")
    assert analyse(spec) == (0, "")
    write(spec, "edited")
    result = tmp_path / "runs" / "a" / "result.json"
    for record in (None, 7, "a.yaml", {}, [7]):
        result.write_text(json.dumps(json.loads(result.read_text()) | {"made_from": record}))
        assert analyse(spec) == (2, "output-other-run")


def test_a_record_in_place_of_the_signal_is_kept(analyse, tmp_path):
    spec = write(tmp_path / "a.yaml", "one")
    result = tmp_path / "r" / "result.json"
    assert analyse(spec, "-o", "r") == (0, "")
    written = (tmp_path / "r" / "signal.csv").read_bytes()
    assert json.loads(result.read_text())["signal_sha256"] == hashlib.sha256(written).hexdigest()
    assert analyse(spec, "-o", "r") == (0, "")  # as it was written
    (tmp_path / "r" / "signal.csv").write_text("time,u1,y1\n0,1,2\n")
    assert analyse(spec, "-o", "r") == (2, "output-signal-changed")
    assert (tmp_path / "r" / "signal.csv").read_text().startswith("time,u1,y1")
    assert analyse(spec, "-o", "r", "--overwrite") == (0, "")
    assert (tmp_path / "r" / "signal.csv").read_bytes() == written


def test_changes_of_the_spec_in_the_run_directory_are_kept(analyse, tmp_path):
    spec = write(tmp_path / "a.yaml", "one")
    assert analyse(spec, "-o", "r") == (0, "")
    own = tmp_path / "r" / "spec.yaml"
    edited = "# my notes\n" + SPEC.format("edited")
    own.write_text(edited)
    assert analyse(spec, "-o", "r") == (2, "output-spec-changed")
    assert analyse(own, "-o", "r", "--set", "experiment.samples=50") == (2, "output-is-the-spec")
    assert analyse(own, "-o", "r", "--set", "title=x", "--overwrite") == (2, "output-is-the-spec")
    assert own.read_text() == edited
    assert analyse(own, "-o", "r") == (0, "")
    assert own.read_text() == edited
    assert json.loads((tmp_path / "r" / "result.json").read_text())["title"] == "edited"
    own.write_text(edited.replace("edited", "edited again"))
    assert analyse(own, "-o", "r") == (0, "")
    assert analyse(spec, "-o", "r") == (2, "output-other-run")
    assert analyse(spec, "-o", "r", "--overwrite") == (0, "")


DESIGN = """\
plant: {B: [0, 1], F: [1, -0.5]}
noise: {variance: 1}
experiment: {samples: 100}
accuracy: {model_error: {relative: 0.1}}
uncertainty: {intervals: {f1: [-0.6, -0.4]}}
campaign: {block: 50}
"""
COMMANDS = {
    "solve": ["a.yaml"],
    "analyse": ["a.yaml"],
    "simulate": ["a.yaml"],
    "campaign": ["a.yaml"],
    "identify": ["d.csv", "--spec", "a.yaml"],
    "assess": ["a.yaml", "d.csv"],
    "explore": ["d.csv"],
}


@pytest.fixture
def computing(monkeypatch):
    """A list that gets an entry when a command begins to compute, which then ends it."""
    begun = []

    def computed(*_, **__):
        begun.append(True)
        raise SystemExit(99)

    for verb in ("solve", "analyse", "simulate", "next_round", "identify", "assess", "explore"):
        monkeypatch.setattr(questions, verb, computed)
    return begun


@pytest.mark.first(4)
@pytest.mark.parametrize("command", COMMANDS)
def test_an_unusable_folder_is_refused_before_anything_is_computed(
    run, computing, monkeypatch, tmp_path, command
):
    def refused(place, *options):
        code, out, _ = run(command, *COMMANDS[command], "-o", place, "--json", *options)
        assert computing == ([True] if code == 99 else [])
        computing.clear()
        return json.loads(out)["errors"][0]["code"] if out else code

    other, edited, foreign = (tmp_path / name for name in ("other", "edited", "foreign"))
    Path("a.yaml").write_text(DESIGN)
    Path("d.csv").write_text("u,y\n" + "1,1\n0,1\n" * 50)
    Path("file").write_text("mine")
    result = Results(typed({"format": 1, "title": "x"}), "title: x\n")
    write_run(result, other, origin=Origin([tmp_path / "b.yaml"]))
    write_run(result, edited, origin=Origin([tmp_path / "a.yaml"]))
    (edited / "spec.yaml").write_text("title: mine\n")
    foreign.mkdir()
    (foreign / "result.json").write_text("mine")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert refused("other") == "output-other-run"
    assert refused("edited") == "output-spec-changed"
    assert refused("foreign") == refused("foreign", "--overwrite") == "output-not-a-run"
    assert refused("file") == "output-not-a-directory"
    assert refused("file/below") == "output-not-writable"
    assert refused("new") == refused("other", "--overwrite") == refused("edited", "--overwrite") == 99
    assert before == {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}


def test_the_replacement_of_a_run_with_other_values_is_reported(run, tmp_path):
    write(tmp_path / "a.yaml", "one")

    def told(*options):
        code, out, _ = run("analyse", "a.yaml", "--no-figures", *options)
        assert code == 0
        return "a run of the same files with other values" in " ".join(out.split())

    assert [told(), told(), told("--set", "experiment.samples=50"), told()] == [False, False, True, True]


def test_a_run_written_during_the_computation_is_not_replaced(analyse, monkeypatch, tmp_path):
    spec = write(tmp_path / "a.yaml", "one")
    true = questions.analyse

    def slowly(stated):
        origin = Origin([tmp_path / "b.yaml"])
        write_run(Results(typed({"format": 1, "title": "x"}), "title: x\n"), tmp_path / "r", origin=origin)
        return true(stated)

    monkeypatch.setattr(questions, "analyse", slowly)
    assert analyse(spec, "-o", "r") == (2, "output-other-run")
    assert (tmp_path / "r" / "spec.yaml").read_text() == "title: x\n"


def test_a_run_whose_spec_is_a_top_up_is_known_by_the_spec_asked_for(tmp_path):
    """The spec.yaml of a run may differ from the spec that was asked for."""
    place, top_up = tmp_path / "r", Results(typed({"format": 1, "title": "x"}), "title: top-up\n")
    one, copy, other = (tmp_path / name for name in ("a.yaml", "copy.yaml", "d.csv"))
    write_run(top_up, place, origin=Origin([one, other], "title: x\n"))
    check_place(place, Origin([copy, other], "title: x\n"), "title: x\n")
    write_run(top_up, place, origin=Origin([copy, other], "title: x\n"))
    for origin in (Origin([one], "title: x\n"), Origin([one, other], "title: y\n")):
        assert code_of(check_place, place, origin, origin.asked, kind=OutputError) == "output-other-run"


def test_a_spec_from_standard_input_has_its_own_run(analyse, tmp_path, monkeypatch):
    def piped(text):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
        return analyse("-")

    assert piped(SPEC.format("one")) == (0, "")
    assert json.loads((tmp_path / "runs" / "stdin" / "result.json").read_text())["title"] == "one"
    assert piped(SPEC.format("one")) == (0, "")
    assert piped(SPEC.format("two")) == (2, "output-other-run")
    assert piped("plant: [") == (2, "yaml-syntax")
    assert piped("\x00")[0] == 2
    assert piped(" " * 11 * 2**20) == (2, "file-too-large")
    monkeypatch.setattr(sys, "stdin", None)
    assert analyse("-") == (2, "file-unreadable")


@pytest.mark.parametrize(
    "text",
    [
        "plant: {B: [0, 1], F: [1, -0.5]}\nexperiment: {sampls: 10}\n",
        "plant: {B: [0, 1], F: [1, -1.5]}\nnoise: {variance: 1}\nexperiment: {samples: 50}\n"
        "accuracy: {model_error: {relative: 0.1}}\nspectrum: {given: white}\n",
    ],
    ids=["key", "build"],
)
def test_errors_of_standard_input_equal_errors_of_a_file_but_for_its_name(text, run, tmp_path, monkeypatch):
    (tmp_path / "s.yaml").write_text(text)
    code, _, told = run("analyse", "s.yaml")
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))
    again, _, piped = run("analyse", "-")
    assert (code, again) == (2, 2)
    assert piped == told.replace("s.yaml", "<stdin>")
    assert "<stdin>:" in piped


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (["-o", ""], "empty"),
        (["-o", "  "], "empty"),
        (["-o", "/"], "the root of the file system is no directory for a run"),
        (["--confine", "nosuch"], "does not exist"),
        (["--confine", "a.yaml"], "is a file"),
    ],
)
def test_impossible_options_for_folders_are_refused_before_the_computation(run, verbs, options, told):
    Path("a.yaml").write_text("x", encoding="utf-8")
    code, _, err = run("solve", "a.yaml", *options)
    assert code == 2
    assert told in " ".join(err.split())
    assert not verbs
    assert [path.name for path in Path().iterdir()] == ["a.yaml"]


def test_a_verdict_is_replaced_by_a_verdict_only(tmp_path):
    files, spec = [tmp_path / "a.yaml", tmp_path / "d.csv"], SPEC.format("a")
    judged = Results(typed({"format": 1, "assessment": {"verdict": "missed", "met": False}}), spec)
    write_run(judged, tmp_path / "run", origin=Origin(files, judges=True))
    check_place(tmp_path / "run", Origin(files, judges=True), spec)
    assert code_of(check_place, tmp_path / "run", Origin(files), spec, kind=OutputError) == "output-other-run"
    check_place(tmp_path / "run", Origin(files, overwrite=True), spec)


def test_runs_of_the_same_data_by_other_specs_get_numbered_folders(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    log = tmp_path / "log.csv"

    def place(file, into=Into()):
        spec = questions.load_spec(file)
        return Place(into, "log_assessed", [file, log], numbered=True).checked(spec).directory, spec

    def written(file):
        where, spec = place(file)
        origin = Origin([file, log], spec.to_yaml())
        write_run(Results(typed({"format": 1, "title": "a"}), spec.to_yaml()), where, origin=origin)
        return str(where)

    one, two = (write(tmp_path / "specs" / f"{name}.yaml", name) for name in "ab")
    usual = "runs/log_assessed"
    assert [written(file) for file in (one, two, one, two)] == [usual, f"{usual}_2", usual, f"{usual}_2"]
    # A spec in such a folder is kept if its run would write another one there.
    other = Path(f"{usual}_2/spec.yaml")
    unlike = Place(Into(), "log_assessed", [other, log], numbered=True).checked(None)
    assert str(unlike.directory) == f"{usual}_3"
    assert str(place(two, Into(overwrite=True))[0]) == usual
    assert code_of(place, two, Into(Path(usual)), kind=OutputError) == "output-other-run"


def test_a_report_replaces_its_own_pages_only_or_goes_to_standard_output(run, analyse, tmp_path, monkeypatch):
    monkeypatch.setattr("inputdesign_cli.report.run_page.run_charts", lambda *_, **__: {})
    assert analyse(write(tmp_path / "a.yaml", "a")) == (0, "")

    def report(name):
        code, out, err = run("report", "runs/a", "-o", name)
        return code, "output-exists" in err or out.startswith("<!DOCTYPE html>")

    (tmp_path / "data.csv").write_text("u,y\n1,2\n")
    spec = (tmp_path / "runs" / "a" / "spec.yaml").read_text()
    assert report("page.html") == report("page.html") == (0, False)
    assert report("data.csv") == report("runs/a/spec.yaml") == (2, True)
    assert (tmp_path / "data.csv").read_text() == "u,y\n1,2\n"
    assert (tmp_path / "runs" / "a" / "spec.yaml").read_text() == spec
    before = set(tmp_path.rglob("*"))
    assert report("-") == (0, True)
    assert set(tmp_path.rglob("*")) == before


def test_the_spec_determines_width_and_format_of_its_figures(run, tmp_path, monkeypatch):
    """A column is 3.5 inches wide, of 72 points each; the option overrides the spec."""
    every = plots.draw_all

    def one_figure(results, *form):
        return every(replace(results, curves={"spectrum": results.curves["spectrum"]}), *form)

    monkeypatch.setattr(plots, "draw_all", one_figure)
    spec = write(tmp_path / "a.yaml", "one")
    spec.write_text(spec.read_text() + "figures: {width: column, format: pdf}\n")
    assert run("analyse", "a.yaml")[0] == 0
    drawn = {file.suffix: file for file in (tmp_path / "runs" / "a").iterdir() if file.stem == "spectrum"}
    assert set(drawn) == {".csv", ".pdf"}
    box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+)", drawn[".pdf"].read_bytes())
    assert float(box[1]) == pytest.approx(252.0)
    assert run("analyse", "a.yaml", "--figure-format", "svg")[0] == 0
    assert (tmp_path / "runs" / "a" / "spectrum.svg").exists()
