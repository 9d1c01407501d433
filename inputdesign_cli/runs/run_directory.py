"""The run directory: written whole or not at all, and `result.json` last.

Where `result.json` stands, the run is complete and every other file belongs to it. A reader may rely on
that whatever happens to the writer: a full disc, an interrupt, a power cut.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType

from inputdesign_cli.errors import DataError, Diagnostic, OutputError
from inputdesign_cli.runs.provenance import environment
from inputdesign_cli.runs.results import Json, Results
from inputdesign_cli.runs.text_formats import csv_text, json_text, plain

RESULT = "result.json"
SPEC = "spec.yaml"
# Every run has some of these; what else it wrote its result lists under `files`.
STANDARD_FILES = (
    SPEC,
    *(f"{stem}.{kind}" for stem in ("spectrum", "signal", "bound") for kind in ("csv", "png")),
)
# Stands in the destination only while one run replaces another; it lists what belongs to either.
JOURNAL = ".replacing-run.json"


def finished_result(results: Results) -> dict[str, Json]:
    """The content of `result.json` in JSON's own types, with `environment` and `spec_sha256` filled in.

    `spec_sha256` is the digest of `spec.yaml` as it is written.

    Raises:
        ValueError, TypeError: The result holds a NaN, an infinity or a type that JSON lacks: a mistake of the
            program.
    """
    result: dict[str, Json] = plain(results.result)
    if not result.get("environment"):
        result["environment"] = environment()
    if not result.get("spec_sha256"):
        result["spec_sha256"] = hashlib.sha256(results.resolved_spec.encode()).hexdigest()
    return result


def write_run(
    results: Results, directory: Path, figures: Mapping[str, bytes] = MappingProxyType({})
) -> list[Path]:
    """Write a run directory and return the paths of its files, `result.json` last.

    An earlier run in `directory` is replaced, including those of its files that the new run no longer
    has; files that are not of a run are left alone. Whatever fails, `directory` holds afterwards what it
    held before.

    Args:
        results: what a verb of the package returned.
        directory: where to write it.
        figures: file name ("bound.png") -> content, as `figures.plots.draw_all` draws them.

    Raises:
        OutputError: `output-not-a-directory`, `output-not-writable`, `output-full`, `output-not-a-run` (a
            file of the user's would be overwritten).
    """
    result = finished_result(results)
    target = Path(os.path.realpath(directory))
    with output_errors(directory):
        if target.exists() and not target.is_dir():
            message = f"{directory} is a file, and a run is written into a directory"
            hint = "choose another directory with -o"
            raise OutputError(Diagnostic("output-not-a-directory", message, hint))
        target.parent.mkdir(parents=True, exist_ok=True)
        # Beside a new run, but inside a directory that exists: it may be the root of a file system
        # (a mounted volume), and a file can be moved in one step only within its file system.
        partial = (target if target.exists() else target.parent) / f".{target.name}.partial-{os.getpid()}"
        try:
            shutil.rmtree(partial, ignore_errors=True)
            partial.mkdir()
            names = _write_files(results, result, partial, figures)
            if target.exists():
                _replace(names, partial, target, shown=directory)
            else:
                partial.rename(target)
                _sync(target.parent)
        finally:
            shutil.rmtree(partial, ignore_errors=True)
    return [directory / name for name in names]


def write_text(path: Path, text: str) -> None:
    """Write a single text file, UTF-8.

    Raises:
        OutputError: `output-not-writable`, `output-full`.
    """
    with output_errors(path):
        _write(path, text)


def replace_text(path: Path, text: str | Iterable[str]) -> None:
    """Write a text file, or one that comes in pieces, so that it is whole whenever the writer is killed.

    A reader finds the old one or the new one.

    Raises:
        OutputError: `output-not-writable`, `output-full`.
    """
    partial = path.with_name(f".{path.name}.partial-{os.getpid()}")
    with output_errors(path):
        try:
            with partial.open("w", encoding="utf-8", newline="\n") as file:
                file.writelines([text] if isinstance(text, str) else text)
                file.flush()
                os.fsync(file.fileno())
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


def read_run(directory: Path) -> dict[str, Json]:
    """The content of `result.json` of a whole run.

    Raises:
        DataError: `run-missing` (no such directory, or no run in it), `run-incomplete` (one of its files is
            gone), `run-unreadable` (`result.json` is not what `write_run` writes).
    """
    result = _load_result(directory)
    missing = [name for name in result.get("files", ()) if not (directory / name).is_file()]
    if missing:
        message = f"{directory} lacks {', '.join(missing)}, which its {RESULT} lists"
        raise DataError(Diagnostic("run-incomplete", message, hint="run the spec again"))
    return result


def _load_result(directory: Path) -> dict[str, Json]:
    try:
        result = json.loads((directory / RESULT).read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        message = f"{directory} holds no finished run: there is no {RESULT} in it"
        hint = "write one with `idesign solve SPEC -o DIR`"
        raise DataError(Diagnostic("run-missing", message, hint)) from None
    except (OSError, UnicodeDecodeError, json.JSONDecodeError) as error:
        raise _unreadable(directory, str(error)) from error
    if not isinstance(result, dict) or result.get("format") != 1:
        raise _unreadable(directory, 'it has no "format": 1')
    return result


def _unreadable(directory: Path, why: str) -> DataError:
    message = f"{directory / RESULT} cannot be read as the result of a run: {why}"
    return DataError(Diagnostic("run-unreadable", message, hint="run the spec again"))


def _write_files(
    results: Results, result: dict[str, Json], folder: Path, figures: Mapping[str, bytes]
) -> list[str]:
    """All files of the run into `folder`, on the disc when this returns; their names, the result last."""
    texts = {SPEC: results.resolved_spec}
    texts |= {f"{stem}.csv": csv_text(table) for stem, table in results.tables.items()}
    for name, text in texts.items():
        _write(folder / name, text)
    contents = {**results.files, **figures}
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    names = [*texts, *contents]
    _write(folder / RESULT, json_text({**result, "files": names}))
    names.append(RESULT)
    for name in names:
        _sync(folder / name)
    _sync(folder)
    return names


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")


def _replace(names: list[str], partial: Path, target: Path, *, shown: Path) -> None:
    """Exchange the files of the run in `target` by those in `partial`; undone if anything fails.

    The old result is the first file to leave and the new one the last to arrive.
    """
    owned = _owned(target)
    foreign = [name for name in names if name not in owned and (target / name).exists()]
    if foreign:
        message = f"{shown} already has {', '.join(foreign)}, written by something other than an earlier run"
        hint = "choose another directory with -o, or move these files away"
        raise OutputError(Diagnostic("output-not-a-run", message, hint))
    previous = partial / "previous"
    previous.mkdir()
    leaving = [RESULT, *(name for name in owned if name != RESULT)]
    journal = target / JOURNAL
    try:
        _write(partial / JOURNAL, json.dumps(sorted({*owned, *names})))
        (partial / JOURNAL).replace(journal)
        _move(leaving, target, previous)
        _sync(target)
        _move(names, partial, target)
        _sync(target)
    except BaseException:
        arrived = [name for name in names if not (partial / name).exists()]
        _move(reversed(arrived), target, partial)
        _move(reversed(leaving), previous, target)
        raise
    finally:
        journal.unlink(missing_ok=True)


def _owned(target: Path) -> list[str]:
    """Names in `target` that belong to an earlier run, finished or broken off while it was put in place."""
    journal = target / JOURNAL
    if journal.is_file():
        listed = json.loads(journal.read_text(encoding="utf-8"))
    else:
        try:
            listed = [RESULT, *STANDARD_FILES, *_load_result(target).get("files", ())]
        except DataError:
            listed = []
    return [name for name in dict.fromkeys(listed) if (target / name).is_file()]


def _move(names: Iterable[str], source: Path, destination: Path) -> None:
    for name in names:
        if (source / name).exists():
            (source / name).rename(destination / name)


def _sync(path: Path) -> None:
    """Wait until a file, or the entries of a directory, are on the disc."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextmanager
def output_errors(target: Path) -> Iterator[None]:
    """Turn what the operating system refuses into an `OutputError`."""
    try:
        yield
    except OSError as error:
        code, message = "output-not-writable", f"{target} cannot be written: {error.strerror or error}"
        hint = "choose another place, or change the permissions"
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            code, message = "output-full", f"there is no space left for {target}"
            hint = "free some space, or choose a place on another disc"
        raise OutputError(Diagnostic(code, message, hint)) from error
