"""What can be wrong with accuracy, objective and limits: where it is reported, under which code and key.

See `tests.support.bad_specs` for the sign §.
"""

# ruff: noqa: E501 (a row is easier to read on one line)

from __future__ import annotations

from tests.support.bad_specs import CONTROLLER, MIMO, REGRESSION, Row, each

ROWS: list[Row] = [
    # accuracy
    ("nothing-asked", "accuracy", "nothing is asked", {"accuracy": None}),
    ("nothing-asked", "accuracy", "nothing is asked", {"§accuracy": "{}"}),
    ("missing-key", "accuracy.model_error", "relative, absolute, table or sensitivity", {
        "accuracy": "{§model_error: {alpha: 2}}"}),
    ("conflicting-keys", "accuracy.model_error.absolute", "relative", {
        "accuracy": "{model_error: {relative: 1, §absolute: 2}}"}),
    ("conflicting-keys", "accuracy.model_error.alpha", "confidence", {
        "accuracy": "{model_error: {relative: 1, §alpha: 2, confidence: 0.9}}"}),
    ("out-of-range", "accuracy.model_error.confidence", "write 0.95 for 95 percent", {
        "accuracy": "{model_error: {relative: 1, confidence: §95}}"}),
    ("out-of-range", "accuracy.model_error.relative", "greater than 0", {"accuracy": "{model_error: {relative: §0}}"}),
    ("bad-band", "accuracy.model_error.band", "ascend", {"accuracy": "{model_error: {relative: 1, band: §[2, 1]}}"}),
    ("bad-band", "accuracy.model_error.band", "two frequencies", {
        "accuracy": "{model_error: {relative: 1, band: §[2]}}"}),
    ("out-of-range", "accuracy.model_error.band[0]", "at least 0", {
        "accuracy": "{model_error: {relative: 1, band: [§-1, 1]}}"}),
    ("beyond-nyquist", "accuracy.model_error.band", "3.14159 rad/s", {
        "accuracy": "{model_error: {relative: 1, band: §[0, 3.2]}}"}),
    ("beyond-nyquist", "limits.band", "1.5708 rad/min", {
        "limits": "{band: §[0, 2]}", "sample_time": "2", "time_unit": "min"}),
    ("needs-controller", "accuracy.model_error.sensitivity", "controller", {
        "accuracy": "{model_error: {§sensitivity: {max_db: 6}}}"}),
    ("missing-key", "accuracy.model_error.sensitivity", "numerator or max_db", {
        "experiment": CONTROLLER, "accuracy": "{model_error: {§sensitivity: {}}}"}),
    ("unknown-word", "accuracy.criterion", 'did you mean "D"', {"accuracy": "{criterion: §d}", "limits": "{input_power: 1}"}),
    ("unsuitable-key", "accuracy.scale", "criterion", {"accuracy": "{model_error: {relative: 1}, scale: §relative}"}),
    ("not-symmetric", "accuracy.information", "not symmetric", {"accuracy": "{information: §[[1, 2], [3, 1]]}"}),
    ("not-positive-definite", "accuracy.application.hessian", "semidefinite", {
        "accuracy": "{application: {parameters: [b1], hessian: §[[-1]], gamma: 100}}"}),
    ("wrong-shape", "accuracy.application.parameters", "2 names", {
        "accuracy": "{application: {parameters: §[b1, f1], hessian: [[1]], gamma: 100}}"}),
    ("wrong-shape", "accuracy.application.parameters", "more than once", {
        "accuracy": "{application: {parameters: §[b1, b1], hessian: [[1, 0], [0, 1]], gamma: 100}}"}),
    ("missing-key", "accuracy.application.gamma", '"gamma"', {
        "accuracy": "{§application: {parameters: [b1], hessian: [[1]]}}"}),
    ("out-of-range", "accuracy.standard_deviation.b1", "greater than 0", {"accuracy": "{standard_deviation: {b1: §0}}"}),
    ("wrong-shape", "accuracy.standard_deviation", "empty", {"accuracy": "{§standard_deviation: {}}"}),
    ("missing-key", "accuracy.weighted_variance.max", '"max"', {"accuracy": "{§weighted_variance: {}}"}),
    ("improper-transfer", "accuracy.weighted_variance.weight.continuous.numerator", "degree 1", {
        "accuracy": "{weighted_variance: {max: 1, weight: {continuous: {numerator: §[1, 1]}}}}"}),
    ("missing-key", "accuracy.closed_loop_error.control", "model_reference", {
        "limits": "{input_power: 1}", "accuracy": "{closed_loop_error: {§control: {}}}"}),
    ("conflicting-keys", "accuracy.closed_loop_error.control.minimum_variance", "model_reference", {
        "limits": "{input_power: 1}",
        "accuracy": "{closed_loop_error: {control: {model_reference: {numerator: [0, 1]}, §minimum_variance: true}}}"}),
    ("unstable-polynomial", "accuracy.closed_loop_error.control.model_reference.continuous.denominator", "left half", {
        "limits": "{input_power: 1}",
        "accuracy": "{closed_loop_error: {control: {model_reference: "
        "{continuous: {numerator: [1], denominator: §[75, -1]}}}}}"}),
    # regression
    ("regression-mismatch", "accuracy.mean_squared_error", "not one", {
        "accuracy": "{§mean_squared_error: {target: 1, estimated: [1], neglected_norm: 1}}"}),
    ("regression-mismatch", "accuracy.model_error", "mean_squared_error", {
        **REGRESSION, "accuracy": "{§model_error: {relative: 1}}"}),
    ("wrong-shape", "accuracy.mean_squared_error.neglected", "2 weights", {
        **REGRESSION,
        "accuracy": "{mean_squared_error: {target: 1, estimated: [1], neglected: §[1, 2], neglected_norm: 1}}"}),
    ("regression-mismatch", "spectrum.type", "moments", {**REGRESSION, "spectrum": "{type: §fir}"}),
    ("regression-mismatch", "spectrum.type", "moments", {"spectrum": "{type: §moments}"}),
    ("unsuitable-key", "noise.D", "white", {**REGRESSION, "noise": "{variance: 1, D: §[1]}"}),
    ("wrong-shape", "simulation.plant.parameters", "3 numbers", {
        **REGRESSION, "simulation": "{plant: {parameters: §[1, 2, 3]}}"}),
    ("regression-mismatch", "simulation.plant", "true parameters", {
        **REGRESSION, "simulation": "{§plant: {B: [0, 1]}}"}),
    ("out-of-range", "plant.regression.estimated", "at least 1", {
        **REGRESSION, "plant": "{regression: {estimated: §0, neglected: 2}}"}),
    # objective and limits
    ("needs-limits", "accuracy.criterion", "limits its power", {"accuracy": "{criterion: §D}"}),
    ("needs-limits", "limits", "limits its power", {"accuracy": "{criterion: D}", "§limits": "{samples: 100}"}),
    ("needs-limits", "objective", "shortest", {"objective": "§shortest_experiment"}),
    ("contradictory-objective", "objective", "remove the target", {
        **REGRESSION, "objective": "§best_accuracy", "limits": "{energy: 1}"}),
    ("needs-limits", "accuracy.mean_squared_error", "add limits.energy", {
        **REGRESSION, "accuracy": "{§mean_squared_error: {estimated: [1], neglected_norm: 1}}"}),
    ("too-large", "experiment.controller.denominator", "at most 301", {
        "experiment": "{controller: {numerator: [1], denominator: §[" + ", ".join(["[1, 0.5]"] * 301) + "]}}"}),
    ("bad-polynomial", "experiment.controller.denominator", "product", {
        "experiment": "{controller: {numerator: [1], denominator: §[[1e90], [1e90], [1e90], [1e90]]}}"}),
    ("contradictory-objective", "objective", "criterion", {
        "accuracy": "{criterion: D}", "limits": "{input_power: 1}", "objective": "§least_cost"}),
    ("needs-limits", "accuracy.model_error", "limits its power", {
        "accuracy": "{§model_error: {relative: 0.01}}", "objective": "best_accuracy"}),
    ("conflicting-keys", "experiment.samples", "limits.samples (100)", {
        "experiment": "{samples: §500}", "limits": "{samples: 100}"}),
    ("out-of-range", "limits.input_power", "remove the key", {"limits": "{input_power: §0}"}),
    ("out-of-range", "limits.input_power[1]", "remove the key", {"plant": MIMO, "limits": "{input_power: [1, §0]}"}),
    ("wrong-shape", "limits.output_power", "outputs is 1", {"limits": "{output_power: §[1, 2]}"}),
    ("conflicting-keys", "limits.input_power.min", "larger than max", {"limits": "{input_power: {min: §2, max: 1}}"}),
    ("missing-key", "limits.input_power", "max or min", {"limits": "{§input_power: {}}"}),
    ("out-of-range", "limits.spectrum.max", "greater than 0", {"limits": "{spectrum: {max: §0}}"}),
    ("out-of-range", "limits.amplitude", "greater than 0", {"limits": "{amplitude: §0}"}),
]  # fmt: skip


@each(ROWS)
def test_the_complaint_names_code_key_place_and_remedy(row, check_row):
    check_row(row)
