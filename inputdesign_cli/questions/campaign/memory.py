"""Read the directory of a campaign, a run directory that is written whole at every decision.

    spec.yaml              the campaign as it was begun
    signal.csv             the samples to apply next; gone when the campaign has ended
    plan_01.csv, ..        what was to be applied in every part
    record_01.csv, ..      what was recorded; record_01_as_given.csv is the file of the user
    model_01.yaml, ..      the estimate after each record
    .lock                  held by the process that decides
    result.json            under `campaign` all decisions, and digests of the files that they rest on

A decision replaces the directory as a run replaces another: if the writer is killed at any moment, the
directory holds the state before or after.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, OutputError
from inputdesign_cli.outcome import plain, read_plain
from inputdesign_cli.outcome.campaign import Campaign
from inputdesign_cli.outcome.run_directory import output_errors, read_run
from inputdesign_cli.outcome.run_files import RESULT, SIGNAL, SPEC, load_result, locked, readable
from inputdesign_cli.outcome.text_formats import csv_columns
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
# Files that decisions rest on; spec and signal of a run have digests of their own.
_READ = re.compile(r"(plan|record)_\d\d+\.csv")
_DIGESTS = "digests"


@dataclass(frozen=True)
class Memory:
    """Holds the content of a directory: its campaign, and the bytes of plans, records and estimates."""

    directory: Path
    campaign: Campaign
    spec: str
    made_from: tuple[str, ...]
    files: Mapping[str, bytes]

    @property
    def folder(self) -> Path:
        """Return the folder that names of files in the spec are relative to."""
        return self.directory / self.campaign.folder


def read_memory(directory: Path, *, withdrawing: Collection[int] = ()) -> Memory:
    """Return the campaign in a directory.

    Args:
        withdrawing: numbers of records that are about to be left out, whatever has become of them.

    Raises:
        DataError: `run-missing`, `run-incomplete`, `run-unreadable`; `campaign-missing`, it holds something
            else; `campaign-version`; `campaign-changed`, something is not as it was kept.
    """
    with _no_run(directory):
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
        with readable(directory / RESULT):
            found = read_plain(Campaign, campaign)
        names = {name for name in result.get("files", ()) if _KEPT.fullmatch(name) or name in (SPEC, SIGNAL)}
        with output_errors(directory):
            files = {name: read_regular(directory / name) for name in sorted(names)}
        due = dict.fromkeys([RESULT, *(r.file for r in found.records), *(p.file for p in found.plans)], "")
        own = {SPEC: result.get("spec_sha256", ""), SIGNAL: result.get("signal_sha256")}
        known = due | dict(found.digests) | own
        out = {r.file for n, r in enumerate(found.records, 1) if r.withdrawn or n in withdrawing}
        now = {name: _sha256(content) for name, content in files.items()} | {RESULT: _decisions(campaign)}
        for name, digest in known.items():
            if digest is not None and name not in out and digest != now.get(name):
                raise _changed(directory, name, found)
        spec, kept = files[SPEC].decode("utf-8"), {n: c for n, c in files.items() if n not in (SPEC, SIGNAL)}
        return Memory(directory, found, spec, tuple(map(str, result.get("made_from", ()))), kept)


@contextmanager
def _no_run(directory: Path) -> Iterator[None]:
    """Replace hints to run again, which would lose the records of a campaign."""
    try:
        yield
    except DataError as error:
        begun = any(directory.glob("record_*"))
        hints = _HINTS | ({"run-missing": _FROM_A_COPY} if begun else {})
        raise DataError(
            [replace(each, hint=hints.get(each.code, each.hint)) for each in error.diagnostics]
        ) from error


def signals_in(content: bytes) -> Array:
    """Return the signals (n, r) in the bytes of a plan, without their times."""
    return np.stack(list(csv_columns(content).values())[1:], axis=1)


def digests(campaign: Campaign, files: Mapping[str, bytes]) -> dict[str, str]:
    """Return SHA-256 of each file that decisions rest on, and of the decisions themselves.

    A record keeps its digest: one that was withdrawn may have changed since. Plans may be made anew.
    """
    found = {name: _sha256(content) for name, content in files.items() if _READ.fullmatch(name)}
    records = {name: digest for name, digest in campaign.digests.items() if name.startswith("record")}
    return {**found, RESULT: _decisions(plain(campaign)), **records}


def _changed(directory: Path, name: str, campaign: Campaign) -> DataError:
    """Return the error about a file that is not as it was kept."""
    numbers = {record.file: n for n, record in enumerate(campaign.records, 1)}
    due = None if campaign.plan is None else campaign.plan.file
    more = ""
    if name in numbers:
        more = f", or go on without it: `idesign next {directory} --withdraw {numbers[name]}`"
    elif name in (SIGNAL, due):
        more = f": {due if name == SIGNAL else SIGNAL} in the same directory holds the same samples"
    elif name == SPEC:
        more = "; for another question begin another campaign, in a directory of its own"
    return DataError.because(
        "campaign-changed",
        f"{directory / name} is not what the campaign kept under this name: it was changed since",
        f"put it back as it was{more}",
    )


def _decisions(campaign: Mapping[str, object]) -> str:
    """Return the digest of all entries but the digests, whatever the order of the keys."""
    kept = {key: value for key, value in campaign.items() if key != _DIGESTS}
    return _sha256(json.dumps(kept, sort_keys=True).encode())


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


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
            alone = stack.enter_context(locked(directory / ".lock"))
        if not alone:
            message = f"another process works on the campaign in {directory}"
            raise OutputError.because("output-busy", message, "wait for it, and see `idesign status` then")
        yield
