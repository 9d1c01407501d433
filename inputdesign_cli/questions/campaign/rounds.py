"""A round of a real campaign: decide from all records whether to go on, and what to apply next."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.campaigns import campaign_doubted, estimate_not_used, no_estimate_yet
from inputdesign_cli.findings.other_systems import contradictions, differences
from inputdesign_cli.identification import information_of_data
from inputdesign_cli.outcome.campaign import State
from inputdesign_cli.outcome.estimate import Verdict
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.assess import judge
from inputdesign_cli.questions.assessment.identify import Identification, estimated, mismeasured, told
from inputdesign_cli.questions.campaign.plans import Planner, standing
from inputdesign_cli.questions.campaign.schedule import Planned, Rules, Standing
from inputdesign_cli.records import Preparation, Record, read_data

_ENDED: dict[Verdict, State] = {"met": "stopped", "missed": "missed", "undecided": "undecided"}
# Data that say nothing yet; more of them will.
_TOO_LITTLE = {"too-few-samples", "not-exciting", "constant-input"}
# Records whose times differ by one sample time, give or take this share of it, are one.
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
class Past:
    """Describes the campaign so far.

    Attributes:
        records: the files that count, each with u and y of a part.
        done: samples that have been applied, in records that count or not.
        applied: (n, r) of these samples, as they were planned; None before any.
        last: (k,) the estimate that was built on before; None before any.
        first_cost: of a sample of the first plan, None before it.
        number: of the round.
        regardless: whether to go on where tests refute the structure.
    """

    records: Sequence[Path] = ()
    done: int = 0
    applied: Array | None = None
    last: Array | None = None
    first_cost: float | None = None
    number: int = 1
    regardless: bool = False


@dataclass(frozen=True)
class Decision:
    """Holds the outcome of a round.

    Attributes:
        seed: of the record of the next part.
        standing: the model that is built on; None while the data say too little.
        assessed: the estimate and its accuracy; None as long as there is no estimate.
        refuted: whether the campaign ends before its time since tests refute the structure.
        plan: the next part; None at the end. `part`: its samples and their times for signal.csv.
    """

    task: Rounds
    seed: int
    state: State
    standing: Standing | None = None
    assessed: Results | None = None
    findings: tuple[Finding, ...] = ()
    refuted: bool = False
    plan: Planned | None = None
    part: Table | None = None


@dataclass(frozen=True)
class Part:
    """Holds a record of a part.

    Attributes:
        table: times, inputs, outputs and, in a loop, the reference.
        excitation: (n, r), u or the reference; None if the file has no column of it.
        rows: (n,), the numbers of the samples from the first one on; samples without values are left out.
        kind: of the excitation: "u", or "r", the reference of a loop.
    """

    table: Table
    excitation: Array | None
    rows: NDArray[np.int64]
    kind: str
    notes: tuple[str, ...]

    @property
    def samples(self) -> int:
        """Return the number of samples that were applied, up to the last known one."""
        return int(self.rows[-1]) + 1


def decide(task: Rounds, past: Past) -> Decision:
    """Estimate all records jointly, judge, and plan the next part; raise `IdesignError` if none can be."""
    rules = task.rules
    decision = Decision(task, rules.seed_of(past.number), "missed" if past.done >= rules.end else "running")
    if past.records:
        decision = _judged(task, past, decision)
    if decision.state != "running":
        return decision
    before = None if past.applied is None else past.applied - task.offsets
    plan = task.planner.plan(rules, decision.standing, past.done, decision.seed, past.first_cost, before)
    # The times of a part continue the times of the last one.
    units, applied = task.identification.header.units, plan.applied + task.offsets
    time_of = units.sample_time * np.arange(past.done, past.done + len(applied), dtype=np.float64)
    columns = {units.header(name): values for name, values in zip(units.excitations, applied.T, strict=True)}
    return replace(decision, plan=plan, part=Table({units.time_header: time_of, **columns}))


def _judged(task: Rounds, past: Past, decision: Decision) -> Decision:
    """Return the decision with the joint estimate of all records, and with its end if that decides it."""
    rules, identification = task.rules, task.identification
    units, nominal = identification.header.units, identification.nominal
    started = time.perf_counter()
    try:
        taken = Preparation(operating_point=identification.operating_point)
        data = continued(read_data(past.records, units, taken), units.sample_time)
        found = estimated(identification, data, past.records[0], taken)
    except DataError as error:
        if not {one.code for one in error.diagnostics} <= _TOO_LITTLE:
            raise
        return replace(decision, findings=tuple(no_estimate_yet(told(error))))
    estimate, earlier = found.estimate, identification.earlier

    def informed(model: Model) -> Array:
        if model is found.model:
            return estimate.information
        return information_of_data(
            model, data.u, data.y, units.step, lengths=data.lengths, free=estimate.start.free, earlier=earlier
        )

    assessment = judge(identification, found, started, first=past.last is None)
    last = nominal if past.last is None else nominal.at(past.last)
    stands, looks = standing(task.planner, found.model, informed, last), rules.schedule.looks
    findings = estimate_not_used(None if stands is None else stands.share, found.unasked)
    decision = replace(decision, standing=stands, assessed=assessment.results)
    files = [name for name, _ in data.files]
    if differences(estimate, files, looks) or contradictions(estimate, looks):
        decision = replace(decision, state="undecided")
    elif rules.over(past.done, met=stands is not None and stands.met):
        decision = replace(decision, state=_ENDED[assessment.verdict])
    # Faulty measurements can be mended, and users may go on.
    elif not past.regardless and rules.refuted(estimate) and not mismeasured(identification, found):
        decision = replace(decision, state="undecided", refuted=True)
    elif assessment.verdict == "undecided":
        findings += campaign_doubted()
    return replace(decision, findings=tuple(findings))


def read_part(task: Rounds, path: Path, preparation: Preparation) -> Part:
    """Read a record of the user; raise `DataError` if it cannot be used."""
    units, levels = task.identification.header.units, task.identification.operating_point
    known = replace(preparation, operating_point={**levels, **preparation.operating_point})
    data = read_data([path], units, known)
    inputs = data.u + np.array([levels.get(f"u{j + 1}", 0.0) for j in range(units.inputs)])
    columns = {units.time_header: data.time}
    columns |= {f"u{j + 1}": values for j, values in enumerate(inputs.T)}
    columns |= {f"y{i + 1}": values for i, values in enumerate(data.y.T)}
    if data.r is not None:
        columns |= {f"r{j + 1}": values for j, values in enumerate(data.r.T)}
    applied, steps = data.r if units.closed_loop else inputs, np.diff(data.time)
    rows = np.rint((data.time - data.time[0]) / (np.median(steps) if steps.size else 1.0)).astype(np.int64)
    return Part(Table(columns), applied, rows, units.excitation, data.notes)


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
