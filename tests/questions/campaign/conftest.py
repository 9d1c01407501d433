"""Fixtures: a folder with a spec, and campaigns that have begun in it."""

import shutil

import pytest

from tests.support.campaigns import SPEC
from tests.support.commands import caller


@pytest.fixture
def run(monkeypatch, capsys, tmp_path):
    """Runs `idesign` in a folder that holds only the spec; returns exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.yaml").write_text(SPEC)
    return caller(monkeypatch, capsys)


@pytest.fixture
def begun(run, campaigns, tmp_path):
    """The directory of a campaign with one plan and no record."""
    return shutil.copytree(campaigns / "begun", tmp_path / "c")


@pytest.fixture
def once(run, campaigns, tmp_path):
    """The directory of a campaign with one record."""
    return shutil.copytree(campaigns / "once", tmp_path / "c")
