"""The last check of a design detects falsified results, and an independent computation agrees."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.outcome import Outcome, plain, read_plain
from inputdesign_cli.questions import build_task
from inputdesign_cli.questions.least_cost.audit import audit
from inputdesign_cli.questions.least_cost.outcome import design_outcome
from tests.fuzzing.judge import written
from tests.fuzzing.textbook import NotJudgedError, findings
from tests.support.first_order_specs import ERROR, PLANT

LEAST = PLANT + ERROR
TWO = """
plant: {B: [[[0, 1], [0, 0.4]], [[0, 0.3], [0, 0.8]]], F: [[[1, -0.8], [1, -0.5]], [[1, -0.6], [1, -0.7]]]}
noise: {variance: [[1, 0.3], [0.3, 2]]}
experiment: {samples: 500}
"""
DESIGNS = {
    "fir": LEAST + "spectrum: {type: fir, order: 8}\n",
    "white": LEAST + "spectrum: {type: white}\n",
    "free": LEAST + "spectrum: {type: free}\n",
    "lines": LEAST + "spectrum: {type: multisine, lines: 20}\n",
    "band": LEAST + "spectrum: {type: polynomial, basis: chebyshev, order: 5, band: [0.02, 3.1]}\n",
    "limited": LEAST + "limits: {output_power: 45}\nspectrum: {type: fir, order: 8}\n",
    "loop": LEAST.replace("500}", "500, controller: {numerator: [0.1], denominator: [1, -1]}}")
    + "spectrum: {type: fir, order: 8}\n",
    "shortest": LEAST + "objective: shortest_experiment\nlimits: {input_power: 1}\n",
    "criterion": TWO
    + "accuracy: {criterion: D}\nlimits: {input_power: [1, 2]}\nspectrum: {type: fir, order: 3}\n",
    "two": TWO + "cost: {input_power: 1}\naccuracy: {model_error: {absolute: 0.3}}\nspectrum: {type: free}\n",
    "polynomial": TWO + "accuracy: {criterion: A}\nlimits: {input_power: 1}\n"
    "spectrum: {type: polynomial, order: 3, band: [0.1, 2], coefficients: complex}\n",
}
SLOW = pytest.mark.slow


@pytest.fixture(scope="module", params=[pytest.param(n, marks=SLOW) if n == "two" else n for n in DESIGNS])
def designed(request):
    done = build_task(parse_spec(DESIGNS[request.param])).designed()
    return done, plain(design_outcome(done))


def test_a_correct_result_passes_the_last_check(designed):
    done, result = designed
    audit(done, read_plain(Outcome, result), on_grid=False)


def resized(factor):
    def lie(done, result):
        entry = result["spectrum"]
        for key in {"coefficients", "powers"} & entry.keys():
            entry[key] = scaled(entry[key], factor)
        if entry["type"] == "white":
            entry["power"] *= factor
        return True

    return lie


def without_a_line(done, result):
    entry = result["spectrum"]
    if "powers" not in entry:
        return False
    sizes = [np.abs(np.sum(p)) if np.ndim(p) == 0 else 0.0 for p in entry["powers"]]
    dropped = int(np.argmax(sizes))
    del entry["frequencies"][dropped], entry["powers"][dropped]
    return True


def beyond(name):
    def lie(done, result):
        objective = result["objective"]
        if name not in objective:
            return False
        step = 1e-4 * max(abs(objective["value"]), done.experiment.size)
        objective[name] = objective["value"] + (-step if "upper_bound" in objective else step)
        return True

    return lie


def cheaper(done, result):
    result["cost"] *= 1.0 - 1e-4
    return bool(done.cost)


def scaled(value, factor):
    if isinstance(value, list):
        return [scaled(part, factor) for part in value]
    if isinstance(value, dict):
        return {name: factor * part for name, part in value.items()}
    return factor * value


BEYOND = [beyond(name) for name in ("lower_bound", "upper_bound", "any_spectrum_bound")]


@pytest.mark.parametrize("lie", [resized(0.999), resized(1.001), without_a_line, *BEYOND, cheaper])
def test_the_last_check_detects_a_falsified_spectrum_bound_or_cost(designed, lie):
    done, result = designed[0], copy.deepcopy(designed[1])
    if lie(done, result):
        with pytest.raises(InaccurateError) as caught:
            audit(done, read_plain(Outcome, result), on_grid=False)
        assert caught.value.diagnostics[0].code == "internal-disagreement"


SPECS = {
    # Many samples: the information of a line over all samples decides whether it is dropped.
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
def test_an_independent_computation_confirms_the_stated_design(text):
    spec = parse_spec(text)
    result = written(solve(spec))
    assert result["status"] == "optimal"
    try:
        assert findings(dict(spec.content), result) == []
    except NotJudgedError:  # rounding would decide on a plain grid: the check of the design itself passed
        assert max(one["worst_ratio"] for one in result["requirements"]) <= 1.0 + 1e-6
