"""Controllers in the words of engineers: the loop of the polynomials that they stand for."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.errors import SpecError
from inputdesign_cli.questions.building.system import build_experiment

REST = """
sample_time: 0.5
noise: {variance: 0.1}
accuracy: {model_error: {relative: 0.1, band: [0.05, 1.5]}}
spectrum: {type: fir, order: 3}
signal: {samples: 60, seed: 1}
"""
ONE = "{continuous: {gain: 2.0, time_constant: 3.0, dead_time: 0.7}, sample: zoh}"
TWO = """{sample: zoh, continuous: {numerator: [[[1.0], [0.2]], [[0.1], [1.5]]],
  denominator: [[[2, 1], [3, 1]], [[3, 1], [1, 1]]]}}"""


def spec_of(controller, plant=ONE, **kwargs):
    experiment = f"experiment: {{samples: 300, controller: {controller}}}"
    return parse_spec(f"plant: {plant}\n{experiment}\n{REST}", **kwargs)


# Kp (1 + h/2/Ti (1 + q)/(1 - q)) with Kp = 0.4, Ti = 2.5, h = 0.5, and with hold and backward differences
PI = {
    "tustin": "numerator: [0.44, -0.36], denominator: [1, -1]",
    "backward": "numerator: [0.48, -0.4], denominator: [1, -1]",
    "zoh": "numerator: [0.4, -0.32], denominator: [1, -1]",
}


@pytest.mark.parametrize("rule", PI)
def test_a_pid_is_its_polynomials(rule):
    words = [
        f"{{pid: {{Kp: 0.4, Ti: 2.5, sample: {rule}}}}}",
        f"{{continuous: {{numerator: [1.0, 0.4], denominator: [2.5, 0]}}, sample: {rule}}}",
        f"{{{PI[rule]}}}",
    ]
    w = np.array([0.0, 0.1, 2.0])
    found = [build_experiment(spec_of(one)).excitation_gradient(w) for one in words]
    for gradient in found:
        np.testing.assert_allclose(gradient, found[0], rtol=1e-9, atol=1e-12)


def test_computing_takes_samples():
    w = np.array([0.1, 1.0])
    late = build_experiment(spec_of("{pid: {Kp: 0.4, Ti: 2.5}, delay: 1}")).loop.controller.at(w)
    soon = build_experiment(spec_of("{pid: {Kp: 0.4, Ti: 2.5}}")).loop.controller.at(w)
    np.testing.assert_allclose(late[:, 0, 0], soon[:, 0, 0] * np.exp(-1j * w))


def test_loops_are_a_matrix():
    loops = """{loops: [{output: 1, input: 1, controller: {pid: {Kp: 0.4, Ti: 2.5}}},
      {output: 2, input: 2, controller: {numerator: [0.3]}}]}"""
    matrix = "{numerator: [[[0.44, -0.36], [0]], [[0], [0.3]]], denominator: [[[1, -1], [1]], [[1], [1]]]}"
    made = [build_experiment(spec_of(one, TWO)) for one in (loops, matrix)]
    w = np.array([0.0, 0.2, 2.0])
    gradients = [experiment.excitation_gradient(w) for experiment in made]
    np.testing.assert_allclose(gradients[0], gradients[1], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(made[0].noise_information, made[1].noise_information, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("controller", "plant", "code", "key"),
    [
        ("{pid: {Kp: 0}}", ONE, "out-of-range", "experiment.controller.pid.Kp"),
        ("{pid: {Kp: 1, Ti: 0}}", ONE, "out-of-range", "experiment.controller.pid.Ti"),
        ("{pid: {Kp: 1, Td: 1, Tf: 0}}", ONE, "improper-transfer", "experiment.controller.pid.Tf"),
        ("{pid: {Kp: 1, Ki: 3}}", ONE, "unknown-key", "experiment.controller.pid.Ki"),
        ("{pid: {Kp: 1, sample: forward}}", ONE, "unknown-word", "experiment.controller.pid.sample"),
        ("{pid: {Kp: 1}, delay: -1}", ONE, "out-of-range", "experiment.controller.delay"),
        ("{pid: {Kp: -3, Ti: 1}}", ONE, "unstable-loop", "experiment.controller"),
        (
            "{continuous: {numerator: [1], denominator: [1, 0]}}",
            ONE,
            "missing-key",
            "experiment.controller.sample",
        ),
        (
            "{continuous: {numerator: [1, 0], denominator: [1]}, sample: zoh}",
            ONE,
            "improper-transfer",
            "experiment.controller.continuous.numerator",
        ),
        ("{pid: {Kp: 1}}", TWO, "wrong-shape", "experiment.controller"),
        (
            "{loops: [{output: 3, input: 1, controller: {pid: {Kp: 1}}}]}",
            TWO,
            "wrong-shape",
            "experiment.controller.loops[0].output",
        ),
        (
            "{loops: [{output: 1, input: 1, controller: {pid: {Kp: 1}}}, "
            "{output: 1, input: 1, controller: {pid: {Kp: 2}}}]}",
            TWO,
            "conflicting-keys",
            "experiment.controller.loops[1]",
        ),
    ],
)
def test_what_is_wrong_with_a_controller_is_told(controller, plant, code, key):
    with pytest.raises(SpecError) as caught:
        build_experiment(spec_of(controller, plant))
    assert (code, key) in [(found.code, found.key) for found in caught.value.diagnostics]
