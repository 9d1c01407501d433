"""The directory of a campaign: a run directory that is written whole at every decision.

    spec.yaml              the campaign as it was begun
    signal.csv             the samples to apply next; gone when the campaign has ended
    plan_01.csv, ..        what was to be applied in every part
    record_01.csv, ..      what was recorded; record_01_as_given.csv is the file of the user
    model_01.yaml, ..      the estimate after so many records
    result.json            under `campaign` all decisions, and digests of the plans and records

A decision replaces the directory as a run replaces another: whatever kills the writer, it holds the state
before or after.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    FiniteFloat,
    NonNegativeFloat,
    PositiveFloat,
    PositiveInt,
    ValidationError,
)

from inputdesign_cli.errors import DataError, OutputError
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.runs.record import RESULT, SPEC, load_result, unreadable
from inputdesign_cli.runs.results import Json
from inputdesign_cli.runs.run_directory import output_errors, read_run
from inputdesign_cli.runs.text_formats import csv_columns

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
# Of these, what decisions are made by.
_READ = re.compile(r"(plan|record)_\d\d+\.csv")


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


def digests(files: Mapping[str, bytes]) -> dict[str, str]:
    """SHA-256 of each file that decisions are made by."""
    return {
        name: hashlib.sha256(content).hexdigest() for name, content in files.items() if _READ.fullmatch(name)
    }


def read_memory(directory: Path, *, withdrawing: int | None = None) -> Memory:
    """What the directory remembers.

    Args:
        withdrawing: the number of a record that is about to be left out, whatever has become of it.

    Raises:
        DataError: `run-missing`, `run-incomplete`, `run-unreadable`; `campaign-missing`, it holds something
            else; `campaign-version`; `campaign-changed`, a plan or record is not as it was kept.
    """
    try:
        return _read(directory, withdrawing)
    except DataError as error:
        # What a run may do, begin anew, would lose what has been recorded.
        raise DataError(
            [replace(each, hint=_HINTS.get(each.code, each.hint)) for each in error.diagnostics]
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
        found = _Campaign.model_validate(campaign)
    except ValidationError:
        found = None
    if found is None or not isinstance(names, list):
        raise unreadable(directory / RESULT, "its campaign is not what idesign writes")
    with output_errors(directory):
        kept = [name for name in names if isinstance(name, str) and _KEPT.fullmatch(name)]
        files = {name: read_regular(directory / name) for name in kept}
        spec = read_regular(directory / SPEC).decode("utf-8")
    _check_kept(directory, found, files, withdrawing)
    if not found.fits(files):
        raise unreadable(directory / RESULT, "its campaign does not fit the plans and records beside it")
    origin = tuple(map(str, result.get("made_from", ())))
    return Memory(directory, campaign, spec, str(campaign["time_unit"]), origin, files)


def _check_kept(
    directory: Path, found: _Campaign, files: Mapping[str, bytes], withdrawing: int | None
) -> None:
    """Raise `DataError` (`campaign-changed`) for plans and records that are not as they were kept.

    Those that are left out may be anything, and directories of before digests were kept have none to compare.
    """
    numbers = {record.file: n for n, record in enumerate(found.records, 1)}
    out = {r.file for n, r in enumerate(found.records, 1) if r.withdrawn or n == withdrawing}
    for name, digest in digests(files).items():
        if name in out or found.digests.get(name, digest) == digest:
            continue
        message = f"{directory / name} is not what the campaign kept under this name: it was changed since"
        hint = "put it back as it was"
        if name in numbers:
            given = next((n for n in files if n.startswith(f"{name[:-4]}_as_given.")), "your own file")
            hint += (
                f", or go on without it: `idesign next {directory} --withdraw {numbers[name]}` "
                f"(what you gave is in {given})"
            )
        elif name == getattr(found.rounds[-1].plan, "file", None):
            hint += ": signal.csv beside it holds the same samples"
        raise DataError.because("campaign-changed", message, hint)


class _Kept(BaseModel):
    """Of what idesign writes, what the next decision goes by."""

    model_config = ConfigDict(strict=True, extra="allow")


class _Record(_Kept):
    file: str
    given: str
    plan: str
    withdrawn: bool
    samples: PositiveInt
    energy: NonNegativeFloat = Field(allow_inf_nan=False)


class _Plan(_Kept):
    file: str
    samples: PositiveInt
    power: NonNegativeFloat = Field(allow_inf_nan=False)
    offset: list[FiniteFloat]


class _Round(_Kept):
    state: Literal["running", "stopped", "missed", "undecided"]
    plan: _Plan | None = None
    estimate: dict[str, FiniteFloat] = {}


class _Campaign(_Kept):
    state: Literal["running", "stopped", "missed", "undecided"]
    folder: str
    time_unit: str
    records: list[_Record]
    rounds: list[_Round] = Field(min_length=1)
    last: dict[str, FiniteFloat] | None = None
    first_cost: PositiveFloat | None = Field(default=None, allow_inf_nan=False)
    digests: dict[str, str] = {}
    regardless: bool = False

    def fits(self, files: Mapping[str, bytes]) -> bool:
        """Whether all files are there that it speaks of, plans as long as what was applied of them."""
        plans = [(record.plan, record.samples) for record in self.records]
        due = self.rounds[-1].plan
        plans += [] if due is None else [(due.file, due.samples)]
        estimated = [set(each.estimate) for each in self.rounds if each.estimate]
        return (
            all(record.file in files for record in self.records)
            and all(name in files and _rows(files[name]) >= samples for name, samples in plans)
            and (self.last is None or set(self.last) in estimated)
        )


def _rows(content: bytes) -> int:
    """Of a table of numbers; -1 where it is none."""
    try:
        columns = list(csv_columns(content).values())
    except ValueError:
        return -1
    return len(columns[0]) if columns and np.isfinite(columns).all() else -1


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
