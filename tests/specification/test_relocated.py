"""The spec of a run names the files of the spec that it was made from, from another folder."""

import pytest

from inputdesign_cli.errors import SpecError
from inputdesign_cli.specification import relocated
from inputdesign_cli.specification.schema import named_files
from inputdesign_cli.specification.yaml.plain import to_yaml
from inputdesign_cli.specification.yaml.reader import read
from inputdesign_cli.sweeps.plan import build_plan, parse_settings
from inputdesign_cli.sweeps.points import Layout
from tests.specification.test_named_files import MODEL, NAMING
from tests.support.refusals import code_of


@pytest.mark.parametrize("written", ["r.csv", '"r.csv"', "sub/r.csv", "'a b.csv'"])
def test_files_that_exist_are_named_from_the_new_folder(written, tmp_path):
    name, there = written.strip("\"'"), tmp_path / "runs" / "one"
    (tmp_path / "specs" / name).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / "specs" / name).touch()
    there.mkdir(parents=True)
    text = f"title: r.csv\naccuracy: {{model_error: {{table: {written}}}}}  # r.csv\n"
    moved = relocated(text, tmp_path / "specs", there)
    inner = written.replace(name, f"../../specs/{name}")
    assert moved == text.replace(f"table: {written}", f"table: {inner}")
    assert relocated(moved, there, tmp_path / "specs") == text


def test_names_of_no_file_and_absolute_ones_stay(tmp_path):
    (tmp_path / "r.csv").touch()
    for name in ("gone.csv", str(tmp_path / "r.csv")):
        text = f"accuracy: {{model_error: {{table: {name}}}}}\n"
        assert relocated(text, tmp_path, tmp_path / "runs") == text


@pytest.mark.parametrize(("key", "text"), NAMING.items())
def test_every_key_that_names_a_file_names_the_same_one_from_a_run_and_from_a_point(key, text, tmp_path):
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


def test_a_key_that_is_swept_has_no_other_value():
    settings = ["experiment.samples=100,200", "experiment.samples=300"]
    assert code_of(parse_settings, settings, kind=SpecError) == "sweep-twice"
