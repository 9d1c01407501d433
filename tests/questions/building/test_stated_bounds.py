"""A bound that a spec passes is stated once, and what it says is taken."""

import pytest

from inputdesign_cli import parse_spec
from inputdesign_cli.errors import SpecError

SPEC = """sample_time: 1
plant: {B: [0, 1], F: [1, -0.7]}
noise: {variance: 1}
experiment: {samples: 1000}
accuracy: {frequency_response: {relative: 0.05, band: [0.1, 2], lines: 12, detection: DETECTION}}
"""


@pytest.mark.parametrize("value", [-1, 0, 1])
def test_the_least_group_of_lines_is_said_at_once(value):
    with pytest.raises(SpecError, match="detection") as raised:
        parse_spec(SPEC.replace("DETECTION", str(value)))
    (told,) = raised.value.diagnostics
    assert "at least 2" in f"{told.message} {told.hint}"
    assert parse_spec(SPEC.replace("DETECTION", "2"))
