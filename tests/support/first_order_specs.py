"""Specs of a first-order Box-Jenkins plant, and what a wrong one is told."""

import pytest

from inputdesign_cli import parse_spec, solve
from inputdesign_cli.errors import SpecError

PLANT = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {C: [1, -0.9], variance: 1.0}
experiment: {samples: 500}
"""
ERROR = "accuracy: {model_error: {relative: 0.01, alpha: 2.45}}\n"
FIR = "spectrum: {type: fir, order: 8}\nsignal: {candidates: 2}\n"


def run(text):
    return solve(parse_spec(PLANT + text, file="plant.yaml")).result


def complaint_of(text, kind=SpecError, verb=solve):
    with pytest.raises(kind) as caught:
        verb(parse_spec(PLANT + text, file="plant.yaml"))
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.hint
    return diagnostic
