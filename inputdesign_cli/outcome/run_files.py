"""Replace one run by another: whole whenever the writer is killed, and repaired by the next call.

Everything happens in a folder of work inside the directory of the run, under a lock that ends with its
process. The folder holds `new`, the files of the new run, and `old`, the files of the run that leaves, while
files are moved. The directory may be a mounted volume: a file moves in one step only within one. The
`result.json` of a run lists its files, whoever has written it.
"""

from __future__ import annotations

import errno
import json
import math
import os
import platform
import shutil
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from inputdesign_cli.errors import DataError, Location, OutputError
from inputdesign_cli.outcome.codec import OutcomeError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.version import __version__

RESULT, SPEC, SIGNAL, PAGE = "result.json", "spec.yaml", "signal.csv", "report.html"
FIGURES = "figures.json"
# Every run has some of these; its result lists the others under `files`.
STANDARD_FILES = (
    SPEC,
    *(f"{stem}.{kind}" for stem in ("spectrum", "signal", "bound") for kind in ("csv", "png")),
)
_LIBRARIES = ("numpy", "scipy", "cvxpy", "clarabel")
_LONGEST_NAME = 255  # bytes of a file name
# Mark of the pages that `idesign report` writes: a page of the user's own is not removed.
PAGE_MARK = b'<meta name="generator" content="idesign '
_DAMAGES = (ArithmeticError, AttributeError, LookupError, OSError, RecursionError, TypeError, ValueError)
_WORK, _LOCK = ".run.partial", ".run.lock"
_PATIENCE = 10.0  # seconds to wait for another writer
_POLL = 0.02  # seconds between two tries


def load_result(directory: Path) -> dict[str, Any]:
    """Return the content of `result.json`, of which only `format` and `files` are checked.

    Raises:
        DataError: `run-missing`, `run-unreadable`.
    """
    with readable(directory / RESULT):
        try:
            text = read_regular(directory / RESULT).decode("utf-8")
        except (FileNotFoundError, NotADirectoryError):
            message = f"{directory} holds no finished run: there is no {RESULT} in it"
            hint = "write one into a new directory: `idesign solve SPEC -o DIR`"
            raise DataError.because("run-missing", message, hint) from None
        result = json.loads(text, parse_float=_finite, parse_constant=_finite)
    if not isinstance(result, dict) or result.get("format") != 1:
        raise unreadable(directory / RESULT, 'it has no "format": 1')
    files = result.get("files", [])
    if not isinstance(files, list) or not all(map(is_plain, files)):
        raise unreadable(directory / RESULT, '"files" is no list of names of files')
    return result


def known_result(directory: Path) -> dict[str, Any]:
    """Return the content of `result.json`; empty where there is none that can be read."""
    try:
        return load_result(directory) if os.path.lexists(directory / RESULT) else {}
    except DataError:
        return {}


def listed_files(directory: Path) -> list[str]:
    """Return the names of the files of the run in `directory`, `result.json` first; none without a run."""
    result = known_result(directory)
    return list(dict.fromkeys([RESULT, *result.get("files", ())])) if result else []


def owned_files(directory: Path) -> list[str]:
    """Return the names of files in `directory` that go when its run is replaced: its own and its page."""
    listed = listed_files(directory)
    if not listed:
        return []
    page = [PAGE] if is_page(directory / PAGE) else []
    names = dict.fromkeys([*listed, *STANDARD_FILES, *page])
    return [name for name in names if (directory / name).is_file()]


def is_page(path: Path) -> bool:
    """Return whether a file is a page that `idesign report` wrote."""
    try:
        return PAGE_MARK in read_regular(path, 1000)
    except OSError:
        return False


def unreadable(file: Path, why: str, of: str = "a run", line: int | None = None) -> DataError:
    """Return the error about a file of a run, or of `a sweep`, that cannot be used."""
    hint = "run the spec again with -o and a new directory"
    hint = hint if of == "a run" else "give the command of the sweep again"
    message = f"{file} cannot be read as part of {of}: {why}"
    place = None if line is None else Location(str(file), line, 1)
    return DataError.because("run-unreadable", message, hint, location=place)


@contextmanager
def readable(file: Path, of: str = "a run") -> Iterator[None]:
    """Turn errors about a file that somebody wrote, damaged or removed into `run-unreadable`."""
    try:
        yield
    except OutcomeError as error:
        raise unreadable(file, str(error), of) from error
    except json.JSONDecodeError as error:
        raise unreadable(file, "it is damaged or cut off", of, error.lineno) from error
    except OSError as error:
        raise unreadable(file, error.strerror or "it cannot be opened", of) from error
    except _DAMAGES as error:
        raise unreadable(file, "its entries are not what idesign writes", of) from error


def _finite(text: str) -> float:
    """Return a finite number of a result; idesign writes no others."""
    if not math.isfinite(value := float(text)):
        raise OutcomeError(f"{text} is no finite number")
    return value


def is_plain(name: object) -> bool:
    """Return whether a name is that of a file in the directory itself, not elsewhere."""
    if not isinstance(name, str) or name in ("", os.curdir, os.pardir) or set(name) & {"/", "\0"}:
        return False
    try:
        return len(os.fsencode(name)) <= _LONGEST_NAME
    except UnicodeEncodeError:
        return False


@cache
def environment() -> Mapping[str, str]:
    """Return versions of Python, of this package and of the numerical libraries, and the platform."""
    return {
        "python": platform.python_version(),
        "platform": platform.platform(),
        "idesign": __version__,
        **{name: metadata.version(name) for name in _LIBRARIES},
    }


@contextmanager
def workplace(target: Path) -> Iterator[Path]:
    """Make a folder of work in `target`, held for this process alone, with an empty `new` in it.

    Remains of a killed process are repaired first. The folder is removed in any case.

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
    """Repair `target` after a killed process: it then holds the earlier run or the new one, whole.

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
    """Return whether a path is a folder and no link, which could lead elsewhere."""
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
        # Removed first: if the rest stays, a later call must not move files back.
        (new / RESULT).unlink(missing_ok=True)
    shutil.rmtree(work, ignore_errors=True)


def _move(names: Iterable[str], source: Path, destination: Path) -> None:
    for name in names:
        if os.path.lexists(source / name):
            (source / name).rename(destination / name)
