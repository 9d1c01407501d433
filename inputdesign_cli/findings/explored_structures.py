"""How a model was found in a log: its structure, drift, inputs at rest, and feedback."""

from __future__ import annotations

from collections.abc import Sequence

from inputdesign_cli.explore.joint import Found
from inputdesign_cli.finding import NOTE, Finding, FindingKind, finding
from inputdesign_cli.findings.places import Record
from inputdesign_cli.findings.prepared_records import JITTER_EVENED
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.response_chance import perhaps_zero
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.plant import Model

_MORE = 0.05  # per cent of the output by which a structure explains more


def explored_structures(log: Record, found: Found, loops: Sequence[tuple[int, float]]) -> list[Finding]:
    """Return notes on the record and on the choice of the model.

    Args:
        loops: inputs (from zero) that respond to the outputs, each with the probability of that by chance.
    """
    return [
        *_chosen(log, found),
        *_drifting(log, found),
        *_wandering(found),
        *_resting(found),
        *_between_rows(log, found.model),
        *_answering(found, loops),
        *_idle(found),
    ]


@finding(NOTE, "structure-chosen", "Nothing; `exploration` in result.json compares the structures.")
def _chosen(kind: FindingKind, log: Record, found: Found) -> list[Finding]:
    """A structure was chosen. Of structures that explain unseen data as well, the simplest wins."""
    said = []
    for i, (chosen, taken) in enumerate(zip(found.outputs, found.taken, strict=True)):
        orders = [", ".join(f"{letter} {n}" for letter, n in taken.orders.numbers.items())]
        delays = " and ".join(
            f"{delay} from {signal_name('u', j, found.model.inputs)} (95 %: {low} to {high})"
            for j, delay, (low, high) in zip(found.moving, taken.orders.delays, taken.ranges, strict=True)
        )
        tried, family = len(chosen.candidates), taken.orders.family
        better = max(one.validation for one in chosen.candidates) - taken.validation
        name = signal_name("y", i, found.model.outputs)
        beside = f"another explains {better:.2g} % more" if better > _MORE else "no other explains more"
        orders += [f"times in {log.time_unit}" if taken.orders.physical else f"delay in samples {delays}"]
        said_of = "; ".join(filter(None, orders))
        fact = f"for {name}, {family} ({said_of}), chosen of {tried} structures: {beside} of the record"
        said.append(kind.found(fact, where=name, family=family, structures=tried, better_percent=better))
    return said


@finding(NOTE, "output-drifts", "It was taken away, as `--detrend linear` does for identify and assess.")
def _drifting(kind: FindingKind, log: Record, found: Found) -> list[Finding]:
    """An output drifts along a line through all records. The inputs do not cause it."""
    said = []
    for i, slope in enumerate(found.slopes.tolist()):
        name, rate = signal_name("y", i, found.model.outputs), slope / log.step
        said += kind.when(slope, f"{name}, by {rate:.4g} per {log.time_unit}", where=name, slope=rate)
    return said


@finding(NOTE, "output-wanders", "For the gain between distant levels, record the levels for longer.")
def _wandering(kind: FindingKind, found: Found) -> list[Finding]:
    """An output wanders as a random walk does. The gain is that of steps, not of distant levels."""
    names = [signal_name("y", i, found.model.outputs) for i, wanders in enumerate(found.wanders) if wanders]
    return [kind.found(name, where=name) for name in names]


@finding(NOTE, "dead-time-between-rows", "Nothing, if the input moves at rows only.")
def _between_rows(kind: FindingKind, log: Record, model: Model) -> list[Finding]:
    """A dead time counts from the row in which the input has moved. A move between two rows was earlier."""
    fact = f"it is longer by up to {log.step:.4g} {log.time_unit} if the input moved between two rows"
    jitter = any(one.code == JITTER_EVENED.code for one in log.findings)
    return kind.when(jitter and bool(model.dead_times.any()), fact, longer=log.step)


@finding(
    NOTE,
    "input-at-rest",
    "Let an experiment move it; or leave it out of `--columns`, and models in s are tried as well.",
)
def _resting(kind: FindingKind, found: Found) -> list[Finding]:
    """An input never moves in this record. The model has no part of it, and is one in q^-1."""
    return [kind.found(f"u{j + 1}", where=f"u{j + 1}") for j in found.still]


@finding(
    NOTE,
    "input-answers-noise",
    "Write the controller of the loop as `experiment.controller`. If no reference moves, add dither.",
)
def _answering(kind: FindingKind, found: Found, loops: Sequence[tuple[int, float]]) -> list[Finding]:
    """The noise of the outputs helps to predict an input. The data may come from a loop.

    Or the input was logged late, or columns are swapped. The direct method is used, and the noise model must
    then be right.
    """
    names = [(signal_name("u", j, found.model.inputs), p) for j, p in loops]
    return [
        kind.found(f"{name} (probability {chance(p)} by chance)", where=name, probability=p)
        for name, p in names
    ]


@finding(NOTE, "input-perhaps-idle", "Move that input more, or leave it out of `--columns`.")
def _idle(kind: FindingKind, found: Found) -> list[Finding]:
    """An input has no effect on the outputs that differs from none. Its delays and parameters say nothing."""
    idle = perhaps_zero(found.model, found.estimate, inputs=True) if found.model.inputs > 1 else ()
    return [kind.found(f"u{j + 1}", where=f"u{j + 1}") for j in idle]
