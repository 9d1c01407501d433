"""Locks that end with their process, on every operating system."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_POLL = 0.02  # seconds between two tries


@contextmanager
def locked(path: Path, patience: float = 0.0) -> Iterator[bool]:
    """Hold the lock file `path`, which is made; False if another holder kept it for `patience` seconds.

    Raises:
        OSError: the file cannot be made.
    """
    from filelock import FileLock, Timeout

    lock = FileLock(path)
    held = True
    try:
        lock.acquire(timeout=patience, poll_interval=_POLL)
    except Timeout:
        held = False
    except OSError as error:
        if error.errno not in (errno.ENOLCK, errno.ENOTSUP):  # a file system without locks
            raise
    try:
        yield held
    finally:
        lock.release()
