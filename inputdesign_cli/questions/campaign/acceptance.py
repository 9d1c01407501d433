"""Decide whether a record is taken for the part that is due."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.campaigns import hardly_followed, shorter, without_excitation
from inputdesign_cli.outcome.campaign import PartRecord, PlannedPart
from inputdesign_cli.outcome.text_formats import csv_columns
from inputdesign_cli.questions.campaign.applied import LIKE, UNLIKE, Match, copied, matched, standing_in
from inputdesign_cli.questions.campaign.memory import Memory
from inputdesign_cli.questions.campaign.rounds import Part

# So few samples are alike by chance.
_FEW = 3


def accepted(
    memory: Memory, due: PlannedPart, file: str, given: Path, part: Part, *, unlike: bool
) -> tuple[PartRecord, list[Finding]]:
    """Return the entry of a record, compared with the part that is due, and its findings.

    Args:
        file: its name in the directory; `given`: the file of the user.
        unlike: whether to take a record of something else.

    Raises:
        DataError: `record-copied`, `record-too-long`, `record-other-part`, `record-other-scale`,
            `record-unlike`.
    """
    _check_answers(given, part)
    if part.samples > due.samples:
        raise DataError.because(
            "record-too-long",
            f"{given.name} has {part.samples} samples, and the plan {due.file} has {due.samples}",
            hint="give the samples from the start of the plan to its end; is it the record of another part?",
        )
    power = due.power if due.part_power is None else due.part_power
    entry = PartRecord(file, given.name, part.samples, due.file, False, part.samples * power)
    if part.excitation is None:
        ended = shorter(given.name, due.file, part.samples, due.samples)
        return entry, [*without_excitation(given.name, due.file), *ended]
    match = _matched(memory, due, part, part.excitation)
    samples = match.begins + part.samples
    other = _of_another(memory, due, part, part.excitation, match.likeness)
    if not unlike:
        _check_columns(given, memory, due, part, part.excitation)
        _check_applied(given, due.file, match, other, loop=part.of_loop)
    energy = float(np.sum((part.excitation - due.offset) ** 2)) * samples / len(part.rows)
    scale = match.scale if match.likeness > LIKE else None
    findings = hardly_followed(
        given.name,
        due.file,
        likeness=match.likeness,
        spliced=match.spliced,
        like=LIKE,
        follows=match.follows,
        other=other,
        scale=match.scale if match.off else 1.0,
    )
    findings += shorter(given.name, due.file, samples, due.samples)
    record = PartRecord(
        file, given.name, samples, due.file, False, energy, likeness=match.likeness, scale=scale
    )
    return record, findings


def _check_answers(given: Path, part: Part) -> None:
    """Raise `DataError` (`record-copied`) where an output is what was applied.

    In a loop that is the reference: without one, a controller without dynamics makes a copy of y of u.
    """
    columns, own = _signals(part), "r" if part.of_loop else "u"
    for output in (name for name in columns if name.startswith("y")):
        for name in (name for name in columns if name.startswith(own)):
            if len(part.rows) > _FEW and copied(columns[output], columns[name]):
                raise DataError.because(
                    "record-copied",
                    f"{output} of {given.name} is a copy of {name}, at some scale and level: what the plant "
                    "answered is not in it",
                    hint=f"{_renamed(name, output)}; is a sensor wired to the actuator, or does the logger "
                    "write the same signal twice?",
                )


def _check_columns(given: Path, memory: Memory, due: PlannedPart, part: Part, excitation: Array) -> None:
    """Raise `DataError` (`record-unlike`) where another column than its own is what was planned."""
    own = "r" if part.of_loop else "u"
    others = {name: column for name, column in _signals(part).items() if not name.startswith(own)}
    found = standing_in(_whole(memory, due)[part.rows], excitation - due.offset, others)
    if found is None:
        return
    channel, name, likeness = found
    raise DataError.because(
        "record-unlike",
        f"the columns of {given.name} look swapped: {name} follows {due.file} as {own}{channel} should "
        f"(correlation {likeness:.2f}), and {own}{channel} does not",
        hint=f"{_renamed(f'{own}{channel}', name)}; if it was really applied so, say --as-applied: the "
        "estimate uses what was recorded",
    )


def _renamed(applied: str, other: str) -> str:
    """Return how to name the columns; a reference is known by the header alone."""
    if applied.startswith("r"):
        return "give the columns their right names in the first line of the file"
    return f"say which column is which, --columns {applied}=NAME,{other}=NAME,.."


def _signals(part: Part) -> dict[str, Array]:
    """Return the columns (m,) of a record without its times."""
    _, *signals = part.table.columns.items()
    return dict(signals)


def _check_applied(given: Path, due: str, match: Match, other: str | None, *, loop: bool) -> None:
    """Raise `DataError` (`record-other-part`, `record-other-scale`, `record-unlike`) for what is no plan."""
    forced = "--as-applied: the estimate uses what was recorded"
    if other is not None:
        raise DataError.because(
            "record-other-part",
            f"what was applied in {given.name} is {other}, not {due}, which is due",
            hint=f"give the record of {due}; if {other} was really applied once more, say {forced}",
        )
    if match.exchanged is not None:
        order = ", ".join(f"{k}" for k in match.exchanged)
        raise DataError.because(
            "record-unlike",
            f"the channels of {given.name} are not in the order of {due}: it holds them as {order}",
            hint="say which column is which channel, --columns u1=NAME,u2=NAME,..; if they were really "
            f"applied so, say {forced}",
        )
    if match.off:
        raise DataError.because(
            "record-other-scale",
            f"{given.name} was applied at {match.scale:.4g} times the scale of {due}",
            hint=f"mend the column if it is in another unit; if it was really applied so, say {forced}",
        )
    # A reference is computed: no actuator clips it. The input of the loop only follows it.
    if not match.follows or (loop and match.spliced <= LIKE):
        raise DataError.because(
            "record-unlike",
            f"what was applied in {given.name} is not {due}: {'r' if loop else 'u'}{match.channel} has a "
            f"correlation of {match.likeness:.2f} with the plan ({match.spliced:.2f} with samples shifted or "
            "lost)" + (", as slow signals have by chance" if match.likeness >= UNLIKE else ""),
            hint=f"give the record of {due}; is it another experiment, or another column (--columns)? If it "
            f"was really applied in its place, say {forced}",
        )


def _matched(memory: Memory, plan: PlannedPart, part: Part, excitation: Array) -> Match:
    """Compare what was applied (m, r) with a plan, about its levels."""
    strongest = max(each.power for each in memory.campaign.plans) ** 0.5
    return matched(_whole(memory, plan), excitation - plan.offset, part.rows, strongest)


def _whole(memory: Memory, plan: PlannedPart) -> Array:
    """Return the samples (n, r) of a plan about its levels."""
    columns = list(csv_columns(memory.files[plan.file]).values())[1:]
    return np.asarray(np.stack(columns, axis=1) - plan.offset, dtype=float)


def _of_another(
    memory: Memory, due: PlannedPart, part: Part, excitation: Array, likeness: float
) -> str | None:
    """Return the file of another plan that was applied, if it is nearer than the one that is due."""
    found = {
        plan.file: abs(_matched(memory, plan, part, excitation).likeness)
        for plan in memory.campaign.plans
        if plan.file != due.file and plan.file in memory.files and len(_whole(memory, plan)) >= part.samples
    }
    likest = max(found, key=found.__getitem__, default=None)
    return likest if likest is not None and found[likest] > max(LIKE, abs(likeness)) else None
