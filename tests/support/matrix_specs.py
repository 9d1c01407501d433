"""Specs with two inputs and two outputs, in open and closed loop and in continuous time."""

from inputdesign_cli.specification import parse_spec

ARX = """
plant:
  A: [[1, -0.7], [1, 0.4]]
  B: [[[0, 1.0, 0.4], [0, -0.5, 0.3]], [[0, 0.6, 0.2], [0, 1.2, -0.5]]]
noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}
experiment: {samples: 500}
"""
IN_LOOP = """
plant:
  A: [[1, -1.1], [1, -0.6]]
  B: [[[0, 1.0, 0.4], [0, -0.3]], [[0, 0.4], [0, 1.2, -0.5]]]
noise: {variance: [[1.0, 0.4], [0.4, 0.5]]}
experiment:
  samples: 500
  controller: {numerator: [[[0.3, -0.25], [0]], [[0], [0.3, -0.2]]], denominator: [1, -1]}
spectrum: {type: fir, order: 2}
"""
CONTINUOUS = """
plant:
  continuous:
    numerator: [[[3.125], [3.188]], [[5.313], [1.563]]]
    denominator: [[[1, 1.5, 1.563], [1, 2, 1.063]], [[1, 0.5, 1.063], [1, 1, 0.312]]]
noise: {variance: [[1, 0], [0, 1]]}
accuracy: {criterion: E}
limits: {input_power: 1000, output_power: 1000}
spectrum: {type: polynomial, order: 4, band: [0, 2.0]}
"""


def changed(text, *overrides):
    """The spec of a text with overrides."""
    return parse_spec(text, overrides=list(overrides))


# Every polynomial of a Box-Jenkins model, D common to the outputs, and an entry that is zero.
JENKINS = """
plant:
  B: [[[0, 1.0], [0, 0.5]], [[0, 0, 0.7], [0]]]
  F: [[[1, -0.7], [1, 0.3]], [[1, -0.5], [1]]]
noise: {C: [[1, 0.5], [1, -0.3]], D: [1, -0.6], variance: [[0.2, 0.05], [0.05, 0.1]]}
experiment: {samples: 400}
accuracy: {model_error: {relative: 0.1}}
spectrum: {type: fir, order: 4}
"""
