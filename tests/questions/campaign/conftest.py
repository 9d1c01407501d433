"""A folder with a spec, and a campaign that has begun in it."""

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
def begun(run, tmp_path):
    """A campaign with its first plan."""
    assert run("campaign", "s.yaml", "-o", "c", "--no-figures")[0] == 0
    return tmp_path / "c"
