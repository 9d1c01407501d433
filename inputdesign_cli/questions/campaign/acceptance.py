"""Decide whether a record is taken for the part that is due."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.campaigns import hardly_followed, shorter, without_excitation
from inputdesign_cli.outcome.campaign import PartRecord, PlannedPart
from inputdesign_cli.outcome.text_formats import csv_columns
from inputdesign_cli.questions.campaign.applied import LIKE, Match, copied, matched, standing_in
from inputdesign_cli.questions.campaign.memory import Memory
from inputdesign_cli.questions.campaign.rounds import Part

# So few samples are alike by chance.
_FEW = 3
_FORCED = "if it was really applied so, say --as-applied: the estimate uses what was recorded"


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
    columns = dict(list(part.table.columns.items())[1:])  # without times
    _check_answers(given.name, part, columns)
    if part.samples > due.samples:
        raise DataError.because(
            "record-too-long",
            f"{given.name} has {part.samples} samples, and the plan {due.file} has {due.samples}",
            hint="give the samples from the start of the plan to its end; is it the record of another part?",
        )
    entry = PartRecord(file, given.name, part.samples, due.file, False, part.samples * due.part_power)
    if part.excitation is None:
        ended = shorter(given.name, due.file, part.samples, due.samples)
        return entry, [*without_excitation(given.name, due.file), *ended]
    plans = [plan for plan in memory.campaign.plans if plan.samples >= part.samples]
    strongest = max(each.power for each in memory.campaign.plans) ** 0.5
    matches, wholes = dict[str, Match](), dict[str, Array]()
    for plan in plans:
        signals = list(csv_columns(memory.files[plan.file]).values())[1:]
        wholes[plan.file] = np.asarray(np.stack(signals, axis=1) - plan.offset, dtype=float)
        about = part.excitation - plan.offset
        matches[plan.file] = matched(wholes[plan.file], about, part.rows, strongest)
    match, levelled = matches[due.file], part.excitation - due.offset
    likest = max(matches, key=lambda name: abs(matches[name].likeness))
    other = likest if abs(matches[likest].likeness) > max(LIKE, abs(match.likeness)) else None
    if not unlike:
        found = standing_in(wholes[due.file][part.rows], levelled, columns)
        _check_applied(given.name, due.file, part.kind, match, other, found)
    samples = match.begins + part.samples
    energy = float(np.sum(levelled**2)) * samples / len(part.rows)
    scale = match.scale if match.likeness > LIKE else None
    entry = PartRecord(file, given.name, samples, due.file, False, energy, match.likeness, scale)
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
    return entry, findings + shorter(given.name, due.file, samples, due.samples)


def _check_answers(given: str, part: Part, columns: Mapping[str, Array]) -> None:
    """Raise `DataError` (`record-copied`) where an output is what was applied.

    In a loop that is the reference: without one, a controller without dynamics makes a copy of y of u.
    """
    outputs, inputs = ([name for name in columns if name.startswith(kind)] for kind in ("y", part.kind))
    for output, name in itertools.product(outputs, inputs):
        if len(part.rows) > _FEW and copied(columns[output], columns[name]):
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
    """Raise `DataError` (`record-unlike`, `record-other-part`, `record-other-scale`) for what is no plan.

    Args:
        found: a column that stands in for a channel, see `standing_in`.
    """
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
    # A reference is computed: no actuator clips it. The input of the loop only follows it.
    elif not match.follows or (loop and match.spliced <= LIKE):
        wrong = f"what was applied in {given} is not {due}: {kind}{match.channel} has a correlation of "
        wrong += f"{match.likeness:.2f} with the plan ({match.spliced:.2f} with samples shifted)"
        hint = f"give the record of {due}; is it another experiment, or another column (--columns)? "
        hint += _FORCED.capitalize()
    else:
        return
    raise DataError.because(code, wrong, hint=hint)
