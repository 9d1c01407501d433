"""The run directory: written whole or not at all, and `result.json` last.

Where `result.json` stands, the run is complete and every other file belongs to it. A reader may rely on
that whatever happens to the writer: a full disc, an interrupt, a power cut.
"""

from __future__ import annotations

import errno
import filecmp
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

from inputdesign_cli.errors import DataError, OutputError
from inputdesign_cli.outcome import Outcome, OutcomeError, read_plain
from inputdesign_cli.outcome.codec import json_text
from inputdesign_cli.outcome.curves_file import curves_json
from inputdesign_cli.outcome.origin import Origin, check_directory, check_origin, digest, encoded, not_a_run
from inputdesign_cli.outcome.record import (
    FIGURES,
    RESULT,
    SIGNAL,
    SPEC,
    environment,
    load_result,
    owned_files,
    unreadable,
)
from inputdesign_cli.outcome.replacing import heal, put_in_place, sync, workplace
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.text_formats import csv_text


def finished_result(results: Results) -> dict[str, Any]:
    """Return the content of `result.json` with `environment` and the digest of `spec.yaml` filled in.

    Raises:
        ValueError, TypeError: the result holds a NaN, an infinity or a type that JSON lacks.
    """
    filled = {"environment": environment(), "spec_sha256": digest(results.resolved_spec)}
    return {**results.result, **filled}


def write_run(
    results: Results,
    directory: Path,
    figures: Mapping[str, bytes] = MappingProxyType({}),
    *,
    origin: Origin | None = None,
) -> list[Path]:
    """Write a run directory and return the paths of its files, `result.json` last.

    An earlier run in `directory` is replaced, including files that the new run no longer has, and the page
    about it. Files that are not of a run are left alone. Whatever fails or kills the writer, `directory`
    holds what it held before or the new run, at the latest after the next call.

    Args:
        results: what a verb of the package returned.
        directory: where to write it.
        figures: file name ("bound.png") -> content, as `figures.plots.draw_all` draws them.
        origin: what the run was made from; a run of something else is then not replaced.

    Raises:
        OutputError: `output-not-a-directory`, `output-not-writable`, `output-full`, `output-not-a-run` (a
            file of the user's would be overwritten), `output-other-run`, `output-spec-changed`,
            `output-signal-changed`, `output-busy`.
    """
    result = finished_result(results)
    with output_errors(directory):
        target = check_directory(directory)
        if origin is not None:
            result |= origin.entry(target, results.resolved_spec)
        with workplace(target) as work:
            if origin is not None and not origin.overwrite:
                check_origin(origin, results.resolved_spec, target, shown=directory)
            names = _write_files(results, result, work / "new", figures)
            owned = owned_files(target)
            _keep_foreign(names, owned, work, target, shown=directory)
            put_in_place(names, owned, work, target)
    return [directory / name for name in names]


def write_text(path: Path, text: str) -> None:
    """Write a single text file, UTF-8; it raises as `write_bytes` does."""
    write_bytes(path, encoded(text))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a single file.

    Raises:
        OutputError: `output-not-writable`, `output-full`.
    """
    with output_errors(path):
        path.write_bytes(content)


def replace_text(path: Path, text: str | Iterable[str]) -> None:
    """Write a text file, or one that comes in pieces, so that it is whole whenever the writer is killed.

    A reader finds the old one or the new one.

    Raises:
        OutputError: `output-not-writable`, `output-full`.
    """
    partial = path.with_name(f".{path.name}.partial-{os.getpid()}")
    with output_errors(path):
        try:
            with partial.open("w", encoding="utf-8", errors="backslashreplace", newline="\n") as file:
                file.writelines([text] if isinstance(text, str) else text)
                file.flush()
                os.fsync(file.fileno())
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


def read_run(directory: Path) -> dict[str, Any]:
    """Return the content of `result.json` of a whole run.

    Raises:
        DataError: `run-missing` (no such directory, or no run in it), `run-incomplete` (one of its files is
            gone), `run-unreadable` (`result.json` is not what `write_run` writes).
    """
    with output_errors(directory):
        heal(Path(os.path.realpath(directory)))
    result = load_result(directory)
    missing = [name for name in result.get("files", ()) if not (directory / name).is_file()]
    if missing:
        message = f"{directory} lacks {', '.join(missing)}, which its {RESULT} lists"
        raise DataError.because("run-incomplete", message, hint="run the spec again")
    return result


def read_outcome(directory: Path, result: Mapping[str, object] | None = None) -> Outcome:
    """Return the outcome of a whole run, typed.

    Args:
        directory: of the run.
        result: its `result.json`, where that was read already.

    Raises:
        DataError: as `read_run`, and `run-unreadable` where an entry is not what `write_run` writes.
    """
    content = read_run(directory) if result is None else result
    if "spec_sha256" not in content:  # every run has it, of whatever kind
        raise unreadable(directory / RESULT, 'it has no "spec_sha256"')
    try:
        return read_plain(Outcome, content)
    except OutcomeError as error:
        raise unreadable(directory / RESULT, str(error)) from error


def _write_files(
    results: Results, result: dict[str, Any], folder: Path, figures: Mapping[str, bytes]
) -> list[str]:
    """Write all files of the run into `folder`, on the disc on return; return names, the result last."""
    tables = {f"{stem}.csv": csv_text(table) for stem, table in results.tables.items()}
    texts = {name: encoded(text) for name, text in ({SPEC: results.resolved_spec} | tables).items()}
    contents = {**texts, **results.files, **figures}
    if results.curves:
        contents[FIGURES] = curves_json(results.curves)
    told = {"signal_sha256": digest(tables[SIGNAL])} if SIGNAL in tables else {}
    contents[RESULT] = encoded(json_text({**result, **told, "files": list(contents)}))
    for name, content in contents.items():
        (folder / name).write_bytes(content)
    for name in contents:
        sync(folder / name)
    sync(folder)
    return list(contents)


def _keep_foreign(names: list[str], owned: list[str], work: Path, target: Path, *, shown: Path) -> None:
    """Refuse to write over files that are of no run, unless that changes nothing."""

    def differs(name: str) -> bool:
        there = target / name
        return not (there.is_file() and filecmp.cmp(work / "new" / name, there, shallow=False))

    there = [name for name in names if name not in owned and os.path.lexists(target / name)]
    if foreign := [name for name in there if differs(name)]:
        raise not_a_run(foreign, shown)


@contextmanager
def output_errors(target: Path) -> Iterator[None]:
    """Turn errors of the operating system into an `OutputError`."""
    try:
        yield
    except OSError as error:
        code, message = "output-not-writable", f"{target} cannot be written: {error.strerror or error}"
        hint = "choose another place, or change the permissions"
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            code, message = "output-full", f"there is no space left for {target}"
            hint = "free some space, or choose a place on another disc"
        raise OutputError.because(code, message, hint) from error
