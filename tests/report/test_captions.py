"""Captions and summaries in words mention what a result contains."""

import re
from dataclasses import replace

import numpy as np
import pytest

from inputdesign_cli import load_spec, solve
from inputdesign_cli.cli.summary import summary
from inputdesign_cli.outcome.curves import (
    BoundCurves,
    BoundPanel,
    Curves,
    FanCurves,
    FitCurves,
    NyquistCurves,
    OptimalityCurves,
    OrderCurves,
    PredictedPanel,
    SignalCurves,
    SpectrumCurves,
)
from inputdesign_cli.outcome.run_directory import curves_json
from inputdesign_cli.outcome.run_files import FIGURES
from inputdesign_cli.report.charts import captioned, run_charts
from inputdesign_cli.report.facts import facts, said
from tests.support.curves import CURVES
from tests.support.outcomes import typed

# The beginning of the caption of a figure of unknown content.
PLACEHOLDER = "The figure"
W = np.array([0.1, 1.0])
ONES = np.ones(2)


def bound(**entries):
    return BoundCurves((BoundPanel(W, 0.5 * ONES, ONES, **entries),))


def spectrum(**entries):
    return SpectrumCurves(W, np.ones((2, 1, 1), dtype=complex), **entries)


def nyquist(**entries):
    return NyquistCurves(W, ONES.astype(complex), ONES, **entries)


def fan(binding):
    return FanCurves(W, ONES[None], ONES, dict.fromkeys(binding, ONES))


PLAIN = bound(r_adm=ONES)
PREDICTED = (PredictedPanel("y1", ONES, ONES),)


@pytest.mark.parametrize(
    ("drawn", "other", "words"),
    [
        (bound(r_adm=ONES, r_u_equal=2.0 * ONES), bound(r_adm=ONES, r_u_equal=0.5 * ONES), "white"),
        (PLAIN, bound(), "below one"),
        (bound(r_adm=ONES, label="data"), PLAIN, "data"),
        (replace(PLAIN, of_several=True), PLAIN, "at others"),
        (spectrum(white=1.0), spectrum(white=1.0, lines=True), "white"),
        (nyquist(circle=0.5, limiting=W), nyquist(), "circle"),
        (FitCurves(W, (), (1, 1)), FitCurves(W, (), (2,)), "dotted"),
        (FitCurves(W, (), (2,), W), FitCurves(W, (), (2,)), "Grey"),
        (OptimalityCurves(W, ONES, W, ONES, 0.25), OptimalityCurves(W, ONES, W), "amplitude, 0.25"),
        (OrderCurves({}, (1.0, 2.0), 1), OrderCurves({}, (1.0, 2.0)), "y2"),
        (OrderCurves({}, (1.0, 2.0)), OrderCurves({}, (1.0, 2.0), unseen=False), "one part"),
        (fan("abcdefg"), fan("abc"), "5 of the 7"),
        (SignalCurves(W, {"u1": ONES}, predicted=PREDICTED), SignalCurves(W, {"u1": ONES}), "output"),
    ],
)
def test_a_caption_names_what_is_drawn_and_no_more(drawn, other, words):
    assert words in captioned(drawn)
    assert words not in captioned(other)


def test_every_kind_of_figure_has_a_caption():
    """A caption does not depend on the name of a file."""
    assert {type(one) for one in CURVES.values()} == set(Curves.__subclasses__())
    for curves in CURVES.values():
        assert not captioned(curves).startswith(PLACEHOLDER)


@pytest.mark.parametrize(
    ("stem", "name", "said"),
    [
        ("structures_2", "structures", "for y2"),
        ("data_fit", "fit", "predicted one step ahead"),
        ("errors_white", "error bands", "r_adm: white."),
        ("cloud_shift_register", "cloud", "theory: shift register."),
        ("disturbance_design", "signal", "does to the loop: design."),
        ("frequency_response", "response without a model", "at up to 5 % of the frequencies"),
    ],
)
def test_figures_of_a_run_are_captioned_by_what_they_show(stem, name, said, tmp_path):
    (tmp_path / FIGURES).write_bytes(curves_json({stem: CURVES[name]}))
    chart = run_charts(tmp_path, "s")[stem]
    assert said in chart.caption


ROBUST = {"source": "intervals", "scenarios": 31, "discarded": 0, "rejected": 0, "active": [], "r_adm": "own"}
ROBUST |= {"cost": "worst", "worst_share": 1.0, "worst_scenario": 0, "support": 0}
SEARCHED = {"proved": False, "parameters": {}, "region": "the intervals", "added": 1, "tried": 40}
KEPT = {"asked": 0.95, "chi_squared_alpha": 2.448, "runs": 4000, "kept": 0.96, "draws": 1000}
KEPT |= {"exact": 0.95, "exact_limits": (0.94, 0.96), "linear": 0.95}
DESIGN = {"kind": "least_cost", "value": 2.0, "lower_bound": 2.0}


def robust(kind, value, share):
    """A robust design whose worst plant found has this share of the error that is admitted or reached."""
    found = ROBUST | {"searched": SEARCHED | {"share": share}}
    return {"objective": {"kind": kind, "value": value}, "robust": found}


@pytest.mark.parametrize(
    ("gap", "written"),
    [*((gap, "below 1e-6") for gap in (0.0, 7.8e-11, 9.99e-7)), (1e-6, "1.0e-06"), (0.021, "2.1e-02")],
)
def test_a_gap_of_the_size_of_rounding_is_reported_as_below_1e_6(gap, written):
    result = {"objective": DESIGN | {"relative_gap": gap}, "spectrum": {"type": "fir"}}
    assert list(said("proofs", typed(result))) == [f"no FIR spectrum gets below 2, gap {written}"]


@pytest.mark.parametrize(
    ("limits", "said"),
    [((0.9567, 0.9686), True), ((0.9473, 0.9605), False), ((0.9501, 0.9633), False), ((0.93, 0.94), False)],
)
def test_an_exceeded_exact_confidence_is_reported(limits, said):
    result = {"model_error": {"confidence": KEPT | {"kept_limits": limits}, "alpha": 7.7}}
    (line,) = [text for name, text, _ in facts(typed(result), "s") if name == "confidence"]
    assert ("more than asked" in line) is said


THREE = {"objective": DESIGN, "power": {"input": [1.0, 0.5, 0.25], "output": [3.0]}}
AS_MUCH = {"objective": DESIGN, "baseline": {"white": {"cost": 2.0, "ratio": 1.0000001}}}
PEAKS = {"samples": 10, "peak": [3.0], "output_peak": [5.0]}


@pytest.mark.parametrize(
    ("result", "name", "numbers"),
    [
        (THREE, "power", "1 0.5 0.25 3"),
        (AS_MUCH, "cost", "2 2"),
        ({"signal": PEAKS | {"input_peak": [2.0]}}, "signal", "10 3 2 5"),
        ({"signal": PEAKS | {"input_peak": [3.0]}}, "signal", "10 3"),
        (robust("least_cost", 0.5, 1.0), "plants", "30 1"),
        # For the best accuracy the share is multiplied by the ratio that the design reaches.
        (robust("accuracy_factor", 0.148, 1.0 + 1e-9), "worst plant", "0.148"),
        (robust("accuracy_factor", 0.5, 1.002), "worst plant", "0.2 0.501"),
        (robust("least_cost", 3.0, 0.9), "worst plant", "0.9"),
    ],
)
def test_a_fact_contains_its_numbers(result, name, numbers):
    told = {name: "; ".join(filter(None, rest)) for name, *rest in facts(typed(result), "s")}
    assert re.findall(r"\d[\d.]*(?<!\.)", told[name].split("; searched")[0]) == numbers.split()


@pytest.mark.parametrize(("ratio", "reserve"), [(0.04, "25"), (0.5, "")])
def test_a_large_reserve_is_reported(ratio, reserve):
    asked = [{"name": "model_error", "worst_ratio": ratio, "frequency": None}]
    (line,) = said("verdict", typed({"assessment": {"verdict": "met", "met": True, "requirements": asked}}))
    assert re.findall(r"(\d+)-fold", line) == [reserve] * bool(reserve)


def test_numbers_have_their_deviations():
    """An estimate and a design report the standard deviations of parameters."""
    found = {"theta": {"gain": 2.0, "L": 25.0}, "standard_deviation": {"gain": 0.1, "L": 2.5}}
    assert "gain 2 +- 0.1, L 25 +- 2.5" in summary(typed({"identification": found}), "s", [])
    information = {"parameters": ["b1", "f1"], "matrix": [[100.0, 0.0], [0.0, 2500.0]]}
    information["standard_deviation"] = {"b1": 0.1, "f1": 0.02}
    assert ("std", "b1 0.1, f1 0.02", "") in facts(typed({"information": information}), "s")


@pytest.mark.parametrize(
    ("tests", "failed", "severity", "signs"),
    [
        (["trend", "delay", "u^2"], [], "note", 3),
        (["trend", "delay", "u^2"], ["delay"], "note", 0),
        (["trend", "delay", "u^2"], [], "refuted", 0),
        (["recent_residuals"], [], "note", 0),
    ],
)
def test_the_tests_of_a_model_are_listed_if_none_failed_or_refutes_it(tests, failed, severity, signs):
    test = {"statistic": 1.0, "degrees_of_freedom": 1, "probability": 0.3}
    found = {"theta": {"gain": 2.0}, "tests": dict.fromkeys(tests, test), "failed": failed}
    finding = {"code": "x", "severity": severity, "message": "A finding."}
    shown = facts(typed({"identification": found, "findings": [finding]}), part="estimate")
    looked = [one.value.split(",") for one in shown if one.name == "tested"]
    assert [len(one) for one in looked] == [signs] * bool(signs)


def test_on_trouble_the_terminal_shows_one_finding_and_the_next_command(tmp_path):
    found = {"verdict": "undecided", "met": False, "undecided": ["Past inputs explain residuals."]}
    found |= {"causes": ["contradicted"], "next": "idesign explore a.csv"}
    result = {"assessment": found, "notes": ["Past inputs explain residuals.", "The residuals drift."]}
    told = summary(typed(result), "s", [])
    assert "next: idesign explore a.csv" in told
    assert told.count("Past inputs explain residuals.") == 1
    assert "1 more with --json" in told
    assert "1 more in result.json" in summary(typed(result), "s", [tmp_path / "result.json"])
    assert "The residuals drift." not in told


@pytest.mark.slow
def test_a_loop_error_names_the_theory_of_its_ratios():
    """Table I of errata.md: N J of formula (19) and of white noise, and 27.7 % in the mean loss."""
    spec = load_spec("specs/distillation_column.yaml", ["signal={samples: 100, candidates: 1}"])
    found = {name: f"{text} {remark}" for name, text, remark in facts(solve(spec).outcome, "s")}
    assert "7.27 times" in found["error of the loop"]
    assert "asymptotic" in found["error of the loop"]
    assert "5.262" in found["for this structure"]
    assert f"{1.02222e-5 / 5.26272e-6:.3g} times" in found["for this structure"]
    assert "27.7 %" in found["for this structure"]
