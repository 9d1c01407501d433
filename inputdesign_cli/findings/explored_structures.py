"""How a model was found in a log: its structure, drift, lags, inputs at rest, and samples used."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from inputdesign_cli.explore.joint import Found
from inputdesign_cli.finding import NOTE, Finding, FindingKind, finding
from inputdesign_cli.findings.explored_logs import open_parameters
from inputdesign_cli.findings.places import Record
from inputdesign_cli.findings.prepared_records import JITTER_EVENED
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.response_chance import perhaps_zero
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.plant import Model

_IN_WORDS = {"FOPDT": "a lag with dead time", "SOPDT": "second order of damping zeta, with dead time"}
_DIRECT = "The direct method is used; the noise model must then be right"
_LOOP = (
    f"It is taken for a loop; or the input was logged late, or the columns are swapped. {_DIRECT}. Without a "
    "reference that moves, the plant may not be identifiable: add a reference or dither, and write "
    "experiment.controller."
)
_BEHIND_REFERENCE = f"{_DIRECT}. For a design write experiment.controller in the spec."


def explored_structures(log: Record, found: Found, loops: Sequence[tuple[int, float]]) -> list[Finding]:
    """Return notes on the record and on the choice of the model.

    Args:
        loops: inputs (from zero) that respond to the outputs, each with the probability of that by chance.
    """
    return [
        *_chosen(log, found),
        *_drifting(log, found),
        *_wandering(found),
        *_two_lags(log, found.model),
        *_between_rows(log, found.model),
        *_resting(found),
        *_answering(log, found, loops),
        *_idle(found),
        *_unknown(found),
        *_busiest(log, found),
        *_in_turn(found),
    ]


@finding(NOTE, "structure-chosen", "Nothing; structures.png compares the structures.")
def _chosen(kind: FindingKind, log: Record, found: Found) -> list[Finding]:
    """A structure was chosen. Of structures that explain unseen data as well, the simplest wins."""
    said = []
    for i, (chosen, taken) in enumerate(zip(found.outputs, found.taken, strict=True)):
        orders = ", ".join(f"{letter} {n}" for letter, n in taken.orders.numbers.items())
        family, known = taken.orders.family, _IN_WORDS.get(taken.orders.family)
        times = f"times in {log.time_unit}" if taken.orders.physical else ""
        orders = "; ".join(filter(None, (family if known else "", orders, times)))
        delays = " and ".join(
            f"{delay} from {signal_name('u', j, found.model.inputs)} (95 %: "
            f"{low if low == high else f'{low} to {high}'})"
            for j, delay, (low, high) in zip(found.moving, taken.orders.delays, taken.ranges, strict=True)
        )
        judge = "the record" if found.split == "none" else "the part that judges"
        better, tried = max(c.validation for c in chosen.candidates), len(chosen.candidates)
        better -= taken.validation
        beside = f"the best explains {better:.2g} % more" if better > 0.0 else "it explains most"
        compared = f"chosen of {tried} structures, of which {beside} of {judge}"
        name = signal_name("y", i, found.model.outputs)
        fact = (
            f"for {name}, {known or family} ({orders}), delay in samples {delays}; "
            f"{compared if tried > 1 else 'no other structure was compared'}"
        )
        said.append(kind.found(fact, where=name, family=family, structures=tried, better_percent=better))
    return said


@finding(NOTE, "output-drifts", "It was taken away, as `--detrend linear` does for identify and assess.")
def _drifting(kind: FindingKind, log: Record, found: Found) -> list[Finding]:
    """An output drifts along a line through all records. The inputs do not cause it."""
    said = []
    for i, slope in enumerate(found.slopes.tolist()):
        name, rate = signal_name("y", i, found.model.outputs), slope / log.step
        fact = f"{name}, by {rate:.4g} per {log.time_unit} whatever the inputs do"
        said += kind.when(slope, fact, where=name, slope=rate)
    return said


@finding(NOTE, "output-wanders", "Nothing, for steps of the input; else record the levels for longer.")
def _wandering(kind: FindingKind, found: Found) -> list[Finding]:
    """An output wanders as a random walk does. The gain is that of steps, not of distant levels."""
    names = [signal_name("y", i, found.model.outputs) for i, wanders in enumerate(found.wanders) if wanders]
    fact = "whatever the inputs do. The gain is that of the steps, not of levels that lie far apart"
    return [kind.found(f"{name}, {fact}", where=name) for name in names]


@finding(NOTE, "two-lags", "Nothing.")
def _two_lags(kind: FindingKind, log: Record, model: Model) -> list[Finding]:
    """The plant has two lags. A damping above 1 stands for two real poles."""
    return [
        kind.found(
            f"{slow:.4g} and {fast:.4g} {log.time_unit}, as the damping {damping:.3g} is above 1",
            damping=damping,
            lags=[slow, fast],
        )
        for damping, slow, fast in _real_lags(model)
    ]


def _real_lags(model: Model) -> Iterator[tuple[float, float, float]]:
    """Yield the damping and the two lags of each plant of second order that does not swing."""
    known = blocks_of(model)["plant"].get("parameters", {})
    for name, damping in known.items():
        time = known.get(name.replace("zeta", "T"))
        if name.startswith("zeta") and time is not None and damping > 1.0:
            apart = math.sqrt(damping**2 - 1.0)
            yield damping, time * (damping + apart), time * (damping - apart)


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
    names = [f"u{j + 1}" for j in found.still]
    return [
        kind.found(f"{name}. The model has no part of it, and is one in q^-1", where=name) for name in names
    ]


@finding(
    NOTE, "input-answers-noise", "Write the controller of the loop in the spec (`experiment.controller`)."
)
def _answering(
    kind: FindingKind, log: Record, found: Found, loops: Sequence[tuple[int, float]]
) -> list[Finding]:
    """The noise of the outputs helps to predict an input. The data may come from a loop."""
    said = []
    for j, p in loops:
        name = signal_name("u", j, found.model.inputs)
        fact, remedy = (
            f"{name} (probability {chance(p)} by chance)",
            _LOOP if log.r is None else _BEHIND_REFERENCE,
        )
        said.append(kind.found(fact, where=name, remedy=remedy, probability=p))
    return said


@finding(NOTE, "input-perhaps-idle", "Move that input more, or leave it out of `--columns`.")
def _idle(kind: FindingKind, found: Found) -> list[Finding]:
    """An input has no effect on the outputs that differs from none. Its delays and parameters say nothing."""
    idle = perhaps_zero(found.model, found.estimate, inputs=True) if found.model.inputs > 1 else ()
    fact = "its delays and parameters say nothing"
    return [kind.found(f"u{j + 1}; {fact}", where=f"u{j + 1}") for j in idle]


@finding(NOTE, "parameter-unknown", "Excite more frequencies, if that parameter matters.")
def _unknown(kind: FindingKind, found: Found) -> list[Finding]:
    """A parameter is not known to one digit. G may be right at the frequencies that the inputs excite."""
    named = open_parameters(found)
    fact = f"{', '.join(named)}. G may be right at the frequencies that the inputs excite"
    return kind.when(named, fact, where="".join(named[:1]).split(" = ")[0])


@finding(NOTE, "samples-of-moves", "Nothing.")
def _busiest(kind: FindingKind, log: Record, found: Found) -> list[Finding]:
    """The model is estimated from the samples in which the inputs move most. All would take minutes."""
    used = sum(len(y) for _, y in found.used)
    return kind.when(used < len(log.y), f"{used} of {len(log.y)}", samples=used)


@finding(NOTE, "blocks-in-turn", "Nothing; a record in which the input moves throughout is split in two.")
def _in_turn(kind: FindingKind, found: Found) -> list[Finding]:
    """Blocks of the record estimate and judge in turn. An input rests in one part of the record."""
    return kind.when(found.split == "blocks in turn", "an input rests in one part")
