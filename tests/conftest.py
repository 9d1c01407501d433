"""Experiments that several tests share; what they import is in `tests/support`."""

import os
from pathlib import Path

import pytest

from inputdesign_cli.compute.threads import ONE_THREAD

os.environ.update(ONE_THREAD | os.environ)  # as the command line does, before numpy is imported

from inputdesign_cli import load_spec
from inputdesign_cli.tasks.build.system import build_experiment

SPECS = Path(__file__).parent.parent / "specs"


@pytest.fixture
def flexible():
    """The flexible transmission in its (reconstructed) loop, N = 500."""
    return build_experiment(load_spec(SPECS / "flexible_transmission.yaml"))


@pytest.fixture
def first_order():
    """The first-order Box-Jenkins system, N = 500."""
    return build_experiment(load_spec(SPECS / "first_order.yaml"))
