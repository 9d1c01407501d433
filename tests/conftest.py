"""Experiments that several tests share; what they import is in `tests/support`."""

import gc
import os
import signal
from pathlib import Path

import pytest

from inputdesign_cli.compute.executor import ONE_THREAD

os.environ.update(ONE_THREAD | os.environ)  # as the command line does, before numpy is imported

from inputdesign_cli import load_spec
from inputdesign_cli.questions.building.system import build_experiment

SPECS = Path(__file__).parent.parent / "specs"
# New objects before the collector of cycles looks at them: by itself it does so every 700.
_NEW_OBJECTS = 50_000

# `nohup` and the background of a shell hand on that these are ignored, and commands under test would obey.
for number, handler in ((signal.SIGINT, signal.default_int_handler), (signal.SIGHUP, signal.SIG_DFL)):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, handler)


def pytest_collection_finish():
    """What was imported and collected stays, so that the collector need not look through it again."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(_NEW_OBJECTS, 10, 10)


@pytest.fixture(autouse=True)
def _time_for_hints(monkeypatch):
    """Hints do not depend on how busy the machine is that runs the tests."""
    monkeypatch.setattr("inputdesign_cli.compute.time_limit.HINT_SECONDS", 600.0)


@pytest.fixture
def flexible():
    """The flexible transmission in its (reconstructed) loop, N = 500."""
    return build_experiment(load_spec(SPECS / "flexible_transmission.yaml"))


@pytest.fixture
def first_order():
    """The first-order Box-Jenkins system, N = 500."""
    return build_experiment(load_spec(SPECS / "first_order.yaml"))
