"""A result in words."""

import pytest

from inputdesign_cli.report.facts import proofs


@pytest.mark.parametrize(
    ("gap", "told"),
    [
        (0.0, "gap below 1e-6"),
        (7.8e-11, "gap below 1e-6"),
        (9.99e-7, "gap below 1e-6"),
        (1e-6, "gap 1.0e-06"),
        (0.021, "gap 2.1e-02"),
    ],
)
def test_a_gap_that_only_rounding_decides_is_told_as_closed(gap, told):
    result = {"objective": {"lower_bound": 2.0, "relative_gap": gap}, "spectrum": {"type": "fir"}}
    assert list(proofs(result)) == [f"no FIR spectrum gets below 2, {told}"]
