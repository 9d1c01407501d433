"""The JSON schema accepts the examples and refuses what no spec may hold."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest

import inputdesign_cli
from inputdesign_cli import parse_spec, validate
from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification import json_schema
from inputdesign_cli.specification.yaml.reader import read

HERE = Path(__file__).parent
SPECS = sorted([*(HERE / "data").glob("*.yaml"), *(HERE.parents[1] / "specs").glob("*.yaml")])

GOOD = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 1}\naccuracy: {model_error: {relative: 0.01}}\n"


def accepts(value, schema):
    return jsonschema.Draft202012Validator(schema).is_valid(value)


@pytest.fixture(scope="module")
def schema():
    found = json_schema()
    jsonschema.Draft202012Validator.check_schema(found)
    return found


def test_the_schema_is_json_and_allows_no_other_keys(schema):
    assert json.loads(json.dumps(schema)) == schema
    assert schema["$schema"].endswith("2020-12/schema")
    whole, included, estimated = schema["anyOf"]
    size = {"anyOf": [{"required": ["variance"]}, {"required": ["standard_deviation"]}]}
    assert whole == {"required": ["plant", "noise"], "properties": {"noise": size}}
    assert included == {"required": ["include"]}
    assert estimated["required"] == ["plant"]
    assert schema["additionalProperties"] is False
    for definition in schema["$defs"].values():
        assert definition["additionalProperties"] is False
        for key, entry in definition["properties"].items():
            assert "description" in entry, key
    assert '"null"' not in json.dumps(schema)


@pytest.mark.parametrize(
    "extra",
    [
        "limits: {input_power: 1}",
        "limits: {input_power: [1, 2]}",
        "limits: {spectrum: {max: {table: a.csv}}}",
        "spectrum: {given: {signal: u.csv}}",
        "accuracy: {information: [[1]]}",
        "title: 3",
        "sample_time: 10\nsimulation: {noise: {standard_deviation: 1, correlation_time: 60}}",
    ],
)
def test_the_schema_accepts_shorthands(extra, schema):
    text = GOOD if "accuracy" not in extra else GOOD.rsplit("accuracy", 1)[0]
    assert accepts(read(text + extra, "x").data, schema)


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
        GOOD + "spectrum: {typ: fir}",
        GOOD + "sweep: {set: {a: 3}}",
        GOOD + "sweep: {}",
    ],
)
def test_the_schema_refuses_invalid_specs(text, schema):
    assert not accepts(read(text, "x").data, schema)


STARTERS = sorted((Path(inputdesign_cli.__file__).parent / "cli" / "starters").glob("*.yaml"))


@pytest.mark.parametrize("path", [*SPECS, *STARTERS], ids=lambda path: path.stem)
def test_an_editor_accepts_the_shipped_specs(schema, path):
    jsonschema.Draft202012Validator(schema).validate(read(path.read_text(), path.name).data)


ESTIMATED = {
    "plant alone": "plant: {B: [0, 1], F: [1, -0.5]}",
    "colour": "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {C: [1, -0.2]}",
    "in s": "plant: {continuous: {gain: 1, time_constant: 9, dead_time: 0.5}, sample: zoh}\nsample_time: 0.5",
    "loop": "plant: {B: [0, 1], F: [1, -0.5]}\nexperiment: {controller: {pid: {Kp: 0.1}}}",
    "levels": "plant: {B: [0, 1], F: [1, -0.5]}\nsignal: {offset: 3}",
}


@pytest.mark.parametrize("text", ESTIMATED.values(), ids=ESTIMATED)
def test_only_a_spec_to_estimate_from_needs_no_noise_and_no_question(text, schema):
    assert accepts(read(text, "x").data, schema)
    validate(parse_spec(text, design=None))
    for asked in ("accuracy: {criterion: D}", "limits: {input_power: 1}", "spectrum: {type: white}"):
        assert not accepts(read(f"{text}\n{asked}", "x").data, schema)
        with pytest.raises(SpecError):
            parse_spec(f"{text}\n{asked}", design=None)


DESIGN = "noise: {variance: 1}\naccuracy: {criterion: D}\nlimits: {input_power: 1, band: [0, 1]}\n"
PLANTS = [
    "{parameters: {K: 2.1, T: 180, L: 25}, continuous: {numerator: [K], denominator: [T, 1], delay: L}}",
    "{parameters: {g: 0.3, p: 0.8}, B: [0, g], F: [1, -p], known: [p]}",
    "{continuous: {gain: 2.1, time_constant: 180, dead_time: 25}, sample: zoh}",
    "{continuous: {gain: [[1, 2]], damping: [[1, 2]], natural_frequency: [[1, 2]]}, sample: zoh}",
    "{continuous: {numerator: [[[1], [2]]], denominator: [1, 1], delay: [[0, 2]]}, sample: zoh}",
]


@pytest.mark.first(2)
@pytest.mark.parametrize("plant", PLANTS)
def test_the_schema_and_the_models_accept_the_same_plants(plant, schema):
    text = f"plant: {plant}\n{DESIGN}"
    assert accepts(read(text, "x").data, schema)
    spec = parse_spec(text)
    assert parse_spec(spec.to_yaml()).plant == spec.plant
