"""Functions for workers: they must be importable by name in another process."""

import os
import signal
import time
from pathlib import Path


def square(x):
    return x * x


def fail_on_three(x):
    if x == 3:
        raise ValueError("three")
    return x


def die_once(mark):
    """Kill the process at the first call; the mark is a file that remembers it."""
    path = Path(mark)
    if not path.exists():
        path.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return "survived"


def die(_):
    os.kill(os.getpid(), signal.SIGKILL)


def threads(_):
    return os.environ.get("OPENBLAS_NUM_THREADS"), os.getpid()


def slow_identity(x):
    time.sleep(0.3)
    return x, os.getpid()


def drawn(runs, rng):
    return rng.standard_normal(runs)


def complain(runs, rng):
    raise ValueError(f"a batch of {runs}")


def end(runs, rng):
    os._exit(1)
