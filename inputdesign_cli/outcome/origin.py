"""Record what a run was made from, so that a run of something else does not replace it by name.

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
    """What a run is made from: files, the spec first, and the spec as it was read, with overrides.

    `overwrite` is whether the run of something else may be replaced, `judges` whether the run has a verdict.
    """

    files: Sequence[Path]
    asked: str = ""
    overwrite: bool = False
    judges: bool = False

    def seen_from(self, target: Path) -> list[str]:
        """The paths of a spec (`-` if it came from standard input) and of data relative to `target`."""
        return [
            STANDARD_STREAM
            if str(file) == STANDARD_STREAM
            else os.path.relpath(os.path.realpath(file), target)
            for file in self.files
        ]

    def entry(self, target: Path, written: str) -> dict[str, object]:
        """What `result.json` says of it.

        Args:
            written: the `spec.yaml` of the run.
        """
        asked = {"asked_sha256": digest(self.asked)} if self.asked and self.asked != written else {}
        return {"made_from": self.seen_from(target), **asked}


def digest(text: str) -> str:
    """The SHA-256 of a text as it is written to a file."""
    return hashlib.sha256(text.encode(errors="backslashreplace")).hexdigest()


def check_directory(directory: Path) -> Path:
    """The directory of a run with links followed; there may be none yet.

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
    owned = owned_files(target)
    certain = [name for name in (SPEC, RESULT) if name not in owned and os.path.lexists(target / name)]
    foreign = [name for name in certain if name == RESULT or not _holds(target / name, spec)]
    if foreign:
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
    """No file is given whose information the spec of a top-up has as its prior.

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
    """The error about files of the user's that would be written over."""
    message = f"{directory} already has {', '.join(foreign)}, written by something other than an earlier run"
    hint = "choose another directory with -o, or move these files away"
    return OutputError.because("output-not-a-run", message, hint)


def _changed(path: Path, known: object) -> bool:
    """Whether a file is there that is not the one of this SHA-256; False where none is known."""
    try:
        return known is not None and hashlib.sha256(read_regular(path)).hexdigest() != known
    except OSError:
        return False


def _holds(path: Path, text: str) -> bool:
    try:
        return read_regular(path) == text.encode(errors="backslashreplace")
    except OSError:
        return False


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
    try:
        result = load_result(target)
        written = read_regular(target / SPEC)
    except (DataError, OSError):
        return
    campaign = result.get("campaign")
    records = campaign.get("records") if isinstance(campaign, dict) else None
    if isinstance(records, list) and records:
        raise OutputError.because(
            "campaign-exists",
            f"{shown} holds a campaign with {len(records)} record{'' if len(records) == 1 else 's'}",
            "go on with it by idesign next, choose another directory with -o, or give it up with --overwrite",
        )
    hint = "choose another directory with -o, or replace the run with --overwrite"
    same = written == spec.encode(errors="backslashreplace")
    if not same and hashlib.sha256(written).hexdigest() != result.get("spec_sha256"):
        message = f"{shown / SPEC} has been changed since its run was written, and would be lost"
        hint = "solve that file, choose another directory with -o, or give up the changes with --overwrite"
        raise OutputError.because("output-spec-changed", message, hint)
    if _changed(target / SIGNAL, result.get("signal_sha256")):
        raise OutputError.because(
            "output-signal-changed",
            f"{shown / SIGNAL} has been changed since its run was written, and would be lost",
            "move it away if it is a record, choose another directory with -o, or give it up by --overwrite",
        )
    ours, theirs = origin.seen_from(target), result.get("made_from")
    known = theirs if isinstance(theirs, list) else []
    if known[:1] != [SPEC] and origin.asked:  # or else spec.yaml is the user's own text
        same |= digest(origin.asked) == result.get("asked_sha256", result.get("spec_sha256"))
    same_file = ours[:1] == known[:1] and ours[:1] not in ([], [STANDARD_STREAM])
    if known[1:] != ours[1:] or not (same or same_file or ours[:1] == [SPEC]):
        of = f" of {', '.join(map(str, known))} (as seen from there)" if known else " of something else"
        message = f"{shown} holds the run{of}, and would lose it"
        raise OutputError.because("output-other-run", message, hint)
    if "assessment" in result and not origin.judges:
        message = f"{shown} holds the verdict of assess on these data, and would lose it"
        raise OutputError.because("output-other-run", message, hint)
