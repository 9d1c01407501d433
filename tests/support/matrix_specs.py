"""A spec with two inputs and two outputs in continuous time, and others made of it."""

from inputdesign_cli.specification import parse_spec

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
