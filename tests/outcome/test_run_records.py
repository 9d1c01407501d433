"""Records of runs that somebody else wrote or broke, writers that meet, and pages that stay behind."""

import json
import pathlib

import pytest

from inputdesign_cli.errors import DataError, OutputError
from inputdesign_cli.outcome import replacing
from inputdesign_cli.outcome.run_directory import read_run, write_run
from tests.support.run_directories import a_run, marks, names


@pytest.mark.parametrize("name", ["../precious.txt", "{}/precious.txt", "..", ".", "", "a/b", "x\0y", 7])
def test_a_record_that_names_files_elsewhere_moves_none(tmp_path, name):
    precious = tmp_path / "precious.txt"
    precious.write_text("mine")
    target = tmp_path / "a"
    target.mkdir()
    listed = name.format(tmp_path) if isinstance(name, str) else name
    record = {"format": 1, "files": [listed]}
    (target / "result.json").write_text(json.dumps(record))
    # As if a writer had been killed in the middle, too.
    for part in ("new", "old"):
        (target / ".run.partial" / part).mkdir(parents=True)
        (target / ".run.partial" / part / "result.json").write_text(json.dumps(record))
    with pytest.raises((OutputError, DataError)) as caught:
        write_run(a_run("first"), target)
    assert caught.value.diagnostics[0].code == "output-not-a-run"
    with pytest.raises(DataError):
        read_run(target)
    assert precious.read_text() == "mine"


def test_links_in_a_run_directory_lead_nowhere(tmp_path):
    (tmp_path / "elsewhere" / "new").mkdir(parents=True)
    (tmp_path / "elsewhere" / "new" / "result.json").write_text("mine")
    (tmp_path / "a").mkdir()
    for name in (".run.partial", "signal.csv"):
        (tmp_path / "a" / name).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(OutputError):
        write_run(a_run("first"), tmp_path / "a")
    assert (tmp_path / "elsewhere" / "new" / "result.json").read_text() == "mine"


def test_two_writers_take_turns(tmp_path, monkeypatch):
    monkeypatch.setattr(replacing, "_PATIENCE", 0.05)
    with replacing.workplace(tmp_path / "a"), pytest.raises(OutputError) as caught:
        write_run(a_run("first"), tmp_path / "a")
    assert caught.value.diagnostics[0].code == "output-busy"
    write_run(a_run("first"), tmp_path / "a")


def test_a_page_about_the_run_before_does_not_stay(tmp_path):
    write_run(a_run("first"), tmp_path / "a")
    page = '<html><head><meta name="generator" content="idesign 0.1.0"></head></html>'
    (tmp_path / "a" / "report.html").write_text(page)
    write_run(a_run("second"), tmp_path / "a")
    assert "report.html" not in names(tmp_path / "a")
    (tmp_path / "a" / "report.html").write_text("<html>mine</html>")
    write_run(a_run("first"), tmp_path / "a")
    assert (tmp_path / "a" / "report.html").read_text() == "<html>mine</html>"


def test_a_run_into_the_current_folder_leaves_it_the_current_one(tmp_path, monkeypatch):
    write_run(a_run("first"), tmp_path / "a")
    monkeypatch.chdir(tmp_path / "a")
    write_run(a_run("second"), pathlib.Path())
    assert pathlib.Path.cwd() == tmp_path / "a"
    assert marks(pathlib.Path()) == {"second"}
