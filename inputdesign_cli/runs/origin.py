"""What a run was made from, so that it is not lost to a run of something else that has the same name.

`made_from` in `result.json` names the spec and the data as they are seen from the run directory: a project
that is moved as a whole keeps its runs.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from pathlib import Path

from inputdesign_cli.errors import STANDARD_INPUT, DataError, OutputError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.runs.record import SPEC, load_result


def made_from(files: Sequence[Path], target: Path) -> list[str]:
    """The paths of a spec (`-` if it came from standard input) and of data relative to `target`."""
    return [
        STANDARD_INPUT if str(file) == STANDARD_INPUT else os.path.relpath(os.path.realpath(file), target)
        for file in files
    ]


def check_origin(ours: Sequence[str], spec: str, target: Path, *, shown: Path) -> None:
    """Refuse to replace the run in `target` unless it was made from the same files, or from the same spec.

    Args:
        ours: what the new run was made from.
        spec: its `spec.yaml`.
        target: the directory of the run.
        shown: how the user calls it.

    Raises:
        OutputError: `output-other-run`; `output-spec-changed`, the user has worked on `spec.yaml` there;
            `campaign-exists`, its records would be lost.
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
    theirs = result.get("made_from")
    known = theirs if isinstance(theirs, list) else []
    same_file = ours[:1] == known[:1] and ours[:1] not in ([], [STANDARD_INPUT])
    if known[1:] != ours[1:] or not (same or same_file or ours[:1] == [SPEC]):
        of = f" of {', '.join(map(str, known))} (as seen from there)" if known else " of something else"
        message = f"{shown} holds the run{of}, and would lose it"
        raise OutputError.because("output-other-run", message, hint)
