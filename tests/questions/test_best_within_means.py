"""Best accuracy within amplitude, rate and duration alone, for several kinds of requirement."""

from pathlib import Path

import numpy as np
import pytest
import scipy.optimize

from inputdesign_cli import load_spec, parse_spec, solve
from inputdesign_cli.errors import InfeasibleError

SPECS = Path(__file__).parents[2] / "specs"
ONE_PARAMETER = """
plant: {B: [0, 1], F: [1, -0.9], known: [b1]}
noise: {variance: 1.0}
accuracy: {criterion: T}
limits: {amplitude: 1, rate: 0.2, samples: 500}
spectrum: {type: multisine, lines: 50}
solver: {any_spectrum: false}
"""
HEATER = """
sample_time: 5
plant: {continuous: {gain: 2.1, time_constant: 180, dead_time: 25}, sample: zoh}
noise: {variance: 0.04}
objective: best_accuracy
limits: {amplitude: 5, rate: %s, duration: 3600}
accuracy: {%s}
spectrum: {type: multisine, lines: 60}
solver: {any_spectrum: false}
"""
LINES = """
plant: {B: [0, 0.4, 0.1], F: [1, -1.5, 0.8]}
noise: {D: [1, -0.9], variance: 0.01}
objective: %s
limits: {samples: 10000, amplitude: 1, rate: 0.5}
accuracy: {frequency_response: {relative: 0.05, band: [0.1, 2], lines: 12, period: 400}}
"""


def test_a_design_within_amplitude_and_rate_is_the_optimum_of_a_linear_program():
    """One parameter: N sum p_k |dG/df|^2 is largest within sum p_k <= 1 and sum p_k |1 - e^-jw|^2 <= 0.04."""
    found = solve(parse_spec(ONE_PARAMETER)).result
    w = np.pi * np.arange(1, 51) / 50
    z = np.exp(-1j * w)
    worth = 500 * np.abs(z**2 / (1 - 0.9 * z) ** 2) ** 2
    rows = np.stack([np.ones(50), np.abs(1 - z) ** 2])
    plain = scipy.optimize.linprog(-worth, rows, [1.0, 0.04], method="highs")
    assert found["objective"]["value"] == pytest.approx(-plain.fun, rel=1e-6)
    assert {limit["name"]: limit["max"] for limit in found["limits"]} == {
        "amplitude.input": 1.0,
        "rate": pytest.approx(0.04),
    }


def test_an_experiment_without_a_length_lasts_as_long_as_its_limit_allows():
    assert parse_spec(ONE_PARAMETER).experiment.samples == 500
    heater = parse_spec(HEATER % (1, "criterion: D"))
    assert heater.experiment.samples == 720
    assert heater.with_(**{"experiment.duration": 1800}).experiment.samples == 360
    shortest = heater.with_(objective="shortest_experiment", accuracy={"standard_deviation": {"gain": 0.1}})
    assert shortest.experiment.samples == 1


@pytest.mark.first(1)
@pytest.mark.parametrize(
    "asked",
    [
        "loop: {tuning: {simc: {tau_c: 30}}, max_sensitivity_db: 6}",
        "standard_deviation: {gain: 0.05, time_constant: 6, dead_time: 0.5}",
    ],
)
def test_a_record_within_amplitude_and_rate_has_at_most_twice_the_designed_error(asked):
    """The rate limit raises the error of the design by more than a half."""
    found = solve(parse_spec(HEATER % (0.2, asked)))
    u = np.array(found.tables["signal"].columns["u1"])
    assert np.abs(u).max() <= 5.0
    assert np.abs(np.diff(u, prepend=0.0)).max() <= 0.2
    value = found.result["objective"]["value"]
    assert value <= found.result["signal"]["worst_ratio"] <= 2.0 * value
    free = solve(parse_spec((HEATER % (0.2, asked)).replace("rate: 0.2, ", ""))).result["objective"]["value"]
    assert value > 1.5 * free


@pytest.mark.slow
def test_a_record_of_a_robust_design_has_at_most_twice_the_designed_error():
    """A record clipped to the power of the design alternates between two values, with 7 times the error."""
    spec = parse_spec(
        (HEATER % (10, "loop: {tuning: {simc: {}}, max_sensitivity_db: 6}")).replace("2.1", "2")
    )
    plants = [
        {"gain": 2.014, "time_constant": 228.65, "dead_time": 19.66},
        {"gain": 1.433, "time_constant": 207.38, "dead_time": 25.57},
    ]
    found = solve(spec.with_(uncertainty={"scenarios": plants})).result
    assert found["signal"]["peak"][0] <= 5.0
    assert found["signal"]["worst_ratio"] <= 2.0 * found["objective"]["value"]


@pytest.mark.first(1)
@pytest.mark.parametrize("objective", ["best_accuracy", "shortest_experiment"])
def test_a_design_for_a_frequency_response_keeps_amplitude_and_rate(objective):
    found = solve(parse_spec(LINES % objective))
    result, u = found.result, np.array(found.tables["signal"].columns["u1"])
    assert np.abs(u).max() <= 1.0 + 1e-9
    assert np.abs(np.diff(u, prepend=0.0)).max() <= 0.5 + 1e-9
    assert max(np.abs(u).max(), 2 * np.abs(np.diff(u, prepend=0.0)).max()) == pytest.approx(1.0, rel=1e-6)
    assert len(u) <= 10000
    # Standard deviations at the lines from the transform of one period, but for a little leakage.
    w = np.array(result["spectrum"]["frequencies"])
    z = np.exp(-1j * w)
    G = (0.4 * z + 0.1 * z**2) / (1 - 1.5 * z + 0.8 * z**2)
    noise = 0.01 / np.abs(1 - 0.9 * z) ** 2
    U = np.exp(-1j * np.outer(w, np.arange(400))) @ u[400:800] / 400
    counted = len(u) - 400
    deviation = np.sqrt(2 * noise / (counted * 2 * np.abs(U) ** 2)) / (0.05 * np.abs(G))
    assert result["signal"]["worst_ratio"] == pytest.approx(deviation.max(), rel=0.02)
    if objective == "shortest_experiment":
        assert result["signal"]["worst_ratio"] <= 1.01


def test_lines_that_amplitude_and_rate_do_not_allow_are_refused():
    with pytest.raises(InfeasibleError) as caught:
        solve(parse_spec(LINES % "least_cost").with_(**{"limits.samples": 2000}))
    (told,) = caught.value.diagnostics
    assert told.code in ("limits-too-tight", "infeasible")
    assert told.key in ("limits.amplitude", "limits.rate")


def test_a_design_for_the_error_of_a_loop_keeps_amplitude_and_rate():
    column = load_spec(SPECS / "distillation_column.yaml", ["experiment.samples=2000"])
    limits = {"amplitude": [1.0, 2.0], "rate": [0.5, 5.0]}
    found = solve(column.with_(limits=limits))
    u = np.stack([found.tables["signal"].columns[name] for name in ("u1", "u2")], axis=1)
    assert np.all(np.abs(u).max(axis=0) <= np.array([1.0, 2.0]) * (1 + 1e-9))
    assert np.all(np.abs(np.diff(u, axis=0, prepend=0.0)).max(axis=0) <= np.array([0.5, 5.0]) * (1 + 1e-9))
    listed = {(e["power"], e["channel"]): e["attained"] for e in found.result["closed_loop_error"]["limits"]}
    assert listed["moves", 1] == pytest.approx(0.25, rel=1e-6)
    assert listed["input", 1] <= 1.0 + 1e-9
