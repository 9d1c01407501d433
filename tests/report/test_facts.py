"""A result in words."""

import pytest

from inputdesign_cli import load_spec, solve
from inputdesign_cli.cli.summary import summary
from inputdesign_cli.report.facts import facts, proofs
from tests.support.outcomes import typed

ROBUST = {"source": "intervals", "scenarios": 31, "discarded": 0, "rejected": 0, "active": [], "r_adm": "own"}
ROBUST |= {"cost": "worst", "worst_share": 1.0, "worst_scenario": 0, "support": 0}
SEARCHED = {
    "proved": False,
    "parameters": {},
    "share": 1.0,
    "region": "the intervals",
    "added": 1,
    "tried": 40,
}


@pytest.mark.parametrize(
    ("gap", "told"),
    [
        (0.0, "gap below 1e-6"),
        (7.8e-11, "gap below 1e-6"),
        (9.99e-7, "gap below 1e-6"),
        (1e-6, "gap 1.0e-06"),
        (0.021, "gap 2.1e-02"),
    ],
)
def test_a_gap_that_only_rounding_decides_is_told_as_closed(gap, told):
    result = {
        "objective": {"kind": "least_cost", "value": 2.0, "lower_bound": 2.0, "relative_gap": gap},
        "spectrum": {"type": "fir"},
    }
    assert list(proofs(typed(result))) == [f"no FIR spectrum gets below 2, {told}"]


@pytest.mark.parametrize(
    ("limits", "said"),
    [((0.9567, 0.9686), True), ((0.9473, 0.9605), False), ((0.9501, 0.9633), False), ((0.93, 0.94), False)],
)
def test_an_exact_confidence_that_is_exceeded_is_told(limits, said):
    told = {"asked": 0.95, "chi_squared_alpha": 2.448, "runs": 4000, "kept": 0.96, "kept_limits": limits}
    told |= {"draws": 1000, "exact": 0.95, "exact_limits": (0.94, 0.96), "linear": 0.95}
    result = {"model_error": {"confidence": told, "alpha": 7.7}}
    (line,) = [text for name, text, _ in facts(typed(result), "s") if name == "confidence"]
    assert ("more than asked" in line) is said


def test_channels_are_enumerated_and_equal_costs_are_told_as_such():
    result = {
        "objective": {"kind": "least_cost", "value": 2.0},
        "power": {"input": [1.0, 0.5, 0.25], "output": [3.0]},
        "baseline": {"white": {"cost": 2.0, "ratio": 1.0000001}},
    }
    told = {name: (value, note) for name, value, note in facts(typed(result), "s")}
    assert told["power"][0] == "input 1, 0.5 and 0.25, output 3"
    assert told["cost"][1] == "white excitation: 2, as much"


def test_plants_that_a_search_found_are_told_apart_from_those_that_were_drawn():
    robust = ROBUST | {"searched": SEARCHED}
    limits = [{"name": "amplitude.input", "binding": True}]
    result = {"objective": {"kind": "accuracy_factor", "value": 0.5}, "robust": robust, "limits": limits}
    told = {name: value for name, value, _ in facts(typed(result), "s")}
    assert told["plants"].endswith("the plant of the spec and 30 drawn and 1 that a search found")
    assert told["limits"] == "input amplitude exhausted"


@pytest.mark.parametrize(
    ("objective", "share", "words"),
    [
        (
            {"kind": "accuracy_factor", "value": 0.148},
            1.0 + 1e-9,
            "none was found in the intervals that errs more than the plants that the design is for: 0.148 of "
            "the admissible error",
        ),
        (
            {"kind": "accuracy_factor", "value": 0.5},
            1.002,
            "the worst that was found in the intervals errs 0.2 % more than the plants that the design is "
            "for: 0.501 of the admissible error",
        ),
        (
            {"kind": "least_cost", "value": 3.0},
            0.9,
            "0.9 of the admissible error is the most that was found in the intervals",
        ),
    ],
)
def test_the_worst_plant_is_measured_by_what_is_admitted_whatever_is_sought(objective, share, words):
    """`share` is one of the ratio that is reached where the best accuracy is sought: times that ratio."""
    robust = ROBUST | {"searched": SEARCHED | {"share": share}}
    told = {name: value for name, value, _ in facts(typed({"objective": objective, "robust": robust}), "s")}
    assert told["worst plant"] == words


def test_the_terminal_tells_estimates_with_their_deviations():
    found = {"theta": {"gain": 2.0, "L": 25.0}, "standard_deviation": {"gain": 0.1, "L": 2.5}}
    assert "gain 2 +- 0.1, L 25 +- 2.5" in summary(typed({"identification": found}), "s", [])


def test_a_loop_error_says_which_theory_its_ratios_are_of():
    """Table I of errata.md: N J of formula (19) and of white noise, and 27.7 % in the mean loss."""
    spec = load_spec("specs/distillation_column.yaml", ["signal={samples: 100, candidates: 1}"])
    found = {name: f"{text} {remark}" for name, text, remark in facts(solve(spec).outcome, "s")}
    assert "7.27 times" in found["error of the loop"]
    assert "asymptotic" in found["error of the loop"]
    assert "5.262" in found["for this structure"]
    assert f"{1.02222e-5 / 5.26272e-6:.3g} times" in found["for this structure"]
    assert "27.7 %" in found["for this structure"]
