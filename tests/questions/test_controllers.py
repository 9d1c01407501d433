"""Controllers in the words of engineers: the loop of the polynomials that they stand for."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec
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
