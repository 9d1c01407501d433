"""Experiments that several tests share; what they import is in `tests/support`."""

import gc
import os
import shutil
import signal
import sys
from collections import Counter
from functools import cache
from pathlib import Path

import pytest
import typer.main
import typer.testing

from inputdesign_cli.compute.executor import ONE_THREAD

os.environ.update(ONE_THREAD | os.environ)  # as the command line does, before numpy is imported
# Workers and the commands that they start read what another has compiled, and do not compile it again.
os.environ["PYTHONDONTWRITEBYTECODE"], sys.dont_write_bytecode = "", False

SPECS = Path(__file__).parent.parent / "specs"
# The number of new objects after which the collector of cycles runs; the default is 700.
gc.set_threshold(50_000, 10, 10)

# The tree of commands is made once, not at every call: it depends on nothing.
typer.main.get_command = typer.testing._get_command = cache(typer.main.get_command)

# `nohup` and background jobs of a shell ignore these signals, and commands under test would inherit that.
for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, handler)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark the parameter sets of a test as slow beyond the number in its mark `first`."""
    seen = Counter()
    for item in items:
        name, mark = item.nodeid.partition("[")[0], item.get_closest_marker("first")
        seen[name] += 1
        if mark is not None and seen[name] > mark.args[0]:
            item.add_marker(pytest.mark.slow)


def pytest_collection_finish():
    """Freeze imported and collected objects, so that the garbage collector need not scan them again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def _time_for_hints(monkeypatch):
    """Hints do not depend on how busy the machine is that runs the tests."""
    monkeypatch.setattr("inputdesign_cli.compute.time_limit.HINT_SECONDS", 600.0)


def built(name):
    """Build an experiment; the import stays here, as a process that only hands out tests needs none."""
    from inputdesign_cli import load_spec
    from inputdesign_cli.questions.building.system import build_experiment

    return build_experiment(load_spec(SPECS / f"{name}.yaml"))


@pytest.fixture
def flexible():
    """The flexible transmission in its (reconstructed) loop, N = 500."""
    return built("flexible_transmission")


@pytest.fixture
def first_order():
    """The first-order Box-Jenkins system, N = 500."""
    return built("first_order")


@pytest.fixture(scope="session")
def campaigns(tmp_path_factory):
    """A folder with a campaign that has `begun`, the same after `r1.csv` in `once`, and `r2.csv`."""
    from tests.support.campaigns import SPEC, applied
    from tests.support.commands import caller

    folder = tmp_path_factory.mktemp("campaigns")
    (folder / "s.yaml").write_text(SPEC)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        run = caller(patch)
        assert run("campaign", "s.yaml", "-o", "begun", "--no-figures", "--quiet")[0] == 0
        shutil.copytree("begun", "once")
        record = applied(folder / "begun", folder / "r1.csv")
        assert run("next", "once", record, "--no-figures", "--quiet")[0] == 0
    applied(folder / "once", folder / "r2.csv")
    return folder
