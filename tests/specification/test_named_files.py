"""Which texts of a spec name files, and that a spec is kept to a folder if that is asked for."""

import os

import pytest

from inputdesign_cli import load_spec
from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification.named_files import named_files
from inputdesign_cli.specification.template import read_template

MODEL = "plant: {B: [0, 1], F: [1, -0.5]}\nnoise: {variance: 2}\naccuracy: {standard_deviation: {b1: 0.1}}\n"
TABLE = "frequency,r_adm\n0,1\n3.2,1\n"
NAMING = {
    "accuracy.model_error": "{table: %s}",
    "limits.spectrum": "{table: %s}",
    "spectrum": "{given: {type: table, file: %s}}",
    "spectrum.given": "{signal: %s}",
    "experiment.prior.information": "%s",
}


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


@pytest.mark.parametrize(("key", "text"), NAMING.items())
def test_texts_at_keys_of_files_are_files_and_no_others(project, key, text):
    draft = read_template(project / "spec.yaml", [f"{key}={text % 'r.csv'}", "report={ellipses: [r.csv]}"])
    (found,) = named_files(draft.data)
    assert found[1] == "r.csv"
    assert draft.files(draft.data) == ["r.csv"]


@pytest.mark.parametrize("title", ["x" * 5000, "r.csv", "a\\0b", "/", ".", "\N{GRINNING FACE}" * 200])
def test_a_title_is_no_file(project, title):
    (project / "spec.yaml").write_text(f'title: "{title}"\n' + MODEL.replace("2", "1"))
    try:
        draft = read_template(project / "spec.yaml")
    except SpecError:  # of the NUL
        return
    assert draft.files(draft.data) == []
    assert draft.digest(draft.data)


@pytest.mark.parametrize(
    "name", ["../r.csv", "{}/r.csv", "link.csv", "sub/../../r.csv", "/etc/passwd", "/dev/zero"]
)
@pytest.mark.parametrize("key", NAMING)
def test_a_spec_is_kept_to_a_folder(project, key, name):
    setting = f"{key}={NAMING[key] % name.format(project.parent)}"
    for read in (load_spec, read_template):
        with pytest.raises(SpecError) as caught:
            read(project / "spec.yaml", [setting], confine=project)
        found = {diagnostic.code: diagnostic for diagnostic in caught.value.diagnostics}
        assert found["file-outside"].key.startswith(key)
    draft = read_template(project / "spec.yaml", confine=project)
    assert draft.files(draft.variant([setting])) == []
    draft = read_template(project / "spec.yaml", [f"{key}={NAMING[key] % 'r.csv'}"], confine=project)
    assert draft.files(draft.data) == ["r.csv"]


@pytest.mark.parametrize("name", ["../more.yaml", "link.yaml", "/etc/passwd"])
def test_what_is_included_is_kept_there_too(project, name):
    with pytest.raises(SpecError) as caught:
        load_spec(project / "spec.yaml", [f"include={name}"], confine=project)
    assert caught.value.diagnostics[0].code == "file-outside"
    assert load_spec(project / "spec.yaml", ["include=more.yaml"], confine=project).experiment.samples == 7


@pytest.mark.parametrize(
    "text",
    [
        "root:x:0:0:root:/root:/bin/sh\n",
        "token: hunter2\n",
        "a: [hunter2\n",
        "- hunter2\n",
        '"hunter2": {a: 1, a: 2}\n',
        "hunter2: !secret x\n",
        "<<: hunter2\n",
        "x: &a hunter2\ny: *b\n",
    ],
)
def test_nothing_is_shown_of_an_included_file_that_holds_no_blocks(project, text):
    secret = project.parent / "secret.conf"
    secret.write_text(text)
    with pytest.raises(SpecError) as caught:
        load_spec(project / "spec.yaml", ["include=../secret.conf"])
    told = repr(caught.value.diagnostics)
    assert "hunter2" not in told
    assert "bin/sh" not in told


def test_bytes_of_an_included_file_are_not_shown(project):
    (project.parent / "secret.conf").write_bytes(b"plant: hunter2 \xff\n")
    with pytest.raises(SpecError) as caught:
        load_spec(project / "spec.yaml", ["include=../secret.conf"])
    assert "hunter2" not in repr(caught.value.diagnostics)


def test_a_pipe_is_not_waited_for(project):
    os.mkfifo(project / "pipe")
    with pytest.raises(SpecError, match="pipe"):
        read_template(project / "spec.yaml", ["include=pipe"])
    draft = read_template(project / "spec.yaml", ["experiment.prior.information=pipe"])
    assert draft.files(draft.data) == []
