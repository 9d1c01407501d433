"""Whether a record is taken for that of the plan which is due, and what is said of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.outcome.text_formats import csv_rows, read_csv
from inputdesign_cli.questions.campaign.applied import LIKE, UNLIKE, Match, copied, matched, standing_in
from inputdesign_cli.questions.campaign.memory import Memory
from inputdesign_cli.questions.campaign.rounds import Part

# So few samples are alike by chance.
_FEW = 3


def accepted(memory: Memory, given: Path, part: Part, *, unlike: bool) -> tuple[dict[str, Json], list[str]]:
    """What is kept of a record, compared with its plan, and what is to be said of it.

    Raises:
        DataError: `record-copied`, `record-too-long`, `record-other-part`, `record-other-scale`,
            `record-unlike`.
    """
    plan = memory.plan
    assert plan is not None
    _check_answers(given, part)
    if part.samples > plan["samples"]:
        raise DataError.because(
            "record-too-long",
            f"{given.name} has {part.samples} samples, and the plan {plan['file']} has {plan['samples']}",
            hint="give the samples from the start of the plan to its end; is it the record of another part?",
        )
    entry: dict[str, Json] = {"samples": part.samples, "plan": plan["file"], "withdrawn": False}
    if part.excitation is None:
        told = f"{given.name} has no column r: whether {plan['file']} was applied cannot be told"
        energy = part.samples * (plan["part_power"] if "part_power" in plan else plan["power"])
        return entry | {"energy": energy}, [told, *_shorter(given, plan, part.samples)]
    applied = part.excitation - np.array(plan["offset"], dtype=float)
    match = _matched(memory, plan, part, part.excitation)
    samples = match.begins + part.samples
    other = _of_another(memory, plan, part, part.excitation, match.likeness)
    if not unlike:
        _check_columns(given, memory, plan, part, part.excitation)
        _check_applied(given, plan, match, other, loop=part.of_loop)
    energy = float(np.sum(applied**2)) * samples / len(part.rows)
    entry |= {"samples": samples, "scale": match.scale} if match.likeness > LIKE else {"samples": samples}
    entry |= {"energy": energy, "likeness": match.likeness}
    return entry, [*_noted(plan, match, other), *_shorter(given, plan, samples)]


def _shorter(given: Path, plan: Mapping[str, Json], samples: int) -> list[str]:
    """That the plan was not applied to its end."""
    if samples == plan["samples"]:
        return []
    return [
        f"{given.name} ends after {samples} of the {plan['samples']} samples of {plan['file']}: the rest is "
        "planned anew"
    ]


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


def _check_columns(
    given: Path, memory: Memory, plan: Mapping[str, Json], part: Part, excitation: Array
) -> None:
    """Raise `DataError` (`record-unlike`) where another column than its own is what was planned."""
    whole, offset = _whole(memory, plan), np.array(plan["offset"], dtype=float)
    own = "r" if part.of_loop else "u"
    others = {name: column for name, column in _signals(part).items() if not name.startswith(own)}
    found = standing_in(whole[part.rows], excitation - offset, others)
    if found is None:
        return
    channel, name, likeness = found
    raise DataError.because(
        "record-unlike",
        f"the columns of {given.name} look swapped: {name} follows {plan['file']} as {own}{channel} should "
        f"(correlation {likeness:.2f}), and {own}{channel} does not",
        hint=f"{_renamed(f'{own}{channel}', name)}; if it was really applied so, say --as-applied: the "
        "estimate goes by what was recorded",
    )


def _renamed(applied: str, other: str) -> str:
    """How to say which column is which; a reference goes by the header alone."""
    if applied.startswith("r"):
        return "give the columns their right names in the first line of the file"
    return f"say which column is which, --columns {applied}=NAME,{other}=NAME,.."


def _signals(part: Part) -> dict[str, Array]:
    """The columns (m,) of a record without its times."""
    _, *signals = part.table.columns.items()
    return dict(signals)


def _check_applied(
    given: Path, plan: Mapping[str, Json], match: Match, other: str | None, *, loop: bool
) -> None:
    """Raise `DataError` (`record-other-part`, `record-other-scale`, `record-unlike`) for what is no plan."""
    due, forced = plan["file"], "--as-applied: the estimate goes by what was recorded"
    if other is not None:
        raise DataError.because(
            "record-other-part",
            f"what was applied in {given.name} is {other}, not {due}, which is due",
            hint=f"give the record of {due}; if {other} was really applied once more, say {forced}",
        )
    if match.exchanged is not None:
        told = ", ".join(f"{k}" for k in match.exchanged)
        raise DataError.because(
            "record-unlike",
            f"the channels of {given.name} are not in the order of {due}: it holds them as {told}",
            hint="say which column is which channel, --columns u1=NAME,u2=NAME,..; if they were really "
            f"applied so, say {forced}",
        )
    if match.off:
        raise DataError.because(
            "record-other-scale",
            f"{given.name} was applied at {match.scale:.4g} times the scale of {due}",
            hint=f"mend the column if it is in another unit; if it was really applied so, say {forced}",
        )
    # A reference is computed: no actuator clips it. The input of the loop is another signal that follows it.
    if not match.follows or (loop and match.spliced <= LIKE):
        raise DataError.because(
            "record-unlike",
            f"what was applied in {given.name} is not {due}: {'r' if loop else 'u'}{match.channel} has a "
            f"correlation of {match.likeness:.2f} with the plan ({match.spliced:.2f} with samples shifted or "
            "lost)" + (", as slow signals have by chance" if match.likeness >= UNLIKE else ""),
            hint=f"give the record of {due}; is it another experiment, or another column (--columns)? If it "
            f"was really applied in its place, say {forced}",
        )


def _noted(plan: Mapping[str, Json], match: Match, other: str | None) -> list[str]:
    """What is to be said of a record that is taken."""
    due, told = plan["file"], f"correlation {match.likeness:.2f}"
    if other is not None:
        return [
            f"what was applied is {other} once more, not {due} ({told}): withdraw the record with --withdraw "
            "if it was given by mistake, else samples count twice"
        ]
    if match.likeness > LIKE:
        return []
    if not match.follows:
        return [
            f"what was applied is hardly {due} ({told}): withdraw the record with --withdraw if it was given "
            "by mistake; the estimate goes by what was recorded"
        ]
    return [
        f"what was applied follows {due} only in part ({told}, {match.spliced:.2f} with samples shifted or "
        "lost): it is taken as recorded"
    ]


def _matched(memory: Memory, plan: Mapping[str, Json], part: Part, excitation: Array) -> Match:
    """How what was applied (m, r) follows a plan, about its levels."""
    offset, whole = np.array(plan["offset"], dtype=float), _whole(memory, plan)
    strongest = max(float(each["power"]) for each in _plans(memory)) ** 0.5
    return matched(whole, excitation - offset, part.rows, strongest)


def _whole(memory: Memory, plan: Mapping[str, Json]) -> Array:
    """(n, r): the samples of a plan about its level."""
    columns = list(read_csv(memory.directory / plan["file"]).values())[1:]
    return np.asarray(np.stack(columns, axis=1) - np.array(plan["offset"], dtype=float), dtype=float)


def _plans(memory: Memory) -> list[dict[str, Json]]:
    return [entry["plan"] for entry in memory.campaign["rounds"] if entry.get("plan")]


def _of_another(
    memory: Memory, due: Mapping[str, Json], part: Part, excitation: Array, likeness: float
) -> str | None:
    """The file of another plan that what was applied is, where that is nearer than the one that is due."""
    found = {
        plan["file"]: abs(_matched(memory, plan, part, excitation).likeness)
        for plan in _plans(memory)
        if plan["file"] != due["file"] and len(csv_rows(memory.files.get(plan["file"], b""))) > part.samples
    }
    likest = max(found, key=found.__getitem__, default=None)
    return likest if likest is not None and found[likest] > max(LIKE, abs(likeness)) else None
