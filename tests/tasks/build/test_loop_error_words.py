"""The closed-loop error estimates coefficients: plants in other parameters are told how to be written so."""

import re

import pytest

from inputdesign_cli import parse_spec, validate
from inputdesign_cli.errors import SpecError

SPEC = """
noise: {variance: 0.04}
experiment: {samples: 500}
accuracy: {closed_loop_error: {control: {internal_model: {continuous: {numerator: [1], denominator: [7, 1]}}},
  reference: {variance: 1}}}
limits: {input_power: 1}
spectrum: {type: pointwise}
"""
SHORT = {
    "first": "{gain: 2, time_constant: 10, dead_time: 3}",
    "no delay": "{gain: 2, time_constant: 10}",
    "second": "{gain: 2, damping: 0.7, natural_frequency: 0.3, dead_time: 0.5}",
}


def complaint(text, *overrides):
    with pytest.raises(SpecError) as caught:
        validate(parse_spec(text, overrides=overrides))
    (found,) = caught.value.diagnostics
    assert found.code == "not-supported"
    return found


@pytest.mark.parametrize("words", SHORT)
def test_a_short_form_is_written_out(words):
    text = f"plant: {{continuous: {SHORT[words]}, sample: zoh}}\n{SPEC}"
    found = complaint(text)
    assert "known" not in found.message + found.hint
    assert "gain" in found.message
    (written,) = re.findall(r"write (\{.*\}) under", found.hint)
    validate(parse_spec(text, overrides=[f"plant.continuous={written}"]))


@pytest.mark.parametrize(
    ("plant", "key", "mended"),
    [
        ("{B: [0, 0.5], F: [1, -0.5], known: [f1]}", "plant.known", "{B: [0, 0.5], F: [1, -0.5]}"),
        ("{parameters: {b: 0.5}, B: [0, b]}", "plant.parameters", "{B: [0, 0.5]}"),
    ],
)
def test_what_is_to_be_removed_is_at_its_place(plant, key, mended):
    found = complaint(f"plant: {plant}\n{SPEC}")
    assert found.key == key
    assert f"remove {key.split('.')[1]}" in found.hint
    validate(parse_spec(f"plant: {mended}\n{SPEC}"))
