"""Read the result of a run directory, and list the files of its run, whoever has written it."""

from __future__ import annotations

import json
import math
import os
import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from inputdesign_cli.errors import DataError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.version import __version__

RESULT, SPEC, SIGNAL, PAGE = "result.json", "spec.yaml", "signal.csv", "report.html"
FIGURES = "figures.json"
# Every run has some of these; what else it wrote its result lists under `files`.
STANDARD_FILES = (
    SPEC,
    *(f"{stem}.{kind}" for stem in ("spectrum", "signal", "bound") for kind in ("csv", "png")),
)
_LIBRARIES = ("numpy", "scipy", "cvxpy", "clarabel")
_LONGEST_NAME = 255  # bytes, of a file system
# How each page that `idesign report` writes begins: one of the user's own is not removed.
PAGE_MARK = b'<meta name="generator" content="idesign '
_DAMAGES = (ArithmeticError, AttributeError, LookupError, OSError, RecursionError, TypeError, ValueError)


def load_result(directory: Path) -> dict[str, Any]:
    """Return the content of `result.json`, of which only `format` and `files` are checked.

    Raises:
        DataError: `run-missing`, `run-unreadable`.
    """
    try:
        result = json.loads(
            read_regular(directory / RESULT).decode("utf-8"), parse_float=_finite, parse_constant=_finite
        )
    except (FileNotFoundError, NotADirectoryError):
        message = f"{directory} holds no finished run: there is no {RESULT} in it"
        hint = "write one with `idesign solve SPEC -o DIR`"
        raise DataError.because("run-missing", message, hint) from None
    except (OSError, ValueError, RecursionError) as error:
        raise unreadable(directory / RESULT, str(error)) from error
    if not isinstance(result, dict) or result.get("format") != 1:
        raise unreadable(directory / RESULT, 'it has no "format": 1')
    files = result.get("files", [])
    if not isinstance(files, list) or not all(map(is_plain, files)):
        raise unreadable(directory / RESULT, '"files" is no list of names of files')
    return result


def listed_files(directory: Path) -> list[str]:
    """Return the names of the files of the run in `directory`, `result.json` first; none without a run."""
    try:
        return list(dict.fromkeys([RESULT, *load_result(directory).get("files", ())]))
    except DataError:
        return []


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


def unreadable(file: Path, why: str) -> DataError:
    """Return the error about a record that cannot be used."""
    message = f"{file} cannot be read as the result of a run: {why}"
    return DataError.because("run-unreadable", message, hint="run the spec again")


@contextmanager
def readable(file: Path) -> Iterator[None]:
    """Turn errors about a record that somebody else wrote or damaged into `run-unreadable`."""
    try:
        yield
    except _DAMAGES as error:
        raise unreadable(file, f"its entries are not what idesign writes ({error})") from error


def _finite(text: str) -> float:
    """Return a number of a result; idesign writes no other than finite ones."""
    if not math.isfinite(value := float(text)):
        raise ValueError(f"{text} is no finite number")
    return value


def is_plain(name: object) -> bool:
    """Return whether a name is of a file in the directory itself, and none elsewhere."""
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
