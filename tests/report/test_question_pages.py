"""The pages about each kind of question: designs, assessments, estimates and studies."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from inputdesign_cli import analyse, assess, identify, load_spec, parse_spec, simulate, solve
from inputdesign_cli.figures.plots import draw_all
from inputdesign_cli.outcome.curves_file import read_curves
from inputdesign_cli.outcome.run_directory import write_run
from inputdesign_cli.report.render import report_text
from tests.support.pages import LOOP, SPEC, XHTML, parse, rows, words

SPECS = Path(__file__).parents[2] / "specs"


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("name", "overrides", "verb", "said"),
    [
        (
            "regression",
            ["experiment.samples=100"],
            solve,
            ["bias and variance together, must not exceed 1", "Asked: the least energy", "No moments at all"],
        ),
        (
            "first_order",
            ["objective=shortest_experiment", "limits={input_power: 1}", "spectrum={type: white}"],
            solve,
            ["The length of the experiment is sought", "has 853 samples", "white excitation: 853"],
        ),
        (
            "first_order",
            ["objective=best_accuracy", "limits={input_power: 1}", "spectrum={type: white}"],
            solve,
            ["Asked: the smallest multiple of the admissible error", "can be kept to 1.30595 times"],
        ),
        (
            "criterion",
            ["spectrum.order=2"],
            solve,
            ["Asked: the most information within the limits", "log det M ="],
        ),
        (
            "first_order_given",
            [],
            analyse,
            ["what accuracy the given excitation buys", "The figures hold for"],
        ),
    ],
)
def test_each_kind_of_question_has_its_own_words(name, overrides, verb, said, tmp_path):
    write_run(verb(load_spec(SPECS / f"{name}.yaml", overrides)), tmp_path / "run")
    page = words(parse(report_text(tmp_path / "run")))
    for part in said:
        assert part in page, part


@pytest.fixture
def data(tmp_path):
    """A record of the plant of SPEC."""
    rng = np.random.default_rng(1)
    u, e = rng.standard_normal((2, 400))
    y = scipy.signal.lfilter([0, 1], [1, -0.5], u) + e
    path = tmp_path / "data.csv"
    path.write_text("u,y\n" + "".join(f"{a},{b}\n" for a, b in zip(u, y, strict=True)))
    return path


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
    assert (
        "These data meet" if met else "The experiment below is what the model of these data still needs"
    ) in words(page)
    assert "idesign assess spec.yaml DATA" in words(page)
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
    write_run(found, tmp_path / "run", draw_all(found))
    page = parse(report_text(tmp_path / "run"))
    assert "The model was estimated from 400 samples" in words(page)
    assert "predicted one step ahead" in words(page)
    assert "Further figures" not in words(page)


@pytest.mark.slow
def test_the_page_of_a_study(tmp_path):
    overrides = ["simulation={runs: 20, compare: [white], plant: {B: [0, 1.1], F: [1, -0.4]}}"]
    outcome = simulate(parse_spec(SPEC % LOOP, overrides=overrides))
    write_run(outcome, tmp_path / "run", draw_all(outcome))
    page, inputs = parse(report_text(tmp_path / "run")), outcome.result["simulation"]["inputs"]
    cells = rows(page)
    for name, entry in inputs.items():
        row = next(r for r in cells if r[0] == name.replace("_", " ") and len(r) > 4)
        assert row[1].startswith(f"{100 * entry['within_r_adm']:.1f} %")
        assert row[2].startswith(f"{100 * entry['on_design_model']['within_r_adm']:.1f} %")
        assert row[4] == f"{entry['cost']:.5g}"
    assert "20 runs of each input" in words(page)
    share = f"{100 * inputs['design']['within_r_adm']:.1f} %"
    assert f"In 20 simulated experiments {share} of the models stayed within r_adm" in words(page)
    assert "What the excitation alone does to the loop: white." in words(page)
    assert "Further figures" not in words(page)


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("inputs", "row"),
    [
        (
            {
                "white": {
                    "loss": {"mean": 2.0, "sd": 0.5},
                    "theory": {"value": 3.6, "loss": {"mean": 1.9, "sd": 0.4}},
                }
            },
            ["white", "2 ± 0.5", "1.9 ± 0.4"],
        ),
        (
            {"design": {"mse": 1.25, "mse_standard_error": 0.1, "theory": {"mse": 1.2, "mean_estimate": []}}},
            ["design", "1.25 ± 0.1", "1.2"],
        ),
    ],
)
def test_studies_of_other_kinds(inputs, row, runs, tmp_path):
    result = json.loads((runs / "open" / "result.json").read_text())
    shutil.copytree(runs / "open", tmp_path / "run")
    result["simulation"] = {"runs": 10, "seed": 1, "inputs": inputs}
    (tmp_path / "run" / "result.json").write_text(json.dumps(result))
    assert row in rows(parse(report_text(tmp_path / "run")))


@pytest.mark.slow
def test_the_chart_of_the_error_says_what_gave_it(data, tmp_path):
    """A top-up has a design of its own; what the data gave stands beside it."""
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
