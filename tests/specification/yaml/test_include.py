"""Blocks of other files: what is put together, where diagnostics point, what contradicts."""

import pytest
import yaml

from inputdesign_cli import load_spec
from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification.loading import read_template

MODEL = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 2}\n"
REST = "accuracy: {standard_deviation: {b1: 0.1}}\nexperiment: {samples: 200}\n"


def written(folder, text, **files):
    for name, content in files.items():
        (folder / f"{name}.yaml").write_text(content)
    (folder / "spec.yaml").write_text(text)
    return folder / "spec.yaml"


def diagnostics(path, *overrides):
    with pytest.raises(SpecError) as caught:
        load_spec(path, overrides)
    return caught.value.diagnostics


def test_blocks_stand_as_if_they_were_pasted(tmp_path):
    path = written(tmp_path, "include: model.yaml\n" + REST, model=MODEL)
    pasted = written(tmp_path, MODEL + REST)
    spec = load_spec(pasted)
    written(tmp_path, "include: model.yaml\n" + REST)
    included = load_spec(path)
    assert included.sha256 == spec.sha256
    assert yaml.safe_load(included.to_yaml()) == yaml.safe_load(spec.to_yaml())
    assert read_template(path).data == yaml.safe_load(spec.to_yaml())


def test_several_files_are_joined_key_by_key(tmp_path):
    prior = "experiment: {prior: {information: [[4, 0], [0, 9]]}}\n"
    spec = load_spec(
        written(tmp_path, "include: [model.yaml, prior.yaml]\n" + REST, model=MODEL, prior=prior)
    )
    assert (spec.experiment.samples, spec.experiment.prior.information) == (200, ((4, 0), (0, 9)))


def test_overrides_reach_what_is_included_and_name_the_file(tmp_path):
    path = written(tmp_path, REST, model=MODEL)
    spec = load_spec(path, ["plant.F=[1, -0.9]", "include=model.yaml"])
    assert spec.plant.F == (1, -0.9)


def test_complaints_point_into_the_included_file(tmp_path):
    path = written(tmp_path, "include: model.yaml\n" + REST, model=MODEL.replace("2}", "-2}"))
    (diagnostic,) = diagnostics(path)
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
def test_what_cannot_be_put_together(text, other, line, said, tmp_path):
    (diagnostic,) = diagnostics(written(tmp_path, text + REST, model=MODEL, other=other))
    assert diagnostic.code == "bad-include"
    assert diagnostic.location.line == line
    assert said in diagnostic.message
    assert diagnostic.hint
