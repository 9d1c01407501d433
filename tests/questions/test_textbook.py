"""Results by the formulas of a textbook, on plants that specs made at random have found to be hard."""

from __future__ import annotations

import pytest

from inputdesign_cli import parse_spec, solve
from tests.fuzzing.judge import written
from tests.fuzzing.textbook import NotJudgedError, findings

SPECS = {
    # Many samples: what a line tells of all of them, not of one, decides whether it can go.
    "zero beside the end of the band": """
plant: {A: [[1, -0.3], [1]], B: [[[0, 2.3], [0, -0.9, 1.7]], [[0, 18, 18], [0, 1.2]]]}
noise: {variance: [[1, 0.9], [0.9, 1.0]]}
accuracy: {model_error: {relative: 0.04, confidence: 0.95, band: [0.01, 3.14159]}}
objective: shortest_experiment
limits: {input_power: 6}
spectrum: {type: free}
signal: {samples: 64}
""",
    # The error has a peak between two points of any grid.
    "resonance": """
plant: {B: [0.0, -0.393861], A: [1.0, 2.2550018, 1.9851051, 0.6125259, 0.0]}
noise: {variance: 0.05023}
experiment: {samples: 100, controller: {numerator: [-0.253897, 0.228507], denominator: [1.0, -1.0]}}
accuracy: {model_error: {absolute: 1.0, alpha: 1.0}}
objective: best_accuracy
limits: {input_power: 9.341}
spectrum: {type: white}
signal: {samples: 64}
""",
}


@pytest.mark.slow
@pytest.mark.parametrize("text", SPECS.values(), ids=SPECS)
def test_what_is_claimed_is_so(text):
    spec = parse_spec(text)
    result = written(solve(spec))
    assert result["status"] == "optimal"
    try:
        assert findings(dict(spec.content), result) == []
    except NotJudgedError:  # rounding would decide on a plain grid: the check of the design itself passed
        assert max(one["worst_ratio"] for one in result["requirements"]) <= 1.0 + 1e-6
