"""Expressions and short forms in the JSON schema, and overrides of named parameters."""

import jsonschema
import pytest
import yaml

from inputdesign_cli import parse_spec
from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification.schema import json_schema

REST = "noise: {variance: 1}\naccuracy: {criterion: D}\nlimits: {input_power: 1}\n"
PLANTS = [
    "{parameters: {K: 2.1, T: 180, L: 25}, continuous: {numerator: [K], denominator: [T, 1], delay: L}}",
    "{parameters: {g: 0.3, p: 0.8}, B: [0, g], F: [1, -p], known: [p]}",
    "{continuous: {gain: 2.1, time_constant: 180, dead_time: 25}, sample: zoh}",
    "{continuous: {gain: [[1, 2]], damping: [[1, 2]], natural_frequency: [[1, 2]]}, sample: zoh}",
    "{continuous: {numerator: [[[1], [2]]], denominator: [1, 1], delay: [[0, 2]]}, sample: zoh}",
]


@pytest.mark.first(2)
@pytest.mark.parametrize("plant", PLANTS)
def test_the_schema_and_the_models_take_the_same_words(plant):
    text = f"plant: {plant}\n{REST}limits: {{input_power: 1, band: [0, 1]}}".replace(
        "limits: {input_power: 1}\n", ""
    )
    jsonschema.validate(yaml.safe_load(text), json_schema())
    spec = parse_spec(text)
    assert parse_spec(spec.to_yaml()).plant == spec.plant


def test_a_named_parameter_is_changed_by_an_override():
    spec = parse_spec(f"plant: {PLANTS[1]}\n{REST}", overrides=["plant.parameters.p=0.5"])
    assert spec.plant.F == (1.0, -0.5)


def test_a_coefficient_that_is_a_word_tells_of_parameters():
    with pytest.raises(SpecError) as caught:
        parse_spec(f"plant: {{B: [0, K]}}\n{REST}")
    assert "parameters: {K: 2.1}" in caught.value.diagnostics[0].hint
