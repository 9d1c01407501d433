"""Replace one run by another: whole whenever the writer is killed, and put right by the next call.

Everything happens in a folder of work: inside the directory of the run, or next to it if the directory is yet
to be made. It holds `new`, the files of the new run; `old`, the files of the run that leaves, while files are
moved; and a lock, which ends with its process.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Collection, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from inputdesign_cli.errors import OutputError
from inputdesign_cli.outcome.locks import locked
from inputdesign_cli.outcome.record import RESULT, listed_files

_PATIENCE = 10.0  # seconds that another writer is waited for


@contextmanager
def workplace(target: Path) -> Iterator[Path]:
    """A folder of work for `target`, held for this process alone, with an empty `new` in it.

    What a killed process left is put right first; whatever happens, nothing of the work remains.

    Raises:
        OutputError: `output-busy`, another process writes into `target`.
        OSError: the folder cannot be made.
    """
    with ExitStack() as held:
        work = _begun(target, held)
        try:
            (work / "new").mkdir()
            yield work
        finally:
            for place in _places(target):
                _clear(place, target)


def _begun(target: Path, held: ExitStack) -> Path:
    """A new folder of work whose lock is held; others may be after it at the same time."""
    inside, beside = _places(target)
    due = time.monotonic() + _PATIENCE
    while True:
        heal(target)
        # Inside a directory that exists: it may be a file system of its own (a mounted volume), and a file
        # can be moved in one step only within one.
        work = inside if target.exists() else beside
        try:
            work.mkdir()
            held.enter_context(_locked(work))
            return work
        except (FileExistsError, FileNotFoundError):
            # Neither a link nor a file of that name goes away by waiting.
            if time.monotonic() > due or (os.path.lexists(work) and not _is_folder(work)):
                raise


def heal(target: Path) -> None:
    """Put right what a killed process left in or beside `target`: it has the run before, or the next one.

    Raises:
        OutputError: `output-busy`.
        OSError: a file cannot be moved.
    """
    for work in _places(target):
        # Whoever else sees to it may be faster.
        with suppress(FileNotFoundError), ExitStack() as held:
            if _is_folder(work):
                held.enter_context(_locked(work))
                _clear(work, target)


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


def _places(target: Path) -> tuple[Path, Path]:
    return target / ".run.partial", target.parent / f".{target.name}.partial"


def _is_folder(path: Path) -> bool:
    """Not through a link: what is done here is not to reach other places."""
    return path.is_dir() and not path.is_symlink()


def _clear(work: Path, target: Path) -> None:
    """Remove a folder of work; files that were being moved go back where they came from."""
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


@contextmanager
def _locked(work: Path) -> Iterator[None]:
    """Hold the lock of a folder of work.

    Raises:
        FileNotFoundError: its owner has removed it in the meantime.
        OutputError: `output-busy`.
    """
    try:
        with locked(work / "lock", _PATIENCE) as held:
            if not held:
                message = f"another process is writing into {work.parent}"
                hint = "wait for it, or choose another directory with -o"
                raise OutputError.because("output-busy", message, hint)
            yield
    finally:  # Windows keeps a folder that has an open file in it
        with suppress(OSError):
            work.rmdir()
