"""Inputs that nothing pays for or limits are refused; a loop that integrates is excited where it is slow."""

import warnings

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve, validate
from inputdesign_cli.errors import SpecError

TWO_INPUTS = """
plant: {B: [[[0, 1.0, 0.4], [0, -0.5, 0.3]]], F: [[[1, -0.7], [1, 0.4]]]}
noise: {variance: 1}
experiment: {samples: 500}
"""
TWO_OUTPUTS = """
plant: {A: [1, -0.7], B: [[[0, 1.0, 0.4], [0, -0.5, 0.3]], [[0, 0.3], [0, 0.8]]]}
noise: {variance: 1}
experiment: {samples: 500}
"""
ERROR = "accuracy: {model_error: {relative: 0.1}}\n"
LOOP = "experiment.controller={numerator: [[[0.1]], [[0]]], denominator: [1, -1]}"


def codes(text, *overrides):
    try:
        validate(parse_spec(text, overrides=list(overrides)))
    except SpecError as error:
        return [diagnostic.code for diagnostic in error.diagnostics]
    return []


@pytest.mark.parametrize("spectrum", ["{type: fir, order: 4}", "{type: free}", "{type: multisine, lines: 9}"])
def test_what_no_power_notices_is_refused(spectrum):
    """One output cannot tell what two inputs do together: they may cancel."""
    asked = (TWO_INPUTS + ERROR, f"spectrum={spectrum}")
    assert codes(*asked, "cost={output_power: 1}") == ["no-cost"]
    assert codes(*asked, "cost={output_power: 1, input_power: [0, 0.1]}") == []
    assert codes(*asked, "objective=shortest_experiment", "limits={output_power: 9}") == ["needs-limits"]
    assert codes(*asked, "objective=best_accuracy", "limits={output_power: 9}", LOOP) == ["needs-limits"]


def test_an_input_without_a_price_is_named():
    with pytest.raises(SpecError, match="input 2 costs nothing"):
        validate(parse_spec(TWO_OUTPUTS + ERROR, overrides=["cost={input_power: [1, 0]}"]))


def test_as_many_outputs_as_inputs_notice_everything():
    assert codes(TWO_OUTPUTS + ERROR, "cost={output_power: 1}") == []
    assert codes(TWO_OUTPUTS + "accuracy: {criterion: T}\n", "limits={output_power: [1, 2]}") == []
    parallel = "plant.B=[[[0, 1, 0.4], [0, 2, 0.8]], [[0, 0.3], [0, 0.6]]]"
    assert codes(TWO_OUTPUTS + ERROR, "cost={output_power: 1}", parallel) == ["no-cost"]


def test_a_limit_on_the_density_counts_every_direction():
    criterion = TWO_INPUTS + "accuracy: {criterion: D}\nspectrum: {type: fir, order: 4}\n"
    assert codes(criterion, "limits={output_power: 9}") == ["needs-limits"]
    assert codes(criterion, "limits={output_power: 9, spectrum: 4}") == []


@pytest.mark.slow
def test_a_limit_may_leave_combinations_that_the_cost_counts():
    """The cheapest design puts little into y; a limit on y that it keeps costs a little, without warnings."""
    free = {"cost": "{input_power: 1}", "spectrum": "{type: fir, order: 3}", "signal": "{candidates: 1}"}
    overrides = [f"{key}={value}" for key, value in free.items()]
    least = solve(parse_spec(TWO_INPUTS + ERROR, overrides=overrides)).result
    most = 0.98 * sum(least["power"]["output"])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        held = parse_spec(TWO_INPUTS + ERROR, overrides=[*overrides, f"limits.output_power={most}"])
        result = solve(held).result
    assert result["power"]["output"][0] <= most * (1.0 + 1e-9)
    assert least["cost"] * (1.0 - 1e-7) <= result["cost"] <= 1.01 * least["cost"]


# A pole of this loop has an angle of rounding, so that the grid of frequencies has a point next to zero.
INTEGRATING = """
plant:
  parameters: {a: 3.21, k: 0.9362, m: 1.865}
  state_space: {A: [[-a, 0], [m, -m]], B: [[k*a], [0]], C: [[0, 1]], delay: 0.04888}
  sample: zoh
  known: [m]
noise: {variance: 0.02358, C: [1.0, 0.23507, -0.52711]}
experiment: {samples: 1000, controller: {pid: {Kp: 0.3, Ti: 0.9346}}}
sample_time: 0.06794
accuracy: {standard_deviation: {k: 0.1024}}
objective: best_accuracy
limits: {input_power: 0.2527}
spectrum: {type: free}
signal: {seed: 81, type: multisine}
"""


def test_the_proof_closes_for_a_very_slow_input():
    """To a very slow input the gain alone matters: var(k) <= v C(1)^2 / (N p), for G(0) = k."""
    found = solve(parse_spec(INTEGRATING)).result["objective"]
    assert found["relative_gap"] < 1e-7
    slow = np.sqrt(0.02358 / (1000 * 0.2527)) * (1 + 0.23507 - 0.52711)
    # What the noise adds around the loop only helps, and is little.
    assert 0.99 * slow < found["value"] * 0.1024 < slow
    assert found["value"] == pytest.approx(found["any_spectrum_bound"], rel=1e-7)
