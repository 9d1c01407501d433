"""Where no record of the cheapest spectrum fits within limits on samples: other signals, spectra, lengths.

The cheapest spectrum need not fit: if outputs are expensive, inputs may be strong, and noise has high peaks.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import islice

import numpy as np
import scipy

from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.design.convex.designs import Design, solve_design
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.limits import Goal, PowerLimit
from inputdesign_cli.design.convex.record_bound import RecordBound, bound_over_records
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.findings.designed_records import other_signal
from inputdesign_cli.questions.common.record import (
    Made,
    RecordRequest,
    design_cost,
    least_period,
    level_search,
    make_record,
    no_record,
    of_samples,
    ratio_before,
    refuse_too_short,
)
from inputdesign_cli.questions.common.searched_record import searches
from inputdesign_cli.signal.evaluation import MET
from inputdesign_cli.signal.selection import LONG, Record

# The longest record that is tried: this multiple of the samples asked for, or the second number if larger.
_LONGEST, _AT_LEAST = 64, 20_000
_LEAP, _DOUBLE = 8.0, 2.0  # largest growth of a length at once; growth where a ratio is infinite
# The ratio of fewer samples predicts nothing for longer records: a dead time may outlast them.
_FEW = 100
_GROWTH, _MOST_GROWTHS = 1.03, 100.0
_FAR = 1.5
_FINE, _STEP = 0.01, 0.009
_LENGTHS = 24
_FALLS = 0.9  # a predicted length must fall to this share of the one before
_BEYOND = 1.25  # a predicted length of this multiple of the longest is out of reach of chance
# A way is not tried if it missed at a nearby length by this factor: other phases usually change less.
_NEARBY, _HOPELESS, _HOPELESS_LONG = 1.2, 1.15, 1.01
# A long record takes seconds to make. A pilot, shorter by the first factor, but of at least the second number
# of samples, predicts its ratio: information grows with the length, and chance averages out.
_PILOT, _FEWEST = 16, 1000
_MARGIN = 1.005
# Near the shortest length it is chance whether a record suffices: all ways are tried at these shares of it.
_BELOW = (0.96, 0.9)


Way = Callable[[int, int], Made | None]
"""Makes a record of one length with the spectrum for another: the first that suffices, or the best."""


# Input powers from the design's (1) to the least that meets the accuracy with a margin (0), on a log scale.
_SHARES = (0.8, 0.6, 0.4, 0.2, 0.0)
_ROOM = 1.02
_TOLERANCE = 1e-5
# Number of candidates of a long record: chance averages out.
_ENOUGH = 3
# No record of a length is made if its pilot needs more than this multiple of that length.
_FAR_FROM = 1.03
# The longest windows of the bound that proves that no record meets the accuracy.
_WINDOWS = 12
_WORDS = {
    "filtered_noise": "noise",
    "multisine": "a multisine",
    "binary": "a binary signal",
    "ternary": "a signal of three levels",
    "slewed": "a signal of ramps between two levels",
}


def reach(record: Record, before: float = np.inf) -> float:
    """Return the length that a record needs if information grows with it; `before` is the ratio at zero."""
    if not np.isfinite(record.worst_ratio):
        return _DOUBLE * len(record.samples)
    known = before**-2.0
    gain = record.worst_ratio**-2.0 - known
    return len(record.samples) * (1.0 - known) / gain if gain > 0.0 else np.inf


def pilot_length(samples: int, block: int) -> int:
    """Return the length of the pilot record that predicts the ratio of a record of `samples` samples."""
    return -(-max(samples // _PILOT, _FEWEST) // block) * block


@dataclass
class ShortestRecord:
    """Searches the shortest record by trying lengths, multiples of `block` up to `longest`, in `ways`.

    At a long length only the most promising way is tried. `before` is the ratio without a record.
    """

    ways: Sequence[Way]
    block: int
    longest: int
    before: float = np.inf
    inputs: int = 1  # a period has an equal block for each
    needed: float = 0.0  # length that is predicted to suffice by the records that missed
    _missed: dict[int, Record] = field(default_factory=dict)  # the latest miss of each way
    _tried: set[tuple[int, int]] = field(default_factory=set)  # ways and lengths
    _found: Made | None = None
    _low: int = 0
    _high: int = 0
    _hopeless: float = _HOPELESS

    def search(self, misses: Sequence[Record], low: int | None = None) -> Made | None:
        """Return the shortest record that meets the accuracy, to one per cent, or so far when time ends.

        The `misses` are records that missed it; records longer than `low` are tried. It raises
        `OutOfTimeError` if time ends before one is found.
        """
        self._low = low or len(misses[0].samples)
        self.needed = min(map(self._reach, misses))
        if self._low > LONG:
            self._try_pilots(misses[0])
        try:
            for length in islice(self._proposed(), _LENGTHS):
                made = self._met(length)
                if made is not None:
                    self._high, self._found = length, made
                else:
                    self._low = length
                    self.needed = min(map(self._reach, self._missed.values()), default=length)
        except OutOfTimeError:
            if self._found is None:
                raise
        return self._found

    def _try_pilots(self, first: Record) -> None:
        """Make a short record in each way (`first` in the first), which shows the most promising one."""
        length = pilot_length(self._low, self.block)
        for number, way in enumerate(self.ways):
            if number == 0 and len(first.samples) == length:
                self._missed[number] = first
                continue
            made = way(length, max(self._low, self._rounded(min(self.needed, self.longest))))
            if made is not None and made.record is not None:
                self._missed[number] = made.record
                self.needed = min(self.needed, self._reach(made.record))

    def _proposed(self) -> Iterator[int]:
        """Yield lengths: ever longer ones, then between a miss and the one found, then shorter ones."""
        growths, step, below, before = 0, _STEP, [*_BELOW], np.inf
        while self._found is None:
            low = self._low
            # An estimate of the needed length that was repeatedly too low is no guide.
            least, margin = (_MARGIN, _MARGIN) if low > LONG else (_GROWTH, 1.0)
            growth = min(least ** min(2.0**growths, _MOST_GROWTHS), _LEAP)
            length = self._rounded(min(max(margin * self.needed, growth * low), _LEAP * low, self.longest))
            # Records shorter than the memory of the plant predict far too great a length.
            far = self.needed > max(_BEYOND * self.longest, _FALLS * before)
            if length <= low or (growths > 0 and low >= _FEW and far):
                return
            before, growths = self.needed if growths > 0 else np.inf, growths + 1
            yield length
        while self._high - self._low > max(_FINE * self._high, self.block):
            low, high = self._low, self._high
            middle = np.sqrt(low * high) if high > _FAR * low else 0.5 * (low + high)
            if high > LONG:  # the first length was predicted, and is hardly too long
                middle, step = max(middle, (1.0 - step) * high), min(2.0 * step, 1.0)
            whole = int(np.ceil(middle / self.block)) * self.block
            length = self._rounded(middle) if self._rounded(middle) < high else whole
            if length in (low, high):
                break
            yield length
        self._hopeless = np.inf  # short records may suffice by chance
        while self._high <= LONG and below:
            high, shorter = self._high, int(below.pop(0) * self._high / self.block) * self.block
            if 0 < shorter < high:
                yield shorter
                below = [*_BELOW] if self._high < high else below

    def _met(self, samples: int) -> Made | None:
        """Return a record of this length that meets the accuracy, the most promising way tried first."""

        def promise(number: int) -> float:
            """Return the length that its latest miss predicts; a way without a miss comes first."""
            return self._reach(self._missed[number]) if number in self._missed else 0.0

        long = samples > LONG
        hopeless = _HOPELESS_LONG if long else self._hopeless
        for number in sorted(range(len(self.ways)), key=promise):
            missed = self._missed.get(number)
            near = missed is not None and samples < _NEARBY * len(missed.samples)
            if (number, samples) in self._tried or (near and samples * hopeless < promise(number)):
                if long:
                    return None
                continue
            self._tried.add((number, samples))
            made = self.ways[number](samples, samples)
            if made is None or made.record is None:
                continue
            if made.record.met:
                return made
            self._missed[number] = made.record
            if long:
                return None
        return None

    def _reach(self, record: Record) -> float:
        return reach(record, self.before)

    def _rounded(self, length: float) -> int:
        """Return the next length of whole blocks; if long, one with a fast transform if it is near."""
        whole = int(np.ceil(length / self.block)) * self.block
        unit = self.block * self.inputs
        fast = unit * int(scipy.fft.next_fast_len(int(np.ceil(length / unit))))
        return whole if whole <= LONG or fast > min(_MARGIN * whole, self.longest) else fast


def fitting_record(request: RecordRequest, question: Question, design: Design, samples: int) -> Made:
    """Return the record of the design; where none is found that meets the accuracy, one that does.

    It tries spectra of less input power, and other kinds of signals; for a shortest experiment longer
    records. A kind that the spec states is not replaced: the error names the one that would do. A shortest
    record of a few levels is shortened by a search.

    Raises:
        InfeasibleError: `limits-too-tight`, with what was tried and what would do; `record-too-short`.
    """
    made = _first_fitting(request, question, design, samples)
    sought = question.goal == "samples" and request.samples is None
    if made.record is None or not sought or not searches(design, made.request.settings):
        return made
    search = level_search(made.request, design)
    shortest = search.shortest(made.record.samples)
    return replace(made, record=of_samples(made.request, search, made.record, shortest))


def _first_fitting(request: RecordRequest, question: Question, design: Design, samples: int) -> Made:
    """Return the record of the design, of another spectrum, of another kind, or a longer one."""
    sought = question.goal == "samples" and request.samples is None
    if sought:
        # A spectrum may need fewer samples than the shortest possible record has.
        samples = max(samples, least_period(design.problem.experiment.inputs) * request.settings.block)
        if request.searched and samples > LONG and request.length(samples) <= request.longest:
            length = pilot_length(samples, request.settings.block)
            pilot = make_record(replace(request, samples=None), design, length, first=True)
            before = ratio_before(design, request.step)
            if pilot is not None and reach(pilot, before) > _FAR_FROM * samples:
                return _longer(request, question, design, [pilot], request.length(samples))
    record = make_record(request, design, samples)
    if record is not None and not record.met and sought and not request.bounds.hard and request.meets:
        # Powers alone are limited, and a record from rest loses the response to its last samples. If longer
        # ones fail too, the first record is kept with a doubt, unless its ratio is infinite.
        try:
            return _longer(request, question, design, [record], len(record.samples))
        except InfeasibleError:
            if not np.isfinite(record.worst_ratio):
                raise
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
    proof = _impossible(request, question, len(record.samples))
    needed = min(reach(one, before) for one in misses)
    raise _refusal(request, record, needed, tried, remedy, proof)


def _others(
    request: RecordRequest, question: Question, design: Design
) -> Iterator[tuple[RecordRequest, Design, float | None]]:
    """Yield other designs with their limit on the input power: the nearest to the one asked for first."""
    spectra: list[tuple[Design, float | None]] = []
    for power, spectrum in _of_less_power(question, design):
        spectra.append((spectrum, power))
        yield request, spectrum, power
    for kind in _kinds(request):
        for spectrum, limit in ((design, None), *spectra[:1], *spectra[-1:]):
            yield kind, spectrum, limit


def _of_less_power(question: Question, design: Design) -> Iterator[tuple[float, Design]]:
    """Yield designs for the same question under ever tighter limits on the input power."""
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
    found = other_signal(_WORDS.get(record.method, record.method), other.input_power)
    return replace(other, record=_at_the_cost(request, design, other, record), findings=(found,))


def _at_the_cost(request: RecordRequest, design: Design, other: Made, record: Record) -> Record:
    """Return the other record with its cost relative to the design that was asked for."""
    asked, own = (design_cost(each, request.cost) for each in (design, other.design))
    return replace(record, extra_power=(1.0 + record.extra_power) * own / asked - 1.0)


def _words(request: RecordRequest) -> str:
    method = request.settings.method
    return _WORDS.get(method, method)


def _kinds(request: RecordRequest) -> list[RecordRequest]:
    """Return other kinds of signals that may stand in."""
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
    """Return the longer record of a shortest experiment, or raise `limits-too-tight` with what was tried."""
    block, allowed = request.settings.block, request.most_samples
    longest = min(max(_LONGEST * samples, _AT_LEAST, allowed or 0), request.longest)
    search = ShortestRecord(
        _ways(request, question, design),
        block,
        longest if allowed is None else min(allowed // block * block, longest),
        ratio_before(design, request.step),
        design.problem.experiment.inputs,
    )
    found = search.search(misses, samples)
    if found is not None and found.record is not None:
        other = found.request.settings.method != request.settings.method
        found = replace(found, record=_at_the_cost(request, design, found, found.record))
        return replace(found, findings=(other_signal(_words(found.request)),) if other else ())
    missed = misses[0]
    if len(missed.samples) != samples:
        one = replace(request, settings=replace(request.settings, candidates=1, most_candidates=1))
        missed = make_record(one, design, samples) or missed
    known = design.any_record
    proof = f"no record of fewer than {known.bound:.0f} samples can" if known and allowed else ""
    raise _refusal(request, missed, search.needed, tried or Counter(), remedy, proof)


def _impossible(request: RecordRequest, question: Question, samples: int) -> str:
    """Return the proof that no record of this length within the amplitude can meet the accuracy, or nothing.

    The best accuracy of all records is bounded, and so is the number of samples that meet it.
    """
    if not any(limit.upper for limit in question.limits):  # a converter alone bounds no spectrum
        return ""

    def bounded(goal: Goal, length: int) -> RecordBound | None:
        best = solve_design(replace(question.of_length(length), goal=goal), tolerance=_TOLERANCE)
        if best.any_spectrum is None or best.problem.demands.criterion is not None:
            return None
        hold = request.settings.hold
        return bound_over_records(best.problem, best.any_spectrum, samples, windows=_WINDOWS, hold=hold)

    reached = bounded("factor", samples)
    if reached is None or reached.bound <= MET:
        return ""
    proof = f"no record of {samples} samples can, the best has r_u / r_adm = {np.sqrt(reached.bound):.4g}"
    least = bounded("samples", 1)
    return proof if least is None else f"{proof}; {least.bound:.0f} samples at least are needed"


def _refusal(
    request: RecordRequest, missed: Record, needed: float, tried: Counter[str], remedy: str, proof: str
) -> InfeasibleError:
    """Return the error that no record was found, with what was tried and about how many samples would do."""
    best = "excites every parameter"
    if np.isfinite(missed.worst_ratio):
        reached = f"r_u / r_adm = {missed.worst_ratio:.4g} with power {missed.power:.4g}"
        best = f"meets the accuracy: the best of those tried reaches {reached}"
    kinds = [f"{kind} of {count} {'spectrum' if count == 1 else 'spectra'}" for kind, count in tried.items()]
    best += f"; tried besides: {', '.join(kinds)}" if kinds else ""
    best += f"; proved: {proof}" if proof else ""
    hint = "raise the limits, or loosen the accuracy"
    enough = _enough(max(needed, len(missed.samples)))
    if enough <= request.longest:
        hint += f": a record of the kinds that were tried would take about {enough} samples"
    return no_record(request, len(missed.samples), best, "; or ".join(filter(None, (hint, remedy))))


def _enough(samples: float) -> float:
    """Return a length a tenth above an estimate, in two digits: after a near miss it is longer still."""
    if not np.isfinite(samples):
        return samples
    unit = 10 ** max(int(np.log10(samples)) - 1, 0)
    return unit * int(np.ceil(1.1 * samples / unit))


def _ways(request: RecordRequest, question: Question, design: Design) -> list[Way]:
    """Return the ways to try: kinds of signals with the designed, then with the cheapest spectrum."""

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

        def made(samples: int, spectrum_of: int) -> Made | None:
            of = spectrum(spectrum_of)
            wanted = of_any_length if samples <= LONG else replace(of_any_length, settings=quick)
            record = None if of is None else make_record(wanted, of, samples, first=True)
            return None if of is None else Made(record, kind, of)

        return made

    kinds = [request, *([] if request.stated_method else _kinds(request))]
    return [way(kind, spectrum) for spectrum in (lambda _: design, cheapest) for kind in kinds]
