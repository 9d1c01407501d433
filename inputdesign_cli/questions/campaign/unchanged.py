"""Check that spec, plans, records, signal and decisions of a campaign are as they were kept."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path

from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome import write_plain
from inputdesign_cli.outcome.campaign import Campaign
from inputdesign_cli.outcome.record import RESULT, SIGNAL, SPEC
from inputdesign_cli.outcome.text_formats import plain

# Files that decisions rest on; spec and signal of a run have digests of their own.
_READ = re.compile(r"(plan|record)_\d\d+\.csv")
_DIGESTS = "digests"


def digests(campaign: Campaign, files: Mapping[str, bytes]) -> dict[str, str]:
    """Return SHA-256 of each file that decisions rest on, and of the decisions themselves.

    A record keeps its digest: one that was withdrawn may have changed since. Plans may be made anew.
    """
    found = {name: _sha256(content) for name, content in files.items() if _READ.fullmatch(name)}
    records = {name: digest for name, digest in (campaign.digests or {}).items() if name.startswith("record")}
    return {**found, RESULT: _decisions(write_plain(campaign)), **records}


def check_files(
    directory: Path,
    result: Mapping[str, object],
    found: Campaign,
    files: Mapping[str, bytes],
    withdrawing: int | None,
) -> None:
    """Raise `DataError` (`campaign-changed`) for files that are not as they were kept.

    Records that do not count may be anything. Directories of older versions have no digests.

    Args:
        result: `result.json`, in which `found` is what the campaign says.
        files: the bytes of the plans and records, of spec.yaml and, where it is there, of signal.csv.
        withdrawing: the number of a record that is about to be left out.
    """
    numbers = {record.file: n for n, record in enumerate(found.records, 1)}
    out = {r.file for n, r in enumerate(found.records, 1) if r.withdrawn or n == withdrawing}
    known = {**(found.digests or {})} | {SPEC: result.get("spec_sha256"), SIGNAL: result.get("signal_sha256")}
    due = None if found.plan is None else found.plan.file
    for name, content in files.items():
        digest = known.get(name)
        if name in out or digest is None or digest == _sha256(content):
            continue
        hint = "put it back as it was"
        if name in numbers:
            given = next((n for n in files if n.startswith(f"{name[:-4]}_as_given.")), "your own file")
            hint += (
                f", or go on without it: `idesign next {directory} --withdraw {numbers[name]}` "
                f"(what you gave is in {given})"
            )
        elif name == due:
            hint += f": {SIGNAL} in the same directory holds the same samples"
        elif name == SIGNAL:
            hint += f": {due} in the same directory holds the same samples"
        elif name == SPEC:
            hint += (
                ". What a campaign asks stays as it was begun: for another question begin another campaign, "
                "in a directory of its own, and let `idesign identify` make a prior of the records"
            )
        raise _changed(directory / name, hint)


def check_decisions(directory: Path, campaign: Mapping[str, object]) -> None:
    """Raise `DataError` (`campaign-changed`) for a campaign, as plain data, that was edited."""
    kept = campaign.get(_DIGESTS)
    if isinstance(kept, Mapping) and kept.get(RESULT, "") not in ("", _decisions(campaign)):
        raise _changed(directory / RESULT, "put it back from a copy of the directory")


def _changed(path: Path, hint: str) -> DataError:
    message = f"{path} is not what the campaign kept under this name: it was changed since"
    return DataError.because("campaign-changed", message, hint)


def _decisions(campaign: Mapping[str, object]) -> str:
    """Return the digest of all but the digests, whatever the order of the keys."""
    kept = {key: value for key, value in campaign.items() if key != _DIGESTS}
    return _sha256(json.dumps(plain(kept), sort_keys=True).encode())


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
