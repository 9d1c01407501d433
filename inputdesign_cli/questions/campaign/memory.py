"""Read the directory of a campaign, a run directory that is written whole at every decision.

    spec.yaml              the campaign as it was begun
    signal.csv             the samples to apply next; gone when the campaign has ended
    plan_01.csv, ..        what was to be applied in every part
    record_01.csv, ..      what was recorded; record_01_as_given.csv is the file of the user
    model_01.yaml, ..      the estimate after each record
    .lock                  held by the process that decides
    result.json            under `campaign` all decisions, and digests of the files that they rest on

A decision replaces the directory as a run replaces another: whatever kills the writer, it holds the state
before or after.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from inputdesign_cli.errors import DataError, OutputError
from inputdesign_cli.outcome import OutcomeError, read_plain
from inputdesign_cli.outcome.campaign import Campaign
from inputdesign_cli.outcome.locks import locked
from inputdesign_cli.outcome.record import RESULT, SIGNAL, SPEC, load_result, unreadable
from inputdesign_cli.outcome.run_directory import output_errors, read_run
from inputdesign_cli.outcome.text_formats import csv_columns
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
_LOCK = ".lock"


@dataclass(frozen=True)
class Memory:
    """The content of a directory: its campaign, and the bytes of plans, records and estimates."""

    directory: Path
    campaign: Campaign
    spec: str
    made_from: tuple[str, ...]
    files: Mapping[str, bytes]

    @property
    def folder(self) -> Path:
        """The folder that names of files in the spec are relative to."""
        return self.directory / self.campaign.folder


def read_memory(directory: Path, *, withdrawing: int | None = None) -> Memory:
    """Return the campaign in a directory.

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
    """Replace hints to run again, which would lose the records of a campaign."""
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
            f"the campaign in {directory} has version {campaign.get('version')}, not {VERSION}",
            hint="go on with the version of idesign that began it: see environment in result.json",
        )
    names = result.get("files")
    damaged = unreadable(directory / RESULT, "its campaign is not what idesign writes")
    try:
        found = read_plain(Campaign, campaign)
    except OutcomeError as error:
        raise damaged from error
    if not _possible(found) or not isinstance(names, list):
        raise damaged
    with output_errors(directory):
        kept = [name for name in names if isinstance(name, str) and _KEPT.fullmatch(name)]
        files = {name: read_regular(directory / name) for name in kept}
        applied = [name for name in (SIGNAL,) if name in names]
        others = {name: read_regular(directory / name) for name in (SPEC, *applied)}
    check_files(directory, result, found, files | others, withdrawing)
    if not _fits(found, files):
        raise unreadable(directory / RESULT, "its campaign does not fit its plans and records")
    check_decisions(directory, campaign)
    spec = others[SPEC].decode("utf-8")
    origin = tuple(map(str, result.get("made_from", ())))
    return Memory(directory, found, spec, origin, files)


def _possible(campaign: Campaign) -> bool:
    """Return whether the numbers are of a kind that idesign writes."""
    lengths = [record.samples for record in campaign.records] + [plan.samples for plan in campaign.plans]
    sizes = [*(record.energy for record in campaign.records), *(plan.power for plan in campaign.plans)]
    cost = campaign.first_cost
    return (
        bool(campaign.rounds)
        and min(lengths, default=1) > 0
        and min(sizes, default=0.0) >= 0.0
        and (cost is None or cost > 0.0)
    )


def _fits(campaign: Campaign, files: Mapping[str, bytes]) -> bool:
    """Return whether all files of the campaign are there, and plans as long as was applied of them."""
    plans = [(record.plan, record.samples) for record in campaign.records]
    due = campaign.plan
    plans += [] if due is None else [(due.file, due.samples)]
    estimated = [set(one.estimate) for one in campaign.rounds if one.estimate]
    return (
        all(record.file in files for record in campaign.records)
        and all(name in files and _rows(files[name]) >= samples for name, samples in plans)
        and (campaign.last is None or set(campaign.last) in estimated)
    )


def _rows(content: bytes) -> int:
    """Return the length of a table of numbers; -1 if it is none."""
    try:
        columns = list(csv_columns(content).values())
    except ValueError:
        return -1
    return len(columns[0]) if columns and np.isfinite(columns).all() else -1


@contextmanager
def held(directory: Path) -> Iterator[None]:
    """Keep other processes from deciding in this directory.

    Raises:
        DataError: `run-missing`, `run-unreadable`.
        OutputError: `output-busy`, `output-not-writable`.
    """
    with _no_run(directory):
        load_result(directory)
    with ExitStack() as stack:
        with output_errors(directory):
            alone = stack.enter_context(locked(directory / _LOCK))
        if not alone:
            message = f"another process works on the campaign in {directory}"
            raise OutputError.because("output-busy", message, "wait for it, and see `idesign status` then")
        yield
