"""Errors in a spec: the place, the code and the key under which each is reported.

The sign § in a row marks the place that the diagnostic must point at; it is removed before reading.
"""

# ruff: noqa: E501 (a row is easier to read on one line)

from __future__ import annotations

import pytest

from inputdesign_cli.specification import parse_spec
from tests.support.refusals import refused

JARGON = ("Input should", "valid dictionary", "Field required", "Extra inputs", "{key}", "type=", "\x00")
BASE: dict[str, str | None] = {
    "plant": "{B: [0, 1], F: [1, -0.5]}",
    "noise": "{variance: 1}",
    "accuracy": "{model_error: {relative: 0.01}}",
}
STEP: dict[str, str | None] = {"sample_time": "10"}
CONTROLLER = "{controller: {numerator: [0.1], denominator: [1, -1]}}"
REGRESSION: dict[str, str | None] = {
    "plant": "{regression: {estimated: 1, neglected: 1}}",
    "accuracy": "{mean_squared_error: {target: 1, estimated: [1], neglected: [1], neglected_norm: 1}}",
}
MIMO = "{B: [[[0, 1], [0, 2]], [[0, 3], [0, 4]]]}"
CONTINUOUS = "{continuous: {numerator: [1], denominator: [1, 1]}}"

# Code, key, words of the message or hint, and the sections that differ from `BASE`.
Row = tuple[str, str, str, dict[str, str | None]]

ROWS: list[Row] = [
    # keys
    ("unknown-key", "sampletime", 'did you mean "sample_time"', {"§sampletime": "1"}),
    ("unknown-key", "Ts", 'did you mean "sample_time"', {"§Ts": "1"}),
    ("unknown-key", "alpha", "belongs under accuracy.model_error", {"§alpha": "2"}),
    ("unknown-key", "plant.limits", "belongs at the top level", {"plant": "{B: [0, 1], §limits: {}}"}),
    ("missing-key", "plant", '"plant"', {"plant": None}),
    ("missing-key", "noise", "variance: 1", {"noise": None}),
    ("missing-key", "noise.variance", '"variance"', {"§noise": "{C: [1]}"}),
    ("missing-key", "plant.B", '"B"', {"§plant": "{F: [1]}"}),
    ("empty-value", "noise", "no value", {"§noise": ""}),
    ("empty-value", "plant.F", "no value", {"plant": "{B: [0, 1], §F: null}"}),
    ("empty-value", "accuracy.model_error.45", "decimal point", {
        "accuracy": "{model_error: {relative: 0.01, alpha: 2,§45}}"}),
    # A broken key that states the variance is not reported as missing as well.
    ("empty-value", "noise.standard_deviation", "no value", {"noise": "{§standard_deviation: null}"}),
    ("empty-value", "noise.standard_deviation", "no value", {
        **STEP, "noise": "{§standard_deviation: null, correlation_time: 60}"}),
    ("empty-value", "noise.correlation_time", "no value", {
        "noise": "{standard_deviation: 1, §correlation_time: null}"}),
    ("empty-value", "simulation.noise.standard_deviation", "no value", {
        "simulation": "{noise: {§standard_deviation: null}}"}),
    ("duplicate-key", "plant.B", "twice, on line 1", {"plant": "{B: [0, 1], §B: [0, 2]}"}),
    # kinds of values
    ("wrong-shape", "plant", "mapping", {"plant": "§3"}),
    ("wrong-shape", "noise", "mapping", {"noise": "§[1]"}),
    ("wrong-shape", "uncertainty.intervals.b1", "two numbers, not 3", {
        "uncertainty": "{intervals: {b1: §[0.7, 0.8, 0.9]}}"}),
    ("not-a-number", "sample_time", "true", {"sample_time": "§true"}),
    ("not-a-number", "sample_time", 'the text "yes"', {"sample_time": "§yes"}),
    ("not-a-number", "sample_time", "write 10", {"sample_time": "§010"}),
    ("not-a-number", "sample_time", "decimal number", {"sample_time": "§0x10"}),
    ("not-a-number", "sample_time", "underscores: 1000", {"sample_time": "§1_000"}),
    ("not-a-number", "sample_time", "decimal point: 0.5", {"sample_time": "§0,5"}),
    ("not-a-number", "sample_time", "write 0.005", {"sample_time": "§5 ms"}),
    ("not-a-number", "sample_time", "remove the quotes", {"sample_time": "§'1e-3'"}),
    ("not-a-number", "sample_time", "3.14159", {"sample_time": "§pi"}),
    ("not-a-number", "accuracy.model_error.relative", "0.01 where a fraction", {
        "accuracy": "{model_error: {relative: §1%}}"}),
    ("not-finite", "sample_time", "finite", {"sample_time": "§.inf"}),
    ("not-finite", "sample_time", "too large", {"sample_time": "§1e400"}),
    ("not-finite", "sample_time", "too large", {"sample_time": "§" + "9" * 5000}),
    ("not-finite", "sample_time", "too small", {"sample_time": "§1e-400"}),
    ("out-of-range", "sample_time", "greater than 0, not 0", {"sample_time": "§0"}),
    ("unknown-word", "time_unit", 'did you mean "min"', {"time_unit": "§minutes"}),
    ("unknown-word", "objective", 'did you mean "least_cost"', {"objective": "§least-cost"}),
    ("not-a-text", "title", "a list", {"title": "§[a]"}),
    ("not-a-whole-number", "experiment.samples", "500 or 501", {"experiment": "{samples: §500.5}"}),
    ("out-of-range", "experiment.samples", "at least 1", {"experiment": "{samples: §0}"}),
    ("out-of-range", "experiment.samples", "at most", {"experiment": "{samples: §1e30}"}),
    # YAML that is valid but refused
    ("yaml-tag", "plant.B", "remove the tag", {"plant": "{B: §!!python/tuple [0, 1]}"}),
    ("yaml-merge-key", "plant.<<", "alias", {"plant": "{B: [0, 1], §<<: {F: [1]}}"}),
    ("bad-key", "plant", "not a word", {"plant": "{B: [0, 1], §[1]: 2}"}),
    ("bad-text", "title", "U+0001", {"title": '§"\\x01"'}),
    # noise by standard deviation and correlation time
    ("missing-key", "noise.correlation_time", "needs sample_time", {
        "noise": "{standard_deviation: 0.1, §correlation_time: 60}"}),
    ("missing-key", "noise.correlation_time", "add standard_deviation", {**STEP, "noise": "{§correlation_time: 60}"}),
    ("conflicting-keys", "noise.variance", "remove it", {"noise": "{standard_deviation: 1, §variance: 1}"}),
    ("conflicting-keys", "noise.D", "remove it", {"noise": "{standard_deviation: 1, §D: [1, -0.5]}"}),
    ("wrong-shape", "noise.drift", "drift: true", {"noise": "{standard_deviation: 1, drift: §[true]}"}),
    ("conflicting-keys", "simulation.noise.relative_std", "remove it", {
        "simulation": "{noise: {standard_deviation: 1, §relative_std: 0.1}}"}),
    ("out-of-range", "noise.standard_deviation", "greater than 0", {"noise": "{standard_deviation: §0}"}),
    ("out-of-range", "noise.standard_deviation", "greater than 0", {"noise": "{standard_deviation: §-0.1}"}),
    ("out-of-range", "noise.standard_deviation", "another unit", {"noise": "{standard_deviation: §1e-30}"}),
    ("not-finite", "noise.standard_deviation", "finite", {"noise": "{standard_deviation: §.nan}"}),
    ("not-a-number", "noise.standard_deviation", "a number", {"noise": "{standard_deviation: §true}"}),
    ("out-of-range", "noise.correlation_time", "remove the key", {
        **STEP, "noise": "{standard_deviation: 1, correlation_time: §0}"}),
    ("not-finite", "noise.correlation_time", "finite", {
        **STEP, "noise": "{standard_deviation: 1, correlation_time: §.inf}"}),
    ("not-a-number", "noise.correlation_time", "write 60", {
        **STEP, "noise": "{standard_deviation: 1, correlation_time: §1 min}"}),
    ("out-of-range", "noise.correlation_time", "sample_time of at most 5", {
        **STEP, "noise": "{standard_deviation: 1, correlation_time: §1}"}),
    ("out-of-range", "noise.correlation_time", "a drift", {
        **STEP, "noise": "{standard_deviation: 1, correlation_time: §1e8}"}),
    ("wrong-shape", "noise.standard_deviation", "number of outputs is 1", {"noise": "{standard_deviation: §[1, 2]}"}),
    ("wrong-shape", "noise.correlation_time", "number of outputs is 2", {
        **STEP, "plant": MIMO, "noise": "{standard_deviation: [1, 2], correlation_time: §[30, 40, 50]}"}),
    ("unsuitable-key", "noise.standard_deviation", "as F in place of A", {
        **STEP, "plant": "{A: [1, -0.5], B: [0, 1]}", "noise": "{standard_deviation: §1, correlation_time: 30}"}),
    ("unsuitable-key", "noise.standard_deviation", "sample: zoh", {
        "plant": CONTINUOUS, "noise": "{standard_deviation: §1}", "limits": "{band: [0, 1]}"}),
    ("unsuitable-key", "noise.standard_deviation", "remove K", {
        "plant": "{parameters: {p: 0.5}, state_space: {A: [[p]], B: [[1]], C: [[1]], K: [[0.2]], time: discrete}}",
        "noise": "{standard_deviation: §1}"}),
    ("unsuitable-key", "noise.correlation_time", "regression is white", {
        **STEP, **REGRESSION, "noise": "{standard_deviation: 1, correlation_time: §30}"}),
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
    ("out-of-range", "accuracy.standard_deviation.b1", "greater than 0", {"accuracy": "{standard_deviation: {b1: §0}}"}),
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
    # spectrum
    ("missing-key", "spectrum", "type: white", {"§spectrum": "{order: 3}"}),
    ("unknown-word", "spectrum.type", 'did you mean "multisine"', {"spectrum": "{type: §multi-sine, lines: 3}"}),
    ("unsuitable-key", "spectrum.basis", "type: polynomial", {"spectrum": "{type: fir, §basis: legendre}"}),
    ("unsuitable-key", "spectrum.type", "given", {"spectrum": "{§type: fir, given: {type: white, power: 1}}"}),
    ("missing-key", "spectrum.order", "type: polynomial", {"§spectrum": "{type: polynomial, band: [0, 1]}"}),
    ("missing-key", "spectrum", "lines or frequencies", {"§spectrum": "{type: multisine}"}),
    ("not-increasing", "spectrum.frequencies", "follows", {"spectrum": "{type: multisine, frequencies: §[1, 0.5]}"}),
    ("beyond-nyquist", "spectrum.frequencies[1]", "Nyquist", {"spectrum": "{type: multisine, frequencies: [1, §4]}"}),
    ("bad-band", "spectrum.frequencies[1]", "outside limits.band", {
        "spectrum": "{type: multisine, frequencies: [1, §2]}", "limits": "{band: [0, 1.5]}"}),
    ("missing-key", "spectrum.given", "type: white", {"spectrum": "{§given: {power: 1}}"}),
    ("unsuitable-key", "spectrum.given.amplitudes", "type: multisine", {
        "spectrum": "{given: {type: white, power: 1, §amplitudes: [1]}}"}),
    ("wrong-shape", "spectrum.given.amplitudes", "1 amplitude, and", {
        "spectrum": "{given: {type: multisine, frequencies: [1, 2], amplitudes: §[1]}}"}),
    ("wrong-shape", "spectrum.given.power", "inputs is 1", {"spectrum": "{given: {type: white, power: §[1, 2]}}"}),
    # signal, solver, simulation
    ("unsuitable-key", "signal.phases", "type: multisine", {"signal": "{type: binary, §phases: random}"}),
    ("out-of-range", "solver.tolerance", "less than 0.01", {"solver": "{tolerance: §0.1}"}),
    ("unknown-word", "solver.method", "exchange, lmi or alternating", {"solver": "{method: §simplex}"}),
    ("unknown-word", "simulation.compare[1]", "white", {"simulation": "{compare: [white, §whit]}"}),
    ("wrong-shape", "simulation.compare", "must be a list", {"simulation": "{compare: §white}"}),
    ("unstable-polynomial", "simulation.plant.A", "radius 2", {"simulation": "{plant: {B: [0, 1], A: §[1, -2]}}"}),
    ("wrong-shape", "simulation.plant", "not sampled", {"simulation": f"{{§plant: {CONTINUOUS}}}"}),
    ("conflicting-keys", "simulation.noise.relative_std", "variance", {
        "simulation": "{noise: {variance: 1, §relative_std: 0.1}}"}),
    ("missing-key", "simulation.noise", "variance or relative_std", {"simulation": "{§noise: {C: [1]}}"}),
    # report
    ("wrong-shape", "report.ellipses[0]", "two different parameters", {"report": "{ellipses: [§[b1]]}"}),
    ("not-a-text", "report.ellipses[0][1]", "a parameter name", {"report": "{ellipses: [[b1, §2]]}"}),
    # polynomials
    ("not-monic", "plant.F", "divide all its coefficients by 2: [1, -0.25]", {"plant": "{B: [1], F: §[2, -0.5]}"}),
    ("not-monic", "plant.F", "did you mean [1, -0.7]?", {"plant": "{B: [1], F: §[-0.7, 1]}"}),
    ("unstable-polynomial", "plant.F", "radius 1.7 at 0 rad", {"plant": "{B: [1], F: §[1, -1.7]}"}),
    # z^2 + 1.21: roots +-1.1j, a quarter turn
    ("unstable-polynomial", "plant.F", "radius 1.1 at 1.571 rad", {"plant": "{B: [1], F: §[1, 0, 1.21]}"}),
    ("unstable-polynomial", "plant.F", "radius 1 at", {"plant": "{B: [1], F: §[1, 1]}"}),
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
    ("not-a-number", "plant.B[0][1][0]", '"x"', {"plant": "{B: [[[0, 1], [§x]]]}"}),
    ("wrong-shape", "plant.B", "same number of columns", {"plant": "{B: §[[[1], [1]], [[1]]]}"}),
    ("wrong-shape", "plant.F", "2 x 2", {"plant": "{B: [[[0, 1], [0, 2]], [[0, 3], [0, 4]]], F: §[1, -0.5]}"}),
    ("wrong-shape", "plant.A", "3 polynomials for 2 outputs", {
        "plant": "{B: [[[0, 1]], [[0, 2]]], A: §[[1], [1], [1]]}"}),
    # continuous time
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
    ("unknown-word", "plant.sample", "must be zoh", {
        "plant": "{continuous: {numerator: [1], denominator: [1, 1]}, sample: §true}"}),
    ("unknown-word", "experiment.controller.pid.sample", "must be tustin, backward or zoh", {
        "experiment": "{controller: {pid: {Kp: 1, sample: §foh}}}"}),
    ("unsuitable-key", "noise.C", "not sampled", {"plant": CONTINUOUS, "noise": "{variance: 1, C: §[1]}"}),
    ("unsuitable-key", "experiment.controller", "sample: zoh", {
        "plant": CONTINUOUS, "experiment": "{§controller: {numerator: [1]}}"}),
    ("unsuitable-key", "spectrum.type", "not sampled", {"plant": CONTINUOUS, "spectrum": "{type: §fir}"}),
    ("unsuitable-key", "accuracy.model_error.weight", "continuous: ", {
        "plant": CONTINUOUS, "accuracy": "{model_error: {absolute: 1, §weight: {numerator: [1]}}}"}),
    # noise
    ("not-positive-definite", "noise.variance", "covariance", {"plant": MIMO, "noise": "{variance: §[[1, 2], [2, 1]]}"}),
    ("not-symmetric", "noise.variance", "(2, 1)", {"plant": MIMO, "noise": "{variance: §[[1, 0.1], [0.2, 1]]}"}),
    ("wrong-shape", "noise.variance", "square", {"plant": MIMO, "noise": "{variance: §[[1, 0]]}"}),
    ("wrong-shape", "noise.variance", "2 x 2, but the plant has 1 output", {"noise": "{variance: §[[1, 0], [0, 1]]}"}),
    ("wrong-shape", "noise.C", "3 polynomials", {"plant": MIMO, "noise": "{variance: 1, C: §[[1], [1], [1]]}"}),
    # experiment, cost
    ("wrong-shape", "experiment.controller", "2 inputs", {
        "plant": MIMO, "experiment": "{§controller: {numerator: [1]}}"}),
    ("not-positive-definite", "experiment.prior.information", "semidefinite", {
        "experiment": "{prior: {information: §[[-1]]}}"}),
    ("wrong-shape", "experiment.prior.parameters", "1 x 1", {
        "experiment": "{prior: {information: [[1]], parameters: §[b1, f1]}}"}),
    ("no-cost", "cost", "free", {"§cost": "{input_power: 0}"}),
]  # fmt: skip


@pytest.fixture
def diagnostics():
    """The diagnostics of a broken spec, and the line and column that the sign § marks in it."""

    def found(marked):
        index = marked.index("§") if "§" in marked else None
        found = refused(parse_spec, marked.replace("§", ""), "x.yaml")
        expected = None
        if index is not None:
            before = marked[:index]
            expected = (before.count("\n") + 1, index - (before.rfind("\n") + 1) + 1)
        return found, expected

    return found


@pytest.mark.parametrize("row", ROWS, ids=[f"{i}-{row[0]}-{row[1]}" for i, row in enumerate(ROWS)])
def test_the_complaint_names_code_key_place_and_remedy(row, diagnostics):
    code, key, words, sections = row
    # A row may rename a section to put the mark before its key.
    merged = {name: value for name, value in BASE.items() if f"§{name}" not in sections} | sections
    text = "".join(f"{k}: {v}\n" for k, v in merged.items() if v is not None)
    found, place = diagnostics(text)
    assert [(c.code, c.key) for c in found] == [(code, key)]
    (diagnostic,) = found
    assert words in diagnostic.message + " | " + diagnostic.hint
    assert diagnostic.location is not None
    if place is not None:
        assert (diagnostic.location.line, diagnostic.location.column) == place
        assert diagnostic.location.text == text.replace("§", "").splitlines()[place[0] - 1]
    for phrase in JARGON:
        assert phrase not in diagnostic.message + diagnostic.hint


MANY = (
    "title: many\n"
    "sampletime: 1\n"
    "plant: {B: [0, x], F: [2, 1]}\n"
    "accuracy:\n"
    "  model_error: {relative: -1, confidence: 95, alpha: 2}\n"
    "limits: {band: [2, 1]}\n"
    "signal: {type: binary, phases: random}\n"
)
NOISE = "noise: {variance: 1}\n"
TOGETHER = {
    "in the order of the file": (MANY, "noise sampletime plant.B[1] plant.F accuracy.model_error.relative "
        "accuracy.model_error.confidence limits.band signal.phases"),
    # With a broken controller the unstable plant is no error; a broken requirement still counts as asked.
    "no consequences": (NOISE + "plant: {B: [0, 1], A: [1, -2]}\n"
        "experiment: {controller: {numerator: [x], denominator: [1]}}\naccuracy: {model_error: {relative: x}}\n",
        "experiment.controller.numerator[0] accuracy.model_error.relative"),
    "several in a section": (NOISE + "plant: {B: [0, 1], F: [1, x]}\n"
        "accuracy: {model_error: {relative: 0.01, alpha: 2, confidence: 0.9, band: [0, x]}}\n",
        "plant.F[1] accuracy.model_error.alpha accuracy.model_error.band[1]"),
    "a missing choice": (NOISE + "plant: {B: [0, 1]}\naccuracy: {model_error: {band: [2, 1]}}\n",
        "accuracy.model_error accuracy.model_error.band"),
    "misspelt is not missing": ("plant: {b: [0, 1]}\nnose: {variance: 1}\nacuracy: {model_error: {relative: 1}}\n",
        "plant.b nose acuracy"),
}  # fmt: skip


@pytest.mark.parametrize("name", TOGETHER)
def test_independent_errors_are_reported_together_in_the_order_of_the_file(name, diagnostics):
    text, keys = TOGETHER[name]
    found, _ = diagnostics(text)
    assert [c.key for c in found] == keys.split()
    assert [c.location.line for c in found] == sorted(c.location.line for c in found)


ASKED = "\nnoise: {variance: 1}\naccuracy: {standard_deviation: {gain: 0.1}}\n"
CASES = {
    "plant: {B: [0, 1], F: [1, -0.5], delay: 3}": "leading zeros of B",
    "plant: {continuous: {numerator: [2], denominator: [9, 1]}, delay: 3, sample: zoh}": "under plant.continuous",
    "plant: {continuous: {gain: 2, time_constant: 9}, dead_time: 3, sample: zoh}": "under plant.continuous",
    "plant: {B: [0, 1]}\nexperiment: {controller: {pid: {Kp: 1, Ki: 2}}}": "Ti: Kp / Ki",
    "plant: {B: [0, 1]}\nexperiment: {controller: {pid: {Kp: 1, Kd: 2}}}": "Td: Kd / Kp",
    "plant: {parameters: {K: 2, θ: 3}, continuous: {numerator: [K], denominator: [9, 1]}}": "a to z",
    "plant: {parameters: {K: 2}, continuous: {numerator: [K], denominator: [9, 1], delay: 25s}}": "unit: 25",
    "plant: {parameters: {K: 2, z: 0}, continuous: {numerator: ['K*sqrt(z)'], denominator: [z, 1]}}": "root",
}


@pytest.mark.parametrize("text", CASES)
def test_the_hint_for_a_misplaced_key_says_what_to_write_instead(text, diagnostics):
    found, _ = diagnostics(text + ASKED)
    assert any(CASES[text] in one.hint for one in found)
