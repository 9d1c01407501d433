"""Designs with several channels in closed loop: against SISO designs, against their own files, bad input."""

import numpy as np
import pytest

from inputdesign_cli import solve
from inputdesign_cli.questions.building.system import build_experiment
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.specification import parse_spec

SPEC = """
plant:
  A: [[1, -1.1], [1, -0.6]]
  B: [[[0, 1.0, 0.4], [0, -0.3]], [[0, 0.4], [0, 1.2, -0.5]]]
noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}
experiment:
  samples: 500
  controller: {numerator: [[[0.3, -0.25], [0]], [[0], [0.3, -0.2]]], denominator: [1, -1]}
cost: {input_power: 1, output_power: 0.1, excitation_power: 0.01}
accuracy: {standard_deviation: {'a1[1]': 0.002, 'b1[1,2]': 0.01}}
spectrum: {type: fir, order: 2}
solver: {any_spectrum: false}
signal: {candidates: 1}
"""


TWO_ALONE = """
plant: {A: [[1, -1.1], [1, -0.6]], B: [[[0, 1, 0.4], [0]], [[0], [0, 0.7]]]}
noise: {C: [[1, 0.3], [1]], variance: [[1, 0], [0, 0.5]]}
experiment:
  samples: 500
  controller:
    numerator: [[[0.3, -0.25], [0]], [[0], [0.3]]]
    denominator: [[[1, -1], [1]], [[1], [1, -0.5]]]
"""


def changed(*overrides):
    return parse_spec(SPEC, overrides=list(overrides))


@pytest.mark.slow
def test_single_samples_of_u_are_limited():
    """What r causes at u, by the recursion of the loop, obeys the limits; the accuracy is met still."""
    free = solve(changed("signal.candidates=2")).result["signal"]
    amplitude, rate = 0.8 * np.array(free["input_peak"]), 0.8 * np.array(free["input_move"])
    limits = f"limits={{amplitude: {{input: {amplitude.tolist()}}}, rate: {rate.tolist()}}}"
    spec = changed(limits, "signal.candidates=2")
    outcome = solve(spec)
    r = np.stack([outcome.tables["signal"].columns[name] for name in ("r1", "r2")], axis=1)
    _, u = build_experiment(spec).loop.signals(r, 0.0 * r)
    assert np.all(np.abs(u).max(axis=0) <= amplitude * (1 + 1e-10))
    assert np.all(np.abs(np.diff(u, axis=0, prepend=0.0)).max(axis=0) <= rate * (1 + 1e-10))
    assert outcome.result["signal"]["worst_ratio"] <= 1 + 1e-9
    assert outcome.result["signal"]["input_peak"] == pytest.approx(np.abs(u).max(axis=0))


def test_decoupled_loops_cost_as_much_as_each_alone():
    common = "cost: {input_power: 1, output_power: 0.2}\nspectrum: {type: fir, order: 5}\n"
    common += "accuracy: {model_error: {relative: 0.05, alpha: 3}}\n"
    both = parse_spec(TWO_ALONE + common)
    alone = [
        "plant: {A: [1, -1.1], B: [0, 1, 0.4]}\nnoise: {C: [1, 0.3], variance: 1}\n"
        "experiment: {samples: 500, controller: {numerator: [0.3, -0.25], denominator: [1, -1]}}\n",
        "plant: {A: [1, -0.6], B: [0, 0.7]}\nnoise: {variance: 0.5}\n"
        "experiment: {samples: 500, controller: {numerator: [0.3], denominator: [1, -0.5]}}\n",
    ]
    design = build_convex(both).designed().design.result
    costs = []
    for text in alone:
        spec = parse_spec(text + common)
        costs.append(build_convex(spec).designed().design.result.objective)
    assert design.gap < 1e-6
    assert design.objective == pytest.approx(sum(costs), rel=2e-6)


def test_limits_bind_what_r_causes():
    free = solve(changed()).result
    most = 0.99 * free["power"]["input"][1]
    held = solve(changed(f"limits.input_power=[1e6, {most}]")).result
    assert held["power"]["input"][1] == pytest.approx(most, rel=1e-6)
    assert held["cost"] > free["cost"]
    assert held["objective"]["relative_gap"] < 1e-6


def test_the_units_of_the_loop_do_not_make_it_algebraic():
    """u1 in millionths, u2 in millions: the gains differ by 1e12, the loop is the same and has its delay."""
    scaled = changed(
        "plant.B=[[[0, 1.0e+6, 0.4e+6], [0, -0.3e-6]], [[0, 0.4e+6], [0, 1.2e-6, -0.5e-6]]]",
        "experiment.controller.numerator=[[[0.3e-6, -0.25e-6], [0]], [[0], [0.3e+6, -0.2e+6]]]",
    )
    build_convex(scaled)
