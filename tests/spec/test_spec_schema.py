"""The JSON schema accepts the examples and refuses what no spec may hold; checked by a small validator."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from inputdesign_cli.spec import json_schema
from inputdesign_cli.spec.reader import read

HERE = Path(__file__).parent
SPECS = sorted([*(HERE / "data").glob("*.yaml"), *(HERE.parents[1] / "specs").glob("*.yaml")])

GOOD = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 1}\naccuracy: {model_error: {relative: 0.01}}\n"

WORDS = (
    "$schema $defs $ref title description default examples type properties required additionalProperties "
    "anyOf oneOf enum const items minItems maxItems minLength minProperties minimum exclusiveMinimum "
    "exclusiveMaximum"
)
KNOWN = set(WORDS.split())

TYPES = {
    "object": dict, "array": list, "string": str, "number": (int, float), "integer": int, "boolean": bool,
}  # fmt: skip


def is_type(value, name):
    if isinstance(value, bool):
        return name == "boolean"
    if name == "integer" and isinstance(value, float):
        return value.is_integer()
    return isinstance(value, TYPES[name])


def accepts(value, schema, root):
    """Whether the JSON schema accepts the value; only the keywords of KNOWN."""
    assert set(schema) <= KNOWN, set(schema) - KNOWN
    if "$ref" in schema and not accepts(value, root["$defs"][schema["$ref"].rsplit("/", 1)[1]], root):
        return False
    kinds = schema.get("type")
    if kinds and not any(is_type(value, k) for k in ([kinds] if isinstance(kinds, str) else kinds)):
        return False
    if "anyOf" in schema and not any(accepts(value, s, root) for s in schema["anyOf"]):
        return False
    if "oneOf" in schema and sum(accepts(value, s, root) for s in schema["oneOf"]) != 1:
        return False
    if "enum" in schema and value not in schema["enum"]:
        return False
    if "const" in schema and value != schema["const"]:
        return False
    if isinstance(value, dict):
        properties, more = schema.get("properties", {}), schema.get("additionalProperties", True)
        if any(key not in value for key in schema.get("required", ())):
            return False
        if len(value) < schema.get("minProperties", 0):
            return False
        for key, entry in value.items():
            rule = properties.get(key, more)
            if rule is False or (isinstance(rule, dict) and not accepts(entry, rule, root)):
                return False
    if isinstance(value, list):
        if not schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)):
            return False
        return all(accepts(entry, schema.get("items", {}), root) for entry in value)
    if isinstance(value, str):
        return len(value) >= schema.get("minLength", 0)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return (
            value >= schema.get("minimum", value)
            and ("exclusiveMinimum" not in schema or value > schema["exclusiveMinimum"])
            and ("exclusiveMaximum" not in schema or value < schema["exclusiveMaximum"])
        )
    return True


@pytest.fixture(scope="module")
def schema():
    return json_schema()


def test_it_is_json_and_closed(schema):
    assert json.loads(json.dumps(schema)) == schema
    assert schema["$schema"].endswith("2020-12/schema")
    assert schema["required"] == ["plant", "noise"]
    assert schema["additionalProperties"] is False
    for definition in schema["$defs"].values():
        assert definition["additionalProperties"] is False
        for key, entry in definition["properties"].items():
            assert "description" in entry, key
    assert '"null"' not in json.dumps(schema)


@pytest.mark.parametrize("path", SPECS, ids=lambda p: p.stem)
def test_it_accepts_the_examples(path, schema):
    assert accepts(read(path.read_text(), "x").data, schema, schema)


@pytest.mark.parametrize(
    "extra",
    [
        "limits: {input_power: 1}",
        "limits: {input_power: [1, 2]}",
        "limits: {input_power: {max: 1}}",
        "limits: {spectrum: {max: {table: a.csv}}}",
        "spectrum: {given: {signal: u.csv}}",
        "accuracy: {information: [[1]]}",
        "title: 3",
    ],
)
def test_it_accepts_shorthands(extra, schema):
    text = GOOD if "accuracy" not in extra else GOOD.rsplit("accuracy", 1)[0]
    assert accepts(read(text + extra, "x").data, schema, schema)


@pytest.mark.parametrize(
    "text",
    [
        "noise: {variance: 1}",
        GOOD + "titel: x",
        GOOD + "sample_time: 0",
        GOOD + "sample_time: fast",
        GOOD + "time_unit: sec",
        GOOD + "spectrum: {type: fir, basis: legendre}",
        GOOD + "spectrum: {type: spline}",
        GOOD + "limits: {input_power: -1}",
        GOOD + "experiment: {samples: 0.5}",
        GOOD.replace("[0, 1]", "[]"),
        GOOD.replace("B:", "b:"),
    ],
)
def test_it_refuses(text, schema):
    assert not accepts(read(text, "x").data, schema, schema)
