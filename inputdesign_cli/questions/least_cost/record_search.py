"""Where no record of the cheapest spectrum fits within limits on samples: other signals, other spectra.

What costs least need not fit: where outputs are dear the inputs may be strong, and noise has high peaks.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from inputdesign_cli.compute.time_limit import OutOfTimeError, seconds_left, time_for_hints
from inputdesign_cli.design.convex.designs import Design, solve_design
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.findings.designed_records import other_signal, other_spectrum
from inputdesign_cli.questions.common.no_record import no_record, refuse_too_short
from inputdesign_cli.questions.common.record import (
    Made,
    RecordRequest,
    design_cost,
    designed_spectrum,
    least_period,
    make_record,
    ratio_before,
)
from inputdesign_cli.questions.least_cost.shortest_record import (
    ShortestRecord,
    Way,
    longest_search,
    pilot_length,
    reach,
)
from inputdesign_cli.signal.selection import LONG, Record

# From the design towards the least input power that meets the accuracy, with a little room there.
_SHARES = (0.8, 0.6, 0.4, 0.2, 0.0)
_ROOM = 1.02
_TOLERANCE = 1e-5
# Number of candidates of a long record: luck averages out.
_ENOUGH = 3
# How often a length is tried, by how much more than a spectrum takes, up to where, and to which gap.
_LENGTHS, _LONGER, _TRIED, _ROUGH = 4, 1.03, 20_000, 1e-4
# No record of a length is made if its pilot needs more than this multiple of that length.
_FAR_FROM = 1.03
# Spectra are compared on this number of frequencies, by the share of their power that differs.
_LINES, _SAME_SHAPE = 256, 0.01
_WORDS = {
    "filtered_noise": "noise",
    "multisine": "a multisine",
    "binary": "a binary signal",
    "ternary": "a signal of three levels",
    "slewed": "a signal of ramps between two levels",
}


def fitting_record(request: RecordRequest, question: Question, design: Design, samples: int) -> Made:
    """The record of the design; where none is found that meets the accuracy, one that does.

    Tried are spectra of less input power, and other kinds of signals; for a shortest experiment longer
    records. A kind that the spec states is not replaced: the error names the one that would do.

    Args:
        samples: of the experiment.

    Raises:
        InfeasibleError: `limits-too-tight`, with what was tried and what would do; `record-too-short`.
    """
    sought = _sought(request, question)
    if sought:
        # A spectrum may take fewer samples than any record has.
        samples = max(samples, least_period(design.problem.experiment.inputs) * request.settings.block)
        if request.searched and samples > LONG:
            pilot = _pilot(request, design, samples)
            if pilot.record is not None and reach(pilot.record, ratio_before(design, request.step)) > (
                _FAR_FROM * samples
            ):
                return _longer(pilot, [pilot.record], request.length(samples), question, Counter(), "")
    record = make_record(request, design, samples)
    plain = Made(record, request, design)
    if record is None:
        return plain
    if record.met or not request.searched:
        refuse_too_short(request, design.problem.experiment, record)
        return plain
    misses, tried, remedy = [record], Counter[str](), ""
    for of, spectrum, power in _others(request, question, design):
        other = Made(make_record(of, spectrum, samples), of, spectrum, power)
        if other.record is not None and other.record.met:
            if not request.stated_method or of is request:
                return _other_record(request, design, other)
            limited = "" if power is None else f" with limits.input_power: {power:.4g}"
            remedy = f"a record of this length does with signal.type: {of.settings.method}{limited}"
            break
        tried[_words(of)] += 1
        misses += [other.record] if other.record is not None else []
    return _longer(plain, misses, len(record.samples), question, tried, remedy)


def _pilot(request: RecordRequest, design: Design, samples: int) -> Made:
    """Make the short record that predicts the ratio of one of `samples` samples."""
    length = pilot_length(samples, request.settings.block)
    return Made(make_record(replace(request, samples=None), design, length, first=True), request, design)


def _sought(request: RecordRequest, question: Question) -> bool:
    """Whether the length of the record is looked for."""
    return question.goal == "samples" and request.samples is None


def _others(
    request: RecordRequest, question: Question, design: Design
) -> Iterator[tuple[RecordRequest, Design, float | None]]:
    """What else there is, with the limit on the input power: the nearest to what was asked first."""
    spectra: list[tuple[Design, float | None]] = []
    for power, spectrum in _of_less_power(question, design):
        spectra.append((spectrum, power))
        yield request, spectrum, power
    for kind in _kinds(request):
        for spectrum, limit in ((design, None), *spectra[:1], *spectra[-1:]):
            yield kind, spectrum, limit


def _of_less_power(question: Question, design: Design) -> Iterator[tuple[float, Design]]:
    """Designs for the same question under ever tighter limits on the input power."""
    if question.goal != "cost" or set(question.cost) == {"input"}:
        return
    own = design.problem.on(design.result.basis).power("input", None).at(design.result.x)
    cheapest = solve_design(replace(question, cost={"input": 1.0}), tolerance=_TOLERANCE)
    least = _ROOM * cheapest.result.objective
    for share in _SHARES if least < own else ():
        power = float(f"{least * (own / least) ** share:.4g}")
        limited = replace(question, limits=[*question.limits, PowerLimit("input", power)])
        yield power, solve_design(limited, tolerance=_TOLERANCE)


def _other_record(request: RecordRequest, design: Design, other: Made) -> Made:
    """Return the other record with its cost relative to the design that was asked for, and a finding."""
    record = other.record
    assert record is not None
    asked, own = (design_cost(each, request.cost) for each in (design, other.design))
    extra = (1.0 + record.extra_power) * own / asked - 1.0
    kind = _WORDS.get(record.method, record.method)
    goal, power = design.problem.goal, other.input_power
    found = other_spectrum(_words(request), kind, request.limit_keys, power, goal)
    return replace(other, record=replace(record, extra_power=extra), findings=(found,))


def _words(request: RecordRequest) -> str:
    method = request.settings.method
    return _WORDS.get(method, method)


def _longer(
    plain: Made, misses: Sequence[Record], samples: int, question: Question, tried: Counter[str], remedy: str
) -> Made:
    """The longer record of a shortest experiment, or the error with what was tried besides.

    Raises:
        InfeasibleError: `limits-too-tight`.
    """
    request, block = plain.request, plain.request.settings.block
    sought = _sought(request, question)
    allowed = request.most_samples if sought else 0
    longest = longest_search(samples, allowed, request.longest)
    search = ShortestRecord(
        _ways(plain, question, sought),
        block,
        longest if allowed is None else min(allowed // block * block, longest),
        ratio_before(plain.design, request.step),
        plain.design.problem.experiment.inputs,
    )
    found = search.search(misses, samples) if sought else None
    if found is not None:
        other = found.request.settings.method != request.settings.method
        return replace(found, findings=(other_signal(_words(found.request)),) if other else ())
    longer, ended = None, ""
    if allowed is not None:
        search.longest = longest
        try:
            with time_for_hints():
                longer = search.search(misses, max(samples, search.tried))
        except OutOfTimeError:
            seconds_left()  # that of the whole task may be over
            ended = "; longer records were not looked for further"
    if len(misses[0].samples) != samples:
        one = replace(request, settings=replace(request.settings, candidates=1, most_candidates=1))
        misses = [make_record(one, plain.design, samples) or misses[0]]
    missed, best = misses[0], "excites every parameter"
    if np.isfinite(missed.worst_ratio):
        reached = f"r_u / r_adm = {missed.worst_ratio:.4g} with power {missed.power:.4g}"
        best = f"meets the accuracy: the best of those tried reaches {reached}"
    kinds = [f"{kind} of {count} {'spectrum' if count == 1 else 'spectra'}" for kind, count in tried.items()]
    best += f"; tried besides: {', '.join(kinds)}" if kinds else ""
    hint = _what_would_do(request, None if longer is None else longer.record, search, allowed) + ended
    raise no_record(request, len(missed.samples), best, "; or ".join(filter(None, (hint, remedy))))


def _what_would_do(
    request: RecordRequest, longer: Record | None, search: ShortestRecord, allowed: int | None
) -> str:
    """Return which length would do, as far as it is known."""
    if longer is not None:
        samples = len(longer.samples)
        length = request.units.length(samples, "limits" if allowed else "experiment")
        return (
            f"{samples} samples can (power {longer.power:.4g}): set {length} (and signal.samples, if "
            "stated), raise the limits, or loosen the accuracy"
        )
    if search.longest < search.needed < np.inf:
        most = f"a record of the kinds that were tried would take about {search.needed:.3g} samples"
        return f"raise the limits: {most}"
    return "raise the limits"


def _ways(plain: Made, question: Question, sought: bool) -> list[Way]:
    """Return what is tried at a length: kinds of signals with the designed, then with the cheapest spectrum.

    Where the length is only part of a hint, one record of each kind is enough.
    """
    request, design = plain.request, plain.design
    kinds = [request, *([] if request.stated_method else _kinds(request))]
    if not sought:
        kinds = [
            replace(kind, settings=replace(kind.settings, candidates=1, most_candidates=1)) for kind in kinds
        ]

    @cache
    def cheapest(samples: int) -> Design | None:
        """Return the cheapest design of a stated length if its spectrum differs from the designed one."""
        stated = replace(question.of_length(samples), goal="cost", cost=request.cost)
        try:
            found = solve_design(stated, tolerance=_TOLERANCE, any_spectrum_tolerance=None)
        except UnreachableError:
            return None
        return None if _alike(request, design, found) else found

    def way(kind: RecordRequest, spectrum: Callable[[int], Design | None]) -> Way:
        of_any_length = replace(kind, samples=None)
        few = min(kind.settings.candidates, _ENOUGH)
        quick = replace(kind.settings, candidates=few, most_candidates=few)

        def made(samples: int, spectrum_of: int | None = None) -> Made | None:
            of = spectrum(spectrum_of or samples)
            wanted = of_any_length if samples <= LONG else replace(of_any_length, settings=quick)
            record = None if of is None else make_record(wanted, of, samples, first=True)
            return None if of is None else Made(record, kind, of)

        return made

    spectra: list[Callable[[int], Design | None]] = [lambda _: design]
    if sought:
        spectra.append(cheapest)
    return [way(kind, spectrum) for spectrum in spectra for kind in kinds]


def _kinds(request: RecordRequest) -> list[RecordRequest]:
    """Other kinds of signals that may stand in."""
    return [replace(request, settings=settings) for settings in request.others]


def _alike(request: RecordRequest, one: Design, other: Design) -> bool:
    """Whether two designs have spectra of one shape."""
    inputs = one.problem.experiment.inputs
    lines = [designed_spectrum(request, design, inputs).lines(_LINES).powers for design in (one, other)]
    if lines[0].shape != lines[1].shape:
        return False
    shapes = [powers / np.einsum("naa->", powers).real for powers in lines]
    return float(np.abs(shapes[0] - shapes[1]).sum()) < _SAME_SHAPE


def samples_of_record(request: RecordRequest, question: Question, samples: int) -> int | None:
    """Return the length of a record that meets the accuracy, or None if none is found.

    Args:
        samples: the length at which a spectrum meets it.

    Raises:
        OutOfTimeError: see `seconds_left`.
    """
    for number in range(_LENGTHS):
        samples = max(int(np.ceil(samples * _LONGER)), 2)
        if samples > _TRIED:
            return None
        try:
            design = solve_design(question.of_length(samples), tolerance=_ROUGH, any_spectrum_tolerance=None)
        except UnreachableError:
            return None
        if number == 0 and samples > LONG:
            record = _pilot(request, design, samples).record
        else:
            record = make_record(replace(request, samples=None), design, samples, first=True)
        if record is None or not np.isfinite(record.worst_ratio):
            return None
        if record.met and len(record.samples) >= samples:
            return samples
        samples = max(int(np.ceil(len(record.samples) * record.worst_ratio**2)), samples)
    return None
