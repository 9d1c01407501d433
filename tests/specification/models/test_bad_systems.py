"""What can be wrong with plant, noise, experiment and cost: where it is reported, under which code and key.

See `tests.support.bad_specs` for the sign §.
"""

# ruff: noqa: E501 (a row is easier to read on one line)

from __future__ import annotations

from tests.support.bad_specs import CONTINUOUS, CONTROLLER, MIMO, Row, each

ROWS: list[Row] = [
    # polynomials
    ("not-monic", "plant.F", "divide all its coefficients by 2: [1, -0.25]", {"plant": "{B: [1], F: §[2, -0.5]}"}),
    ("not-monic", "plant.F", "did you mean [1, -0.7]?", {"plant": "{B: [1], F: §[-0.7, 1]}"}),
    ("not-monic", "plant.A", "ascending", {"plant": "{B: [1], A: §[0, 1]}"}),
    ("not-monic", "noise.C", "not 3", {"noise": "{variance: 1, C: §[3]}"}),
    ("unstable-polynomial", "plant.F", "radius 1.7 at 0 rad", {"plant": "{B: [1], F: §[1, -1.7]}"}),
    ("unstable-polynomial", "plant.F", "radius 1.7 at 3.142 rad", {"plant": "{B: [1], F: §[1, 1.7]}"}),
    # z^2 + 1.21: roots +-1.1j, a quarter turn
    ("unstable-polynomial", "plant.F", "radius 1.1 at 1.571 rad", {"plant": "{B: [1], F: §[1, 0, 1.21]}"}),
    ("unstable-polynomial", "plant.F", "radius 1 at", {"plant": "{B: [1], F: §[1, 1]}"}),
    ("unstable-polynomial", "noise.D", "radius", {"noise": "{variance: 1, D: §[1, -2]}"}),
    ("unstable-polynomial", "plant.A", "experiment.controller", {"plant": "{B: [0, 1], A: §[1, -2]}"}),
    ("unstable-polynomial", "plant.A[1]", "radius 3", {
        "plant": "{B: [[[0, 1]], [[0, 2]]], A: [[1], §[1, -3]]}"}),
    ("unstable-polynomial", "plant.F", "radius", {
        "plant": "{B: [0, 1], F: §[1, -2]}", "experiment": CONTROLLER}),
    ("too-large", "plant.F", "at most 301", {"plant": "{B: [1], F: §[1" + ", 0" * 300 + ", 0.1]}"}),
    ("bad-polynomial", "plant.continuous.denominator", "magnitude", {
        "plant": "{continuous: {numerator: [1], denominator: §[1e-320, 1e90, 1]}}"}),
    ("zero-polynomial", "plant.B", "zero", {"plant": "{B: §[0, 0]}"}),
    ("wrong-shape", "plant.B", "empty", {"plant": "{B: §[]}"}),
    ("wrong-shape", "plant.B", "rows of columns", {"plant": "{B: §[[0, 1], [0, 2]]}"}),
    ("wrong-shape", "plant.B", "list of coefficients", {"plant": "{B: §1}"}),
    ("wrong-shape", "plant.B", "rows", {"plant": "{B: §[[[0, [1]]]]}"}),
    ("not-a-number", "plant.B[1]", '"x"', {"plant": "{B: [0, §x]}"}),
    ("not-a-number", "plant.B[0][1][0]", '"x"', {"plant": "{B: [[[0, 1], [§x]]]}"}),
    ("wrong-shape", "plant.B", "same number of columns", {"plant": "{B: §[[[1], [1]], [[1]]]}"}),
    ("wrong-shape", "plant.F", "2 x 2", {"plant": "{B: [[[0, 1], [0, 2]], [[0, 3], [0, 4]]], F: §[1, -0.5]}"}),
    ("wrong-shape", "plant.A", "3 polynomials for 2 outputs", {
        "plant": "{B: [[[0, 1]], [[0, 2]]], A: §[[1], [1], [1]]}"}),
    # continuous time
    ("unstable-polynomial", "plant.continuous.denominator", "s = 1", {
        "plant": "{continuous: {numerator: [1], denominator: §[1, -1]}}"}),
    ("unstable-polynomial", "plant.continuous.denominator", "s = 0", {
        "plant": "{continuous: {numerator: [1], denominator: §[1, 0, 1]}}"}),
    ("unstable-polynomial", "plant.continuous.denominator[1]", "left half", {
        "plant": "{continuous: {numerator: [1], denominator: [[1, 2], §[1, -3]]}}"}),
    ("unstable-polynomial", "plant.continuous.denominator[0][1]", "left half", {
        "plant": "{continuous: {numerator: [[[1], [1]]], denominator: [[[1, 2], §[1, -3]]]}}"}),
    ("improper-transfer", "plant.continuous.numerator", "degree 2", {
        "plant": "{continuous: {numerator: §[1, 0, 0], denominator: [1, 1]}}"}),
    ("zero-leading-coefficient", "plant.continuous.denominator", "leading zeros", {
        "plant": "{continuous: {numerator: [1], denominator: §[0, 1]}}"}),
    ("wrong-shape", "plant.continuous.denominator", "1 x 2", {
        "plant": "{continuous: {numerator: [[[1], [1]]], denominator: §[[[1, 1]], [[1, 1]]]}}"}),
    ("unsuitable-key", "plant.B", "continuous-time plant", {
        "plant": "{continuous: {numerator: [1], denominator: [1, 1]}, §B: [1]}"}),
    ("unknown-word", "plant.sample", "zoh", {
        "plant": "{continuous: {numerator: [1], denominator: [1, 1]}, sample: §foh}"}),
    ("unknown-word", "plant.sample", "write zoh", {
        "plant": "{continuous: {numerator: [1], denominator: [1, 1]}, sample: §foh}"}),
    ("unknown-word", "plant.sample", 'did you mean "zoh"?', {
        "plant": "{continuous: {numerator: [1], denominator: [1, 1]}, sample: §zho}"}),
    ("unknown-word", "plant.sample", "write zoh", {
        "plant": "{continuous: {numerator: [1], denominator: [1, 1]}, sample: §true}"}),
    ("unknown-word", "experiment.controller.pid.sample", "must be tustin, backward or zoh", {
        "experiment": "{controller: {pid: {Kp: 1, sample: §foh}}}"}),
    ("unsuitable-key", "noise.C", "not sampled", {"plant": CONTINUOUS, "noise": "{variance: 1, C: §[1]}"}),
    ("unsuitable-key", "experiment.controller", "sample: zoh", {
        "plant": CONTINUOUS, "experiment": "{§controller: {numerator: [1]}}"}),
    ("unsuitable-key", "spectrum.type", "not sampled", {"plant": CONTINUOUS, "spectrum": "{type: §fir}"}),
    ("unsuitable-key", "accuracy.model_error.weight", "continuous: ", {
        "plant": CONTINUOUS, "accuracy": "{model_error: {absolute: 1, §weight: {numerator: [1]}}}"}),
    ("unsuitable-key", "limits.spectrum.max", "continuous: ", {
        "plant": CONTINUOUS, "limits": "{spectrum: {§max: {numerator: [1]}}}"}),
    # noise
    ("out-of-range", "noise.variance", "greater than 0", {"noise": "{variance: §0}"}),
    ("not-positive-definite", "noise.variance", "covariance", {"plant": MIMO, "noise": "{variance: §[[1, 2], [2, 1]]}"}),
    ("not-symmetric", "noise.variance", "(2, 1)", {"plant": MIMO, "noise": "{variance: §[[1, 0.1], [0.2, 1]]}"}),
    ("wrong-shape", "noise.variance", "square", {"plant": MIMO, "noise": "{variance: §[[1, 0]]}"}),
    ("wrong-shape", "noise.variance", "2 x 2, but the plant has 1 output", {"noise": "{variance: §[[1, 0], [0, 1]]}"}),
    ("wrong-shape", "noise.C", "3 polynomials", {"plant": MIMO, "noise": "{variance: 1, C: §[[1], [1], [1]]}"}),
    # experiment, cost
    ("zero-leading-coefficient", "experiment.controller.denominator", "0", {
        "experiment": "{controller: {numerator: [1], denominator: §[0, 1]}}"}),
    ("zero-polynomial", "experiment.controller.numerator", "zero", {
        "experiment": "{controller: {numerator: §[0], denominator: [1]}}"}),
    ("wrong-shape", "experiment.controller", "2 inputs", {
        "plant": MIMO, "experiment": "{§controller: {numerator: [1]}}"}),
    ("not-positive-definite", "experiment.prior.information", "semidefinite", {
        "experiment": "{prior: {information: §[[-1]]}}"}),
    ("wrong-shape", "experiment.prior.parameters", "1 x 1", {
        "experiment": "{prior: {information: [[1]], parameters: §[b1, f1]}}"}),
    ("no-cost", "cost", "free", {"§cost": "{input_power: 0}"}),
    ("out-of-range", "cost.input_power", "at least 0", {"cost": "{input_power: §-1}"}),
    ("wrong-shape", "cost.input_power", "inputs is 1", {"cost": "{input_power: §[1, 2]}"}),
]  # fmt: skip


@each(ROWS)
def test_the_complaint_names_code_key_place_and_remedy(row, check_row):
    check_row(row)
