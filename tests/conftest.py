"""Experiments that several tests share; what they import is in `tests/support`."""

from pathlib import Path

import pytest

from inputdesign_cli.compute.threads import use_one_thread

use_one_thread()  # before anything imports numpy

from inputdesign_cli import load_spec  # noqa: E402
from inputdesign_cli.tasks.build.system import build_experiment  # noqa: E402

SPECS = Path(__file__).parent.parent / "specs"


@pytest.fixture
def flexible():
    """The flexible transmission in its (reconstructed) loop, N = 500."""
    return build_experiment(load_spec(SPECS / "flexible_transmission.yaml"))


@pytest.fixture
def first_order():
    """The first-order Box-Jenkins system, N = 500."""
    return build_experiment(load_spec(SPECS / "first_order.yaml"))
