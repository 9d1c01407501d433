"""A folder with a spec, and a campaign that has begun in it."""

import shutil

import pytest

from tests.support.campaigns import SPEC
from tests.support.commands import caller


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Run `idesign` in an empty folder with the spec in it: its exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.yaml").write_text(SPEC)
    return caller(monkeypatch, capsys)


@pytest.fixture
def begun(run, campaigns, tmp_path):
    """A campaign with its first plan."""
    return shutil.copytree(campaigns / "begun", tmp_path / "c")


@pytest.fixture
def once(run, campaigns, tmp_path):
    """A campaign with its first record."""
    return shutil.copytree(campaigns / "once", tmp_path / "c")
