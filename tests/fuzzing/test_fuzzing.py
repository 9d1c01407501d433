"""A few mutated specs in this process, and what the judge must see; `make fuzz` runs many."""

from __future__ import annotations

import dataclasses
import random

import pytest
import yaml

from inputdesign_cli import load_spec, parse_spec, solve
from inputdesign_cli.runs.run_directory import finished_result
from tests.fuzzing.judge import independent_ratio, judged, nonsense
from tests.fuzzing.mutations import ROOT, mutated

# Seeds whose specs end within moments, one way or another.
SEEDS = (1, 2, 3, 5, 8, 13, 21)


@pytest.mark.parametrize("seed", SEEDS)
def test_mutated_specs_end_well(seed):
    text = yaml.safe_dump(mutated(random.Random(seed)), default_flow_style=None, sort_keys=False)
    _, wrong = judged(text, ROOT / "specs")
    assert wrong == ""


LOOP = """
plant: {A: [1, -0.5], B: [0, 1.0, 0.3]}
noise: {C: [1, 0.4], variance: 0.2}
experiment: {samples: 200, controller: {numerator: [0.3], denominator: [1, -0.2]}}
accuracy: {model_error: {absolute: 0.1, alpha: 2, band: [0.1, 2]}}
"""


@pytest.mark.parametrize("spectrum", ["{type: white}", "{type: fir, order: 4}", "{type: free}"])
@pytest.mark.parametrize(
    "text", [LOOP, (ROOT / "specs" / "first_order.yaml").read_text()], ids=["loop", "open"]
)
def test_the_independent_ratio_of_a_design_is_one(text, spectrum):
    spec = parse_spec(text, overrides=[f"spectrum={spectrum}"])
    assert independent_ratio(spec, solve(spec).result) == pytest.approx(1.0, abs=1e-6)


def test_the_judge_sees_nonsense():
    spec = load_spec(ROOT / "specs" / "first_order.yaml")
    result = finished_result(solve(spec))
    assert nonsense(spec, result) == ""
    weaker = {**result["spectrum"], "coefficients": [0.99 * c for c in result["spectrum"]["coefficients"]]}
    assert "ratio" in nonsense(spec, {**result, "spectrum": weaker})
    beyond = {**result["objective"], "lower_bound": 2.0 * result["objective"]["value"]}
    assert "bound" in nonsense(spec, {**result, "objective": beyond})


def test_the_judge_sees_exceptions_and_warnings(monkeypatch):
    text = (ROOT / "specs" / "first_order.yaml").read_text()

    def broken(spec):
        raise RuntimeError("a mistake")

    monkeypatch.setattr("tests.fuzzing.judge.solve", broken)
    assert "a mistake" in judged(text, ROOT / "specs")[1]
    done = dataclasses.replace(solve(load_spec(ROOT / "specs" / "criterion.yaml")))

    def warns(spec):
        import warnings

        warnings.warn("careful", stacklevel=1)
        return done

    monkeypatch.setattr("tests.fuzzing.judge.solve", warns)
    assert "careful" in judged((ROOT / "specs" / "criterion.yaml").read_text(), ROOT / "specs")[1]
