"""A round of a real campaign: all records so far in, a decision out: what is applied next, or why no more."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.findings.other_systems import contradictions, differences
from inputdesign_cli.identification import information_of_data
from inputdesign_cli.outcome.assessment import Verdict
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.assess import judge
from inputdesign_cli.questions.assessment.identify import (
    Identification,
    Identified,
    estimated,
    mismeasured,
    told,
)
from inputdesign_cli.questions.campaign.schedule import Planned, Planner, Rules, Standing, standing
from inputdesign_cli.tasks.build.data import Data, read_data
from inputdesign_cli.tasks.build.preparation import Preparation

State = Literal["running", "stopped", "missed", "undecided"]
_SPEAK_AGAINST = (
    "what has been recorded speaks against the model (see the other notes): before more is applied, see "
    "whether its structure should change; as it stands the campaign would end undecided"
)
_ENDED: dict[Verdict, State] = {"met": "stopped", "missed": "missed", "undecided": "undecided"}
# Data that say nothing yet; more of them will.
_TOO_LITTLE = {"too-few-samples", "not-exciting", "constant-input"}
# Records whose times differ by one sample time, give or take this share of it, are one.
_CONTINUES = 0.1
# A part of less than this share of its power is told.
_NEARLY = 0.9


@dataclass(frozen=True)
class Rounds:
    """What the rounds of one campaign share.

    Attributes:
        offsets: (r,) what the excitation varies about.
    """

    identification: Identification
    planner: Planner
    rules: Rules
    offsets: Array


@dataclass(frozen=True)
class Past:
    """What has been done.

    Attributes:
        records: the files that count, each with u and y of a part.
        done: samples that have been applied, in records that count or not.
        applied: (n, r) of these samples, as they were planned; None before any.
        last: (k,) the estimate that was built on before; None before any.
        first_cost: of a sample of the first plan, None before it.
        number: of the round.
        regardless: whether to go on where tests refute the structure.
    """

    records: Sequence[Path]
    done: int
    applied: Array | None
    last: Array | None
    first_cost: float | None
    number: int
    regardless: bool = False


@dataclass(frozen=True)
class Decision:
    """What a round comes to.

    Attributes:
        standing: what is built on; None while the data say too little.
        assessed: the estimate and what it says of what is asked; None as long as there is none.
        plan: the next part; None at the end.
        part: its samples as they are applied, with their times.
        offsets: (r,) what they vary about.
        refuted: whether it ends before its time since tests refute the structure.
    """

    header: Header
    rules: Rules
    state: State
    standing: Standing | None
    assessed: Results | None
    plan: Planned | None
    part: Table | None
    offsets: Array
    notes: tuple[str, ...]
    refuted: bool = False


@dataclass(frozen=True)
class Part:
    """What was recorded of a part.

    Attributes:
        table: times, inputs, outputs and, in a loop, the reference as they are kept.
        excitation: (n, r), what was applied; None where the file does not tell it.
        rows: (n,), the numbers of the samples from the first one on; those without values are left out.
        of_loop: whether the excitation is the reference of a loop.
    """

    table: Table
    excitation: Array | None
    rows: NDArray[np.int64]
    of_loop: bool
    notes: tuple[str, ...]

    @property
    def samples(self) -> int:
        """How many were applied, to the last that is known."""
        return int(self.rows[-1]) + 1


def decide(task: Rounds, past: Past) -> Decision:
    """Estimate all records jointly, judge, and plan what is left.

    Raises:
        DataError: a record cannot be used.
        IdesignError: nothing can be planned.
    """
    header = task.identification.header
    notes: list[str] = []
    assessed, stands, state, refuted = None, None, _running(task, past), False
    if past.records:
        started = time.perf_counter()
        try:
            found = _found(task, past.records)
        except DataError as error:
            if not {one.code for one in error.diagnostics} <= _TOO_LITTLE:
                raise
            notes.append(f"no estimate yet: {told(error)}")
        else:
            assessment = judge(task.identification, found, started, first=past.last is None)
            assessed, stands = assessment.results, _standing(task, found, past)
            notes += _shrunk(found, stands)
            looks = task.rules.schedule.looks
            other = [
                *differences(found.estimate, [name for name, _ in found.data.files], looks),
                *contradictions(found.estimate, looks),
            ]
            met = stands is not None and stands.met
            if other:
                state = "undecided"
            elif task.rules.over(past.done, met=met):
                state = _ENDED[assessment.verdict]
            elif _refuted(task, found, past):
                state, refuted = "undecided", True
            elif assessment.verdict == "undecided":
                notes.append(_SPEAK_AGAINST)
    if state != "running":
        return Decision(
            header, task.rules, state, stands, assessed, None, None, task.offsets, tuple(notes), refuted
        )
    before = None if past.applied is None else past.applied - task.offsets
    seed = task.rules.seed_of(past.number)
    plan = task.planner.plan(task.rules, stands, past.done, seed, past.first_cost, before)
    part = _part(task, plan, past.done)
    more = _of_the_plan(plan, task, past)
    return Decision(header, task.rules, state, stands, assessed, plan, part, task.offsets, (*notes, *more))


def _refuted(task: Rounds, found: Identified, past: Past) -> bool:
    """Whether tests refute the structure, and nobody wants to go on; faults of measurement can be mended."""
    asked = not past.regardless and task.rules.refuted(found.estimate)
    return asked and not mismeasured(task.identification, found)


def read_part(task: Rounds, path: Path, preparation: Preparation) -> Part:
    """A record of the user's, as it is kept.

    Raises:
        DataError: the file cannot be used.
    """
    units, levels = task.identification.header.units, task.identification.operating_point
    known = replace(preparation, operating_point={**levels, **preparation.operating_point})
    data = read_data([path], units, known)
    inputs = data.u + np.array([levels.get(f"u{j + 1}", 0.0) for j in range(units.inputs)])
    columns = {units.time_header: data.time}
    columns |= {f"u{j + 1}": values for j, values in enumerate(inputs.T)}
    columns |= {f"y{i + 1}": values for i, values in enumerate(data.y.T)}
    if data.r is not None:
        columns |= {f"r{j + 1}": values for j, values in enumerate(data.r.T)}
    applied = data.r if units.closed_loop else inputs
    return Part(Table(columns), applied, _numbered(data.time), units.closed_loop, data.notes)


def _numbered(time: Array) -> NDArray[np.int64]:
    """(n,): the times (n,) counted in samples from the first."""
    if time.size < 2:
        return np.zeros(time.size, dtype=np.int64)
    return np.rint((time - time[0]) / np.median(np.diff(time))).astype(np.int64)


def _part(task: Rounds, plan: Planned, done: int) -> Table:
    """signal.csv of a part: its times go on where those of the last part end."""
    units = task.identification.header.units
    applied = plan.applied + task.offsets
    time_of = units.sample_time * np.arange(done, done + len(applied), dtype=np.float64)
    columns = {units.header(name): values for name, values in zip(units.excitations, applied.T, strict=True)}
    return Table({units.time_header: time_of, **columns})


def _running(task: Rounds, past: Past) -> State:
    """Before the data are looked at: whether anything more may be applied."""
    return "missed" if past.done >= task.rules.end else "running"


def _found(task: Rounds, records: Sequence[Path]) -> Identified:
    identification = task.identification
    taken = Preparation(operating_point=identification.operating_point)
    data = read_data(records, identification.header.units, taken)
    step = identification.header.units.sample_time
    return estimated(identification, continued(data, step), records[0], taken)


def continued(data: Data, step: float) -> Data:
    """The same, files whose times go on where those of the file before end taken as one record.

    Args:
        step: the sample time.
    """
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


def _standing(task: Rounds, found: Identified, past: Past) -> Standing | None:
    data, estimate = found.data, found.estimate
    units, earlier = task.identification.header.units, task.identification.earlier

    def informed(model: Model) -> Array:
        if model is found.model:
            return estimate.information
        return information_of_data(
            model, data.u, data.y, units.step, lengths=data.lengths, free=estimate.free, earlier=earlier
        )

    nominal = task.identification.nominal
    return standing(
        task.planner, found.model, informed, nominal if past.last is None else nominal.at(past.last)
    )


def _shrunk(found: Identified, stands: Standing | None) -> list[str]:
    """A note where the estimate is not built on as it is."""
    if stands is None:
        return ["nothing can be asked of this estimate, nor of any on the way from the last one"]
    if stands.share == 1.0:
        return []
    why = found.unasked or "its poles are too near to the unit circle, or outside"
    return [
        f"the estimate is not built on as it is ({why}): the plan is made at {100 * stands.share:.0f} % of "
        "the way to it from the last one, and the data decide nothing yet"
    ]


def _of_the_plan(plan: Planned, task: Rounds, past: Past) -> list[str]:
    notes = []
    if plan.why:
        notes.append(
            f"there is no design at this estimate ({plan.why}): the next part is white noise at the cost of "
            "the first plan, or of the pilot, and the estimate after it decides"
        )
    if plan.capped:
        notes.append(
            "the plan falls short of what is asked: campaign.power_cap (10 times the cost of a sample of the "
            "first plan, if it is not stated) or limits leave no more until campaign.max_samples"
        )
    if plan.share < _NEARLY:
        share = f"the part has {100 * plan.share:.0f} % of its power"
        notes.append(
            f"{share}: it would cost more than campaign.power_cap, at the estimate or the plant of the spec"
        )
    if plan.beyond:
        told = f"a sample of the next part costs {plan.part_cost:.4g}, more than campaign.power_cap allows"
        notes.append(f"{told}, by what the parts before it have left in the plant")
    wanted = task.rules.robust_last and task.rules.schedule.last(past.done)
    if wanted and plan.kind == "nominal":
        notes.append(
            "this part is planned for the estimate alone: some plant that the data leave open asks for more "
            "than campaign.power_cap and limits allow"
        )
    return notes
