"""Compare a record with the plan of the part that is due, and decide whether it is taken.

Loggers begin late or early and lose a sample, actuators clip, sensors round. Most of a record is in step with
its plan nevertheless; a record of another experiment is not. Signals are compared without their levels.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.campaigns import hardly_followed, shorter, without_excitation
from inputdesign_cli.outcome.campaign import PartRecord, PlannedPart
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.outcome.text_formats import csv_text
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.campaign.memory import Memory, signals_in
from inputdesign_cli.records import Record

LIKE = 0.9
"""From this correlation on a record follows its plan; below it there is a finding."""
UNLIKE = 0.5
"""Below it a record does not follow."""
# Least t-ratio of the plan in a record, in place and with shifted samples: slow signals are alike by chance.
_SURE_IN_PLACE, _SURE_SHIFTED = 1.8, 5.0
# Largest shift in samples, lags of a regression on the past, and a gain in correlation that counts.
_SHIFTS, _PAST, _BETTER = 5, 2, 0.02
# A scale is wrong if it is off by more than this, by these standard deviations, and by most of the error.
_SCALE_ERROR, _DEVIATIONS = 0.02, 3.0
# An actuator that clips does so in samples beyond this share of half their range.
_CLIPPED = 0.95
# Shares of the strongest plan: below the first a channel is to be at rest, above the second it has moved.
_AT_REST, _MOVED = 0.02, 0.5
# Rounding to five digits lowers the correlation of a copy by no more than this.
_COPY = 1e-10

# Signals of this many samples, or fewer, are alike by chance.
_FEW = 3
_FORCED = "if it was really applied so, say --as-applied: the estimate uses what was recorded"


@dataclass(frozen=True)
class Match:
    """Describes how well a record follows a plan.

    Attributes:
        begins: the sample of the plan that the record begins with.
        likeness: the correlation of the channel that follows least, as recorded; `spliced`: its correlation
            with shifted samples put back in place.
        channel: its number from 1.
        scale: the scale of the channel whose scale is farthest from one; `off`: whether
            a scale of one is refuted.
        follows: whether it may be the record of the plan.
    """

    begins: int
    likeness: float
    spliced: float
    channel: int
    scale: float
    off: bool
    follows: bool


def matched(plan: Array, applied: Array, rows: NDArray[np.int64], strongest: float) -> Match:
    """Compare a record with its plan.

    Args:
        plan: (n, r); `applied`: (m, r), whose `rows` (m,) are counted from its first.
        strongest: the largest root mean square of all plans, beside which a plan may be at rest.
    """

    def alike(start: int) -> float:
        return abs(likeness(plan[start + rows], applied))

    best = max(range(len(plan) - int(rows[-1])), key=alike)
    begins = best if alike(best) > max(LIKE, alike(0) + _BETTER) else 0
    due = plan[begins + rows]
    # A channel that should be at rest follows or does not.
    shares = [
        float(np.std(own) <= _MOVED * strongest)
        if np.sqrt(np.mean(wanted**2)) < _AT_REST * strongest
        else likeness(wanted, own)
        for wanted, own in zip(due.T, applied.T, strict=True)
    ]
    least = int(np.argmin(shares))
    spliced, own = shares[least], applied[:, least]
    follows = _follows(spliced, due[:, least], own, _SURE_IN_PLACE)
    if spliced < LIKE:
        placed = _in_step(plan[:, least], own, begins + rows)
        shifted = likeness(placed, own)
        follows = follows or _follows(shifted, placed, own, _SURE_SHIFTED)
        spliced = max(spliced, shifted)
    scales = [_scale(due[:, j], applied[:, j]) for j in range(plan.shape[1])]
    off, _, scale = max((off, abs(scale - 1.0), scale) for scale, off in scales)
    # Samples out of place look like a smaller scale.
    off = off and spliced <= abs(shares[least]) + _BETTER
    return Match(begins, shares[least], spliced, least + 1, scale, off, follows)


def standing_in(plan: Array, applied: Array, columns: Mapping[str, Array]) -> tuple[int, str, float] | None:
    """Return a channel of a plan (m, r) that another column (m,) follows instead of its own, applied (m, r).

    Return its number from 1, the name of the column and its correlation; None if there is no such channel.
    """
    for j in range(plan.shape[1]):
        least = max(LIKE, abs(likeness(plan[:, j], applied[:, j])) + _BETTER)
        for name, column in columns.items():
            each = [likeness(due, column) for due in plan.T]
            if each[j] > least and each[j] == max(each) and not _scale(plan[:, j], column)[1]:
                return j + 1, name, each[j]
    return None


def copied(column: Array, other: Array) -> bool:
    """Return whether a column (m,) is a copy of `other`, at any scale and about any level."""
    return abs(likeness(column, other)) > 1.0 - _COPY


def likeness(plan: Array, applied: Array) -> float:
    """Return the correlation of two signals (m,) or (m, r); about zero if the plan is constant."""
    plan, applied = _varying(plan, applied)
    sizes = float(np.linalg.norm(plan)) * float(np.linalg.norm(applied))
    return float(np.sum(plan * applied)) / sizes if sizes > 0.0 else 0.0


def _varying(plan: Array, applied: Array) -> tuple[Array, Array]:
    if np.all(np.ptp(plan, axis=0) == 0.0):
        return plan, applied
    return plan - plan.mean(axis=0), applied - applied.mean(axis=0)


def _in_step(plan: Array, applied: Array, places: NDArray[np.int64]) -> Array:
    """Return the samples (m,) of a plan (n,) that a record follows best if it slips once by a few samples."""
    padded = np.pad(plan - plan.mean(), _SHIFTS)
    along = padded[np.clip(places[:, None] + np.arange(2 * _SHIFTS + 1), 0, len(padded) - 1)]
    before = np.cumsum(along * (applied - applied.mean())[:, None], axis=0)
    after = before[-1] - before
    slip = int(np.argmax(before.max(axis=1) + after.max(axis=1)))
    early, late = int(np.argmax(before[slip])), int(np.argmax(after[slip]))
    return np.concatenate([along[: slip + 1, early], along[slip + 1 :, late]])


def _follows(alike: float, plan: Array, applied: Array, sure: float) -> bool:
    return alike >= LIKE or (alike >= UNLIKE and _sureness(plan, applied) >= sure)


def _sureness(plan: Array, applied: Array) -> float:
    """Return the t-ratio of a plan (m,) in a record, if the rest is autoregressive noise of order two.

    Unrelated slow signals are correlated over a few samples. After a regression on the past of both they are
    not ([cochrane-orcutt-1949]).
    """
    signals = _varying(plan, applied)
    past = [signal[_PAST - k : -k] for signal in signals for k in range(1, _PAST + 1)]
    x, y = (signal[_PAST:] for signal in signals)
    if len(x) <= len(past) + 1:
        return np.inf
    others = np.column_stack(past)
    x, y = (signal - others @ np.linalg.lstsq(others, signal, rcond=None)[0] for signal in (x, y))
    size, rest = float(x @ x), float(y @ y)
    across = float(x @ y)
    left = max(rest * size - across**2, 1e-300)
    return across * float(np.sqrt(max(len(x) - len(past) - 1, 1) / left))


def _scale(plan: Array, applied: Array) -> tuple[float, bool]:
    """Return the scale at which a plan (m,) was applied, and whether samples without clipping refute one."""
    scale, off = _fitted(plan, applied)
    if not off or abs(likeness(plan, applied)) <= LIKE:
        return scale, False
    low, high = float(np.min(applied)), float(np.max(applied))
    inner = np.abs(applied - 0.5 * (low + high)) < _CLIPPED * 0.5 * (high - low)
    return scale, int(np.sum(inner)) <= 2 or _fitted(plan[inner], applied[inner])[1]


def _fitted(plan: Array, applied: Array) -> tuple[float, bool]:
    """Return the scale of a plan (m,) in a record, and whether it differs from one by more than chance."""
    plan, applied = _varying(plan, applied)
    size = float(plan @ plan)
    if size == 0.0:
        return 1.0, False
    scale = float(plan @ applied) / size
    rest = float(np.sum((applied - scale * plan) ** 2)) / size
    least = max(_SCALE_ERROR, _DEVIATIONS * np.sqrt(rest / max(len(plan) - 2, 1)), np.sqrt(rest))
    return scale, bool(abs(scale - 1.0) > least)


def table_of(units: Units, data: Record) -> Table:
    """Return the table in which a record is kept: times, inputs, outputs and, in a loop, the reference."""
    signals = {"u": data.u, "y": data.y} | ({} if data.r is None else {"r": data.r})
    columns = {f"{kind}{j + 1}": x for kind, values in signals.items() for j, x in enumerate(values.T)}
    return Table({units.time_header: data.time, **columns})


def accepted(
    memory: Memory, kind: str, given: str, data: Record, table: Table, *, unlike: bool
) -> tuple[PartRecord, list[Finding]]:
    """Return the entry of a record, compared with the part that is due, and its findings.

    Args:
        kind: the letter of the excitation: "u", or "r", the reference of a loop.
        given: the name of the user's file; `table`: its `data` in the form that is kept.
        unlike: whether to take a record of something else.

    Raises:
        DataError: `campaign-over`, `data-repeated`, `record-copied`, `record-too-long`, `record-other-part`,
            `record-other-scale`, `record-unlike`.
    """
    campaign, columns = memory.campaign, dict(list(table.columns.items())[1:])  # without times
    due, steps = _due(memory, given, table), np.diff(data.time)
    # The numbers of the samples from the first one on; samples without values are left out.
    rows = np.rint((data.time - data.time[0]) / (np.median(steps) if steps.size else 1.0)).astype(np.int64)
    samples, file = int(rows[-1]) + 1, f"record_{len(campaign.records) + 1:02d}.csv"
    _check_answers(given, kind, columns)
    if samples > due.samples:
        raise DataError.because(
            "record-too-long",
            f"{given} has {samples} samples, and the plan {due.file} has {due.samples}",
            hint="give the samples from the start of the plan to its end; is it the record of another part?",
        )
    excitation = data.r if kind == "r" else data.u
    if excitation is None:
        entry = PartRecord(file, given, samples, due.file, False, samples * due.part_power)
        ended = shorter(given, due.file, samples, due.samples)
        return entry, [*without_excitation(given, due.file), *ended]
    plans = [plan for plan in campaign.plans if plan.samples >= samples]
    strongest = max(each.power for each in campaign.plans) ** 0.5
    wholes = {plan.file: signals_in(memory.files[plan.file]) - plan.offset for plan in plans}
    matches = {
        plan.file: matched(wholes[plan.file], excitation - plan.offset, rows, strongest) for plan in plans
    }
    match, levelled = matches[due.file], excitation - due.offset
    likest = max(matches, key=lambda name: abs(matches[name].likeness))
    other = likest if abs(matches[likest].likeness) > max(LIKE, abs(match.likeness)) else None
    if not unlike:
        found = standing_in(wholes[due.file][rows], levelled, columns)
        _check_applied(given, due.file, kind, match, other, found)
    samples += match.begins
    energy = float(np.sum(levelled**2)) * samples / len(rows)
    scale = match.scale if match.likeness > LIKE else None
    entry = PartRecord(file, given, samples, due.file, False, energy, match.likeness, scale)
    findings = hardly_followed(
        given,
        due.file,
        match.likeness,
        like=LIKE,
        follows=match.follows,
        other=other,
        scale=match.scale if match.off else 1.0,
    )
    return entry, findings + shorter(given, due.file, samples, due.samples)


def _due(memory: Memory, given: str, table: Table) -> PlannedPart:
    """Return the part that is due; raise `DataError` where there is none, or its record has been given."""
    campaign, due = memory.campaign, memory.campaign.plan
    if campaign.state != "running" or due is None:
        raise DataError.because(
            "campaign-over",
            f"the campaign in {memory.directory} has ended: {campaign.state}",
            hint="withdraw a record with --withdraw N to go on without it, or begin another campaign; "
            "where the data contradict the model, --regardless without a record goes on as it is",
        )
    for known in campaign.records:
        if memory.files[known.file] == csv_text(table).encode():
            stays = " (this one stays withdrawn)" if known.withdrawn else ""
            raise DataError.because(
                "data-repeated",
                f"{given} holds the samples of {known.file}, given as {known.given}",
                hint=f"give each record once{stays}",
            )
    return due


def _check_answers(given: str, kind: str, columns: Mapping[str, Array]) -> None:
    """Raise `DataError` (`record-copied`) where an output is a copy of the excitation.

    In a loop that is the reference: a static controller without a reference makes u a copy of y.
    """
    outputs, inputs = ([name for name in columns if name.startswith(letter)] for letter in ("y", kind))
    for output, name in itertools.product(outputs, inputs):
        if len(columns[output]) > _FEW and copied(columns[output], columns[name]):
            raise DataError.because(
                "record-copied",
                f"{output} of {given} is a copy of {name}, at some scale and level: what the plant "
                "answered is not in it",
                hint=f"{_renamed(name, output)}; is a sensor wired to the actuator, or does the logger "
                "write the same signal twice?",
            )


def _renamed(applied: str, other: str) -> str:
    """Return the hint that names the columns rightly; a reference is known by the header alone."""
    if applied.startswith("r"):
        return "give the columns their right names in the first line of the file"
    return f"say which column is which, --columns {applied}=NAME,{other}=NAME,.."


def _check_applied(
    given: str, due: str, kind: str, match: Match, other: str | None, found: tuple[int, str, float] | None
) -> None:
    """Raise `DataError` (`record-unlike`, `record-other-part`, `record-other-scale`) for an unlike record."""
    code, hint, loop = "record-unlike", f"give the record of {due}; {_FORCED}", kind == "r"
    if found is not None:
        own = f"{kind}{found[0]}"
        wrong = f"the columns of {given} look swapped: {found[1]} follows {due} as {own} should "
        wrong += f"(correlation {found[2]:.2f}), and {own} does not"
        hint = f"{_renamed(own, found[1])}; {_FORCED}"
    elif other is not None:
        code, wrong = "record-other-part", f"what was applied in {given} is {other}, not {due}, which is due"
    elif match.off:
        code = "record-other-scale"
        wrong = f"{given} was applied at {match.scale:.4g} times the scale of {due}"
        hint = f"mend the column if it is in another unit; {_FORCED}"
    # No actuator clips a reference, which is computed. It must follow the plan closely.
    elif not match.follows or (loop and match.spliced <= LIKE):
        wrong = f"what was applied in {given} is not {due}: {kind}{match.channel} has a correlation of "
        wrong += f"{match.likeness:.2f} with the plan ({match.spliced:.2f} with samples shifted)"
        hint = f"give the record of {due}; is it another experiment, or another column (--columns)? "
        hint += _FORCED.capitalize()
    else:
        return
    raise DataError.because(code, wrong, hint=hint)
