"""Runs for tests of their pages."""

import pytest

from inputdesign_cli import load_spec, solve
from inputdesign_cli.outcome.run_directory import write_run
from tests.support.pages import LOOP, SPEC


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """An open and a closed loop, solved and written without figures."""
    folder = tmp_path_factory.mktemp("runs")
    for name, loop in (("open", ""), ("closed", LOOP)):
        (folder / f"{name}.yaml").write_text(SPEC % loop)
        write_run(solve(load_spec(folder / f"{name}.yaml")), folder / name)
    return folder
