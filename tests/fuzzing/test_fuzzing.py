"""A few specs of `make fuzz` in this process, and faults that the judge must find."""

from __future__ import annotations

import random
import warnings
from contextlib import suppress
from unittest.mock import Mock

import pytest
import yaml

from inputdesign_cli import load_spec, parse_spec, solve, validate
from inputdesign_cli.errors import IdesignError
from tests.fuzzing.generation import generated
from tests.fuzzing.judge import judged, nonsense, written
from tests.fuzzing.mutations import ROOT, mutated
from tests.fuzzing.textbook import findings, worst_ratio

# Seeds whose specs end within moments, one way or another.
SEEDS = (1, 2, 3, 5, 8, 13, 21)


def of_shipped(seed):
    return mutated(random.Random(seed))


@pytest.mark.first(1)
@pytest.mark.parametrize(
    ("make", "seed"), [*((of_shipped, seed) for seed in SEEDS), *((generated, seed) for seed in (3, 7, 11))]
)
def test_specs_have_answers_without_a_fault(make, seed):
    text = yaml.safe_dump(make(seed), default_flow_style=None, sort_keys=False)
    assert judged(text, ROOT / "specs")[1] == ""


@pytest.mark.slow
def test_enough_random_specs_are_well_posed():
    """Otherwise nothing would be tested. The same number gives the same spec."""
    assert generated(5) == generated(5)
    posed = 0
    for number in range(24):
        with suppress(IdesignError):
            validate(parse_spec(yaml.safe_dump(generated(number))))
            posed += 1
    assert posed >= 10


LOOP = """
plant: {A: [1, -0.5], B: [0, 1.0, 0.3]}
noise: {C: [1, 0.4], variance: 0.2}
experiment: {samples: 200, controller: {numerator: [0.3], denominator: [1, -0.2]}}
accuracy: {model_error: {absolute: 0.1, alpha: 2, band: [0.1, 2]}}
"""


def scaled(value, factor):
    """Numbers, complex ones and lists of them, times a factor."""
    if isinstance(value, list):
        return [scaled(part, factor) for part in value]
    if isinstance(value, dict):
        return {key: scaled(part, factor) for key, part in value.items()}
    return factor * value


TEXTS = {
    "loop": LOOP,
    **{name: (ROOT / "specs" / f"{name}.yaml").read_text() for name in ("first_order", "two_by_two_loop")},
}


@pytest.mark.first(3)
@pytest.mark.parametrize(
    ("name", "spectrum"),
    [
        *(("loop", spectrum) for spectrum in ("{type: white}", "{type: fir, order: 4}", "{type: free}")),
        ("first_order", "{type: free}"),
        ("two_by_two_loop", "{type: fir, order: 4}"),
    ],
)
def test_textbook_formulas_agree_and_detect_a_weaker_spectrum(name, spectrum):
    spec = parse_spec(
        TEXTS[name],
        overrides=[f"spectrum={spectrum}", "signal.samples=64", "solver.any_spectrum_tolerance=0.009"],
    )
    result = written(solve(spec))
    content = dict(spec.content)
    assert worst_ratio(content, result) == pytest.approx(1.0, abs=1e-6)
    assert findings(content, result) == []
    for key in ("coefficients", "powers", "power"):
        if key in result["spectrum"]:
            result["spectrum"][key] = scaled(result["spectrum"][key], 0.999)
    assert worst_ratio(content, result) == pytest.approx(0.999**-0.5, abs=1e-4)
    assert any("times what is admitted" in told for told in findings(content, result))


def test_the_judge_finds_false_statements():
    spec = load_spec(ROOT / "specs" / "first_order.yaml")
    result, content = written(solve(spec)), dict(spec.content)
    assert nonsense(content, result) == ""
    weaker = {**result["spectrum"], "coefficients": [0.99 * c for c in result["spectrum"]["coefficients"]]}
    assert "admitted" in nonsense(content, {**result, "spectrum": weaker})
    beyond = {**result["objective"], "lower_bound": 2.0 * result["objective"]["value"]}
    assert "bound" in nonsense(content, {**result, "objective": beyond})


def test_the_judge_finds_exceptions_and_warnings(monkeypatch):
    text = (ROOT / "specs" / "first_order.yaml").read_text()
    monkeypatch.setattr("tests.fuzzing.judge.solve", Mock(side_effect=RuntimeError("a mistake")))
    assert "a mistake" in judged(text, ROOT / "specs")[1]
    done = solve(load_spec(ROOT / "specs" / "criterion.yaml"))

    def warns(spec):
        warnings.warn("careful", stacklevel=1)
        return done

    monkeypatch.setattr("tests.fuzzing.judge.solve", warns)
    assert "careful" in judged((ROOT / "specs" / "criterion.yaml").read_text(), ROOT / "specs")[1]
