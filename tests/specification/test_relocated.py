"""The spec of a run names the files of the spec that it was made from, from another folder."""

import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification import relocated
from inputdesign_cli.sweeps.plan import parse_settings
from tests.support.refusals import code_of


@pytest.mark.parametrize("written", ["r.csv", '"r.csv"', "sub/r.csv", "'a b.csv'"])
def test_files_that_exist_are_named_from_the_new_folder(written, tmp_path):
    name = written.strip("\"'")
    (tmp_path / "specs" / name).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / "specs" / name).touch()
    text = f"title: r.csv\naccuracy: {{model_error: {{table: {written}}}}}  # r.csv\n"
    (tmp_path / "runs" / "one").mkdir(parents=True)
    moved = relocated(text, tmp_path / "specs", tmp_path / "runs" / "one")
    assert moved == text.replace(
        f"table: {written}", f"table: {written.replace(name, f'../../specs/{name}')}"
    )
    assert relocated(moved, tmp_path / "runs" / "one", tmp_path / "specs") == text


def test_names_of_no_file_and_absolute_ones_stay(tmp_path):
    (tmp_path / "r.csv").touch()
    for name in ("gone.csv", str(tmp_path / "r.csv")):
        text = f"accuracy: {{model_error: {{table: {name}}}}}\n"
        assert relocated(text, tmp_path, tmp_path / "runs") == text


def test_a_key_that_is_swept_has_no_other_value():
    settings = ["experiment.samples=100,200", "experiment.samples=300"]
    assert code_of(parse_settings, settings, kind=SpecError) == "sweep-twice"
