"""At any time limit the delivered design meets its requirements, and its bounds hold."""

from __future__ import annotations

from itertools import count

import numpy as np
import pytest

from inputdesign_cli import parse_spec, simulate, solve
from inputdesign_cli.compute.time_limit import stoppable, watching
from inputdesign_cli.errors import InaccurateError
from tests.fuzzing.judge import written
from tests.fuzzing.textbook import findings
from tests.support.first_order_specs import ERROR as BOUND, PLANT

SPECS = {
    "cost": BOUND + "spectrum: {type: fir, order: 20}\n",
    "sinusoids": BOUND + "spectrum: {type: free}\n",
    "limits that bind": BOUND + "spectrum: {type: fir, order: 12}\nlimits: {output_power: 30}\n",
    "limits that white keeps": BOUND + "spectrum: {type: fir, order: 12}\nlimits: {input_power: 1.8}\n",
    "best accuracy": BOUND + "objective: best_accuracy\nspectrum: {type: fir, order: 12}\n"
    "limits: {input_power: 1}\n",
    "shortest": BOUND + "objective: shortest_experiment\nspectrum: {type: fir, order: 12}\n"
    "limits: {input_power: 1}\n",
    "criterion": "accuracy: {criterion: D}\nspectrum: {type: fir, order: 12}\nlimits: {input_power: 1}\n",
    "A, std b1": "accuracy: {criterion: A, standard_deviation: {b1: 0.2}}\nspectrum: {type: fir, order: 12}\n"
    "limits: {input_power: 1}\n",
}


@pytest.mark.first(2)
@pytest.mark.parametrize("text", SPECS.values(), ids=SPECS)
def test_a_design_at_any_time_limit_meets_its_requirements_with_valid_bounds(slow_solver, text):
    best = solve(parse_spec(PLANT + text)).result["objective"]
    statuses = []
    for calls in count():
        spec = parse_spec(f"{PLANT}{text}solver: {{time_limit: {3 * calls + 1}}}\n")
        try:
            result = written(solve(spec))
        except InaccurateError as ended:
            statuses.append(ended.diagnostics[0].code)
            continue
        found, status = result["objective"], result["status"]
        statuses.append(status)
        assert findings(dict(spec.content), result) == []
        slack = 1e-7 * max(1.0, abs(best["value"]))
        side = 1.0 if "upper_bound" in best else -1.0
        for name in ("value", "lower_bound", "upper_bound"):
            beyond = side if name != "value" else -side
            assert beyond * (found.get(name, best["value"]) - best["value"]) >= -slack
        if "any_spectrum_bound" in found:
            assert side * (found["any_spectrum_bound"] - found["value"]) >= -slack
        assert (status == "gap_open") == (found.get("relative_gap", 1.0) > 1e-5)
        if status == "gap_open":
            assert result["solver"]["ended_by"] == "solver.time_limit"
            assert "no-record-in-time" in [one["code"] for one in result["findings"]]
        if status == "optimal" and "signal" in result and "any_spectrum_bound" in found:
            assert "notes" not in result or "came before" not in " ".join(result["notes"])
            break
    assert {"gap_open", "optimal"} <= set(statuses)
    assert set(statuses[: statuses.index("gap_open")]) <= {"out-of-time"}
    assert "out-of-time" not in statuses[statuses.index("gap_open") :]


EXACT = SPECS["cost"].replace("alpha: 2.45", "confidence: {exact: 0.9, draws: 200}")


@pytest.mark.parametrize(
    ("verb", "text"), [(simulate, SPECS["cost"] + "simulation: {runs: 2}\n"), (solve, EXACT)]
)
def test_simulation_and_exact_confidence_are_refused_without_time_for_a_record(slow_solver, verb, text):
    with pytest.raises(InaccurateError) as ended:
        verb(parse_spec(f"{PLANT}{text}solver: {{time_limit: 1}}"))
    assert ended.value.diagnostics[0].code == "out-of-time"


def test_an_interrupt_has_the_effect_of_a_time_limit():
    with stoppable() as stop, watching(lambda done: stop()):
        result = solve(parse_spec(PLANT + SPECS["cost"])).result
    assert (result["status"], result["solver"]["ended_by"]) == ("gap_open", "the interrupt")


MOMENTS = """
plant: {regression: {estimated: 2, neglected: 3}}
noise: {variance: 1.0}
accuracy:
  mean_squared_error: {target: 1.2, estimated: [1, 1], neglected: [0.5, 0.3, 0.4], neglected_norm: 1.0}
spectrum: {type: moments, structure: toeplitz}
"""


def test_moments_are_delivered_with_a_valid_bound_at_any_time_limit(slow_solver):
    best = solve(parse_spec(MOMENTS)).result["objective"]
    gaps = []
    for seconds in (1, 91, 601):
        result = solve(parse_spec(f"{MOMENTS}solver: {{time_limit: {seconds}}}")).result
        found = result["objective"]
        assert result["mean_squared_error"]["value"] <= 1.2 * (1.0 + 1e-6)
        assert found["lower_bound"] <= best["value"] * (1.0 + 1e-6) <= found["value"] * (1.0 + 2e-6)
        gaps.append(found["relative_gap"])
    assert np.all(np.diff(gaps) <= 1e-9)
    assert gaps[0] > 1e-3


@pytest.mark.first(2)
@pytest.mark.parametrize("prices", [[1, 1], [1, 30], [0.03, 1]])
@pytest.mark.parametrize("gains", [(1, 0.5), (0.02, 3)])
def test_a_design_of_two_inputs_never_costs_more_than_white_input(prices, gains):
    """This holds after the first round and at the end."""
    text = f"""
plant: {{B: [[[0, {gains[0]}], [0, {gains[1]}]]], F: [[[1, -0.5], [1, -0.9]]]}}
noise: {{variance: 0.1}}
experiment: {{samples: 200}}
cost: {{input_power: {prices}}}
accuracy: {{model_error: {{relative: 0.1}}}}
spectrum: {{type: fir, order: 3}}
"""
    with stoppable() as stop, watching(lambda done: stop()):
        early = solve(parse_spec(text)).result
    best = solve(parse_spec(text)).result
    white = best["baseline"]["white"]["cost"]
    assert best["cost"] <= early["cost"] * (1.0 + 1e-7) <= white * (1.0 + 2e-7)
