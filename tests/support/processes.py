"""Processes that tests start: whatever a test finds, they end, and their pipes are closed."""

import subprocess
from contextlib import contextmanager


@contextmanager
def running(command, **options):
    """A process (as of `subprocess.Popen`) while the block runs; killed, if it still goes on."""
    with subprocess.Popen(command, **options) as process:
        try:
            yield process
        finally:
            process.kill()
