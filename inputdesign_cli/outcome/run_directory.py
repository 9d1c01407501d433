"""The run directory: written whole or not at all, `result.json` last, and never over something else.

If `result.json` is there, the run is complete and every other file belongs to it. This holds whatever happens
to the writer: a full disc, an interrupt, a power cut.

`made_from` in `result.json` names the spec and the data relative to the run directory: a project that is
moved as a whole keeps its runs. `asked_sha256` is the digest of the spec as it was read, if the `spec.yaml`
of the run differs from it.
"""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, cast

import numpy as np
import orjson
from numpy.typing import NDArray

from inputdesign_cli.errors import STANDARD_STREAM, DataError, OutputError
from inputdesign_cli.outcome import Outcome, read_plain
from inputdesign_cli.outcome.codec import json_text
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.run_files import (
    FIGURES,
    RESULT,
    SIGNAL,
    SPEC,
    environment,
    heal,
    known_result,
    load_result,
    owned_files,
    put_in_place,
    readable,
    sync,
    unreadable,
    workplace,
)
from inputdesign_cli.outcome.text_formats import csv_text
from inputdesign_cli.regular_file import read_regular


@dataclass(frozen=True)
class Origin:
    """Holds the source of a run: files, the spec first, and the spec as it was read, with overrides.

    `overwrite` is whether the run of something else may be replaced, `judges` whether the run has a verdict.
    """

    files: Sequence[Path]
    asked: str = ""
    overwrite: bool = False
    judges: bool = False

    def seen_from(self, target: Path) -> list[str]:
        """Return the paths of a spec (`-` from standard input) and of data relative to `target`."""
        return [
            STANDARD_STREAM
            if str(file) == STANDARD_STREAM
            else os.path.relpath(os.path.realpath(file), target)
            for file in self.files
        ]

    def entry(self, target: Path, written: str) -> dict[str, object]:
        """Return the entry of `result.json` on the source; `written` is the `spec.yaml` of the run."""
        asked = {"asked_sha256": digest(self.asked)} if self.asked and self.asked != written else {}
        return {"made_from": self.seen_from(target), **asked}


def encoded(text: str) -> bytes:
    """Return a text as it is written to a file."""
    return text.encode(errors="backslashreplace")


def digest(text: str) -> str:
    """Return the SHA-256 of a text as it is written to a file."""
    return hashlib.sha256(encoded(text)).hexdigest()


def check_directory(directory: Path) -> Path:
    """Return the directory of a run with links followed; there may be none yet.

    Raises:
        OutputError: `output-not-a-directory`.
    """
    target = Path(os.path.realpath(directory))
    if target.exists() and not target.is_dir():
        message = f"{directory} is a file, and a run is written into a directory"
        raise OutputError.because("output-not-a-directory", message, hint="choose another directory with -o")
    return target


def check_place(directory: Path, origin: Origin, spec: str) -> None:
    """Refuse a directory that could not take a run, before the run is computed.

    Conditions that may change in the meantime are checked again when the run is written.

    Args:
        spec: the `spec.yaml` of the run, as far as it is known beforehand.

    Raises:
        OutputError: `output-not-a-directory`, `output-not-writable`, `output-not-a-run`; as `check_origin`.
    """
    target = check_directory(directory)
    there = next(parent for parent in (target, *target.parents) if parent.exists())
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        why = "it may not be written to" if there.is_dir() else "it is a file"
        raise OutputError.because(
            "output-not-writable",
            f"{directory} cannot be written: {there}: {why}",
            hint="choose another place, or change the permissions",
        )
    check_foreign(target, {SPEC: encoded(spec), RESULT: b""}, shown=directory)
    if not origin.overwrite:
        check_origin(origin, spec, target, shown=directory)


def has_other_values(directory: Path, spec: str) -> bool:
    """Return whether the directory holds a run whose `spec.yaml` differs from this one."""
    return known_result(directory).get("spec_sha256") not in (None, digest(spec))


def check_counted_once(spec: Path, data: Sequence[Path]) -> None:
    """Refuse a file whose information the spec of a top-up has as its prior.

    Raises:
        DataError: `data-repeated`.
    """
    result = known_result(spec.parent) if spec.name == SPEC else {}
    assessment, counted = result.get("assessment"), result.get("made_from")
    if not (isinstance(assessment, dict) and "top_up_status" in assessment and isinstance(counted, list)):
        return
    before = [spec.parent / str(name) for name in counted[1:]]
    for file in data:
        content = _content(file)
        if content is not None and any(_content(one) == content for one in before):
            raise DataError.because(
                "data-repeated",
                f"{file} counts as experiment.prior of {spec} already, and would count twice",
                "give only the records since then, or all of them with the spec that was assessed first",
            )


def check_foreign(target: Path, contents: Mapping[str, bytes], *, shown: Path) -> None:
    """Refuse to write over files that are of no run, unless that changes nothing.

    Raises:
        OutputError: `output-not-a-run`.
    """
    owned = owned_files(target)
    there = [name for name in contents if name not in owned and os.path.lexists(target / name)]
    foreign = [name for name in there if _content(target / name) != contents[name]]
    if foreign:
        message = f"{shown} already has {', '.join(foreign)}, written by something other than an earlier run"
        hint = "choose another directory with -o, or move these files away"
        raise OutputError.because("output-not-a-run", message, hint)


def _content(path: Path) -> bytes | None:
    try:
        return read_regular(path)
    except OSError:
        return None


def check_origin(origin: Origin, spec: str, target: Path, *, shown: Path) -> None:
    """Refuse to replace the run in `target` unless it was made from the same files, or from the same spec.

    Args:
        origin: the sources of the new run.
        spec: its `spec.yaml`.
        target: the directory of the run.
        shown: the name by which the user calls it.

    Raises:
        OutputError: `output-other-run`; `output-spec-changed` and `output-signal-changed`, the user has
            worked on `spec.yaml` or `signal.csv` there; `campaign-exists`, its records would be lost.
    """
    result, written, signal = known_result(target), _content(target / SPEC), _content(target / SIGNAL)
    if not result or written is None:
        return
    campaign = result.get("campaign")
    records = campaign.get("records") if isinstance(campaign, dict) else None
    if isinstance(records, list) and records:
        raise OutputError.because(
            "campaign-exists",
            f"{shown} holds a campaign with {len(records)} record{'' if len(records) == 1 else 's'}",
            "go on with it by idesign next, choose another directory with -o, or give it up with --overwrite",
        )
    same = written == encoded(spec)
    if not same and hashlib.sha256(written).hexdigest() != result.get("spec_sha256"):
        raise _lost("output-spec-changed", shown / SPEC, "solve that file")
    known_signal = result.get("signal_sha256")
    if known_signal and signal is not None and hashlib.sha256(signal).hexdigest() != known_signal:
        raise _lost("output-signal-changed", shown / SIGNAL, "move it away if it is a record")
    ours, theirs = origin.seen_from(target), result.get("made_from")
    known = theirs if isinstance(theirs, list) else []
    if known[:1] != [SPEC] and origin.asked:  # otherwise spec.yaml is the user's own text
        same |= digest(origin.asked) == result.get("asked_sha256", result.get("spec_sha256"))
    same_file = ours[:1] == known[:1] and ours[:1] not in ([], [STANDARD_STREAM])
    of = ""
    if known[1:] != ours[1:] or not (same or same_file or ours[:1] == [SPEC]):
        of = f"run of {', '.join(map(str, known))} (as seen from there)" if known else "run of something else"
    elif "assessment" in result and not origin.judges:
        of = "verdict of assess on these data"
    if of:
        hint = "choose another directory with -o, or replace the run with --overwrite"
        raise OutputError.because("output-other-run", f"{shown} holds the {of}, and would lose it", hint)


def _lost(code: str, file: Path, instead: str) -> OutputError:
    """Return the error about a file that the user has worked on."""
    message = f"{file} has been changed since its run was written, and would be lost"
    hint = f"{instead}, choose another directory with -o, or give up the changes with --overwrite"
    return OutputError.because(code, message, hint)


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
    about it. Files that belong to no run are left alone. Whatever fails or kills the writer, `directory`
    holds its earlier content or the new run, at the latest after the next call.

    Args:
        results: the results that a verb of the package returned.
        directory: the directory to write.
        figures: file name ("bound.png") -> content, as `figures.plots.draw_all` draws them.
        origin: the sources of the run; a run from other sources is then not replaced.

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
        contents = run_contents(results, figures, result)
        with workplace(target) as work:
            if origin is not None and not origin.overwrite:
                check_origin(origin, results.resolved_spec, target, shown=directory)
            check_foreign(target, contents, shown=directory)
            for name, content in contents.items():
                (work / "new" / name).write_bytes(content)
            for name in (*contents, ""):
                sync(work / "new" / name)
            put_in_place(list(contents), owned_files(target), work, target)
    return [directory / name for name in contents]


def write_text(path: Path, text: str) -> None:
    """Write a single text file, UTF-8; it raises as `write_bytes` does."""
    write_bytes(path, encoded(text))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a single file as `replace_text` does; a pipe or a device is written into."""
    if path.exists() and not path.is_file():
        with output_errors(path):
            path.write_bytes(content)
    else:
        _replace(Path(os.path.realpath(path)), [content])


def replace_text(path: Path, text: str | Iterable[str]) -> None:
    """Write a text file, or one that comes in pieces, so that it is whole whenever the writer is killed.

    A reader finds the old one or the new one.

    Raises:
        OutputError: `output-not-writable`, `output-full`.
    """
    _replace(path, map(encoded, [text] if isinstance(text, str) else text))


def _replace(path: Path, pieces: Iterable[bytes]) -> None:
    partial = path.with_name(f".{path.name}.partial-{os.getpid()}")
    with output_errors(path):
        try:
            with partial.open("wb") as file:
                file.writelines(pieces)
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
        directory: the directory of the run.
        result: its `result.json`, where that was read already.

    Raises:
        DataError: as `read_run`, and `run-unreadable` where an entry is not what `write_run` writes.
    """
    content = read_run(directory) if result is None else result
    if "spec_sha256" not in content:  # every run has it, of whatever kind
        raise unreadable(directory / RESULT, 'it has no "spec_sha256"')
    with readable(directory / RESULT):
        return read_plain(Outcome, content)


def run_contents(
    results: Results, figures: Mapping[str, bytes], result: dict[str, Any] | None = None
) -> dict[str, bytes]:
    """Return the content of all files of the run by name, the result last; `result.json` may have more."""
    result = finished_result(results) if result is None else result
    tables = {f"{stem}.csv": csv_text(table) for stem, table in results.tables.items()}
    texts = {name: encoded(text) for name, text in ({SPEC: results.resolved_spec} | tables).items()}
    contents = {**texts, **results.files, **figures}
    if results.curves:
        contents[FIGURES] = curves_json(results.curves)
    known = {"signal_sha256": digest(tables[SIGNAL])} if SIGNAL in tables else {}
    contents[RESULT] = encoded(json_text({**result, **known, "files": list(contents)}))
    return contents


_KIND = "kind"


def curves_json(curves: Mapping[str, Curves]) -> bytes:
    """Return the content of figures.json: curves by the file stem of their figure; NaN is null."""
    content = {stem: {_KIND: type(one).__name__, **asdict(cast(Any, one))} for stem, one in curves.items()}
    return orjson.dumps(content, default=_plain, option=orjson.OPT_NON_STR_KEYS | orjson.OPT_SERIALIZE_NUMPY)


def _plain(value: NDArray) -> object:
    """Return complex numbers as {re, im}, and other arrays in contiguous memory, for orjson."""
    if np.iscomplexobj(value):
        return {"re": np.ascontiguousarray(value.real), "im": np.ascontiguousarray(value.imag)}
    return np.ascontiguousarray(value)


def read_curves(directory: Path) -> dict[str, Curves]:
    """Return the curves of a run by file stem, from which a page draws the figures again in its own size.

    Raises:
        DataError: `run-unreadable`, figures.json holds something else.
    """
    file = directory / FIGURES
    if not file.is_file():
        return {}
    with readable(file):
        kinds = {kind.__name__: kind for kind in Curves.__subclasses__()}
        content = orjson.loads(read_regular(file))
        return {stem: read_plain(kinds[fields[_KIND]], fields) for stem, fields in content.items()}


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
