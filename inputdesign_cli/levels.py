"""Significance levels: shares of one error rate for all tests of data together.

All tests together refute right models of plant and noise, or leave a verdict undecided, with at most the
probability `RATE` (Bonferroni).
"""

from __future__ import annotations

RATE = 0.05

SHARES = {
    "one parameter": 0.12,  # a coefficient, a delay, or a gain that varies
    "many signals": 0.1,  # past inputs, past residuals, trends
    "varying gain": 0.1,  # large enough to move G by more than is admitted
    "level shift": 0.02,
    "one system": 0.02,  # experiments that differ
    "prior": 0.2,  # an earlier estimate that differs
    "far from nominal": 0.02,
    "feedback": 0.002,  # an input that depends on the outputs, or is logged late
    "frozen": 0.002,  # a sensor that stands still
}
"""The share of each group of tests; their sum below one makes chance findings rarer still."""


def level(tests: str) -> float:
    """Return the significance level of a group of tests: the probability that any of them fails by chance."""
    return RATE * SHARES[tests]
