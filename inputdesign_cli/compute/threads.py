"""One thread for the linear algebra: matrices are small, and results must not depend on the machine."""

from __future__ import annotations

import os

# Read by the libraries when numpy is first imported.
ONE_THREAD = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"), "1"
)


def use_one_thread() -> None:
    """Ask for one thread, unless the environment asks for something else."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
