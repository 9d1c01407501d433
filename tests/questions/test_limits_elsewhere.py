"""What a record does to limits on single samples at plants that it was not made for is told, not promised."""

import numpy as np
import pytest
import scipy.signal

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.questions.least_cost.build import build_convex
from inputdesign_cli.report.facts import facts

SPEC = """
plant: {B: [0, 1.0], F: [1, -0.8]}
noise: {variance: 0.01}
experiment: {samples: 120}
accuracy: {model_error: {relative: 0.5}}
objective: best_accuracy
limits: {amplitude: {input: 1, output: 2}}
uncertainty: {intervals: {b1: [0.8, 1.2], f1: [-0.85, -0.75]}, scenarios: 4, fresh: 60}
spectrum: {type: fir, order: 4}
signal: {type: multisine, seed: 1, candidates: 1}
solver: {any_spectrum: false}
"""


def peaks(u, plants):
    return [
        np.abs(scipy.signal.lfilter([0.0, b], [1.0, f], u)).max() / 2.0
        for b, f in (plant.experiment.model.theta for plant in plants)
    ]


@pytest.mark.slow
def test_drawn_plants_keep_limits_and_others_are_counted():
    found = solve(parse_spec(SPEC))
    u = found.tables["signal"].columns["u1"]
    done = build_convex(parse_spec(SPEC)).designed()
    assert max(peaks(u, done.plants.batch.plants)) <= 1.0
    others = [size for batch in done.plants.afresh() for size in peaks(u, batch.plants)]
    told = found.result["robust"]["fresh"]["beyond_limits"]
    assert told["largest"] == pytest.approx(max(others), rel=1e-9)
    assert told["draws"] == sum(size > 1.0 + 1e-6 for size in others) > 0
    lines = {name: text for name, text, _ in facts(found.outcome, "s")}
    assert f"of 60 more {told['draws']} go beyond, up to {100 * max(others):.3g} %" in lines["limits there"]


@pytest.mark.slow
def test_limits_that_no_plant_changes_are_not_counted():
    found = solve(parse_spec(SPEC, overrides=["limits={amplitude: 1}"]))
    assert "beyond_limits" not in found.result["robust"]["fresh"]
