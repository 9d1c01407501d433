"""The verbs of a campaign: begin it, take a record and decide, withdraw a record."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, Diagnostic
from inputdesign_cli.outcome.curves import Curves, SignalCurves
from inputdesign_cli.outcome.results import Json, Results, Table, typed
from inputdesign_cli.outcome.text_formats import csv_columns, csv_text
from inputdesign_cli.questions.campaign.acceptance import accepted
from inputdesign_cli.questions.campaign.memory import VERSION, Memory
from inputdesign_cli.questions.campaign.pictures import history
from inputdesign_cli.questions.campaign.rounds import Decision, Part, Past
from inputdesign_cli.questions.campaign.unchanged import digests
from inputdesign_cli.regular_file import read_regular

Decide = Callable[[Past], Decision]


def begun(decide: Decide, folder: Path, directory: Path) -> Results:
    """The first plan.

    Args:
        folder: what names of files in the spec start from.
        directory: where the campaign will be.
    """
    decision = decide(Past((), 0, None, None, None, 1))
    campaign: dict[str, Json] = {
        "version": VERSION,
        "time_unit": decision.header.units.time_unit,
        "folder": os.path.relpath(os.path.realpath(folder), os.path.realpath(directory)),
        "samples": decision.rules.schedule.samples,
        "max_samples": decision.rules.end,
        "records": [],
        "rounds": [],
    }
    return _decided(decision, campaign, {})


def advanced(
    decide: Decide,
    memory: Memory,
    given: Path | None,
    part: Part | None,
    *,
    unlike: bool = False,
    regardless: bool = False,
) -> Results:
    """The next decision, with a new record or with those at hand.

    Args:
        given: the file of the user, and what was read of it.
        unlike: whether to take a record at another scale than its plan, like another plan, or like none.
        regardless: whether to go on, from now on, where tests refute the structure.

    Raises:
        DataError: `campaign-over`; `data-repeated`, `record-copied`, `record-too-long`, `record-other-part`,
            `record-other-scale`, `record-unlike`; what is wrong with a record.
    """
    records, files, notes = memory.records, dict(memory.files), list[str]()
    if given is not None and part is not None:
        name, text = f"record_{len(records) + 1:02d}", csv_text(part.table)
        _check_going_on(memory)
        _check_new(records, files, given, text)
        entry, of_the_plan = accepted(memory, given, part, unlike=unlike)
        files[f"{name}.csv"] = text.encode()
        files[f"{name}_as_given{given.suffix.lower()}"] = read_regular(given)
        records.append({"file": f"{name}.csv", "given": given.name, **entry})
        notes = [*part.notes, *of_the_plan]
    decided = _again(decide, memory, records, files, given=given, regardless=regardless)
    if not notes:
        return decided
    told = dict.fromkeys([*notes, *decided.result.get("notes", [])])
    return replace(decided, outcome=typed({**decided.result, "notes": list(told)}))


def withdrawn(decide: Decide, memory: Memory, number: int) -> Results:
    """The decision without a record, whose file stays.

    Raises:
        DataError: `record-unknown`.
    """
    records = memory.records
    if not 1 <= number <= len(records) or records[number - 1]["withdrawn"]:
        left = [str(n + 1) for n, record in enumerate(records) if not record["withdrawn"]]
        raise DataError.because(
            "record-unknown",
            f"there is no record {number} that could be withdrawn",
            hint=f"those that count are {', '.join(left)}" if left else "none counts",
        )
    records[number - 1]["withdrawn"] = True
    return _again(decide, memory, records, dict(memory.files))


def _again(
    decide: Decide,
    memory: Memory,
    records: list[dict[str, Json]],
    files: dict[str, bytes],
    *,
    given: Path | None = None,
    regardless: bool = False,
) -> Results:
    counting = [str(record["file"]) for record in records if not record["withdrawn"]]
    campaign = {**memory.campaign, "records": records}
    campaign |= {"regardless": True} if regardless else {}
    last = campaign.get("last")
    with _on_disc(files, counting, given) as paths:
        past = Past(
            records=paths,
            done=sum(int(record["samples"]) for record in records),
            applied=_applied(files, records),
            last=None if last is None else np.array(list(last.values()), dtype=float),
            first_cost=campaign.get("first_cost"),
            number=len(campaign["rounds"]) + 1,
            regardless=bool(campaign.get("regardless", False)),
        )
        decision = decide(past)
    if decision.refuted:
        told = _refuted(memory.directory, records, past.done, decision.rules.end)
        decision = replace(decision, notes=(told, *decision.notes))
    results = _decided(decision, campaign, files)
    return replace(results, outcome=typed({**results.result, "made_from": list(memory.made_from)}))


def _refuted(directory: Path, records: Sequence[Mapping[str, Json]], done: int, end: int) -> str:
    """That a campaign ends before its time, and what to do."""
    every = all(not record["withdrawn"] for record in records)
    names = ["record_??.csv"] if every else [r["file"] for r in records if not r["withdrawn"]]
    listed = " ".join(str(directory / name) for name in names)
    return (
        f"the campaign ends after {done} of at most {end} samples: tests of the residuals refute the "
        "structure of the model (see the other notes), and what it lacks it would lack however long it went "
        f"on. Look for another one in what has been recorded, `idesign explore {listed}`, and begin another "
        f"campaign with it. To go on as it is: `idesign next {directory} --regardless`"
    )


def _applied(files: Mapping[str, bytes], records: Sequence[Mapping[str, Json]]) -> Array | None:
    """(n, r): what was applied, as it was planned."""
    parts = [
        np.stack(list(csv_columns(files[record["plan"]]).values())[1:], axis=1)[: int(record["samples"])]
        for record in records
    ]
    return np.concatenate(parts) if parts else None


@contextmanager
def _on_disc(files: Mapping[str, bytes], names: Sequence[str], given: Path | None) -> Iterator[list[Path]]:
    """The records that count as files, the new one as well, which is not in the directory yet.

    What is wrong with the new one is said of the file that was `given`.
    """
    with tempfile.TemporaryDirectory(prefix="idesign-") as folder:
        paths = [Path(folder) / name for name in names]
        for path in paths:
            path.write_bytes(files[path.name])
        try:
            yield paths
        except DataError as error:
            known = {} if given is None else {names[-1]: given.name}
            told = [_of_the_campaign(one, Path(folder), known) for one in error.diagnostics]
            raise DataError(told) from error


def _of_the_campaign(diagnostic: Diagnostic, folder: Path, known: Mapping[str, str]) -> Diagnostic:
    """A diagnostic that names a record by itself, or as it is known to the user, not by where it was read."""
    message = diagnostic.message
    for name, user in known.items():
        message = message.replace(name, user)
    place = diagnostic.location
    if place is not None and Path(place.file).is_relative_to(folder):
        name = Path(place.file).name
        place = replace(place, file=known.get(name, name))
    return replace(diagnostic, message=message, location=place)


def _check_going_on(memory: Memory) -> None:
    """Raise `DataError` (`campaign-over`) where no part is due."""
    if memory.state != "running" or memory.plan is None:
        raise DataError.because(
            "campaign-over",
            f"the campaign in {memory.directory} has ended: {memory.state}",
            hint="withdraw a record with --withdraw N to go on without it, or begin another campaign; where "
            "tests refute the structure, --regardless without a record goes on as it is",
        )


def _check_new(
    records: Sequence[Mapping[str, Json]], files: Mapping[str, bytes], given: Path, text: str
) -> None:
    """Raise `DataError` (`data-repeated`) where the same samples have been given before."""
    for record in records:
        if files[record["file"]] == text.encode():
            raise DataError.because(
                "data-repeated",
                f"{given.name} holds the samples of {record['file']}, given as {record['given']}",
                hint="give each record once"
                + (": it was withdrawn, and stays so" if record["withdrawn"] else ""),
            )


def _decided(decision: Decision, campaign: Mapping[str, Json], files: dict[str, bytes]) -> Results:
    """The directory after a decision."""
    number = len(campaign["records"]) + 1
    plan, stands = decision.plan, decision.standing
    done = sum(int(record["samples"]) for record in campaign["records"])
    energy = sum(float(record["energy"]) for record in campaign["records"])
    entry: dict[str, Json] = {
        "samples": done,
        "energy": energy,
        "records": [n + 1 for n, record in enumerate(campaign["records"]) if not record["withdrawn"]],
        "state": decision.state,
    }
    assessed = decision.assessed
    result: dict[str, Json] = {"format": 1, "title": decision.header.title, "timing_s": {}}
    tables: dict[str, Table] = {}
    curves: dict[str, Curves] = {}
    if assessed is not None:
        result |= assessed.result
        tables, curves = dict(assessed.tables), dict(assessed.curves)
        files[f"model_{number - 1:02d}.yaml"] = assessed.files["model.yaml"]
    more = dict(campaign)
    if stands is not None:
        values = dict(zip(stands.model.names, stands.model.theta.tolist(), strict=True))
        deviation = np.sqrt(np.diag(np.linalg.inv(stands.information)))
        entry |= {
            "estimate": values,
            "standard_deviation": dict(zip(stands.model.names, deviation.tolist(), strict=True)),
            "worst_ratio": stands.ratio,
            "share": stands.share,
        }
        if stands.share == 1.0:
            more["last"] = values
    if plan is not None and decision.part is not None:
        files[f"plan_{number:02d}.csv"] = csv_text(decision.part).encode()
        moved = np.stack(list(decision.part.columns.values())[1:], axis=1) - decision.offsets
        entry["plan"] = {
            "file": f"plan_{number:02d}.csv",
            "samples": plan.take,
            "planned_samples": len(plan.record),
            "power": plan.power,
            "part_power": float(np.sum(np.mean(moved**2, axis=0))),
            "cost": plan.cost,
            "part_cost": plan.part_cost,
            "kind": plan.kind,
            "capped": plan.capped,
            "seed": decision.rules.seed_of(len(campaign["rounds"]) + 1),
            "offset": decision.offsets.tolist(),
            **({} if plan.claim is None else {"design": plan.claim()}),
            **({"why": plan.why} if plan.why else {}),
        }
        if plan.designed:
            more.setdefault("first_cost", plan.cost)
        time, *signals = decision.part.columns.values()
        names = list(decision.part.columns)[1:]
        tables["signal"] = decision.part
        curves["signal"] = SignalCurves(
            time, {name.split()[0]: x for name, x in zip(names, signals, strict=True)}
        )
    more |= {"rounds": [*campaign["rounds"], entry], "state": decision.state}
    # Those of records stay: one that is withdrawn may not be what it was. Plans may be made anew.
    kept = {name: digest for name, digest in campaign.get("digests", {}).items() if name.startswith("record")}
    more["digests"] = digests(more, files) | kept
    tables["rounds"], progress = history(more["rounds"], decision.rules.end)
    curves |= progress
    notes = [*decision.notes, *result.get("notes", [])]
    result |= {"status": decision.state, "samples": done, "campaign": more}
    result |= {"notes": notes} if notes else {}
    return Results(
        typed(result), decision.header.resolved_spec, decision.header.units.time_unit, tables, curves, files
    )
