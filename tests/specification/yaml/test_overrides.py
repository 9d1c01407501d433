"""`--set`, `Spec.with_` and `include`: what they change, and their own diagnostics."""

from __future__ import annotations

import json

import numpy as np
import pytest
import yaml

from inputdesign_cli.specification import load_spec, parse_spec, read_template
from tests.support.refusals import refused

GOOD = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 1}\naccuracy: {model_error: {relative: 0.01}}\n"


def test_overrides_replace_create_and_remove_values():
    spec = parse_spec(
        GOOD,
        overrides=[
            "plant.B.1=3",
            "plant.F[1]=-0.25",
            "experiment.samples=1e3",
            "signal={type: multisine, seed: 2}",
            "signal.seed=7",
            "accuracy.model_error.relative=null",
            "accuracy.model_error.absolute=0.5",
            "title= a = b",
        ],
    )
    assert spec.plant.B == (0.0, 3.0)
    assert spec.plant.F == (1.0, -0.25)
    assert spec.experiment.samples == 1000
    assert spec.signal.seed == 7
    assert spec.accuracy.model_error.relative is None
    assert spec.accuracy.model_error.absolute == 0.5
    assert spec.title == "a = b"
    assert parse_spec(spec.to_yaml()).sha256 == spec.sha256


def test_an_override_mends_a_file():
    broken = GOOD.replace("[1, -0.5]", "[1, -1.5]")
    assert parse_spec(broken, overrides=["plant.F=[1, -0.5]"]).sha256 == parse_spec(GOOD).sha256
    assert parse_spec(GOOD + "spectrum:\n", overrides=["spectrum.type=white"]).spectrum.type == "white"


def test_the_last_override_of_a_key_holds():
    assert parse_spec(GOOD, overrides=["noise.variance=2", "noise.variance=3"]).noise.variance == 3.0


def test_places_point_at_the_override():
    spec = parse_spec(GOOD, "x.yaml", overrides=["plant.F=[1, -0.25]"])
    at = spec.locate("plant.F[1]")
    assert (at.file, at.line, at.column, at.text) == ("--set plant.F=[1, -0.25]", 1, 13, "plant.F=[1, -0.25]")
    assert spec.locate("plant.B").file == "x.yaml"


@pytest.mark.parametrize(
    ("override", "code", "column", "words"),
    [
        ("plant.F=[1, -1.7]", "unstable-polynomial", 9, "radius 1.7"),
        ("plant.F=[1, x]", "not-a-number", 13, 'the text "x"'),
        ("plant.Q=1", "unknown-key", 1, "A, B, F"),
        ("spectrum.ordr=3", "unknown-key", 1, "x"),
        ("expriment.samples=3", "unknown-key", 1, 'did you mean "experiment"'),
        ("sample_time=0", "out-of-range", 13, "greater than 0"),
        ("plant.B.2=1", "bad-override", 1, "list of 2"),
        ("plant.B.x=1", "bad-override", 1, "no entry x"),
        ("plant.B.-1=1", "bad-override", 1, "no entry -1"),
        ("noise.variance.x=1", "bad-override", 1, "single value"),
        ("noise", "bad-override", 1, "key.path=value"),
        ("=3", "bad-override", 1, "key.path=value"),
        ("a..b=3", "bad-override", 1, "key.path=value"),
        ("", "bad-override", 1, "key.path=value"),
        ("noise.variance=", "bad-override", 16, "null"),
        ("noise.variance=[1", "yaml-syntax", 18, "closed"),
        ("noise={variance: 1, variance: 2}", "duplicate-key", 21, "twice"),
        ("noise.variance=!!x 1", "yaml-tag", 16, "tag"),
        ("x" + ".x" * 100 + "=1", "bad-override", 1, "too many steps"),
        ("title=\x07", "file-encoding", 7, "U+0007"),
    ],
)
def test_complaints_name_the_override(override, code, column, words):
    base = GOOD + "spectrum: {type: fir}\n" if override.startswith("spectrum") else GOOD
    (diagnostic,) = refused(parse_spec, base, "x.yaml", overrides=[override])
    assert diagnostic.code == code
    assert diagnostic.location.file == f"--set {override}"
    assert (diagnostic.location.line, diagnostic.location.column) == (1, column)
    if words != "x":
        assert words in diagnostic.message + " | " + diagnostic.hint


def test_complaints_of_file_and_overrides_come_together():
    found = refused(
        parse_spec, GOOD + "sampletime: 1\n", "x.yaml", overrides=["nonsense", "noise.variance=-1"]
    )
    assert [(c.location.file, c.code) for c in found] == [
        ("x.yaml", "unknown-key"),
        ("--set noise.variance=-1", "out-of-range"),
        ("--set nonsense", "bad-override"),
    ]


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
    place = revised.locate("experiment.samples")
    assert (place.file, place.line) == ("s.yaml", 3)
    assert revised.locate("noise.variance").file == "the estimate"
    assert (spec.noise.variance, spec.locate("noise.variance").file) == (0.4, "s.yaml")
    (found,) = refused(spec.revised, {"noise.variance": -1.0}, file="the estimate")
    assert (found.code, found.key, found.location.file) == ("out-of-range", "noise.variance", "the estimate")


@pytest.mark.parametrize("text", ["a\x00b", "\x1b[31m"])
def test_unprintable_texts_are_refused(text):
    found = refused(parse_spec(TEXT).with_, title=text)
    assert [(d.code, d.key) for d in found] == [("bad-argument", "title")]


@pytest.mark.parametrize("value", [10**400, -(10**400), np.nan, np.inf], ids=["huge", "-huge", "nan", "inf"])
def test_numbers_that_no_double_holds_are_refused(value):
    """A count has a range; any other number must be a finite double."""
    for key in ("sample_time", "experiment.samples"):
        (found,) = refused(parse_spec(TEXT).with_, **{key: value})
        counted = key != "sample_time" and isinstance(value, int)
        assert (found.code, found.key) == ("out-of-range" if counted else "not-finite", key)


MODEL = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 2}\n"
ASKED = "accuracy: {standard_deviation: {b1: 0.1}}\nexperiment: {samples: 200}\n"


def written(folder, text, **files):
    for name, content in files.items():
        (folder / f"{name}.yaml").write_text(content)
    (folder / "spec.yaml").write_text(text)
    return folder / "spec.yaml"


def complaints(path, *overrides):
    return refused(load_spec, path, overrides)


def test_included_blocks_count_as_if_they_were_pasted(tmp_path):
    path = written(tmp_path, "include: model.yaml\n" + ASKED, model=MODEL)
    pasted = written(tmp_path, MODEL + ASKED)
    spec = load_spec(pasted)
    written(tmp_path, "include: model.yaml\n" + ASKED)
    included = load_spec(path)
    assert included.sha256 == spec.sha256
    assert yaml.safe_load(included.to_yaml()) == yaml.safe_load(spec.to_yaml())
    assert read_template(path).data == yaml.safe_load(spec.to_yaml())


def test_several_files_are_joined_key_by_key(tmp_path):
    prior = "experiment: {prior: {information: [[4, 0], [0, 9]]}}\n"
    spec = load_spec(
        written(tmp_path, "include: [model.yaml, prior.yaml]\n" + ASKED, model=MODEL, prior=prior)
    )
    assert (spec.experiment.samples, spec.experiment.prior.information) == (200, ((4, 0), (0, 9)))


def test_overrides_change_included_keys_and_may_name_the_file(tmp_path):
    path = written(tmp_path, ASKED, model=MODEL)
    spec = load_spec(path, ["plant.F=[1, -0.9]", "include=model.yaml"])
    assert spec.plant.F == (1, -0.9)


def test_complaints_point_into_the_included_file(tmp_path):
    path = written(tmp_path, "include: model.yaml\n" + ASKED, model=MODEL.replace("2}", "-2}"))
    (diagnostic,) = complaints(path)
    assert diagnostic.location.file == str(tmp_path / "model.yaml")
    assert (diagnostic.location.line, diagnostic.key) == (2, "noise.variance")


@pytest.mark.parametrize(
    ("text", "other", "line", "said"),
    [
        ("title: x\ninclude: modell.yaml\n", "", 2, "there is no file"),
        ("include: 3\n", "", 1, "not the name of a file"),
        ("include: [model.yaml, other.yaml]\n", "include: model.yaml\n", 1, "includes others itself"),
        ("include: other.yaml\n", "- 1\n", 1, "holds no blocks"),
        ("include: model.yaml\nplant: {B: [0, 1]}\n", "", 2, "plant stands here and in"),
        ("include: other.yaml\n" + MODEL, "experiment: {samples: 3}\n", 5, "experiment.samples stands"),
    ],
)
def test_missing_or_conflicting_includes_are_refused(text, other, line, said, tmp_path):
    (diagnostic,) = complaints(written(tmp_path, text + ASKED, model=MODEL, other=other))
    assert diagnostic.code == "bad-include"
    assert diagnostic.location.line == line
    assert said in diagnostic.message
    assert diagnostic.hint
