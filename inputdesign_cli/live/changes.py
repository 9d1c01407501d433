"""Whether a file or a directory has changed since one looked at it last."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path

_EVERY = 0.05  # seconds between looks
Stamp = tuple[tuple[int, int, int] | None, ...]


def stamp(paths: Sequence[Path]) -> Stamp:
    """What tells the present content of files from any other: times, sizes and numbers of their inodes."""
    return tuple(map(_of, paths))


def wait_for_change(paths: Sequence[Path], before: Stamp) -> Stamp:
    """Return once some file differs from `before`, and has stopped to: the new stamp."""
    while (now := stamp(paths)) == before:
        time.sleep(_EVERY)
    # An editor may write in pieces, or take the file away for a moment.
    while (later := _later(paths)) != now or None in later:
        if None in later and _later(paths) == later:
            break
        now = later
    return later


def _later(paths: Sequence[Path]) -> Stamp:
    time.sleep(_EVERY)
    return stamp(paths)


def _of(path: Path) -> tuple[int, int, int] | None:
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
