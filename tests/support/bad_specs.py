"""Sections of specs with something wrong in them, a row each.

The sign § in a row marks the place that the diagnostic must point at; it is removed before reading.
"""

import pytest

BASE: dict[str, str | None] = {
    "plant": "{B: [0, 1], F: [1, -0.5]}",
    "noise": "{variance: 1}",
    "accuracy": "{model_error: {relative: 0.01}}",
}
CONTROLLER = "{controller: {numerator: [0.1], denominator: [1, -1]}}"
REGRESSION: dict[str, str | None] = {
    "plant": "{regression: {estimated: 1, neglected: 1}}",
    "accuracy": "{mean_squared_error: {target: 1, estimated: [1], neglected: [1], neglected_norm: 1}}",
}
MIMO = "{B: [[[0, 1], [0, 2]], [[0, 3], [0, 4]]]}"
CONTINUOUS = "{continuous: {numerator: [1], denominator: [1, 1]}}"

# Code, key, words of the message or hint, and the sections that differ from those of `BASE`.
Row = tuple[str, str, str, dict[str, str | None]]


def each(rows: list[Row]) -> pytest.MarkDecorator:
    """A test of every row."""
    names = [f"{i}-{code}-{key}" for i, (code, key, _, _) in enumerate(rows)]
    return pytest.mark.parametrize("row", rows, ids=names)
