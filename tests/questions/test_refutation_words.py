"""Refutations in sentences: probabilities below the smallest number, and levels that looks share."""

from types import SimpleNamespace

import pytest

from inputdesign_cli.findings.other_systems import contradictions, differences
from inputdesign_cli.outcome.shares import chance


@pytest.mark.parametrize(
    ("probability", "told"),
    [(0.0123, "1.2e-02"), (1e-299, "1.0e-299"), (1e-310, "below 1e-300"), (0.0, "below 1e-300")],
)
def test_no_probability_is_told_as_zero(probability, told):
    assert chance(probability) == told


def test_looks_share_the_level_of_what_they_may_end():
    """0.001 for records and 0.01 for a prior, of two records and twenty looks at data that come in."""
    prior, tests = SimpleNamespace(differing=4e-4, alike=0.9), SimpleNamespace(alike=(2e-5, 2e-5))
    estimate = SimpleNamespace(prior=prior, tests=tests)
    assert differences(estimate, ["a.csv", "b.csv"], looks=24)
    assert contradictions(estimate, looks=24)
    assert not differences(estimate, ["a.csv", "b.csv"], looks=26)
    assert not contradictions(estimate, looks=26)
