"""Texts of a spec that name files, the folder they start from, and specs that are confined to a folder."""

import os
import re

import pytest

from inputdesign_cli import Spec, load_spec
from inputdesign_cli.cli.watch import _named_files as followed_files
from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification import relocated
from inputdesign_cli.specification.loading import read_template
from inputdesign_cli.specification.schema import named_files
from inputdesign_cli.specification.yaml.places import format_key
from inputdesign_cli.specification.yaml.plain import to_yaml
from inputdesign_cli.specification.yaml.reader import read
from inputdesign_cli.sweeps.plan import build_plan, parse_settings
from inputdesign_cli.sweeps.points import Layout
from tests.support.refusals import code_of, refused

MODEL = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 2}\naccuracy: {standard_deviation: {b1: 0.1}}\n"
TABLE = "frequency,r_adm\n0,1\n3.2,1\n"
NAMING = {
    "accuracy.model_error.table": "%s",
    "accuracy": "{frequency_response: {table: %s, band: [0.1, 1], lines: 9}}",
    "accuracy.frequency_response": "{relative: 0.1, band: [0.1, 1], lines: 9, noise: %s}",
    "limits.spectrum": "{max: {table: %s}}",
    "limits.spectrum.min": "{table: %s}",
    "spectrum": "{given: {type: table, file: %s}}",
    "spectrum.given.signal": "%s",
    "experiment.prior.information": "%s",
    "uncertainty.covariance": "%s",
    "uncertainty.information": "%s",
}
"""Every key that may name a file, with a text that does."""
OTHER_TEXTS = re.compile(
    r"title|channels\.\*\.(name|unit)|sweep\.set\.\*|report\.ellipses\.\[\]\.\[\]"  # for people, or keys
    r"|.*\.(parameters|known)\.\[\]"  # names of parameters
    r"|(simulation\.)?plant\..*"  # expressions
)
"""Every other key that may be any text."""


@pytest.fixture
def project(tmp_path):
    """A folder `in` with a spec, and a table beside it and in it."""
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "spec.yaml").write_text("title: r.csv\n" + MODEL)
    for folder in (tmp_path, tmp_path / "in"):
        (folder / "r.csv").write_text(TABLE)
        (folder / "more.yaml").write_text("experiment: {samples: 7}\n")
    (tmp_path / "in" / "link.csv").symlink_to("../r.csv")
    (tmp_path / "in" / "link.yaml").symlink_to("../more.yaml")
    return tmp_path / "in"


def texts(schema, node, path=()):
    """Every key at which any text may stand, and whether it may name a file."""
    node = {**node, **schema["$defs"][node["$ref"].split("/")[-1]]} if "$ref" in node else node
    if "string" in (kinds := node.get("type", ()), *kinds) and not {"enum", "const"} & node.keys():
        yield ".".join(path), node.get("format") == "path"
    for union in ("anyOf", "oneOf", "allOf"):
        for option in node.get(union, ()):
            yield from texts(schema, option, path)
    inner = [("[]", item) for item in (node.get("items"), *node.get("prefixItems", ()))]
    inner += [("*", node.get("additionalProperties")), *node.get("properties", {}).items()]
    for step, below in inner:
        if isinstance(below, dict):
            yield from texts(schema, below, (*path, step))


def test_every_key_that_may_hold_a_text_is_known_to_name_a_file_or_not(project):
    schema = Spec.model_json_schema()
    found = set(texts(schema, schema))
    files = {key for key, of_file in found if of_file}
    named = set()
    for key, text in NAMING.items():
        tree = read_template(project / "spec.yaml", [f"{key}={text % 'r.csv'}"]).data
        named |= {format_key(path) for path, _ in named_files(tree)}
    assert files == named
    assert {key for key, of_file in found if not (of_file or OTHER_TEXTS.fullmatch(key))} == set()


@pytest.mark.parametrize(("key", "text"), NAMING.items())
def test_sweeps_and_watch_see_every_file(project, key, text):
    setting = f"{key}={text % 'r.csv'}"
    draft = read_template(project / "spec.yaml", [setting, "report={ellipses: [r.csv]}"])
    ((_, found),) = named_files(draft.data)
    assert [found] == draft.files(draft.data) == ["r.csv"]
    draft = read_template(project / "spec.yaml", ["sweep={set: {noise.variance: [1, 2]}}"])
    before = draft.digest(draft.variant([setting]))
    (project / "r.csv").write_text(TABLE + "4,1\n")
    assert draft.digest(draft.variant([setting])) != before
    plan = build_plan(project / "spec.yaml", [setting, "noise.variance=1,2"], zipped=False, verb="solve")
    assert "r.csv" in plan.job(0, project, carries=True, figures="").files
    assert project / "r.csv" in followed_files(project / "spec.yaml", [setting])


@pytest.mark.parametrize("name", ["secret.csv", "secret.yaml", "secret"])
@pytest.mark.parametrize("key", ["accuracy.model_error.table", "uncertainty.covariance"])
def test_no_content_of_a_file_outside_the_folder_is_shown(project, key, name):
    (project.parent / name).write_text("frequency,r_adm,u,hunter2\n0,hunter2,1,1\nhunter2,1,1,1\n")
    found = refused(
        load_spec, project / "spec.yaml", [f"{key}={NAMING[key] % f'../{name}'}"], confine=project
    )
    assert "hunter2" not in repr(found)


@pytest.mark.parametrize("title", ["x" * 5000, "r.csv", "a\\0b", "/", ".", "\N{GRINNING FACE}" * 200])
def test_a_title_is_no_file(project, title):
    (project / "spec.yaml").write_text(f'title: "{title}"\n' + MODEL.replace("2", "1"))
    try:
        draft = read_template(project / "spec.yaml")
    except SpecError:  # the title with a NUL
        return
    assert draft.files(draft.data) == []
    assert draft.digest(draft.data)


OUTSIDE = ["../r.csv", "{}/r.csv", "link.csv", "sub/../../r.csv", "/etc/passwd", "/dev/zero"]


@pytest.mark.parametrize(
    ("key", "name"),
    [*((key, OUTSIDE[0]) for key in NAMING), *(("limits.spectrum.min", name) for name in OUTSIDE[1:])],
)
def test_a_confined_spec_names_no_file_outside_its_folder(project, key, name):
    setting = f"{key}={NAMING[key] % name.format(project.parent)}"
    for reading in (load_spec, read_template):
        found = {
            diagnostic.code: diagnostic
            for diagnostic in refused(reading, project / "spec.yaml", [setting], confine=project)
        }
        assert found["file-outside"].key.startswith(key)
    draft = read_template(project / "spec.yaml", confine=project)
    assert draft.files(draft.variant([setting])) == []
    draft = read_template(project / "spec.yaml", [f"{key}={NAMING[key] % 'r.csv'}"], confine=project)
    assert draft.files(draft.data) == ["r.csv"]


@pytest.mark.parametrize("name", ["../more.yaml", "link.yaml", "/etc/passwd"])
def test_a_confined_spec_includes_no_file_outside_its_folder(project, name):
    found = refused(load_spec, project / "spec.yaml", [f"include={name}"], confine=project)
    assert found[0].code == "file-outside"
    assert load_spec(project / "spec.yaml", ["include=more.yaml"], confine=project).experiment.samples == 7


SECRETS = [
    b"hunter2:x:0:0:root:/root:/bin/sh\n", b"token: hunter2\n", b"a: [hunter2\n", b"- hunter2\n",
    b'"hunter2": {a: 1, a: 2}\n', b"hunter2: !secret x\n", b"<<: hunter2\n", b"x: &a hunter2\ny: *b\n",
    b"plant: hunter2 \xff\n",
]  # fmt: skip


@pytest.mark.parametrize("text", SECRETS)
def test_no_content_of_an_included_file_without_blocks_is_shown(project, text):
    (project.parent / "secret.conf").write_bytes(text)
    assert "hunter2" not in repr(refused(load_spec, project / "spec.yaml", ["include=../secret.conf"]))


def test_a_pipe_is_not_waited_for(project):
    os.mkfifo(project / "pipe")
    assert code_of(read_template, project / "spec.yaml", ["include=pipe"]) == "bad-include"
    draft = read_template(project / "spec.yaml", ["experiment.prior.information=pipe"])
    assert draft.files(draft.data) == []


@pytest.mark.parametrize("written", ["r.csv", '"r.csv"', "sub/r.csv", "'a b.csv'"])
def test_a_relocated_spec_names_existing_files_from_its_new_folder(written, tmp_path):
    name, there = written.strip("\"'"), tmp_path / "runs" / "one"
    (tmp_path / "specs" / name).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / "specs" / name).touch()
    there.mkdir(parents=True)
    text = f"title: r.csv\naccuracy: {{model_error: {{table: {written}}}}}  # r.csv\n"
    moved = relocated(text, tmp_path / "specs", there)
    inner = written.replace(name, f"../../specs/{name}")
    assert moved == text.replace(f"table: {written}", f"table: {inner}")
    assert relocated(moved, there, tmp_path / "specs") == text


def test_a_relocated_spec_keeps_absolute_names_and_names_of_missing_files(tmp_path):
    (tmp_path / "r.csv").touch()
    for name in ("gone.csv", str(tmp_path / "r.csv")):
        text = f"accuracy: {{model_error: {{table: {name}}}}}\n"
        assert relocated(text, tmp_path, tmp_path / "runs") == text


@pytest.mark.parametrize(("key", "text"), NAMING.items())
def test_every_key_names_the_same_file_from_a_run_and_from_a_point_of_a_sweep(key, text, tmp_path):
    table = tmp_path / "in" / "r.csv"
    table.parent.mkdir()
    table.touch()
    spec = table.parent / "spec.yaml"
    spec.write_text(MODEL)
    plan = build_plan(spec, [f"{key}={text % 'r.csv'}", "experiment.samples=5,6"])
    run, point = tmp_path / "runs" / "one", Layout(tmp_path / "sweep").run(plan.key(0))
    moved = read(relocated(to_yaml(plan.base), table.parent, run), "spec.yaml").data
    (of_run,), (of_point,) = (
        {name for _, name in named_files(moved)},
        plan.names(0, tmp_path / "sweep").values(),
    )
    for folder, name in ((run, of_run), (point, of_point)):
        folder.mkdir(parents=True)
        assert (folder / name).samefile(table)


def test_a_key_that_is_swept_may_not_have_another_value():
    settings = ["experiment.samples=100,200", "experiment.samples=300"]
    assert code_of(parse_settings, settings, kind=SpecError) == "sweep-twice"
