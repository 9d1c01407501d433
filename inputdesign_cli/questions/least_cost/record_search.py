"""Where no record of the cheapest spectrum fits within limits on samples: other signals, other spectra.

What costs least need not fit: where outputs are dear the inputs may be strong, and noise has high peaks.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from inputdesign_cli.design.convex.designs import Design, solve_design
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.findings.designed_records import other_signal, other_spectrum
from inputdesign_cli.questions.common.infeasible import no_record, refuse_too_short
from inputdesign_cli.questions.common.record import (
    Made,
    RecordRequest,
    design_cost,
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
# No record of a length is made if its pilot needs more than this multiple of that length.
_FAR_FROM = 1.03
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
    sought = question.goal == "samples" and request.samples is None
    if sought:
        # A spectrum may take fewer samples than any record has.
        samples = max(samples, least_period(design.problem.experiment.inputs) * request.settings.block)
        if request.searched and samples > LONG:
            length = pilot_length(samples, request.settings.block)
            pilot = make_record(replace(request, samples=None), design, length, first=True)
            before = ratio_before(design, request.step)
            if pilot is not None and reach(pilot, before) > _FAR_FROM * samples:
                return _longer(request, question, design, [pilot], request.length(samples))
    record = make_record(request, design, samples)
    if record is None or record.met or not request.searched:
        if record is not None:
            refuse_too_short(request, design.problem.experiment, record)
        return Made(record, request, design)
    misses, tried, remedy = [record], Counter[str](), ""
    for of, spectrum, power in _others(request, question, design):
        other = Made(make_record(of, spectrum, samples), of, spectrum, power)
        if other.record is not None and other.record.met:
            if not request.stated_method or of is request:
                return _other_record(request, design, other, other.record)
            limited = "" if power is None else f" with limits.input_power: {power:.4g}"
            remedy = f"a record of this length does with signal.type: {of.settings.method}{limited}"
            break
        tried[_words(of)] += 1
        misses += [other.record] if other.record is not None else []
    if sought:
        return _longer(request, question, design, misses, len(record.samples), tried, remedy)
    before = ratio_before(design, request.step)
    raise _refusal(request, record, min(reach(one, before) for one in misses), tried, remedy)


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
    own = design_cost(design, {"input": 1.0})
    cheapest = solve_design(replace(question, cost={"input": 1.0}), tolerance=_TOLERANCE)
    least = _ROOM * cheapest.result.objective
    for share in _SHARES if least < own else ():
        power = float(f"{least * (own / least) ** share:.4g}")
        limited = replace(question, limits=[*question.limits, PowerLimit("input", power)])
        yield power, solve_design(limited, tolerance=_TOLERANCE)


def _other_record(request: RecordRequest, design: Design, other: Made, record: Record) -> Made:
    """Return the other record with its cost relative to the design that was asked for, and a finding."""
    asked, own = (design_cost(each, request.cost) for each in (design, other.design))
    extra = (1.0 + record.extra_power) * own / asked - 1.0
    kind = _WORDS.get(record.method, record.method)
    goal, power = design.problem.goal, other.input_power
    found = other_spectrum(_words(request), kind, request.limit_keys, power, goal)
    return replace(other, record=replace(record, extra_power=extra), findings=(found,))


def _words(request: RecordRequest) -> str:
    method = request.settings.method
    return _WORDS.get(method, method)


def _kinds(request: RecordRequest) -> list[RecordRequest]:
    """Other kinds of signals that may stand in."""
    return [replace(request, settings=settings) for settings in request.others]


def _longer(
    request: RecordRequest,
    question: Question,
    design: Design,
    misses: Sequence[Record],
    samples: int,
    tried: Counter[str] | None = None,
    remedy: str = "",
) -> Made:
    """The longer record of a shortest experiment, or the error with what was tried besides.

    Raises:
        InfeasibleError: `limits-too-tight`.
    """
    block, allowed = request.settings.block, request.most_samples
    longest = longest_search(samples, allowed, request.longest)
    search = ShortestRecord(
        _ways(request, question, design),
        block,
        longest if allowed is None else min(allowed // block * block, longest),
        ratio_before(design, request.step),
        design.problem.experiment.inputs,
    )
    found = search.search(misses, samples)
    if found is not None:
        other = found.request.settings.method != request.settings.method
        return replace(found, findings=(other_signal(_words(found.request)),) if other else ())
    missed = misses[0]
    if len(missed.samples) != samples:
        one = replace(request, settings=replace(request.settings, candidates=1, most_candidates=1))
        missed = make_record(one, design, samples) or missed
    raise _refusal(request, missed, search.needed, tried or Counter(), remedy)


def _refusal(
    request: RecordRequest, missed: Record, needed: float, tried: Counter[str], remedy: str
) -> InfeasibleError:
    """Return the error that no record was found, with what was tried and about how many samples would do."""
    best = "excites every parameter"
    if np.isfinite(missed.worst_ratio):
        reached = f"r_u / r_adm = {missed.worst_ratio:.4g} with power {missed.power:.4g}"
        best = f"meets the accuracy: the best of those tried reaches {reached}"
    kinds = [f"{kind} of {count} {'spectrum' if count == 1 else 'spectra'}" for kind, count in tried.items()]
    best += f"; tried besides: {', '.join(kinds)}" if kinds else ""
    hint = "raise the limits, or loosen the accuracy"
    if np.isfinite(needed):
        hint += f": a record of the kinds that were tried would take about {needed:.3g} samples"
    return no_record(request, len(missed.samples), best, "; or ".join(filter(None, (hint, remedy))))


def _ways(request: RecordRequest, question: Question, design: Design) -> list[Way]:
    """Return what is tried: kinds of signals with the designed, then with the cheapest spectrum."""

    @cache
    def cheapest(samples: int) -> Design | None:
        """Return the cheapest design of a stated length."""
        stated = replace(question.of_length(samples), goal="cost", cost=request.cost)
        try:
            return solve_design(stated, tolerance=_TOLERANCE, any_spectrum_tolerance=None)
        except UnreachableError:
            return None

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

    kinds = [request, *([] if request.stated_method else _kinds(request))]
    return [way(kind, spectrum) for spectrum in (lambda _: design, cheapest) for kind in kinds]
