"""The page about a run or a sweep: strict HTML without outside resources, its content, and escaped text."""

import base64
import copy
import hashlib
import json
import os
import re
import shutil
from functools import cache, reduce
from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest
import scipy.stats

from inputdesign_cli import analyse, assess, identify, load_spec, parse_spec, simulate, solve
from inputdesign_cli.errors import DataError, IdesignError
from inputdesign_cli.outcome.run_directory import read_curves, write_run
from inputdesign_cli.report.render import bibtex_text, report_text
from inputdesign_cli.report.run_page import command_of
from tests.support.pages import LOOP, SPEC, XHTML, parse, recorded, rows, words
from tests.support.refusals import refused
from tests.support.sweep_files import run_sweep

page_of = cache(report_text)  # the pictures of a page take most of its time


@pytest.mark.first(1)
@pytest.mark.parametrize("name", ["open", "closed"])
def test_the_page_of_a_run(runs, name):
    page = parse(page_of(runs / name))
    result = json.loads((runs / name / "result.json").read_text())
    headings = [element.text for element in page.iter(f"{XHTML}h2")]
    assert ("The loop" in headings) == (name == "closed")
    contents = ["".join(link.itertext()) for link in page.iter(f"{XHTML}a")]
    assert contents == headings
    said = words(page)
    for part in (
        "90 % confidence",
        "10 % of |G|",
        f"{result['cost']:.6g}",
        f"{result['baseline']['white']['ratio']:.3g} times as much",
        f"No FIR spectrum gets below {result['objective']['lower_bound']:.7g}",
        f"No spectrum at all gets below {result['objective']['any_spectrum_bound']:.7g}",
        result["spec_sha256"],
        "idesign solve spec.yaml",
        "Bombois and G. Scorletti",
        result["environment"]["numpy"],
        "alert(1)",
    ):
        assert part in said, part
    assert (runs / name / "spec.yaml").read_text() in "".join(page.itertext())


def test_a_page_has_the_hash_of_its_result_and_is_the_same_for_the_same_run(runs, unpictured):
    text = report_text(runs / "open")
    assert report_text(runs / "open") == text
    digest = hashlib.sha256((runs / "open" / "result.json").read_bytes()).hexdigest()
    page = parse(text)
    (stamp,) = [meta for meta in page.iter(f"{XHTML}meta") if meta.get("name") == "sha256"]
    assert stamp.get("content") == digest
    assert digest in words(page)


@pytest.fixture
def unpictured(monkeypatch):
    """Pages have no pictures, which take most of the time."""
    monkeypatch.setattr("inputdesign_cli.report.run_page.run_charts", lambda *_, **__: {})


@pytest.fixture
def copied(runs, tmp_path):
    shutil.copytree(runs / "open", tmp_path / "run")
    return tmp_path / "run"


def test_a_directory_without_a_run_is_refused(copied, tmp_path):
    (copied / "result.json").write_text('{"format": 1}')
    for directory, code in ((copied, "run-unreadable"), (tmp_path, "run-missing")):
        assert refused(report_text, directory, kind=DataError)[0].code == code


def paths(value, path=()):
    """The path of every entry below a value; a list counts by its first element."""
    if path:
        yield path
    first = enumerate(value[:1]) if isinstance(value, list) else ()
    for key, item in value.items() if isinstance(value, dict) else first:
        yield from paths(item, (*path, key))


@pytest.mark.parametrize("broken", ["x", {}, [[1]]])
def test_an_entry_of_the_wrong_type_is_named_wherever_it_is(copied, unpictured, broken):
    file = copied / "result.json"
    whole = json.loads(file.read_text())
    named = 0
    for path in paths(whole):
        if path[0] in ("files", "format"):
            continue
        changed = copy.deepcopy(whole)
        holder = reduce(lambda held, key: held[key], path[:-1], changed)
        if type(holder[path[-1]]) is type(broken):
            continue
        holder[path[-1]] = broken
        file.write_text(json.dumps(changed))
        try:
            report_text(copied)
        except DataError as error:
            found = re.findall('of a run: "([^"]*)" ', str(error))
            if not found:  # the entries of a kind of spectrum have no types
                continue
            (told,) = found
            name = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path)[1:]
            # The error may lie one level above or below the entry.
            assert told.startswith(name) or name.startswith(told)
            named += 1
    assert named > 5


@pytest.mark.parametrize("name", ["spec.yaml", "bound.csv", "result.json"])
def test_a_pipe_in_a_run_directory_is_not_waited_for(copied, name):
    (copied / name).unlink()
    os.mkfifo(copied / name)
    with pytest.raises(DataError):
        report_text(copied)


def test_charts_are_svg_pictures_with_alternative_texts(runs):
    page = parse(page_of(runs / "open"))
    images = list(page.iter(f"{XHTML}img"))
    assert len(images) == 4
    for image in images:
        assert len(image.get("alt")) > 20
        kind, _, data = image.get("src").partition(";base64,")
        assert kind == "data:image/svg+xml"
        assert ElementTree.fromstring(base64.b64decode(data)).tag.endswith("svg")


def test_the_sources_of_a_run_stand_on_its_page_and_in_the_bibliography(runs):
    """Each source has a key of docs/references.md."""
    text = bibtex_text(runs / "open")
    keys = re.findall(r"^@\w+\{(.*),$", text, re.MULTILINE)
    assert keys == ["bombois-least-costly", "kiefer-wolfowitz-1960", "ljung-1999"]
    assert text.count("{") == text.count("}")
    said = words(parse(page_of(runs / "open")))
    assert all(title in said for title in re.findall(r"title = \{(.*)\}", text))
    known = (resources.files("inputdesign_cli.report") / "sources.bib").read_text()
    listed = (Path(__file__).parents[2] / "docs" / "references.md").read_text()
    assert all(f"### {key}\n" in listed for key in re.findall(r"^@\w+\{(.*),$", known, re.MULTILINE))


def test_a_bound_over_all_records_is_on_the_page_with_its_source(copied, unpictured):
    file = copied / "result.json"
    result = json.loads(file.read_text())
    assert "howard-1960" not in bibtex_text(copied)
    file.write_text(json.dumps({**result, "objective": {**result["objective"], "any_record_bound": 0.1}}))
    assert "howard-1960" in bibtex_text(copied)
    assert "samples within the amplitude gets below 0.1" in words(parse(report_text(copied)))


def swept(runs, folder, *settings):
    run_sweep(runs / "open.yaml", settings, directory=folder / "out")
    return parse(report_text(folder / "out"))


def test_the_page_of_a_sweep(runs, tmp_path):
    """A sweep without any result has a page, too."""
    page = swept(runs, tmp_path, "experiment.samples=50,100,-1", "spectrum.order=1,2")
    said = words(page)
    for part in ("6 points: 2 invalid, 4 optimal", "best at experiment.samples = 100",
                 "out-of-range", "at least 1", "idesign sweep sweep.yaml", "Bombois"):  # fmt: skip
        assert part in said, part
    assert len(list(page.iter(f"{XHTML}img"))) == 2
    assert (tmp_path / "out" / "sweep.yaml").read_text() in "".join(page.itertext())
    nothing = swept(runs, tmp_path / "nothing", "accuracy.model_error={table: a.csv},{table: b.csv}")
    assert "2 points: 2 invalid" in words(nothing)


def test_the_page_of_a_sweep_compares_in_one_unit(runs, tmp_path):
    limits = "limits={input_power: 0.5},{input_power: 1}"
    page = swept(runs, tmp_path, "objective=shortest_experiment", limits, "spectrum.order=1")
    table = next(t for t in page.iter(f"{XHTML}table") if "samples of white" in "".join(t.itertext()))
    header, *rows = [[("".join(cell.itertext())).strip() for cell in row] for row in table.iter(f"{XHTML}tr")]
    white, design = (
        [float(row[header.index(name)]) for row in rows] for name in ("samples of white", "samples")
    )
    assert all(one >= other for one, other in zip(white, design, strict=True))


SPECS = Path(__file__).parents[2] / "specs"


WHITE = ["limits={input_power: 1}", "spectrum={type: white}"]
KINDS = [
    ("regression", ["experiment.samples=100"], ["must not exceed 1", "No moments at all"]),
    ("first_order", ["objective=shortest_experiment", *WHITE], ["samples 853", "white excitation: 853"]),
    ("first_order", ["objective=best_accuracy", *WHITE], ["r_u / r_adm 1.30595"]),
    ("criterion", ["spectrum.order=2"], [": log det M "]),
    ("first_order_given", [], ["The figures hold for"]),
]


@pytest.mark.first(1)
@pytest.mark.parametrize(("name", "overrides", "said"), KINDS)
def test_each_kind_of_question_has_a_page_with_its_answer(name, overrides, said, tmp_path):
    verb = analyse if "given" in name else solve
    write_run(verb(load_spec(SPECS / f"{name}.yaml", overrides)), tmp_path / "run")
    page = words(parse(report_text(tmp_path / "run")))
    assert [part for part in said if part not in page] == []


@pytest.fixture
def data(tmp_path):
    return recorded(tmp_path / "data.csv")


@pytest.mark.first(1)
@pytest.mark.parametrize(("relative", "met"), [(0.5, True), (0.1, False)])
def test_the_page_of_an_assessment(relative, met, data, tmp_path):
    spec = parse_spec(SPEC % "", overrides=[f"accuracy.model_error.relative={relative}"])
    found = assess(spec, data)
    assert found.met == met
    write_run(found.results, tmp_path / "run")
    page, result = parse(report_text(tmp_path / "run")), found.results.result
    verdict = result["assessment"]["requirements"][0]
    assert f"model error reaches {verdict['worst_ratio']:.4g}" in words(page)
    cells = rows(page)
    assert ["model error", f"{verdict['worst_ratio']:.4g}", "met" if met else "missed"] == [
        cell for i, cell in enumerate(next(r for r in cells if r[0] == "model error")) if i != 2
    ]
    identified = result["identification"]
    for name, value in identified["theta"].items():
        deviation = identified["standard_deviation"][name]
        row = next(r for r in cells if r[0] == name)
        assert row[1:3] == [f"{value:.6g}", f"{deviation:.2g}"]
        limits = [scipy.stats.norm.ppf(p, value, deviation) for p in (0.025, 0.975)]
        assert [*map(float, row[3].split(" to "))] == pytest.approx(limits, abs=0.02 * deviation)


def test_the_page_of_an_estimate_and_of_its_figures(data, tmp_path):
    found = identify(parse_spec(SPEC % ""), data)
    write_run(found, tmp_path / "run")
    page = parse(report_text(tmp_path / "run"))
    assert "The model was estimated from 400 samples" in words(page)
    assert "predicted one step ahead" in words(page)
    assert "Further figures" not in words(page)


@pytest.mark.slow
def test_the_page_of_a_study(tmp_path):
    overrides = ["simulation={runs: 20, compare: [white], plant: {B: [0, 1.1], F: [1, -0.4]}}"]
    outcome = simulate(parse_spec(SPEC % LOOP, overrides=overrides))
    write_run(outcome, tmp_path / "run")
    page, inputs = parse(report_text(tmp_path / "run")), outcome.result["simulation"]["inputs"]
    cells = rows(page)
    for name, entry in inputs.items():
        row = next(r for r in cells if r[0] == name.replace("_", " ") and len(r) > 4)
        assert row[1].startswith(f"{100 * entry['within_r_adm']:.1f} %")
        assert row[2].startswith(f"{100 * entry['on_design_model']['within_r_adm']:.1f} %")
        assert row[4] == f"{entry['cost']:.5g}"
    share = f"{100 * inputs['design']['within_r_adm']:.1f} %"
    assert f"In 20 simulated experiments {share} of the models stayed within r_adm" in words(page)
    assert "Further figures" not in words(page)


LOSS = {"loss": {"mean": 2.0, "sd": 0.5}, "theory": {"value": 3.6, "loss": {"mean": 1.9, "sd": 0.4}}}
MSE = {"mse": 1.25, "mse_standard_error": 0.1, "theory": {"mse": 1.2, "mean_estimate": []}}


@pytest.mark.parametrize(
    ("entry", "cells"), [(LOSS, ["2 ± 0.5", "1.9 ± 0.4"]), (MSE, ["1.25 ± 0.1", "1.2"]), ({"a": 0.5}, None)]
)
def test_studies_of_other_kinds_have_their_numbers_on_the_page(entry, cells, copied, unpictured):
    """A study of an unknown kind is listed among all numbers."""
    result = json.loads((copied / "result.json").read_text())
    result["simulation"] = {"runs": 10, "seed": 1, "inputs": {"white": entry}}
    (copied / "result.json").write_text(json.dumps(result))
    page = parse(report_text(copied))
    assert ["white", *cells] in rows(page) if cells else "inputs.white.a" in words(page)


@pytest.mark.slow
def test_charts_of_the_error_of_a_top_up_are_labelled_design_and_data(data, tmp_path):
    """A top-up has its own design; the error from the data is drawn beside it."""
    spec = parse_spec(SPEC % "", overrides=["accuracy.model_error.relative=0.1"])
    write_run(assess(spec, data).results, tmp_path / "run")
    panels = {stem: one.panels for stem, one in read_curves(tmp_path / "run").items() if "bound" in stem}
    assert {stem: panel.label for stem, (panel,) in panels.items()} == {
        "bound": "design",
        "data_bound": "data",
    }
    page = parse(report_text(tmp_path / "run"))
    drawn = [
        json.loads(f.get("data-readings")) for f in page.iter(f"{XHTML}figure") if f.get("data-readings")
    ]
    named = {curve["name"] for panels in drawn for panel in panels for curve in panel["curves"]}
    assert {"r_u, design", "r_u, data"} <= named


@pytest.mark.parametrize(
    ("sources", "command"),
    [
        (["a.csv", "b.csv"], "idesign explore a.csv b.csv --columns u1=valve"),
        (["wish.yaml", "a b.csv"], "idesign explore 'a b.csv' --spec wish.yaml --columns u1=valve"),
        ([], "idesign explore DATA --columns u1=valve"),
    ],
)
def test_the_page_of_an_explored_log_names_its_command(sources, command):
    explored = SimpleNamespace(exploration=SimpleNamespace(channels={"u1": "valve"}))
    assert command_of("identify", explored, sources) == command


@pytest.mark.parametrize("left", [None, 0, 40, -40])
def test_an_error_names_the_file_that_is_missing_empty_or_cut(left, runs, unpictured, tmp_path, monkeypatch):
    """Every file of a run and of a sweep is tried; a page that does not need the file may be made."""
    monkeypatch.setattr("inputdesign_cli.report.sweep_page.sweep_figures", lambda _: [])
    run_sweep(runs / "open.yaml", ["experiment.samples=50,-1"], directory=tmp_path / "sweep")
    shutil.copytree(runs / "open", tmp_path / "run")
    python, named = (r"(?i)errno|__|error|object|index|none|char \d|argument|expect|\bkey\b|codec", set())
    for file in sorted(path for path in tmp_path.rglob("*") if path.is_file() and path.name[0] != "."):
        whole, root = file.read_bytes(), tmp_path / file.relative_to(tmp_path).parts[0]
        _ = file.unlink() if left is None else file.write_bytes(whole[:left])
        for read in (report_text, bibtex_text, read_curves):
            try:
                read(root)
            except IdesignError as error:
                said = str(error).replace(str(tmp_path), "")
                assert (file.name in said, re.search(python, said)) == (True, None)
                named.add(file.name)
        file.write_bytes(whole)
    assert named >= {"result.json", "spec.yaml", "sweep.csv", "sweep.json", "figures.json"}
