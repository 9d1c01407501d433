"""Replace one run by another: whole whenever the writer is killed, and repaired by the next call.

Everything happens in a folder of work inside the directory of the run, under a lock that ends with its
process. The folder holds `new`, the files of the new run, and `old`, the files of the run that leaves, while
files are moved. The directory may be a mounted volume: a file moves in one step only within one.
"""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from inputdesign_cli.errors import OutputError
from inputdesign_cli.outcome.record import RESULT, listed_files

_WORK, _LOCK = ".run.partial", ".run.lock"
_PATIENCE = 10.0  # seconds that another writer is waited for
_POLL = 0.02  # seconds between two tries


@contextmanager
def workplace(target: Path) -> Iterator[Path]:
    """Make a folder of work in `target`, held for this process alone, with an empty `new` in it.

    What a killed process left is put right first; whatever happens, nothing of the work remains.

    Raises:
        OutputError: `output-busy`, another process writes into `target`.
        OSError: the folder cannot be made.
    """
    made = not target.exists()
    target.mkdir(parents=True, exist_ok=True)
    try:
        with _alone(target) as work:
            work.mkdir()
            (work / "new").mkdir()
            yield work
    finally:
        if made:
            with suppress(OSError):  # it is not empty
                target.rmdir()


def heal(target: Path) -> None:
    """Repair `target` after a killed process: it has the run before, or the next one.

    Raises:
        OutputError: `output-busy`.
        OSError: a file cannot be moved.
    """
    if os.path.lexists(target / _LOCK):
        with _alone(target):
            pass


def put_in_place(names: list[str], owned: Collection[str], work: Path, target: Path) -> None:
    """Replace the files `owned` of `target` by `names` of the new run in `work`, the result last.

    If anything fails, the end of the `workplace` or the next call undoes it.
    """
    (work / "old").mkdir()
    _move([RESULT, *(name for name in owned if name != RESULT)], target, work / "old")
    sync(target)
    _move(names, work / "new", target)
    sync(target)


def sync(path: Path) -> None:
    """Wait until a file, or the entries of a directory where the system allows that, are on the disc."""
    folder = path.is_dir()
    if folder and not hasattr(os, "O_DIRECTORY"):
        return
    handle = os.open(path, os.O_RDONLY if folder else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


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


@contextmanager
def _alone(target: Path) -> Iterator[Path]:
    """Hold the lock of a directory; the folder of work is removed before and after."""
    work = target / _WORK
    with locked(target / _LOCK, _PATIENCE) as held:
        if not held:
            message = f"another process is writing into {target}"
            raise OutputError.because(
                "output-busy", message, "wait for it, or choose another directory with -o"
            )
        try:
            _clear(work, target)
            yield work
        finally:
            _clear(work, target)
            with suppress(OSError):
                (target / _LOCK).unlink()


def _is_folder(path: Path) -> bool:
    """Return whether a path is a folder and no link: other places are not to be reached."""
    return path.is_dir() and not path.is_symlink()


def _clear(work: Path, target: Path) -> None:
    """Remove the folder of work; files that were being moved go back where they came from."""
    new, old = work / "new", work / "old"
    if not _is_folder(work):
        return
    if _is_folder(new):
        if _is_folder(old) and (new / RESULT).is_file():
            _move([name for name in listed_files(new) if not os.path.lexists(new / name)], target, new)
            _move(sorted(os.listdir(old), key=RESULT.__eq__), old, target)
        # Without it the rest is never taken for what is to be moved back.
        (new / RESULT).unlink(missing_ok=True)
    shutil.rmtree(work, ignore_errors=True)


def _move(names: Iterable[str], source: Path, destination: Path) -> None:
    for name in names:
        if os.path.lexists(source / name):
            (source / name).rename(destination / name)
