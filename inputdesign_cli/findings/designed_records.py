"""What a user should know before applying the record of a design or of a given spectrum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from inputdesign_cli.finding import Finding, doubt, note
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.signal.selection import Record

_FALLS_SHORT = 5e-3
_DEAR = 1.0  # beyond the cost of the design, relative to it

RECORD_TOO_LONG = note(
    "record-not-computed",
    "The experiment is too long to compute its record. It has more samples than the longest record that is "
    "computed for this model.",
    "Set a shorter record with `signal.samples`.",
)
RECORD_UNDETERMINED = doubt(
    "record-undetermined",
    "The record does not determine all parameters. Its information matrix is singular to working precision, "
    "so that the accuracy cannot be computed.",
    "Take more samples (`signal.samples`), or a model of lower order.",
)
RECORD_MISSES = doubt(
    "record-misses-accuracy",
    "The record misses the accuracy. The largest ratio r_u/r_adm of its samples exceeds one.",
    "Take more samples, or allow more power.",
)
RECORD_DEAR = doubt(
    "record-dear",
    "The record costs far more than the spectrum. A short record loses the response after its last sample, "
    "because of dead times and time constants.",
    "Take more samples.",
)
RECORD_LONGER = note(
    "record-longer",
    "Limits on single samples require a longer record. The spectrum alone needs fewer samples. The length "
    "was found by trial, without proof.",
    "Nothing, or widen the limit on single samples that the record uses most.",
)
RECORD_LESS_ACCURATE = note(
    "record-less-accurate",
    "The record is less accurate than the design. The accuracy of the design holds for its spectrum. The "
    "finite length or limits on single samples reduce it.",
    "Take more samples, or more candidates (`signal.candidates`).",
)
RECORD_MISSES_SIDE = doubt(
    "record-misses-requirement",
    "The record misses a requirement that the design meets. The search for the record aims at another "
    "requirement.",
    "Take more samples, or loosen the requirement.",
)
START_MATTERS = doubt(
    "start-from-rest",
    "The record relies on its start from rest. Its errors would be larger if the initial state were "
    "unknown. Spectra have no initial state.",
    "Keep the plant at rest before the record. Measure inputs and outputs from their levels there.",
)
OTHER_SIGNAL = note(
    "other-signal",
    "The record has another kind or spectrum than requested. No record of the first choice met the accuracy "
    "within the limits on single samples.",
    "Nothing, or state `signal.type`.",
)


def too_long(samples: int, longest: int) -> list[Finding]:
    """Return a finding if a record has more samples than any that is computed."""
    message = (
        f"there is no record: it would have {samples} samples, and at most {longest} are computed for this "
        "model; signal.samples sets a shorter one"
    )
    found = RECORD_TOO_LONG.found(message, where="signal.samples", samples=samples, longest=longest)
    return [found] if samples > longest else []


def accuracy_missed(record: Record, *, held: bool) -> list[Finding]:
    """Return a finding if a record misses the accuracy; limits, a level or the length may hold its power."""
    if record.met:
        return []
    if not np.isfinite(record.worst_ratio):
        message = (
            "the record does not determine all parameters to working precision: its accuracy cannot be "
            "computed; take more samples (signal.samples), or a model of lower order"
        )
        return [RECORD_UNDETERMINED.found(message, where="signal.samples")]
    why = (
        "the limits on the powers, the level asked for or its length leave no room: a little more power or "
        "a few more samples would do"
        if held
        else "no level of it would do, since too little of its effect comes before its last sample: take "
        "more samples"
    )
    message = f"the record misses the accuracy: its worst ratio is {record.worst_ratio:.7g}; {why}"
    return [RECORD_MISSES.found(message, where="signal", worst_ratio=record.worst_ratio)]


def length_of_record(record: Record, asked: int, block: int, shares: Mapping[str, float]) -> list[Finding]:
    """Return a finding if a record is longer than was asked for, or dear for want of samples.

    Args:
        asked: its samples by the spec, or by the spectrum.
        block: lengths are multiples of this.
        shares: of each limit on single samples that it takes.
    """
    size, times = len(record.samples), 1.0 + record.extra_power
    if record.method == "given":
        return []
    if size > asked + block:
        nearest = max(shares, key=lambda name: shares[name], default=None)
        share = f"; the record takes {100 * shares[nearest]:.3g} % of limits.{nearest}" if nearest else ""
        message = (
            f"within the limits on single samples {size} samples are the shortest record that was found, by "
            f"trying, to one per cent; the spectrum alone would take {asked}{share}"
        )
        return [RECORD_LONGER.found(message, where="signal", samples=size, of_spectrum=asked)]
    message = (
        f"the record costs {times:.3g} times what the designed spectrum does: its {size} samples are few "
        "beside the dead times and time constants of the plant; much of their effect comes after the last "
        "one; take more samples"
    )
    found = RECORD_DEAR.found(message, where="signal.samples", times=times)
    return [found] if record.extra_power > _DEAR else []


def less_accurate(reached: float, designed: float) -> list[Finding]:
    """Return a finding if a record reaches a larger multiple of the admissible error than its design."""
    more = reached / designed - 1.0
    message = (
        f"the record reaches {reached:.4g} times the admissible error, the design {designed:.4g}: "
        f"{per_cent(more)} more, by its length or by the limits on single samples"
    )
    found = RECORD_LESS_ACCURATE.found(message, where="signal", reached=reached, designed=designed)
    return [found] if more > _FALLS_SHORT else []


def requirement_missed(names: Sequence[str], ratio: float) -> list[Finding]:
    """Return a finding if a record misses requirements that its design meets; `ratio` is the worst."""
    message = (
        f"the record misses {' and '.join(names)}, which the design meets: its worst ratio is {ratio:.4g}"
    )
    found = RECORD_MISSES_SIDE.found(message, where="signal", worst_ratio=ratio)
    return [found] if ratio > 1.0 + _FALLS_SHORT else []


def start_matters(growth: float) -> Finding:
    """Return the finding that errors grow by this factor where the start of a record is unknown."""
    known = np.isfinite(growth)
    errors = f"its errors would be {growth:.3g} times as large" if known else "it would not determine all "
    message = (
        "the record relies on its start from rest, which spectra and the bounds on them do not know: begun "
        f"in an unknown state about unknown levels {errors}{'' if known else 'parameters'}; keep the plant "
        "at rest before the record begins, and take inputs and outputs from their levels there"
    )
    return START_MATTERS.found(message, where="signal", growth=growth if known else None)


def other_signal(kind: str) -> Finding:
    """Return the finding that a record is of another kind than the first choice."""
    return OTHER_SIGNAL.found(f"the record is {kind}", where="signal.type", kind=kind)


def other_spectrum(asked: str, kind: str, limits: Sequence[str], power: float | None, goal: str) -> Finding:
    """Return the finding that another record stands in for one that was not found.

    Args:
        asked: the kind of signal that was asked for; `kind`: that of the record.
        limits: the keys that the record keeps.
        power: the limit on the input power that gives its spectrum; None if that is the designed one.
        goal: of the design.
    """
    another = "that spectrum" if power is None else "another spectrum, that of limits.input_power: "
    message = (
        f"no record of {asked} with the {'cheapest' if goal == 'cost' else 'designed'} spectrum was found "
        f"that meets the accuracy within {' and '.join(limits)}; the record is {kind} with "
        f"{another}{'' if power is None else f'{power:.4g}'}"
    )
    return OTHER_SIGNAL.found(message, where="signal.type", kind=kind, input_power=power)
