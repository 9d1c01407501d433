"""A folder with a spec, and a campaign that has begun in it."""

import shutil
from types import SimpleNamespace

import pytest

from tests.support.campaigns import SPEC, applied
from tests.support.commands import caller


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run `idesign` in an empty folder with the spec in it: its exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.yaml").write_text(SPEC)
    return caller(monkeypatch, capsys)


@pytest.fixture(scope="session")
def campaigns(tmp_path_factory):
    """Two campaigns: with a first plan, and with one record and the plan after it."""
    folder = tmp_path_factory.mktemp("campaigns")
    (folder / "s.yaml").write_text(SPEC)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        run = caller(patch, SimpleNamespace(readouterr=lambda: ("", "")))
        assert run("campaign", "s.yaml", "-o", "begun", "--no-figures", "--quiet")[0] == 0
        shutil.copytree("begun", "taken")
        record = applied(folder / "taken", folder / "r1.csv")
        assert run("next", "taken", record, "--no-figures", "--quiet")[0] == 0
    return folder


@pytest.fixture
def begun(run, tmp_path, campaigns):
    """A campaign with its first plan."""
    return shutil.copytree(campaigns / "begun", tmp_path / "c")


@pytest.fixture
def taken(run, tmp_path, campaigns):
    """A campaign with one record."""
    return shutil.copytree(campaigns / "taken", tmp_path / "c")
