"""Probabilities in sentences, down to those below the smallest number."""

import pytest

from inputdesign_cli.tasks.result.refutations import chance


@pytest.mark.parametrize(
    ("probability", "told"),
    [(0.0123, "1.2e-02"), (1e-299, "1.0e-299"), (1e-310, "below 1e-300"), (0.0, "below 1e-300")],
)
def test_no_probability_is_told_as_zero(probability, told):
    assert chance(probability) == told
