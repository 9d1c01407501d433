"""Record the source of a run, so that a run of something else does not replace it by name.

`made_from` in `result.json` names the spec and the data relative to the run directory: a project that is
moved as a whole keeps its runs. `asked_sha256` is the digest of the spec as it was read, if the `spec.yaml`
of the run differs from it.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from filecmp import cmp
from pathlib import Path

from inputdesign_cli.errors import STANDARD_STREAM, DataError, OutputError
from inputdesign_cli.outcome.record import RESULT, SIGNAL, SPEC, load_result, owned_files
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

    What may change in the meantime is looked at again when the run is written.

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
    foreign = [n for n in (SPEC, RESULT) if n not in owned_files(target) and os.path.lexists(target / n)]
    if RESULT in foreign or (foreign and _content(target / SPEC) != encoded(spec)):
        raise not_a_run(foreign, directory)
    if not origin.overwrite:
        check_origin(origin, spec, target, shown=directory)


def has_other_values(directory: Path, spec: str) -> bool:
    """Return whether the directory holds a run whose `spec.yaml` differs from this one."""
    try:
        return load_result(directory).get("spec_sha256") not in (None, digest(spec))
    except DataError:
        return False


def check_counted_once(spec: Path, data: Sequence[Path]) -> None:
    """Refuse a file whose information the spec of a top-up has as its prior.

    Raises:
        DataError: `data-repeated`.
    """
    try:
        result = load_result(spec.parent) if spec.name == SPEC else {}
    except DataError:
        return
    assessment, counted = result.get("assessment"), result.get("made_from")
    if not (isinstance(assessment, dict) and "top_up_status" in assessment and isinstance(counted, list)):
        return
    before = [spec.parent / str(name) for name in counted[1:]]
    for file in data:
        if any(one.is_file() and file.is_file() and cmp(one, file, shallow=False) for one in before):
            raise DataError.because(
                "data-repeated",
                f"{file} counts as experiment.prior of {spec} already, and would count twice",
                "give only the records since then, or all of them with the spec that was assessed first",
            )


def not_a_run(foreign: Sequence[str], directory: Path) -> OutputError:
    """Return the error about files of the user's that would be written over."""
    message = f"{directory} already has {', '.join(foreign)}, written by something other than an earlier run"
    hint = "choose another directory with -o, or move these files away"
    return OutputError.because("output-not-a-run", message, hint)


def _content(path: Path) -> bytes | None:
    try:
        return read_regular(path)
    except OSError:
        return None


def check_origin(origin: Origin, spec: str, target: Path, *, shown: Path) -> None:
    """Refuse to replace the run in `target` unless it was made from the same files, or from the same spec.

    Args:
        origin: what the new run is made from.
        spec: its `spec.yaml`.
        target: the directory of the run.
        shown: how the user calls it.

    Raises:
        OutputError: `output-other-run`; `output-spec-changed` and `output-signal-changed`, the user has
            worked on `spec.yaml` or `signal.csv` there; `campaign-exists`, its records would be lost.
    """
    written, signal = _content(target / SPEC), _content(target / SIGNAL)
    try:
        result = load_result(target)
    except DataError:
        return
    if written is None:
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
    if known[:1] != [SPEC] and origin.asked:  # or else spec.yaml is the user's own text
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
