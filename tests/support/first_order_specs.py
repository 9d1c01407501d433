"""Specs of a first-order Box-Jenkins plant, and their results."""

from inputdesign_cli import parse_spec, solve

PLANT = """
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {C: [1, -0.9], variance: 1.0}
experiment: {samples: 500}
"""
ERROR = "accuracy: {model_error: {relative: 0.01, alpha: 2.45}}\n"
FIR = "spectrum: {type: fir, order: 8}\nsignal: {candidates: 2}\n"


def run(text):
    return solve(parse_spec(PLANT + text, file="plant.yaml")).result
