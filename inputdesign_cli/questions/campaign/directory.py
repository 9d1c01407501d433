"""The verbs of a campaign: begin it, take a record and decide by all of them, withdraw a record."""

from __future__ import annotations

import os
import shlex
import tempfile
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, Diagnostic
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.campaigns import (
    campaign_doubted,
    campaign_refuted,
    estimate_not_used,
    no_estimate_yet,
    planned_otherwise,
    withdrawn_record,
)
from inputdesign_cli.findings.other_systems import contradictions, differences
from inputdesign_cli.findings.places import argument
from inputdesign_cli.identification import information_of_data
from inputdesign_cli.outcome import Outcome
from inputdesign_cli.outcome.campaign import Campaign, PlannedPart, Round, State
from inputdesign_cli.outcome.curves import CampaignCurves, Curves, EstimateCurves, SignalCurves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.run_files import SPEC
from inputdesign_cli.outcome.text_formats import csv_text
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.assess import judge
from inputdesign_cli.questions.assessment.identify import Identification, estimated, mismeasured, sentence_of
from inputdesign_cli.questions.campaign.acceptance import accepted, table_of
from inputdesign_cli.questions.campaign.memory import VERSION, Memory, digests, signals_in
from inputdesign_cli.questions.campaign.plans import Planner, other_minima, standing
from inputdesign_cli.questions.campaign.schedule import Rules, Standing
from inputdesign_cli.records import Preparation, Record, read_data
from inputdesign_cli.regular_file import read_regular
from inputdesign_cli.signal.selection import power_of

# Errors of data that are too few for an estimate; more data will do.
_TOO_LITTLE = {"too-few-samples", "not-exciting", "constant-input"}
# Records are joined if one begins a sample time after the other ends, to within this share of it.
_CONTINUES = 0.1


@dataclass(frozen=True)
class Rounds:
    """Holds all that the rounds of a campaign need.

    Attributes:
        offsets: (r,) the levels that the excitation varies about.
    """

    identification: Identification
    planner: Planner
    rules: Rules
    offsets: Array


@dataclass(frozen=True)
class Judged:
    """Describes how a campaign stands after its records.

    Attributes:
        standing: the model that plans rest on; None while the data are too few.
        assessed: the estimate and its accuracy; None as long as there is no estimate.
        refuted: whether the campaign ends before its time since tests refute the structure.
    """

    state: State
    standing: Standing | None = None
    assessed: Results | None = None
    findings: tuple[Finding, ...] = ()
    refuted: bool = False


def begun(task: Rounds, folder: Path, directory: Path) -> Results:
    """Return the results with the first plan; names of files in the spec are relative to a `folder`."""
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
    return _decided(task, campaign, {}, Outcome(), judged(task, campaign, [], directory))


def advanced(
    task: Rounds,
    memory: Memory,
    given: Path | None = None,
    preparation: Preparation | None = None,
    *,
    unlike: bool = False,
    regardless: bool = False,
) -> Results:
    """Return the results of the next decision, with a new record or with the known ones.

    Args:
        given: the file of the user; `preparation`: what to do to it before.
        unlike: whether to take a record at another scale than its plan, like another plan, or like none.
        regardless: whether to go on, from now on, where the data contradict the model.

    Raises:
        DataError: `campaign-over`; `data-repeated`, `record-copied`, `record-too-long`, `record-other-part`,
            `record-other-scale`, `record-unlike`; what is wrong with a record.
    """
    campaign, files, said = memory.campaign, dict(memory.files), Outcome()
    if given is not None:
        units, levels = task.identification.header.units, task.identification.operating_point
        stated = preparation or Preparation()
        known = replace(stated, operating_point={**levels, **stated.operating_point})
        data = read_data([given], units, known)
        data = replace(data, u=data.u + np.array([levels.get(f"u{j + 1}", 0.0) for j in range(units.inputs)]))
        table = table_of(units, data)
        record, findings = accepted(memory, units.excitation, given.name, data, table, unlike=unlike)
        files[record.file] = csv_text(table).encode()
        files[f"{Path(record.file).stem}_as_given{given.suffix.lower()}"] = read_regular(given)
        campaign = replace(campaign, records=(*campaign.records, record))
        said = Outcome().saying([*data.findings, *findings])
    if regardless:
        campaign = replace(campaign, regardless=True)
    return _again(task, memory, campaign, files, said, given)


def withdrawn(task: Rounds, memory: Memory, numbers: Sequence[int]) -> Results:
    """Return the results of the decision without some records, whose files stay; raise `record-unknown`."""
    records, said = list(memory.campaign.records), Outcome()
    left = [n for n, record in enumerate(records, 1) if not record.withdrawn]
    for number in numbers:
        if number not in left:
            raise DataError.because(
                "record-unknown",
                f"there is no record {number} that could be withdrawn",
                hint=f"the records that count are {', '.join(map(str, left))}"
                if left
                else "no record counts",
            )
        records[number - 1] = replace(records[number - 1], withdrawn=True)
        said = said.saying(withdrawn_record(records[number - 1].file, number))
    campaign = replace(memory.campaign, records=tuple(records))
    return _again(task, memory, campaign, dict(memory.files), said)


def _again(
    task: Rounds,
    memory: Memory,
    campaign: Campaign,
    files: dict[str, bytes],
    said: Outcome,
    given: Path | None = None,
) -> Results:
    """Return the results of a decision by all records that count; `said` holds findings on a new one."""
    counting = [record.file for record in campaign.records if not record.withdrawn]
    # The new record is not in the directory yet; errors about it name the file that was given.
    with tempfile.TemporaryDirectory(prefix="idesign-") as folder:
        for name in counting:
            Path(folder, name).write_bytes(files[name])

        def renamed(text: str) -> str:
            own = text.removeprefix(f"{folder}{os.sep}")
            return own if given is None else own.replace(counting[-1], given.name)

        def named(one: Diagnostic) -> Diagnostic:
            place = None if one.location is None else replace(one.location, file=renamed(one.location.file))
            return replace(one, message=renamed(one.message), location=place)

        try:
            found = judged(task, campaign, [Path(folder, name) for name in counting], memory.directory)
        except DataError as error:
            raise DataError([named(one) for one in error.diagnostics]) from error
    if found.refuted:
        refuted = campaign_refuted(memory.directory, campaign.done, task.rules.end, counting)
        said = said.saying(refuted)
    results = _decided(task, campaign, files, said, found)
    provenance = {**results.outcome.provenance, "made_from": list(memory.made_from)}
    return replace(results, outcome=replace(results.outcome, provenance=provenance))


def _decided(
    task: Rounds, campaign: Campaign, files: dict[str, bytes], said: Outcome, found: Judged
) -> Results:
    """Return the results of a decision, with the next part where the campaign goes on.

    The findings of `said` come first. Raises `IdesignError` if no part can be planned.
    """
    header, outcome = task.identification.header, Outcome(title=task.identification.header.title, timing_s={})
    tables, curves, said = dict[str, Table](), dict[str, Curves](), said.saying(found.findings)
    if (assessed := found.assessed) is not None:
        outcome, tables, curves = assessed.outcome, dict(assessed.tables), dict(assessed.curves)
        files[f"model_{len(campaign.records):02d}.yaml"] = assessed.files["model.yaml"]
    entry = _stood(campaign, found)
    if entry.share == 1.0:
        campaign = replace(campaign, last=entry.estimate)
    if found.state == "running":
        part, table, findings = _next_part(task, campaign, files, found)
        entry, said = replace(entry, plan=part), said.saying(findings)
        files[part.file], tables["signal"] = csv_text(table).encode(), table
        time_of, *signals = table.columns.values()
        named = dict(zip(header.units.excitations, signals, strict=True))
        curves["signal"] = SignalCurves(time_of, named)
        if part.design is not None and campaign.first_cost is None:
            campaign = replace(campaign, first_cost=part.cost)
    campaign = replace(campaign, rounds=(*campaign.rounds, entry), state=found.state)
    campaign = replace(campaign, digests=digests(campaign, files))
    tables["rounds"], progress = history(campaign.rounds, task.rules.end)
    listed = {one.message: one for one in [*(said.findings or ()), *(outcome.findings or ())]}
    outcome = replace(outcome, status=found.state, samples=campaign.done, campaign=campaign)
    outcome = outcome.with_findings(list(listed.values()))
    time_unit, curves = header.units.time_unit, curves | progress
    return Results(outcome, header.resolved_spec, time_unit, tables, curves, files)


def _stood(campaign: Campaign, found: Judged) -> Round:
    """Return the round of a decision, without a plan."""
    entry = Round(
        samples=campaign.done,
        energy=sum((record.energy for record in campaign.records), start=0.0),
        records=tuple(n for n, record in enumerate(campaign.records, 1) if not record.withdrawn),
        state=found.state,
    )
    if (stands := found.standing) is None:
        return entry
    names, deviation = stands.model.names, np.sqrt(np.diag(np.linalg.inv(stands.information)))
    return replace(
        entry,
        estimate=dict(zip(names, stands.model.theta.tolist(), strict=True)),
        standard_deviation=dict(zip(names, deviation.tolist(), strict=True)),
        worst_ratio=stands.ratio,
        share=stands.share,
    )


def _next_part(
    task: Rounds, campaign: Campaign, files: Mapping[str, bytes], found: Judged
) -> tuple[PlannedPart, Table, list[Finding]]:
    """Return the next part to apply, its samples for signal.csv, and findings where it is not as asked."""
    rules, done, number = task.rules, campaign.done, len(campaign.records) + 1
    units, seed = task.identification.header.units, rules.seed_of(number)
    applied = [signals_in(files[record.plan])[: record.samples] for record in campaign.records]
    before = np.concatenate(applied) - task.offsets if applied else None
    plan = task.planner.plan(rules, found.standing, done, seed, campaign.first_cost, before)
    part = PlannedPart(
        file=f"plan_{number:02d}.csv",
        samples=plan.take,
        planned_samples=len(plan.record),
        power=plan.power,
        part_power=power_of(plan.applied),
        cost=plan.cost,
        part_cost=plan.part_cost,
        kind=plan.kind,
        capped=plan.capped,
        seed=seed,
        offset=tuple(task.offsets.tolist()),
        design=None if plan.claim is None else plan.claim(),
        why=plan.why or None,
    )
    findings = planned_otherwise(
        part.file,
        why=plan.why,
        capped=plan.capped,
        share=plan.share,
        beyond=plan.beyond,
        part_cost=plan.part_cost,
        fragile=plan.fragile and plan.kind == "nominal",
        parts=plan.kind == "parting",
    )
    # The times of a part continue the times of the last one.
    time_of = units.sample_time * np.arange(done, done + plan.take, dtype=np.float64)
    signals = zip(units.excitations, (plan.applied + task.offsets).T, strict=True)
    columns = {units.time_header: time_of} | {units.header(name): values for name, values in signals}
    return part, Table(columns), findings


def history(rounds: Sequence[Round], end: int) -> tuple[Table, dict[str, Curves]]:
    """Return rounds.csv, a row for each round with an estimate, and its figures; `end` is the last sample."""
    known = [one for one in rounds if one.estimate is not None]
    rows: dict[str, list[float | None]] = {
        "samples": [one.samples for one in known],
        "energy": [one.energy for one in known],
        "worst_ratio": [one.worst_ratio for one in known],
    }
    names = list(known[0].estimate or {}) if known else []
    for name in names:
        rows[name] = [(one.estimate or {})[name] for one in known]
        rows[f"sd_{name}"] = [(one.standard_deviation or {})[name] for one in known]
    columns = {name: np.array(values, dtype=float) for name, values in rows.items()}
    if not known:
        return Table(columns), {}
    samples, spreads = columns["samples"], {name: columns[f"sd_{name}"] for name in names}
    return Table(columns), {
        "campaign": CampaignCurves(samples, columns["worst_ratio"], columns["energy"], end),
        "estimates": EstimateCurves(samples, {name: columns[name] for name in names}, spreads),
    }


def judged(task: Rounds, campaign: Campaign, paths: Sequence[Path], directory: Path) -> Judged:
    """Return how a campaign stands by the joint estimate of the records that count, and whether it ends.

    Args:
        paths: where the records are now; the `directory` keeps them under the same names.

    Raises:
        DataError: a record cannot be used.
    """
    rules, identification, done = task.rules, task.identification, campaign.done
    units, nominal, last = identification.header.units, identification.nominal, campaign.last
    now, started = Judged("missed" if done >= rules.end else "running"), time.perf_counter()
    if not paths:
        return now
    try:
        taken = Preparation(operating_point=identification.operating_point)
        data = continued(read_data(paths, units, taken), units.sample_time)
        data = replace(data, paths=tuple(str(directory / path.name) for path in paths))
        found = estimated(identification, data, paths[0], taken)
    except DataError as error:
        if not {one.code for one in error.diagnostics} <= _TOO_LITTLE:
            raise
        return replace(now, findings=tuple(no_estimate_yet(sentence_of(error))))
    estimate = found.estimate

    def informed(model: Model) -> Array:
        if model is found.model:
            return estimate.information
        free, earlier = estimate.start.free, identification.earlier
        return information_of_data(
            model, data.u, data.y, units.step, lengths=data.lengths, free=free, earlier=earlier
        )

    assessment = judge(identification, found, started, first=last is None)
    sound = nominal if last is None else nominal.at(np.array(list(last.values()), dtype=float))
    stands = standing(task.planner, found.model, informed, sound)
    findings = estimate_not_used(None if stands is None else stands.share, found.unasked)
    verdict, suffices = assessment.verdict, stands is not None and stands.met
    if stands is not None:
        others = other_minima(found.model, estimate, found.question)
        stands = replace(stands, open=verdict == "undecided" or bool(others), others=others)
    if verdict == "met" and not suffices:
        verdict = "missed"
    files, looks = [name for name, _ in data.files], rules.schedule.looks
    contradicted = bool(differences(estimate, files, looks) or contradictions(estimate, looks))
    # Faulty measurements can be mended, and a user may go on `regardless` while the data do not suffice.
    ends = contradicted or (rules.refuted(estimate) and not mismeasured(identification, found))
    ends = ends and rules.stops and (suffices or not campaign.regardless)
    state = rules.state(done, verdict, refuted=ends)
    if state == "running" and verdict == "undecided":
        findings += campaign_doubted()
    refuted = ends and done < rules.end and not (contradicted or campaign.regardless)
    results = _naming(assessment.results, directory / SPEC)
    return Judged(state, stands, results, tuple(findings), refuted)


def _naming(results: Results, spec: Path) -> Results:
    """Return an assessment whose next command names the spec."""
    judged = results.outcome.assessment
    if judged is None or judged.next is None:
        return results
    command = judged.next.replace(" SPEC ", f" {shlex.quote(argument(str(spec)))} ", 1)
    return replace(results, outcome=replace(results.outcome, assessment=replace(judged, next=command)))


def continued(data: Record, step: float) -> Record:
    """Join files whose times continue the times of the file before, after one `step`, into one record."""
    ends = np.cumsum(data.lengths)
    files = set(np.cumsum([samples for _, samples in data.files]).tolist())
    lengths = [data.lengths[0]]
    for end, length in zip(ends[:-1], data.lengths[1:], strict=True):
        gap = data.time[end] - data.time[end - 1]
        if int(end) in files and abs(gap - step) <= _CONTINUES * step:
            lengths[-1] += length
        else:
            lengths.append(length)
    return replace(data, lengths=tuple(lengths))
