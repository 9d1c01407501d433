"""Numbers beyond arithmetic, memory or time are refused with their key; results do not depend on units."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve, validate
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.questions import finite, most_extreme, sound_arithmetic
from tests.support.first_order_specs import PLANT as WHOLE
from tests.support.outcomes import typed
from tests.support.refusals import refusal

BOUND = "accuracy: {model_error: {relative: 0.01, alpha: 2.45}}"
CRITERION = "accuracy: {criterion: D}\nlimits: {input_power: 1}"


def objective(asked, *, variance=1.0, gain=3.6):
    text = (
        f"plant: {{B: [0, {gain}], F: [1, -0.7]}}\nnoise: {{C: [1, -0.9], variance: {variance}}}\n{asked}\n"
    )
    return solve(parse_spec(f"{text}experiment: {{samples: 50}}\nspectrum: {{type: fir, order: 3}}")).result[
        "objective"
    ]


@pytest.mark.first(1)
@pytest.mark.parametrize("power", [-40, 20])
def test_designs_scale_with_their_units_from_1e_minus_40_to_1e20(power):
    unit = 10.0**power
    plain, other = objective(BOUND)["value"], objective(BOUND, variance=unit)["value"]
    assert other / unit == pytest.approx(plain, rel=1e-6)
    half = 10.0 ** (power / 2)
    assert objective(BOUND, gain=3.6 * half)["value"] * unit == pytest.approx(plain, rel=1e-6)
    # The information on c1 has no unit; that on b1 and f1 is inverse to the variance.
    better = objective(CRITERION, variance=1 / unit)["value"]
    assert better == pytest.approx(objective(CRITERION)["value"] + 2 * math.log(unit), rel=1e-6)


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("noise.variance", "noise: {variance: 1.0e-300}"),
        ("sample_time", "sample_time: 1.0e+300"),
        ("accuracy.model_error.alpha", "accuracy: {model_error: {relative: 0.01, alpha: 1.0e-300}}"),
        ("accuracy.standard_deviation.b1", "accuracy: {standard_deviation: {b1: 1.0e-300}}"),
        ("plant.B[1]", "plant: {B: [0, 1.0e+300], F: [1, -0.7]}"),
        ("experiment.prior.information[0][0]", "experiment: {prior: {information: [[1.0e+300, 0], [0, 1]]}}"),
        ("signal.offset", "signal: {offset: 1.0e+90}\nexperiment: {samples: 50}"),
    ],
)
def test_a_number_out_of_range_is_refused_by_its_key(key, text):
    base = {"plant": "plant: {B: [0, 1], F: [1, -0.7]}", "noise": "noise: {variance: 1}", "accuracy": BOUND}
    lines = [line for name, line in base.items() if not text.startswith(name)]
    diagnostic = refusal(lambda: solve(parse_spec("\n".join([*lines, text, "spectrum: {type: white}"]))))
    assert (diagnostic.code, diagnostic.key) == ("out-of-range", key)


@pytest.mark.parametrize("fault", [lambda: np.ones(1) / np.zeros(1), lambda: 1.0 / 0.0, lambda: 10.0**400])
def test_an_arithmetic_fault_is_reported_with_the_most_extreme_number(fault):
    with pytest.raises(InaccurateError) as found, sound_arithmetic(("noise.variance", 12.0)):
        fault()
    (diagnostic,) = found.value.diagnostics
    assert (diagnostic.code, diagnostic.key) == ("beyond-precision", "noise.variance")


def test_the_most_extreme_number_is_the_farthest_from_one_in_powers_of_ten():
    data = {"a": [1.0, {"b": 1e-9}], "c": 1e7, "d": 0.0, "e": True, "f": "1e99"}
    assert most_extreme(data) == ("a[1].b", pytest.approx(9.0))
    assert most_extreme({}) == ("", 0.0)


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_results_with_nan_or_infinity_are_refused(value):
    good = Results(
        typed({"cost": 1.0, "power": {"input": [1.0]}}), "", "s", {"spectrum": Table({"phi": np.ones(2)})}
    )
    assert finite(good, ("", 0.0)) is good
    for bad in (
        replace(good, outcome=typed({"cost": 1.0, "power": {"input": [value]}})),
        replace(good, tables={"spectrum": Table({"phi": np.array([1.0, value])})}),
    ):
        with pytest.raises(InaccurateError) as found:
            finite(bad, ("", 0.0))
        assert found.value.diagnostics[0].code == "beyond-precision"


def test_the_power_of_an_unused_input_is_not_negative():
    text = """
plant:
  continuous:
    numerator: [[[-1.4, 1.2], [-1.5]], [[0.5], [1.3]]]
    denominator: [[[1, 2.9, 2.1], [1, 0.9]], [[1, 1], [1, 1.2, 1.6]]]
noise: {variance: [[0.03, 0.02], [0.02, 0.26]]}
spectrum: {type: polynomial, order: 4, band: [0, 3], basis: legendre}
experiment: {samples: 500}
limits: {input_power: 1}
accuracy: {criterion: T}
"""
    found = solve(parse_spec(text)).result
    assert min(found["power"]["input"]) >= 0.0
    assert sum(found["power"]["input"]) == pytest.approx(1.0, rel=1e-6)


PLANT = WHOLE.replace("experiment: {samples: 500}\n", "")
ASKED = "accuracy: {model_error: {relative: 0.01, alpha: 2.45}}\nspectrum: {type: fir, order: 3}\n"


def refused(text):
    diagnostic = refusal(lambda: validate(parse_spec(text)))
    assert diagnostic.code == "too-large"
    return diagnostic


def test_cost_is_inverse_to_the_number_of_samples_up_to_1e15():
    few, many = (solve(parse_spec(f"{PLANT}{ASKED}experiment: {{samples: {n}}}")) for n in (500, 10**15))
    assert many.result["cost"] * 10**15 == pytest.approx(few.result["cost"] * 500, rel=1e-6)
    assert "signal" in few.result
    assert "signal" not in many.result


def test_a_requested_record_of_1e15_samples_is_refused():
    found = refused(f"{PLANT}{ASKED}experiment: {{samples: {10**15}}}\nsignal: {{seed: 1}}")
    assert found.key == "experiment.samples"
    assert "signal.samples: 1000000" in found.hint


def test_a_model_with_too_many_parameters_is_refused_with_the_largest_number():
    zeros = ", ".join(["0"] * 127)
    found = refused(f"plant: {{B: [0, 1], A: [1, {zeros}, 0.5]}}\nnoise: {{variance: 1}}\n{ASKED}")
    assert found.key == "plant"
    assert "127 parameters fit" in found.hint


def test_each_call_of_the_solver_gets_the_remaining_time_limit(slow_solver):
    text = f"{PLANT}{ASKED}experiment: {{samples: 500}}\n".replace("order: 3", "order: 20")
    solve(parse_spec(text + "solver: {time_limit: 10000}"))
    np.testing.assert_allclose(slow_solver, 10000.0 - 3.0 * np.arange(len(slow_solver)))
    slow_solver.clear()
    solve(parse_spec(text + "solver: {time_limit: 7}"))
    assert slow_solver == pytest.approx([7.0, 4.0, 1.0])
