"""The directory of a campaign: a run directory that is written whole at every decision.

    spec.yaml              the campaign as it was begun
    signal.csv             the samples to apply next; gone when the campaign has ended
    plan_01.csv, ..        what was to be applied in every part
    record_01.csv, ..      what was recorded; record_01_as_given.csv is the file of the user
    model_01.yaml, ..      the estimate after so many records
    result.json            under `campaign` all decisions, and digests of all that they are made by

A decision replaces the directory as a run replaces another: whatever kills the writer, it holds the state
before or after.
"""

from __future__ import annotations

import fcntl
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import ValidationError

from inputdesign_cli.errors import DataError, OutputError
from inputdesign_cli.outcome.record import RESULT, SIGNAL, SPEC, load_result, unreadable
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.outcome.run_directory import output_errors, read_run
from inputdesign_cli.questions.campaign.state import Campaign
from inputdesign_cli.questions.campaign.unchanged import check_decisions, check_files
from inputdesign_cli.regular_file import read_regular

VERSION = 1
_FROM_A_COPY = (
    "put it back from a copy of the directory; without one, begin another campaign, and let "
    "`idesign identify` make a prior of the records that are left"
)
_HINTS = {
    "run-missing": "begin a campaign with `idesign campaign SPEC -o DIR`",
    "run-incomplete": _FROM_A_COPY,
    "run-unreadable": _FROM_A_COPY,
}
_KEPT = re.compile(r"(plan|record|model)_\d\d+(_as_given)?\.[a-z0-9]+")
_RECORDS = "record_*"


@dataclass(frozen=True)
class Memory:
    """What a directory says of its campaign: `campaign` of its result, and the bytes of what is kept."""

    directory: Path
    campaign: Mapping[str, Json]
    spec: str
    time_unit: str
    made_from: tuple[str, ...]
    files: Mapping[str, bytes]

    @property
    def state(self) -> str:
        """`running`, or how it ended."""
        return str(self.campaign["state"])

    @property
    def records(self) -> list[dict[str, Json]]:
        """What was recorded, in order; those that are withdrawn as well."""
        return [dict(record) for record in self.campaign["records"]]

    @property
    def counting(self) -> list[Path]:
        """The files of the records that count."""
        return [self.directory / record["file"] for record in self.records if not record["withdrawn"]]

    @property
    def done(self) -> int:
        """Samples that have been applied."""
        return sum(int(record["samples"]) for record in self.records)

    @property
    def plan(self) -> dict[str, Json] | None:
        """What is to be applied next."""
        return self.campaign["rounds"][-1].get("plan")

    @property
    def folder(self) -> Path:
        """What names of files in the spec start from."""
        return self.directory / self.campaign["folder"]


def read_memory(directory: Path, *, withdrawing: int | None = None) -> Memory:
    """What the directory remembers.

    Args:
        withdrawing: the number of a record that is about to be left out, whatever has become of it.

    Raises:
        DataError: `run-missing`, `run-incomplete`, `run-unreadable`; `campaign-missing`, it holds something
            else; `campaign-version`; `campaign-changed`, something is not as it was kept.
    """
    with _no_run(directory):
        return _read(directory, withdrawing)


@contextmanager
def _no_run(directory: Path) -> Iterator[None]:
    """What a run may do where it is damaged, begin anew, would lose what has been recorded."""
    try:
        yield
    except DataError as error:
        begun = any(directory.glob(_RECORDS))
        hints = _HINTS | ({"run-missing": _FROM_A_COPY} if begun else {})
        raise DataError(
            [replace(each, hint=hints.get(each.code, each.hint)) for each in error.diagnostics]
        ) from error


def _read(directory: Path, withdrawing: int | None) -> Memory:
    result = read_run(directory)
    campaign = result.get("campaign")
    if not isinstance(campaign, dict) or "records" not in campaign:
        raise DataError.because(
            "campaign-missing",
            f"{directory} holds a run, and no campaign",
            hint="begin one with `idesign campaign SPEC -o DIR`, in a directory of its own",
        )
    if campaign.get("version") != VERSION:
        raise DataError.because(
            "campaign-version",
            f"the campaign in {directory} has version {campaign.get('version')}, and this is {VERSION}",
            hint="go on with the version of idesign that began it, which result.json tells under environment",
        )
    names = result.get("files")
    try:
        found = Campaign.model_validate(campaign)
    except ValidationError:
        found = None
    if found is None or not isinstance(names, list):
        raise unreadable(directory / RESULT, "its campaign is not what idesign writes")
    with output_errors(directory):
        kept = [name for name in names if isinstance(name, str) and _KEPT.fullmatch(name)]
        files = {name: read_regular(directory / name) for name in kept}
        applied = [name for name in (SIGNAL,) if name in names]
        others = {name: read_regular(directory / name) for name in (SPEC, *applied)}
    check_files(directory, result, found, files | others, withdrawing)
    if not found.fits(files):
        raise unreadable(directory / RESULT, "its campaign does not fit the plans and records beside it")
    check_decisions(directory, campaign, found)
    spec = others[SPEC].decode("utf-8")
    origin = tuple(map(str, result.get("made_from", ())))
    return Memory(directory, campaign, spec, str(campaign["time_unit"]), origin, files)


@contextmanager
def held(directory: Path) -> Iterator[None]:
    """Nobody else decides in this directory meanwhile.

    Raises:
        DataError: `run-missing`.
        OutputError: `output-busy`.
    """
    try:
        handle = os.open(directory / RESULT, os.O_RDONLY | os.O_NOFOLLOW)
    except OSError:
        with _no_run(directory):
            load_result(directory)  # says what is wrong
        raise
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            current = os.path.samestat(os.fstat(handle), os.stat(directory / RESULT))
        except OSError:
            current = False
        if not current:
            message = f"another process works on the campaign in {directory}"
            raise OutputError.because("output-busy", message, "wait for it, and see `idesign status` then")
        yield
    finally:
        os.close(handle)
