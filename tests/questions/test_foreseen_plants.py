"""An estimate within what the spec says of its plant is no surprise."""

import numpy as np
import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.questions.building.uncertainty import build_foreseen

SPEC = """
sample_time: 5
plant: {continuous: {gain: 2, time_constant: 180, dead_time: 25}, sample: zoh}
noise: {variance: 0.04}
experiment: {samples: 720}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: white}
"""
INTERVALS = "uncertainty: {intervals: {gain: [1.4, 2.6], time_constant: [126, 234]}, scenarios: 3}\n"
COVARIANCE = (
    "uncertainty: {covariance: [[0.04, 0, 0], [0, 400, 0], [0, 0, 4]], "
    "parameters: [gain, time_constant, dead_time], scenarios: 3}\n"
)


@pytest.mark.parametrize(
    ("stated", "theta", "within"),
    [
        (INTERVALS, {"gain": 2.4, "time_constant": 143.0}, True),
        (INTERVALS, {"gain": 2.62}, True),  # by its own deviation of 0.01
        (INTERVALS, {"gain": 2.7}, False),
        (INTERVALS, {"dead_time": 30.0}, False),  # is not drawn
        (COVARIANCE, {"gain": 2.4, "time_constant": 200.0}, True),
        (COVARIANCE, {"gain": 3.2}, False),
        (COVARIANCE, {"gain": -2.0}, False),
    ],
)
def test_estimates_within_the_stated_uncertainty_are_foreseen(stated, theta, within):
    spec = parse_spec(SPEC + stated)
    nominal = build_model(spec)
    values = dict(zip(nominal.names, nominal.theta.tolist(), strict=True)) | theta
    foreseen = build_foreseen(spec, nominal)
    assert foreseen is not None
    theta = np.array([values[name] for name in nominal.names])
    assert foreseen.admits(theta, 1e-4 * np.eye(len(values))) == within


def test_without_uncertainty_nothing_is_foreseen():
    spec = parse_spec(SPEC)
    assert build_foreseen(spec, build_model(spec)) is None
