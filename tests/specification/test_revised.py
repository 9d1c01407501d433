"""A spec with other values is made from its data: nothing is written as YAML and read again."""

import json

import numpy as np
import pytest

from inputdesign_cli import Spec, parse_spec
from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification.yaml import reader

TEXT = """\
plant: {B: [0, 3.6], F: [1, -0.7]}
noise: {variance: 0.4}
experiment: {samples: 200}
accuracy: {model_error: {relative: 0.05}}
"""
CHANGES = [
    {"experiment.samples": 600},
    {"plant": {"B": [0, 1.5], "F": [1, -0.5]}, "noise": {"variance": 2, "C": [1, 0.3]}},
    {"plant.F.1": -0.8, "accuracy.model_error": None, "accuracy.criterion": "D", "limits.input_power": 1},
    {"spectrum": {"type": "fir", "order": 12}, "signal.seed": 4},
    {"experiment.prior": {"information": [[20.0, 1.0], [1.0, 30.0]], "parameters": ["b1", "f1"]}},
]


@pytest.mark.parametrize("changes", CHANGES)
def test_a_revised_spec_is_the_one_with_overrides(changes):
    overrides = [f"{key}={json.dumps(value)}" for key, value in changes.items()]
    written = parse_spec(TEXT, overrides=overrides)
    revised = parse_spec(TEXT).revised(changes)
    assert revised.model_dump() == written.model_dump()
    assert revised.sha256 == written.sha256


def test_places_of_other_keys_stay_and_new_values_name_their_source():
    spec = parse_spec(TEXT, "s.yaml")
    revised = spec.revised({"noise.variance": np.float64(2.0)}, file="the estimate")
    assert (revised.locate("experiment.samples").file, revised.locate("experiment.samples").line) == (
        "s.yaml",
        3,
    )
    assert revised.locate("noise.variance").file == "the estimate"
    assert (spec.noise.variance, spec.locate("noise.variance").file) == (0.4, "s.yaml")
    with pytest.raises(SpecError) as caught:
        spec.revised({"noise.variance": -1.0}, file="the estimate")
    (found,) = caught.value.diagnostics
    assert (found.code, found.key, found.location.file) == ("out-of-range", "noise.variance", "the estimate")


def test_no_text_is_parsed(monkeypatch):
    spec = parse_spec(TEXT)
    monkeypatch.setattr(reader, "_Loader", None)
    assert spec.with_(**{"experiment.samples": 600}).experiment.samples == 600
    assert Spec.from_dict(spec.content).model_dump() == spec.model_dump()


@pytest.mark.parametrize("text", ["a\x00b", "\x1b[31m"])
def test_unprintable_texts_are_refused(text):
    with pytest.raises(SpecError) as caught:
        parse_spec(TEXT).with_(title=text)
    assert [(d.code, d.key) for d in caught.value.diagnostics] == [("bad-argument", "title")]
