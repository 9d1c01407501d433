"""Levels of significance: shares of one error rate for all tests of data together.

A right model of a right noise is refuted, or leaves a verdict undecided, with at most the probability `RATE`
by all tests together (Bonferroni).
"""

from __future__ import annotations

RATE = 0.05

SHARES = {
    "one parameter": 0.12,  # a coefficient, a delay, a gain that is not always the same
    "many signals": 0.1,  # past inputs, past residuals, trends
    "varying gain": 0.1,  # of such a size that it moves G by more than is admitted
    "level shift": 0.02,
    "one system": 0.02,  # experiments that differ
    "prior": 0.2,  # an earlier estimate that differs
    "far from nominal": 0.02,
    "feedback": 0.002,  # an input that answers the outputs, or is logged late
    "frozen": 0.002,  # a sensor that stands still
}
"""The share of each group of tests; what is left of the rate makes chance findings rarer."""


def level(tests: str) -> float:
    """Return the probability with which any of a group of tests fails though all is right."""
    return RATE * SHARES[tests]
