"""Where no record of the cheapest spectrum fits within limits on samples: other signals, other spectra.

What costs least need not fit: where outputs are dear the inputs may be strong, and noise has high peaks.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.compute.time_limit import OutOfTimeError
from inputdesign_cli.design.convex.designs import Design, solve_design
from inputdesign_cli.design.convex.feasible import UnreachableError
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.design.convex.question import Question
from inputdesign_cli.errors import InfeasibleError
from inputdesign_cli.information import Experiment
from inputdesign_cli.runs.results import Json
from inputdesign_cli.signal import Record
from inputdesign_cli.tasks.record import RecordRequest, design_cost, make_record

# From the design towards the least input power that meets the accuracy, with a little room there.
_SHARES = (0.8, 0.6, 0.4, 0.2, 0.0)
_ROOM = 1.02
_TOLERANCE = 1e-5
# Where nothing meets the accuracy so many longer records are tried, with a little room, if not too long.
_LENGTHS, _LONGER, _TRIED, _ROUGH, _ANY = 3, 1.03, 20_000, 1e-4, 0.5
_WORDS = {"filtered_noise": "noise", "multisine": "a multisine", "binary": "a binary signal"}


@dataclass(frozen=True)
class Made:
    """A record with what it realises: the request that made it, and the design whose spectrum it has.

    `input_power` limits that design, where it is not the one that was asked for.
    """

    record: Record | None
    request: RecordRequest
    design: Design
    input_power: float | None = None
    notes: tuple[str, ...] = ()

    @property
    def entry(self) -> dict[str, Json]:
        """What `signal` of the result adds about another spectrum."""
        return {} if self.input_power is None else {"spectrum_of": {"input_power": self.input_power}}


def fitting_record(
    request: RecordRequest, question: Question, design: Design, experiment: Experiment
) -> Made:
    """The record of the design; where none is found that meets the accuracy, one that does.

    Tried are spectra of less input power, and other kinds of signals. A kind that the spec states is not
    replaced: the error names the one that would do.

    Raises:
        InfeasibleError: `limits-too-tight`, with what was tried and what would do.
    """
    record = make_record(request, design, experiment, longer=False)
    plain = Made(record, request, design)
    if record is None or record.met or not request.searched:
        return plain
    tried: Counter[str] = Counter()
    hint = ""
    for of, spectrum, power in _others(request, question, design):
        other = Made(make_record(of, spectrum, experiment, longer=False), of, spectrum, power)
        if other.record is not None and other.record.met:
            if not request.stated_method or of is request:
                return _told(request, design, other)
            limited = "" if power is None else f" with limits.input_power: {power:.4g}"
            hint = f"a record of this length does with signal.type: {of.settings.method}{limited}"
            break
        tried[_words(of)] += 1
    return replace(plain, record=_longer(request, design, experiment, tried, hint))


def _others(
    request: RecordRequest, question: Question, design: Design
) -> Iterator[tuple[RecordRequest, Design, float | None]]:
    """What else there is, with the limit on the input power: the nearest to what was asked first."""
    spectra: list[tuple[Design, float | None]] = []
    for power, spectrum in _of_less_power(question, design):
        spectra.append((spectrum, power))
        yield request, spectrum, power
    for settings in request.others:
        for spectrum, limit in ((design, None), *spectra[:1], *spectra[-1:]):
            yield replace(request, settings=settings), spectrum, limit


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


def _told(request: RecordRequest, design: Design, other: Made) -> Made:
    """The other record, its cost told against the design that was asked for, and a note."""
    record = other.record
    assert record is not None
    asked, own = (design_cost(each, request.cost) for each in (design, other.design))
    extra = (1.0 + record.extra_power) * own / asked - 1.0
    limit = other.input_power
    spectrum = (
        "that spectrum" if limit is None else f"another spectrum, that of limits.input_power: {limit:.4g}"
    )
    note = (
        f"no record of {_words(request)} with the cheapest spectrum was found that meets the accuracy within "
        f"{' and '.join(request.limit_keys)}; the record is {_WORDS.get(record.method, record.method)} with "
        f"{spectrum}"
    )
    return replace(other, record=replace(record, extra_power=extra), notes=(note,))


def _words(request: RecordRequest) -> str:
    method = request.settings.method
    return _WORDS.get(method, method)


def _longer(
    request: RecordRequest, design: Design, experiment: Experiment, tried: Counter[str], hint: str
) -> Record | None:
    """The longer record of a shortest experiment, or the error with what was tried besides."""
    try:
        return make_record(request, design, experiment)
    except InfeasibleError as missed:
        told = missed.diagnostics[0]
        kinds = [
            f"{kind} of {count} {'spectrum' if count == 1 else 'spectra'}" for kind, count in tried.items()
        ]
        besides = f"; tried besides: {', '.join(kinds)}" if kinds else ""
        hints = "; or ".join(text for text in (told.hint, hint) if text)
        raise InfeasibleError(replace(told, message=told.message + besides, hint=hints)) from missed


def samples_of_record(request: RecordRequest, question: Question, samples: int) -> int | None:
    """The samples of a record that is found to meet the accuracy where a spectrum takes so many."""
    for _ in range(_LENGTHS):
        samples = max(int(np.ceil(samples * _LONGER)), 2)
        if samples > _TRIED:
            return None
        stated = question.of_length(samples)
        try:
            design = solve_design(stated, tolerance=_ROUGH, any_spectrum_tolerance=_ANY)
            of_any_length = replace(request, samples=None)
            record = make_record(of_any_length, design, design.problem.experiment, longer=False)
        except (OutOfTimeError, UnreachableError):
            return None
        if record is None or record.met:
            return samples if record is not None else None
        if not np.isfinite(record.worst_ratio):
            return None
        samples = int(np.ceil(samples * record.worst_ratio**2))
    return None
