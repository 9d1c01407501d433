"""Findings on the record of a design, of a given spectrum or of a top-up, before it is applied."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import DOUBT, NOTE, Finding, FindingKind, doubt, finding, note
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.signal.selection import Record
from inputdesign_cli.signal.settings import Quantiser

_FALLS_SHORT = 5e-3  # relative excess of a ratio that is reported
_FAR = 0.1  # relative distance from the bound over all records that is reported
_NOTABLE = 0.01  # share of the largest move that is reported
_EXPENSIVE = 1.0  # cost beyond that of the spectrum, relative to it, that is reported

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
    "The record costs far more than the spectrum. A short record loses the response after its last sample. "
    "A PRBS has a spectrum of its own.",
    "Take more samples, or another `signal.type`.",
)
RECORD_LONGER = note(
    "record-longer",
    "The record is longer than its spectrum alone needs. A limit on single samples requires it, the fewest "
    "values of a period, or the response that its end cuts off. It was found by trial, without proof.",
    "Nothing, or widen the limit on single samples that the record uses most.",
)
OTHER_SIGNAL = note(
    "other-signal",
    "The record has another kind or spectrum than requested. No record of the first choice met the accuracy "
    "within the limits on single samples.",
    "Nothing, or state `signal.type`.",
)


@finding(NOTE, "record-not-computed", "Set a shorter record with `signal.samples`.")
def too_long(kind: FindingKind, samples: int, longest: int, *, sought: bool = False) -> list[Finding]:
    """The experiment is too long to compute its record. There is a longest record for each model."""
    fact = f"it has {samples} samples, and at most {longest} are computed for this model"
    where, remedy = "signal.samples", ""
    if sought:  # no shorter one would do
        where, remedy = "limits", "Raise the limits, or loosen the accuracy."
    return kind.when(samples > longest, fact, where=where, remedy=remedy, samples=samples, longest=longest)


@finding(NOTE, "record-too-few-values", "Take more samples, a shorter `signal.hold`, or fewer periods.")
def too_short(kind: FindingKind, values: int, fewest: int) -> list[Finding]:
    """The experiment is too short for a record. Each input needs some values of its own in a period."""
    fact = f"a period has {values} values, and at least {fewest} are needed"
    return kind.when(values < fewest, fact, where="signal.samples", values=values, fewest=fewest)


def accuracy_missed(record: Record) -> list[Finding]:
    """Return a finding if a record misses the accuracy."""
    if not (record.met or np.isfinite(record.worst_ratio)):
        return [RECORD_UNDETERMINED.found(where="signal.samples")]
    fact, ratio = f"its worst ratio is {record.worst_ratio:.7g}", record.worst_ratio
    return RECORD_MISSES.when(not record.met, fact, where="signal", worst_ratio=ratio)


def requirement_missed(names: Sequence[str], ratio: float) -> list[Finding]:
    """Return a finding if a record misses a requirement at which its search does not aim."""
    fact = f"the worst ratio of {' and '.join(names)} is {ratio:.4g}"
    return RECORD_MISSES.when(ratio > 1.0 + _FALLS_SHORT, fact, where="signal", worst_ratio=ratio)


def length_of_record(
    record: Record, asked: int, block: int, fewest: int, shares: Mapping[str, float]
) -> list[Finding]:
    """Return a finding if a record is longer than was asked for, or dear for want of samples.

    Args:
        asked: the number of samples by the spec, or by the spectrum.
        block: lengths are multiples of this.
        fewest: the fewest values of a period.
        shares: used share of each limit on single samples.
    """
    size, times = len(record.samples), 1.0 + record.extra_power
    if record.method == "given":
        return []
    if size > asked + block:
        nearest = max(shares, key=lambda name: shares[name], default="")
        where, remedy, why = "signal", "", "the response to its last samples is lost"
        if size == fewest * block:
            why = f"a period has at least {fewest} values"
            if block > 1:
                where, remedy = "signal.hold", "A shorter signal.hold or fewer signal.periods shorten it."
        elif nearest:
            where = f"limits.{nearest}"
            uses = f"{100 * shares[nearest]:.3g} % of {where}"
            why = f"no shorter one of this kind was found, to one per cent; it uses {uses}"
        fact = f"{size} samples in place of {asked}, because {why}"
        return [RECORD_LONGER.found(fact, where=where, remedy=remedy, samples=size, of_spectrum=asked)]
    dear = record.extra_power > _EXPENSIVE
    return RECORD_DEAR.when(dear, f"{times:.3g} times as much", where="signal.samples", times=times)


@finding(NOTE, "record-less-accurate", "Take more samples, candidates or seconds (`signal`).")
def less_accurate(kind: FindingKind, reached: float, designed: float) -> list[Finding]:
    """The record is less accurate than the design. Finite length or limits on samples reduce accuracy.

    Args:
        reached, designed: multiples of the admissible error.
    """
    more = reached / designed - 1.0
    fact = f"it reaches {reached:.4g} times the admissible error, {per_cent(more)} more than {designed:.4g}"
    remedy = "It is below 1, which is enough." if reached <= 1.0 else ""
    return kind.when(
        more > _FALLS_SHORT, fact, where="signal", remedy=remedy, reached=reached, designed=designed
    )


@finding(NOTE, "bound-of-power-only", "Take `signal.hold: auto` if the actuator may keep its values as long.")
def short_windows(kind: FindingKind, seen: int, remembered: float, distance: float | None) -> list[Finding]:
    """The bound over all records equals that of the power. It sees fewer samples than the plant remembers.

    Args:
        seen: samples in a window of the bound.
        remembered: the slowest time constant of the plant in samples.
        distance: relative distance of the record from the bound.
    """
    fact = f"the slowest time constant is {remembered:.3g} samples, and a window of the bound has {seen}"
    far = distance is not None and distance > _FAR and remembered > seen
    return kind.when(far, fact, where="signal.hold", seen=seen, distance=distance)


@finding(
    DOUBT,
    "start-from-rest",
    "Let the plant come to rest before. Give its levels there to assess (`--operating-point`).",
)
def start_matters(kind: FindingKind, growth: float) -> Finding:
    """The promised accuracy needs a plant at rest before the record. Its levels there have to be known.

    Otherwise the initial state and the levels are estimated too, which costs accuracy.

    Args:
        growth: the factor by which errors grow if the start is not known.
    """
    known, fact = bool(np.isfinite(growth)), "otherwise the record does not determine all parameters"
    fact = f"otherwise errors are {growth:.3g} times as large" if known else fact
    return kind.found(fact, where="signal", growth=growth if known else None)


@finding(
    NOTE, "noise-moves-input", "Leave that room in `limits.amplitude`, or let the actuator reach its ends."
)
def noise_moves_input(kind: FindingKind, deviations: Array, peaks: Sequence[float]) -> list[Finding]:
    """The controller passes noise on to the input. Limits on single samples do not count it.

    Args:
        deviations: (r,), standard deviations of the inputs by the noise alone.
        peaks: (r,), peaks of the inputs without noise.
    """
    beside = list(enumerate(zip(deviations.tolist(), peaks, strict=True), start=1))
    fact = " and ".join(
        f"{size:.3g} to u{j}, whose peak is {peak:.3g} without it" for j, (size, peak) in beside
    )
    fact = f"it adds a standard deviation of {fact}"
    seen = any(size > _NOTABLE * peak for _, (size, peak) in beside)
    return kind.when(seen, fact, where="limits.amplitude", deviations=deviations.tolist())


@finding(NOTE, "level-rounded", "State `signal.offset` at a value of the converter, or give it more bits.")
def level_rounded(kind: FindingKind, quantisers: Sequence[Quantiser], peak: float) -> list[Finding]:
    """The record moves about another level than signal.offset. A converter has only values of its own.

    Args:
        quantisers: one for each input, in the converter's own units.
        peak: the largest move from the level; a shift of a small share of it is not worth a note.
    """
    return [
        kind.found(
            f"input {j} stands at {one.operating_point:.6g} in place of {one.offset:.6g}",
            where="signal.offset",
            level=one.operating_point,
            offset=one.offset,
        )
        for j, one in enumerate(quantisers, start=1)
        if abs(one.operating_point - one.offset) > _NOTABLE * peak
    ]


def other_signal(kind: str, power: float | None = None) -> Finding:
    """Return the finding that a record is of another kind or spectrum than the first choice.

    Args:
        power: the limit on the input power that gives its spectrum; None if that is the designed one.
    """
    spectrum = "" if power is None else f", with the spectrum of limits.input_power: {power:.4g}"
    return OTHER_SIGNAL.found(f"it is {kind}{spectrum}", where="signal.type", kind=kind, input_power=power)


def level_notes(
    levels: Mapping[str, float], point: Sequence[float] | None, means: Array | None, swings: Array
) -> list[Finding]:
    """Return what the user should know before the record is applied.

    Args:
        levels: the levels that were subtracted from the data, by channel.
        point: the levels of the inputs about which the record varies; None for zero.
        means: (r,), means of the recorded inputs; None: not known.
        swings: (r,), the largest deviations of the inputs from their means. Smaller means are not reported,
            since means of short records are uncertain.
    """
    found = _about_levels(point) if point is not None and levels else []
    if means is None or (point is not None and not levels):  # the spec states it
        return found
    unknown = {
        j: float(f"{mean:.4g}")
        for j, (mean, swing) in enumerate(zip(means, swings, strict=True))
        if f"u{j + 1}" not in levels and abs(mean) > swing
    }
    offsets = [unknown.get(j, 0.0 if point is None else point[j]) for j in range(len(means))]
    return [*found, *_about_zero(unknown, offsets)]


@finding(NOTE, "about-an-operating-point", "Apply `signal.csv` unchanged.")
def _about_levels(kind: FindingKind, point: Sequence[float]) -> list[Finding]:
    """The record varies about the operating point. `signal.csv` includes the levels of the data."""
    about = ", ".join(f"u{j + 1} = {level:g}" for j, level in enumerate(point))
    return [kind.found(about, where="signal.csv", levels=list(point))]


@finding(
    DOUBT,
    "record-about-zero",
    "Write these levels as `signal.offset` and assess again, or add them to `signal.csv`.",
)
def _about_zero(kind: FindingKind, unknown: Mapping[int, float], offsets: Sequence[float]) -> list[Finding]:
    """The new record moves inputs about zero, but the data were recorded at other levels.

    The spec has no `signal.offset`. Applied as it is, the record would move the plant far away.
    """
    at = " and ".join(f"u{j + 1} = {level:g}" for j, level in unknown.items())
    offset = f"{offsets[0]:g}" if len(offsets) == 1 else f"[{', '.join(f'{x:g}' for x in offsets)}]"
    remedy = f"Write signal.offset: {offset} and assess again, or add that to signal.csv."
    fact = f"their mean is {at}"
    return kind.when(unknown, fact, where="signal.offset", remedy=remedy, offset=list(offsets))
