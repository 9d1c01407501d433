"""Controllers designed on simulated estimates: zeros outside the circle, unstable loops, lengths."""

import pytest

from inputdesign_cli import parse_spec, simulate
from inputdesign_cli.errors import SpecError
from inputdesign_cli.report.facts import simulation_table
from tests.support.outcomes import typed

SPEC = """
plant: {A: [1, -0.8], B: [0, 1, -1.5]}
noise: {variance: 0.01}
experiment: {samples: 1000}
accuracy: {closed_loop_error: {control: {internal_model: {numerator: [0.4], denominator: [1, -0.6]}}}}
limits: {input_power: 1}
signal: {candidates: 1}
simulation: {runs: 100, seed: 1, compare: [white]}
"""


def simulated(*overrides):
    return simulate(parse_spec(SPEC, overrides=list(overrides))).result


@pytest.mark.parametrize("true", ["{A: [1, -0.8], B: [0, 1, -1.5]}", "{A: [1, -0.7], B: [0, 1, -2.5]}"])
def test_runs_with_a_zero_outside_are_stable_and_as_theory_says(true):
    """The second plant is not the one of the spec: its own zero is kept, by both controllers."""
    found = simulated(f"simulation.plant={true}")
    for entry in found["simulation"]["inputs"].values():
        assert entry["unstable"] == 0
        exact = entry["exact"]["squared"]
        assert exact["mean"] == pytest.approx(entry["theory"]["value"], abs=4 * exact["standard_error"])
    assert "notes" not in found


def test_unstable_loops_are_said():
    found = simulated("noise.variance=10", "experiment.samples=60")
    inputs = found["simulation"]["inputs"]
    counts = [entry["unstable"] for entry in inputs.values()]
    assert min(counts) > 0
    table = simulation_table(typed(found).simulation)
    column = table.head.index("unstable loops")
    assert [row[column] for row in table.rows] == [str(count) for count in counts]
    for (name, entry), note in zip(inputs.items(), found["notes"], strict=True):
        assert name in note
        assert f"{entry['unstable']} of 100" in note


def test_a_true_plant_that_the_law_cannot_control_is_refused():
    law = (
        "accuracy.closed_loop_error.control={model_reference: {numerator: [0, 0.4], denominator: [1, -0.6]}}"
    )
    with pytest.raises(SpecError) as caught:
        simulated(law, "plant.B=[0, 1]", "simulation.plant={A: [1, -0.8], B: [0, 1, -1.5]}")
    (found,) = caught.value.diagnostics
    assert (found.code, found.key) == ("non-minimum-phase", "simulation.plant")


def test_records_are_as_long_as_the_signal():
    """A design without a length counts per sample; the signal has one."""
    long, found = simulated(), simulated("experiment=null", "signal.samples=1000")
    assert (found["samples"], found["simulation"]["samples"]) == (1, 1000)
    for name, entry in found["simulation"]["inputs"].items():
        assert entry["loss"] == long["simulation"]["inputs"][name]["loss"]
