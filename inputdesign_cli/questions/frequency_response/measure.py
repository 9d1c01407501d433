"""Compare a measured frequency response with what is admitted, and write its outcome."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.response_lines import ResponseLines
from inputdesign_cli.errors import DataError
from inputdesign_cli.finding import Finding, reasons, trusted, verdict
from inputdesign_cli.findings import frequency_responses as responses
from inputdesign_cli.findings.frequency_responses import Distorted, distorted
from inputdesign_cli.findings.places import places
from inputdesign_cli.identification import FrequencyResponse, frequency_response, response_delays
from inputdesign_cli.identification.faults import period_spikes
from inputdesign_cli.identification.frequency_response import of_periods
from inputdesign_cli.identification.nonlinearity import SilentLines, cubes, response_error, silent_lines
from inputdesign_cli.identification.periodic_response import (
    PeriodicResponse,
    Periods,
    differing,
    excited_lines,
    period_drift,
    periodic_response,
)
from inputdesign_cli.outcome import Assessment, Identification, Outcome, RequirementMet
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.estimate import SilentLine
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.noise_spectrum import NoiseSpectrum
from inputdesign_cli.questions.assessment.outcome import response_of_data
from inputdesign_cli.questions.common.delivery import results_of
from inputdesign_cli.questions.frequency_response.outcome import ResponseTerms, deviation_curves
from inputdesign_cli.records import Preparation, Record, read_data
from inputdesign_cli.signal.harmonic_grid import HarmonicGrid
from inputdesign_cli.specification.models.sizes import most

# Degrees of freedom (of complex numbers) over which the noise is averaged along the lines.
_FREEDOM = 60
_SURE = 0.95


@dataclass(frozen=True)
class Judged:
    """Holds the deviations (L, p, r) of data by the noise of the spec (`expected`) and of the data (`found`).

    The true ratios are between `least` and `largest` (L,) with 95 %. Of the `asked` lines these are excited.
    Of the power of the inputs the share `differing` differs from period to period; `noise` (L, p) is averaged
    along the lines. With `times` the periods a verdict would be met. The response is `moved` (L,) by a drift,
    over what is admitted, and `distorted` by a nonlinearity. Spikes and drifts are `scattered`.
    """

    grid: HarmonicGrid
    periods: Periods
    lines: ResponseLines
    expected: NDArray[np.float64]
    found: NDArray[np.float64]
    least: Array
    largest: Array
    counted: int
    asked: int
    differing: float
    times: float
    noise: NDArray[np.float64]
    moved: Array
    distorted: Distorted | None = None
    scattered: tuple[Finding, ...] = ()
    silent: Mapping[str, SilentLines] = field(default_factory=dict)

    @cached_property
    def ratios(self) -> Array:
        """Return the largest deviation (L,) of an entry by the noise of the data, over r_adm."""
        return self.lines.ratios(self.found)

    @property
    def worst(self) -> int:
        """Return the line of the largest ratio."""
        return int(np.argmax(self.ratios))

    @property
    def limits(self) -> tuple[float, float]:
        """Return the 95 % limits of the largest ratio."""
        return float(self.least.max()), float(self.largest.max())

    @property
    def missed(self) -> bool:
        """Return whether noise alone exceeds the admitted error beyond chance (it may be a share of |G|)."""
        bent = self.distorted.shares if self.distorted is not None and self.distorted.matters else 0.0
        sure = self.least / (1.0 + (self.lines.share or 0.0) * (self.moved + bent))
        return not self.scattered and bool(np.any(sure > 1.0))

    @property
    def periods_needed(self) -> int | None:
        """Return the periods (of each block) that would have to count; None if more are no remedy."""
        samples = self.times * self.counted
        # Of inputs that do not repeat the mean of the periods falls as the noise does.
        if self.differing > responses.UNLIKE or samples > most("signal.samples"):
            return None
        return int(np.ceil(samples / (self.periods.blocks * self.grid.period)))

    @property
    def remedy(self) -> str:
        """Return the number of periods that would do, or the remedy where more would not, in words."""
        if self.periods_needed is not None:
            blocks = "" if self.periods.blocks == 1 else f" in each of {self.periods.blocks} blocks"
            return f"about {self.periods_needed} periods that count{blocks} would do"
        why = "do not repeat" if self.differing > responses.UNLIKE else "are too weak at some lines"
        return f"more periods of this signal are no remedy, as the inputs {why}: {responses.REMEDY}"


def _measured_results(
    question: Measurement,
    data: Record,
    found: FrequencyResponse,
    judged: Judged | None,
    findings: Sequence[Finding],
    seconds: float,
    *,
    assess: bool,
) -> Results:
    """Return the outcome, frequency_response.csv and its figure; with lines also their deviations."""
    header, units = question.header, question.header.units
    by_reference = data.r is not None and judged is None
    table, curve, response = response_of_data(units, question.model, found, by_reference=by_reference)
    tables, curves = {"frequency_response": table}, dict[str, Curves](frequency_response=curve)
    assessment, blocks = None, 1
    if judged is not None:
        w, blocks = judged.grid.frequencies / units.frequency, judged.periods.blocks
        listed = {"deviation": judged.expected, "deviation_data": judged.found}
        drawn = ("deviation_data", "these data")
        columns, curves["deviations"] = deviation_curves(units, w, judged.lines, listed, drawn)
        tables["deviations"] = Table(columns)
        silent, moved = silent_entry(judged.silent), judged.distorted
        if moved is not None:
            at, cubed = float(w[moved.line]), moved.cubed or None
            silent["odd"] = replace(silent["odd"], worst_ratio=moved.share, frequency=at, cubed=cubed)
        response = replace(
            response,
            lines=int(w.size),
            asked=judged.asked,
            period=judged.periods.period,
            periods=judged.periods.each(data.lengths[0]),
            records=len(data.lengths),
            transient=judged.periods.skip,
            counted=judged.counted,
            worst_ratio=float(judged.ratios[judged.worst]),
            worst_frequency=float(w[judged.worst]),
            worst_ratio_limits=judged.limits,
            nonlinearity=silent or None,
        )
        # Spikes, drifts and a nonlinearity.
        bent = responses.nonlinear_response(units, judged.distorted, w, decided=judged.missed)
        doubts = [*judged.scattered, *bent]
        if assess:
            assessment, doubts = _assessment(units, judged, w, doubts)
        findings = [*findings, *responses.silent_lines_answer(judged.silent), *doubts]
    outcome = Outcome(
        title=header.title,
        status="measured" if assessment is None else assessment.verdict,
        samples=len(data.y),
        identification=Identification(method=response.method),
        frequency_response=replace(response, blocks=blocks),
        assessment=assessment,
        findings=data.findings or None,
        notes=data.notes or None,
        timing_s={"measurement": seconds},
    )
    return results_of(header, outcome.saying(findings), tables, curves)


def silent_entry(silent: Mapping[str, SilentLines]) -> dict[str, SilentLine]:
    """Return `nonlinearity` of the result, by kind of the lines: odd and even; lists are by output."""
    return {
        kind: SilentLine(
            one.lines,
            tuple(one.over_noise.tolist()),
            tuple(one.probability.tolist()),
            tuple(one.rms.tolist()),
        )
        for kind, one in silent.items()
    }


def _assessment(
    units: Units, judged: Judged, w: Array, doubts: list[Finding]
) -> tuple[Assessment, list[Finding]]:
    """Return the verdict with the periods that would settle it, and the findings that it rests on."""
    ratio, at = float(judged.ratios[judged.worst]), float(w[judged.worst])
    met, periods, no_top_up = judged.limits[1] <= 1.0, None, None
    doubted = not trusted(doubts)
    if judged.missed and doubted:
        no_top_up = "more periods alone are no remedy: the notes say why"
    elif not met and not doubted:
        periods = judged.periods_needed
        if judged.missed:
            no_top_up = judged.remedy if periods is None else f"repeat the record: {judged.remedy}"
        else:
            doubts = [*doubts, responses.within_chance(units, ratio, judged.limits, at, judged.remedy)]
    answer, why = verdict(doubts, met=met), reasons(doubts)
    return Assessment(
        verdict=answer,
        met=answer == "met",
        requirements=(RequirementMet("frequency_response", ratio, at),),
        undecided=tuple(one.message for those in why.values() for one in those) or None,
        causes=tuple(why) or None,
        no_top_up=no_top_up,
        periods=periods,
    ), doubts


@dataclass(frozen=True)
class Counted:
    """Holds data that count, their periods, the number of records of equal length, and the data left out."""

    data: Record
    periods: Periods
    repeats: int
    findings: tuple[Finding, ...] = ()

    @property
    def kept(self) -> int:
        """Return the number of periods of one phase that count, in all records."""
        return self.repeats * self.periods.kept(self.data.lengths[0])

    def response(self, harmonics: NDArray[np.int_]) -> PeriodicResponse | None:
        """Return the response at harmonics (L,); None if the inputs are alike there."""
        data = self.data
        return periodic_response(data.u, data.y, self.periods, harmonics, repeats=self.repeats)


def whole_periods(stated: Periods, data: Record, name: str, step: float) -> Counted:
    """Return the data that count, or raise `DataError` (`bad-period`, `too-few-samples`).

    Records of equal length are not changed. Of pieces between gaps, and of records of several lengths, the
    periods that lie in one piece are taken. All have the same phase, counted from the begin of each file:
    the one with the most periods. The sample time `step` is in the unit of the times of the data.
    """
    lengths, length = set(data.lengths), data.lengths[0]
    whole = stated.blocks * stated.period
    if len(lengths) == 1 and len(data.files) == len(data.lengths):
        if stated.blocks == 1 or length % whole == 0:
            _check(stated.kept(length), stated.kept(length) * len(data.lengths), stated, name)
            return Counted(
                data, stated, len(data.lengths), tuple(responses.samples_before_periods(length, stated))
            )
    elif stated.blocks == 1:
        return _from_pieces(stated, data, name, step)
    what = " and ".join(str(one) for one in sorted(lengths))
    raise DataError.because(
        "bad-period",
        f"{name} has stretches of {what} samples, and the design has {stated.blocks} blocks of "
        f"whole periods of {stated.period}",
        hint="cut every record to the length of signal.csv (--skip, --range), and close gaps",
    )


def _from_pieces(stated: Periods, data: Record, name: str, step: float) -> Counted:
    """Return one record of the periods without a gap."""
    period = stated.period
    files = np.split(data.time, np.cumsum([count for _, count in data.files])[:-1])
    # The number of samples between the begin of a file and each of its samples.
    places = np.concatenate([np.round((part - part[0]) / step) for part in files]).astype(np.int64)
    transient = stated.skip * period
    follow = np.ones(len(places), dtype=bool)
    follow[np.cumsum(data.lengths)[:-1]] = False
    gaps = np.cumsum(~follow)
    last = np.arange(len(places)) + period - 1
    begins = np.flatnonzero((last < len(places)) & (places >= transient))
    begins = begins[gaps[last[begins]] == gaps[begins]]
    phases = places[begins] % period
    taken = begins[phases == np.argmax(np.bincount(phases, minlength=1))]
    _check(taken.size, taken.size, stated, name)
    samples = (taken[:, None] + np.arange(period)).ravel()
    kept = data.at(samples, (len(samples),))
    left_out = responses.periods_between_gaps(len(data.lengths), taken.size, period)
    return Counted(kept, replace(stated, skip=0), 1, (left_out,))


def _check(each: int, together: int, stated: Periods, name: str) -> None:
    """Raise `DataError` (`too-few-samples`) unless enough periods count, in a block and in all records."""
    if each < 1 or together < 2:
        raise DataError.because(
            "too-few-samples",
            f"{name} has {max(each, 0)} whole periods of {stated.period} samples after {stated.skip} that "
            "are transient: the noise is estimated from the scatter of two or more",
            hint="record more periods, or give several records",
        )


@dataclass(frozen=True)
class Measurement:
    """Describes the measurement of a response: at the lines of `terms`, or without them where data excite.

    The nominal `model` is drawn, too; signals vary about the `operating_point`, by channel.
    """

    header: Header
    model: Model
    terms: ResponseTerms | None
    operating_point: Mapping[str, float]


def measure(
    question: Measurement, paths: Sequence[Path], preparation: Preparation, *, assess: bool = False
) -> Results:
    """Return the response with its confidence, compared with what a spec asks of its lines."""
    started = time.perf_counter()
    units, terms, name = question.header.units, question.terms, paths[0].name
    results = partial(_measured_results, question, assess=assess)
    known = {**question.operating_point, **preparation.operating_point}
    data = read_data(paths, units, replace(preparation, operating_point=known))
    if terms is None:
        delays = partial(response_delays, question.model, step=units.step)
        response = frequency_response(data.u, data.y, data.r, lengths=data.lengths, delays=delays)
        if response is None:
            message = f"{name} excites no frequency enough for a response without a model"
            hint = "record longer, or excite more frequencies"
            raise DataError.because("too-few-samples", message, hint=hint)
        return results(data, response, None, (), time.perf_counter() - started)
    counted = whole_periods(terms.periods, data, name, units.sample_time)
    data, periods = counted.data, counted.periods
    excited = excited_lines(data.u, periods, terms.grid.excited, repeats=counted.repeats)
    missing = responses.unexcited_lines(units, terms.grid.frequencies, excited)
    found = counted.response(terms.grid.excited[excited])
    if found is None or (assess and missing):
        why = missing[0].message if missing else "the inputs are alike at the lines of the spec"
        raise DataError.because("not-exciting", f"{name}: {why}", hint=responses.REMEDY)
    judged = judge_lines(terms, found, counted, excited)
    seen = [*missing, *counted.findings, *responses.inputs_do_not_repeat(judged.differing, periods.period)]
    # Periods of outputs differ if the inputs do not repeat.
    if judged.differing <= responses.UNLIKE:
        judged = _doubted(question, terms, found, counted, judged)
    return results(data, of_periods(found, periods.period), judged, seen, time.perf_counter() - started)


def _doubted(
    question: Measurement, terms: ResponseTerms, found: PeriodicResponse, counted: Counted, judged: Judged
) -> Judged:
    """Return the comparison with spikes, drifts, and, without spikes, a nonlinearity by the silent lines."""
    units, data, periods, repeats = question.header.units, counted.data, counted.periods, counted.repeats
    spikes = period_spikes(data.y, periods, repeats=repeats)
    if spikes:
        where = [places(units, data, one.samples) for one in spikes]
        spiked = list(responses.spiked_periods(units, spikes, where, len(data.y), counted.kept))
        return replace(judged, scattered=tuple(spiked))
    # The noise of the data near frequency zero; noise of the spec may go on rising below the lowest line.
    lowest = int(np.argmin(judged.grid.frequencies))
    noise = judged.noise[lowest]
    if not terms.tabulated:
        known = NoiseSpectrum.of(question.model).at(periods.period, np.array([0]))[0]
        noise = np.maximum(noise, noise / judged.lines.noise[lowest] * known)
    drift = period_drift(data.y, data.time, periods, noise, repeats=repeats)
    if drift is not None:
        counted = replace(counted, data=replace(data, y=data.y - drift.curve))
        without = counted.response(found.harmonics)
        if without is not None:
            scatter = np.abs(found.deviation**2 - without.deviation**2)
            moved = judged.lines.ratios(np.sqrt(np.abs(found.G - without.G) ** 2 + scatter))
            w = judged.grid.frequencies / units.frequency
            drifting = responses.drifting_periods(units, drift, moved, w, lined=data.lined)
            found, judged = without, replace(judged, scattered=tuple(drifting))
            judged = replace(judged, moved=moved) if drifting else judged
    judged = replace(judged, silent=silent_of(terms, counted))
    if "odd" not in judged.silent:
        return judged
    # The change of the response by a nonlinearity, by power at silent lines and by cubes.
    odd, data = terms.grid.odd, counted.data
    error = response_error(found, periods.period, counted.kept, judged.silent["odd"], odd)
    nominal = [question.model.plant_at(terms.grid.at(lines)) for lines in (found.harmonics, odd)]
    shape = _between(terms.grid.at(odd), terms.grid.frequencies, terms.lines.noise)
    cube = cubes(found, data.u, data.y, periods, odd, (nominal[0], nominal[1]), shape, repeats=repeats)
    ratios = judged.lines.ratios
    bent = distorted(judged.silent, ratios(error), cube, lambda y: ratios(cube.error * y[:, None]))
    return replace(judged, distorted=bent)


def judge_lines(
    terms: ResponseTerms, found: PeriodicResponse, counted: Counted, excited: NDArray[np.bool_]
) -> Judged:
    """Return the deviations of the data against r_adm at the measured G, at the `excited` lines (L,).

    Few periods give the noise of one line badly: its ratio to that of the spec is averaged along the lines.
    """
    if np.any(found.noise <= 0.0):
        message = "the periods do not differ at all, so that their noise is not known"
        hint = "give records of a real plant, not of one period that was repeated"
        raise DataError.because("noise-free-data", message, hint=hint)
    periods, repeats = counted.periods, counted.repeats
    lines = terms.lines.where(excited).at(found.G)
    expected = found.deviation * np.sqrt(lines.noise / found.noise)[:, :, None]
    window = min(max(-(-_FREEDOM // found.freedom), 1), len(found.harmonics))
    # Means over neighbours, at the ends over the nearest ones.
    first = np.clip(np.arange(len(lines.noise)) - window // 2, 0, len(lines.noise) - window)
    sums = np.cumsum(np.pad(found.noise / lines.noise, ((1, 0), (0, 0))), axis=0)
    excess = (sums[first + window] - sums[first]) / window
    smooth = expected * np.sqrt(excess)[:, :, None]
    freedom = 2 * found.freedom * window
    tests = max(len(found.harmonics) // window, 1) * found.noise.shape[1]
    rare = 0.5 * (1.0 - _SURE) / tests
    chances = np.array([1.0 - rare, rare])
    low, high = np.sqrt(freedom / (2.0 * scipy.special.gammaincinv(0.5 * freedom, chances))).tolist()
    # If r_adm is a share of |G|, it is known as well as |G| is.
    far = -float(scipy.special.ndtri(0.25 * (1.0 - _SURE) / smooth.size)) * np.sqrt(0.5)
    away = far * smooth
    at_least = lines.at(np.maximum(np.abs(found.G) - away, 1e-9 * away))
    at_most = lines.at(np.abs(found.G) + away)
    # Sizes are less by `far` deviations at most, and noise comes out anew, in these data and in others.
    anew = 1.0 + scipy.special.ndtri(_SURE) / np.sqrt(freedom)
    needed = np.max(lines.ratios(smooth)) * (high + far * (lines.share or 0.0)) * anew
    return Judged(
        grid=replace(terms.grid, excited=found.harmonics),
        asked=excited.size,
        differing=differing(counted.data.u, periods, repeats=repeats),
        times=float(needed) ** 2,
        periods=periods,
        lines=lines,
        expected=expected,
        found=smooth,
        least=low * at_most.ratios(smooth),
        largest=high * at_least.ratios(smooth),
        counted=counted.kept * periods.blocks * periods.period,
        noise=lines.noise * excess,
        moved=np.zeros(len(found.harmonics)),
    )


def silent_of(terms: ResponseTerms, counted: Counted) -> dict[str, SilentLines]:
    """Return the outputs at lines of the design that are not excited, by kind: odd and even."""
    found = {}
    for kind, harmonics in (("odd", terms.grid.odd), ("even", terms.grid.even)):
        parts = np.split(counted.data.y, counted.repeats)
        records = [counted.periods.transforms(one)[:, :, harmonics] for one in parts]
        shape = _between(terms.grid.at(harmonics), terms.grid.frequencies, terms.lines.noise)
        lines = silent_lines(np.concatenate(records, axis=1), shape)
        if lines is not None:
            found[kind] = lines
    return found


def _between(w: Array, lines: Array, values: Array) -> Array:
    """Return values (L, p) at lines (L,) between them, at w (n,), linear in both logarithms."""
    logs = [np.interp(np.log(w), np.log(lines), np.log(column)) for column in values.T]
    return np.exp(np.stack(logs, axis=1))
