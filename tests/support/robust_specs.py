"""Specs of uncertain plants, and their results."""

from inputdesign_cli import parse_spec, solve
from tests.support.first_order_specs import PLANT
from tests.support.matrix_specs import ARX

FIRST = f"""{PLANT}
accuracy: {{model_error: {{relative: 0.02}}}}
spectrum: {{type: fir, order: 6}}
signal: {{candidates: 1, seed: 1}}
"""
LOOP = """
plant: {B: [0, 0.5], F: [1, -0.8]}
noise: {variance: 1.0}
experiment: {samples: 500, controller: {numerator: [0.4], denominator: [1, -0.95]}}
cost: {input_power: 1, output_power: 1}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 6}
signal: {candidates: 1, seed: 1}
"""
TWO = f"""{ARX}
accuracy: {{model_error: {{relative: 0.2}}}}
spectrum: {{type: fir, order: 3}}
signal: {{candidates: 1, seed: 1}}
solver: {{any_spectrum_tolerance: 0.009}}
"""
PROCESS = """
sample_time: 1
plant: {continuous: {gain: 2, time_constant: 10, dead_time: 2}, sample: zoh}
noise: {variance: 0.04}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 8}
"""
PHYSICAL = """
sample_time: 1
plant:
  parameters: {K: 2, T: 15}
  continuous: {numerator: ["sqrt(K)/(T - 5)"], denominator: ["T", 1]}
  sample: zoh
noise: {variance: 0.04}
experiment: {samples: 500}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 8}
"""
COVARIANCE = "[[0.01, 0, 0], [0, 0.001, 0], [0, 0, 0.0004]]"


def solved(text, *overrides):
    return solve(parse_spec(text, overrides=list(overrides))).result
