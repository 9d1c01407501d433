"""The verbs of a campaign: begin it, take a record and decide, withdraw a record."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, Diagnostic
from inputdesign_cli.findings.campaigns import campaign_refuted, planned_otherwise, withdrawn_record
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.outcome.campaign import Campaign, PlannedPart, Round
from inputdesign_cli.outcome.curves import CampaignCurves, Curves, EstimateCurves, SignalCurves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.text_formats import csv_columns, csv_text
from inputdesign_cli.questions.campaign.acceptance import accepted
from inputdesign_cli.questions.campaign.memory import VERSION, Memory, digests
from inputdesign_cli.questions.campaign.rounds import Decision, Part, Past
from inputdesign_cli.questions.campaign.schedule import power_of
from inputdesign_cli.regular_file import read_regular

Decide = Callable[[Past], Decision]


def begun(decide: Decide, folder: Path, directory: Path) -> Results:
    """Return the results with the first plan; names of files in the spec are relative to a `folder`."""
    decision = decide(Past())
    task = decision.task
    campaign = Campaign(
        version=VERSION,
        time_unit=task.identification.header.units.time_unit,
        folder=os.path.relpath(os.path.realpath(folder), os.path.realpath(directory)),
        state="running",
        samples=task.rules.schedule.samples,
        max_samples=task.rules.end,
        records=(),
        rounds=(),
        digests={},
    )
    return _decided(decision, campaign, {}, Outcome())


def advanced(
    decide: Decide,
    memory: Memory,
    given: Path | None,
    part: Part | None,
    *,
    unlike: bool = False,
    regardless: bool = False,
) -> Results:
    """Return the results of the next decision, with a new record or with those at hand.

    Args:
        given: the file of the user; `part`: its content.
        unlike: whether to take a record at another scale than its plan, like another plan, or like none.
        regardless: whether to go on, from now on, where tests refute the structure.

    Raises:
        DataError: `campaign-over`; `data-repeated`, `record-copied`, `record-too-long`, `record-other-part`,
            `record-other-scale`, `record-unlike`; what is wrong with a record.
    """
    campaign, files, said = memory.campaign, dict(memory.files), Outcome()
    if given is not None and part is not None:
        name, text, due = f"record_{len(campaign.records) + 1:02d}", csv_text(part.table), campaign.plan
        if campaign.state != "running" or due is None:
            raise DataError.because(
                "campaign-over",
                f"the campaign in {memory.directory} has ended: {campaign.state}",
                hint="withdraw a record with --withdraw N to go on without it, or begin another campaign; "
                "where tests refute the structure, --regardless without a record goes on as it is",
            )
        for known in campaign.records:
            if files[known.file] == text.encode():
                stays = " (this one stays withdrawn)" if known.withdrawn else ""
                raise DataError.because(
                    "data-repeated",
                    f"{given.name} holds the samples of {known.file}, given as {known.given}",
                    hint=f"give each record once{stays}",
                )
        record, findings = accepted(memory, due, f"{name}.csv", given, part, unlike=unlike)
        files[f"{name}.csv"] = text.encode()
        files[f"{name}_as_given{given.suffix.lower()}"] = read_regular(given)
        campaign = replace(campaign, records=(*campaign.records, record))
        said = Outcome(notes=part.notes).saying(findings)
    if regardless:
        campaign = replace(campaign, regardless=True)
    return _again(decide, memory, campaign, files, said, given)


def withdrawn(decide: Decide, memory: Memory, number: int) -> Results:
    """Return the results of the decision without a record, whose file stays; raise `record-unknown`."""
    records = list(memory.campaign.records)
    if not 1 <= number <= len(records) or records[number - 1].withdrawn:
        left = [str(n) for n, record in enumerate(records, 1) if not record.withdrawn]
        raise DataError.because(
            "record-unknown",
            f"there is no record {number} that could be withdrawn",
            hint=f"the records that count are {', '.join(left)}" if left else "no record counts",
        )
    records[number - 1] = replace(records[number - 1], withdrawn=True)
    campaign = replace(memory.campaign, records=tuple(records))
    said = Outcome().saying(withdrawn_record(records[number - 1].file, number))
    return _again(decide, memory, campaign, dict(memory.files), said)


def _again(
    decide: Decide,
    memory: Memory,
    campaign: Campaign,
    files: dict[str, bytes],
    said: Outcome,
    given: Path | None = None,
) -> Results:
    """Decide on the next part from all records that count; `said` is what there is to say of a new one."""
    counting = [record.file for record in campaign.records if not record.withdrawn]
    applied = [
        np.stack(list(csv_columns(files[record.plan]).values())[1:], axis=1)[: record.samples]
        for record in campaign.records
    ]
    past = Past(
        done=campaign.done,
        applied=np.concatenate(applied) if applied else None,
        last=None if campaign.last is None else np.array(list(campaign.last.values()), dtype=float),
        first_cost=campaign.first_cost,
        number=len(campaign.rounds) + 1,
        regardless=bool(campaign.regardless),
    )
    # The new record is not in the directory yet; errors about it name the file that was given.
    with tempfile.TemporaryDirectory(prefix="idesign-") as folder:
        paths = [Path(folder) / name for name in counting]
        for path in paths:
            path.write_bytes(files[path.name])

        def renamed(text: str) -> str:
            own = text.removeprefix(f"{folder}{os.sep}")
            return own if given is None else own.replace(counting[-1], given.name)

        def named(one: Diagnostic) -> Diagnostic:
            place = None if one.location is None else replace(one.location, file=renamed(one.location.file))
            return replace(one, message=renamed(one.message), location=place)

        try:
            decision = decide(replace(past, records=paths))
        except DataError as error:
            raise DataError([named(one) for one in error.diagnostics]) from error
    if decision.refuted:
        every, end = len(counting) == len(campaign.records), decision.task.rules.end
        said = said.saying(campaign_refuted(memory.directory, campaign.done, end, counting, every=every))
    results = _decided(decision, campaign, files, said)
    provenance = {**results.outcome.provenance, "made_from": list(memory.made_from)}
    return replace(results, outcome=replace(results.outcome, provenance=provenance))


def _decided(decision: Decision, campaign: Campaign, files: dict[str, bytes], said: Outcome) -> Results:
    """Return the results of a decision; what was `said` before comes first."""
    number, header, rules = len(campaign.records), decision.task.identification.header, decision.task.rules
    tables: dict[str, Table] = {}
    curves: dict[str, Curves] = {}
    outcome = Outcome(title=header.title, timing_s={})
    if (assessed := decision.assessed) is not None:
        outcome, tables, curves = assessed.outcome, dict(assessed.tables), dict(assessed.curves)
        files[f"model_{number:02d}.yaml"] = assessed.files["model.yaml"]
    said = said.saying(decision.findings)
    plan, file = decision.plan, f"plan_{number + 1:02d}.csv"
    entry = _entry(decision, campaign, file)
    if entry.share == 1.0:
        campaign = replace(campaign, last=entry.estimate)
    if plan is not None and decision.part is not None:
        files[file] = csv_text(decision.part).encode()
        fragile = rules.robust_last and rules.schedule.last(campaign.done) and plan.kind == "nominal"
        said = said.saying(
            planned_otherwise(
                file,
                why=plan.why,
                capped=plan.capped,
                share=plan.share,
                beyond=plan.beyond,
                part_cost=plan.part_cost,
                fragile=fragile,
            )
        )
        if plan.designed and campaign.first_cost is None:
            campaign = replace(campaign, first_cost=plan.cost)
        time_of, *signals = decision.part.columns.values()
        names = [name.split()[0] for name in list(decision.part.columns)[1:]]
        tables["signal"] = decision.part
        curves["signal"] = SignalCurves(time_of, dict(zip(names, signals, strict=True)))
    campaign = replace(campaign, rounds=(*campaign.rounds, entry), state=decision.state)
    campaign = replace(campaign, digests=digests(campaign, files))
    tables["rounds"], progress = history(campaign.rounds, rules.end)
    notes = tuple(dict.fromkeys([*(said.notes or ()), *(outcome.notes or ())]))
    findings = (*(said.findings or ()), *(outcome.findings or ()))
    outcome = replace(
        outcome,
        status=decision.state,
        samples=campaign.done,
        campaign=campaign,
        notes=notes or None,
        findings=findings or None,
    )
    time_unit, curves = header.units.time_unit, curves | progress
    return Results(outcome, header.resolved_spec, time_unit, tables, curves, files)


def _entry(decision: Decision, campaign: Campaign, file: str) -> Round:
    """Return the round of a decision, whose plan, if there is one, is kept in a `file`."""
    stands, plan = decision.standing, decision.plan
    entry = Round(
        samples=campaign.done,
        energy=sum((record.energy for record in campaign.records), start=0.0),
        records=tuple(n for n, record in enumerate(campaign.records, 1) if not record.withdrawn),
        state=decision.state,
    )
    if stands is not None:
        names, deviation = stands.model.names, np.sqrt(np.diag(np.linalg.inv(stands.information)))
        entry = replace(
            entry,
            estimate=dict(zip(names, stands.model.theta.tolist(), strict=True)),
            standard_deviation=dict(zip(names, deviation.tolist(), strict=True)),
            worst_ratio=stands.ratio,
            share=stands.share,
        )
    if plan is None:
        return entry
    planned = PlannedPart(
        file=file,
        samples=plan.take,
        planned_samples=len(plan.record),
        power=plan.power,
        part_power=power_of(plan.applied),
        cost=plan.cost,
        part_cost=plan.part_cost,
        kind=plan.kind,
        capped=plan.capped,
        seed=decision.seed,
        offset=tuple(decision.task.offsets.tolist()),
        design=None if plan.claim is None else plan.claim(),
        why=plan.why or None,
    )
    return replace(entry, plan=planned)


def history(rounds: Sequence[Round], end: int) -> tuple[Table, dict[str, Curves]]:
    """Return rounds.csv, a row for each round with an estimate, and its figures; `end` is the last sample."""
    known = [one for one in rounds if one.estimate is not None]

    def column(values: Iterable[float | None]) -> Array:
        return np.array(list(values), dtype=float)

    samples, energy = column(one.samples for one in known), column(one.energy for one in known)
    ratio = column(one.worst_ratio for one in known)
    columns = {"samples": samples, "energy": energy, "worst_ratio": ratio}
    if not known:
        return Table(columns), {}
    names = list(known[0].estimate or {})
    estimates = {name: column((one.estimate or {})[name] for one in known) for name in names}
    spreads = {name: column((one.standard_deviation or {})[name] for one in known) for name in names}
    for name in names:
        columns |= {name: estimates[name], f"sd_{name}": spreads[name]}
    return Table(columns), {
        "campaign": CampaignCurves(samples, ratio, energy, end),
        "estimates": EstimateCurves(samples, estimates, spreads),
    }
