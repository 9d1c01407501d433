"""Compare a measured frequency response with what is admitted, and write its outcome."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.response_lines import ResponseLines
from inputdesign_cli.errors import DataError
from inputdesign_cli.finding import Finding, reasons, trusted, verdict
from inputdesign_cli.findings import frequency_responses as responses
from inputdesign_cli.findings.leading import leading
from inputdesign_cli.findings.places import places
from inputdesign_cli.identification import frequency_response, response_delays
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
from inputdesign_cli.outcome.estimate import SilentLine
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.units import Header, Units
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.noise_spectrum import NoiseSpectrum
from inputdesign_cli.questions.assessment.outcome import response_of_data
from inputdesign_cli.questions.common.delivery import adding, results_of
from inputdesign_cli.questions.frequency_response.solve import ResponseTask, deviation_curves
from inputdesign_cli.records import Preparation, Record, read_data
from inputdesign_cli.specification.models.sizes import most

# Degrees of freedom (of complex numbers) over which the noise is averaged along the lines.
_FREEDOM = 60
_SURE = 0.95


@dataclass(frozen=True)
class Counted:
    """Holds data that count, their periods, the number of records of equal length, and notes on the rest."""

    data: Record
    periods: Periods
    repeats: int
    findings: tuple[Finding, ...] = ()

    @property
    def kept(self) -> int:
        """Return the number of periods of one phase that count, in all records."""
        return self.repeats * self.periods.kept(self.data.lengths[0])

    @property
    def samples(self) -> int:
        """Return the number of samples that count."""
        return self.kept * self.periods.blocks * self.periods.period

    def response(self, harmonics: NDArray[np.int_]) -> PeriodicResponse | None:
        """Return the response at harmonics (L,); None if the inputs are alike there."""
        data = self.data
        return periodic_response(data.u, data.y, self.periods, harmonics, repeats=self.repeats)


@dataclass(frozen=True)
class Judged:
    """Holds the deviations (L, p, r) of data by the noise of the spec (`expected`) and of the data (`found`).

    The true ratios are between `least` and `largest` (L,) with confidence 95 %. A share `differing` of the
    input power changes from period to period. `noise` (L, p) is averaged along the lines. `times` as many
    periods would meet the accuracy. `moved` (L,) is the shift of G by a drift, over r_adm; `distorted` is
    its error by a nonlinearity. `scattered` are findings on spikes and drifts.
    """

    counted: Counted
    response: PeriodicResponse
    lines: ResponseLines
    expected: NDArray[np.float64]
    found: NDArray[np.float64]
    least: Array
    largest: Array
    differing: float
    times: float
    noise: NDArray[np.float64]
    moved: Array
    distorted: responses.Distorted | None = None
    scattered: tuple[Finding, ...] = ()
    silent: Mapping[str, SilentLines] = field(default_factory=dict)

    @property
    def frequencies(self) -> Array:
        """Return the frequencies (L,) of the lines, in rad/sample."""
        return 2.0 * np.pi * self.response.harmonics / self.counted.periods.period

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

    def remedy(self) -> tuple[int | None, str]:
        """Return the periods (of each block) that would have to count, and the remedy in words.

        No number is returned if more do not help: the mean of inputs that do not repeat falls like the noise.
        """
        samples, periods = self.times * self.counted.samples, self.counted.periods
        unlike = self.differing > responses.UNLIKE
        if unlike or samples > most("signal.samples"):
            why = "do not repeat" if unlike else "are too weak at some lines"
            no = f"more periods of this signal are no remedy, as the inputs {why}: {responses.REMEDY}"
            return None, no
        needed = int(np.ceil(samples / (periods.blocks * periods.period)))
        each = "" if periods.blocks == 1 else f" in each of {periods.blocks} blocks"
        return needed, f"about {needed} periods that count{each} would do"


@dataclass(frozen=True)
class Measurement:
    """Describes the measurement of a response: at the lines of `terms`, or without them where data excite.

    The nominal `model` is drawn, too; signals vary about the `operating_point`, by channel.
    """

    header: Header
    model: Model
    terms: ResponseTask | None
    operating_point: Mapping[str, float]


def measure(
    question: Measurement, paths: Sequence[Path], preparation: Preparation, *, assess: bool = False
) -> Results:
    """Return the response with its confidence, compared with what a spec asks of its lines."""
    started, terms, model, name = time.perf_counter(), question.terms, question.model, paths[0].name
    units, judged, seen = question.header.units, None, list[Finding]()
    known = {**question.operating_point, **preparation.operating_point}
    data = read_data(paths, units, replace(preparation, operating_point=known))
    if terms is None:
        delays = response_delays(model, max(data.lengths), step=units.step)
        response = frequency_response(data.u, data.y, data.r, lengths=data.lengths, delays=delays)
        if response is None:
            message = f"{name} excites no frequency enough for a response without a model"
            hint = "record longer, or excite more frequencies"
            raise DataError.because("too-few-samples", message, hint)
    else:
        counted = whole_periods(terms.periods, data, name, units.sample_time)
        data = counted.data
        judged, seen = _at_lines(terms, counted, name, assess=assess)
        response = of_periods(judged.response, terms.periods.period)
        # If the inputs do not repeat, periods of the outputs differ without any fault.
        if judged.differing <= responses.UNLIKE:
            judged = _doubted(terms, judged)
    by_reference = data.r is not None and terms is None
    table, curve, lines = response_of_data(units, model, response, by_reference=by_reference)
    outcome = Outcome(
        title=question.header.title,
        status="measured",
        samples=len(data.y),
        identification=Identification(method=lines.method),
        frequency_response=replace(lines, blocks=1),
        timing_s={"measurement": time.perf_counter() - started},
    ).saying(data.findings)
    drawn = {"frequency_response": table}, {"frequency_response": curve}
    results = results_of(question.header, outcome, *drawn)
    if terms is None or judged is None:
        return results
    return _compared(terms, results, judged, seen, assess=assess)


def _compared(
    terms: ResponseTask, results: Results, judged: Judged, found: list[Finding], *, assess: bool
) -> Results:
    """Return the results with the comparison with r_adm and the figure of the deviations."""
    units, outcome, counted = terms.header.units, results.outcome, judged.counted
    w = judged.frequencies / units.frequency
    silent, bent, periods = silent_entry(judged.silent), judged.distorted, counted.periods
    if bent is not None:
        at, cubed = float(w[bent.line]), bent.cubed or None
        silent["odd"] = replace(silent["odd"], worst_ratio=bent.share, frequency=at, cubed=cubed)
    assert outcome.frequency_response is not None
    lines = replace(
        outcome.frequency_response,
        blocks=periods.blocks,
        lines=int(w.size),
        asked=len(terms.grid.excited),
        period=periods.period,
        periods=periods.each(counted.data.lengths[0]),
        records=len(counted.data.lengths),
        transient=periods.skip,
        counted=counted.samples,
        worst_ratio=float(judged.ratios[judged.worst]),
        worst_frequency=float(w[judged.worst]),
        worst_ratio_limits=judged.limits,
        nonlinearity=silent or None,
    )
    outcome = replace(outcome, frequency_response=lines)
    doubts = [*judged.scattered, *responses.nonlinear_response(units, bent, w, decided=judged.missed)]
    if assess:
        assessment, doubts = _assessment(units, judged, w, doubts)
        outcome = replace(outcome, assessment=assessment, status=assessment.verdict)
    listed = {"deviation": judged.expected, "deviation_data": judged.found}
    drawn = ("deviation_data", "these data")
    columns, deviations = deviation_curves(units, w, judged.lines, listed, drawn)
    found = [*found, *responses.silent_lines_answer(judged.silent), *doubts]
    return adding(results, outcome, found, {"deviations": Table(columns)}, {"deviations": deviations})


def silent_entry(silent: Mapping[str, SilentLines]) -> dict[str, SilentLine]:
    """Return `nonlinearity` of the result, by kind of the lines: odd and even; lists are by output."""
    found = {}
    for kind, one in silent.items():
        over, chance, rms = (tuple(x.tolist()) for x in (one.over_noise, one.probability, one.rms))
        found[kind] = SilentLine(one.lines, over, chance, rms)
    return found


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
        periods, remedy = judged.remedy()
        if judged.missed:
            no_top_up = remedy if periods is None else f"repeat the record: {remedy}"
        else:
            doubts = [*doubts, responses.within_chance(units, ratio, judged.limits, at, remedy)]
    answer, why, first = verdict(doubts, met=met), reasons(doubts), leading(doubts, None, judged.counted.data)
    return Assessment(
        verdict=answer,
        met=answer == "met",
        requirements=(RequirementMet("frequency_response", ratio, at),),
        undecided=tuple(one.message for those in why.values() for one in those) or None,
        causes=tuple(why) or None,
        next=None if first is None else first.command,
        no_top_up=no_top_up,
        periods=periods,
    ), doubts


def whole_periods(stated: Periods, data: Record, name: str, step: float) -> Counted:
    """Return the data that count, or raise `DataError` (`bad-period`, `too-few-samples`).

    Records of equal length are not changed. Of pieces between gaps, and of records of several lengths, the
    periods that lie in one piece are taken. All have the same phase, counted from the start of each file:
    the one with the most periods. The sample time `step` is in the unit of the times of the data.
    """
    lengths, length = sorted(set(data.lengths)), data.lengths[0]
    period, blocks, pieces = stated.period, stated.blocks, len(data.lengths)
    whole = len(lengths) == 1 and len(data.files) == pieces
    if blocks > 1 and not (whole and length % (blocks * period) == 0):
        held = f"stretches of {' and '.join(map(str, lengths))} samples"
        message = f"{name} has {held}, and the design has {blocks} blocks of whole periods of {period}"
        hint = "cut every record to the length of signal.csv (--skip, --range), and close gaps"
        raise DataError.because("bad-period", message, hint)
    begins = np.zeros(0, dtype=int) if whole else _longest_phase(stated, data, step)
    each = stated.kept(length) if whole else begins.size
    if each < 1 or each * (pieces if whole else 1) < 2:
        after = f"{max(each, 0)} whole periods of {period} samples after {stated.skip} that are transient"
        message = f"{name} has {after}: the noise is estimated from the scatter of two or more"
        raise DataError.because("too-few-samples", message, "record more periods, or give several records")
    if whole:
        return Counted(data, stated, pieces, tuple(responses.samples_before_periods(length, stated)))
    samples = (begins[:, None] + np.arange(period)).ravel()
    left_out = responses.periods_between_gaps(pieces, begins.size, period)
    return Counted(data.at(samples, (len(samples),)), replace(stated, skip=0), 1, (left_out,))


def _longest_phase(stated: Periods, data: Record, step: float) -> NDArray[np.int_]:
    """Return the first samples of the periods without a gap, of the phase that has the most."""
    period = stated.period
    files = np.split(data.time, np.cumsum([count for _, count in data.files])[:-1])
    # The number of samples between the start of a file and each of its samples.
    places = np.concatenate([np.round((part - part[0]) / step) for part in files]).astype(np.int64)
    piece = np.repeat(np.arange(len(data.lengths)), data.lengths)
    begins = np.flatnonzero(places[: max(len(places) - period + 1, 0)] >= stated.skip * period)
    begins = begins[piece[begins + period - 1] == piece[begins]]
    phases = places[begins] % period
    return begins[phases == np.argmax(np.bincount(phases, minlength=1))]


def _at_lines(
    terms: ResponseTask, counted: Counted, name: str, *, assess: bool
) -> tuple[Judged, list[Finding]]:
    """Return the comparison at the lines of the spec that the data excite, and findings."""
    data, periods = counted.data, counted.periods
    excited = excited_lines(data.u, periods, terms.grid.excited, repeats=counted.repeats)
    missing = responses.unexcited_lines(terms.header.units, terms.grid.frequencies, excited)
    found = counted.response(terms.grid.excited[excited])
    if found is None or (assess and missing):
        why = missing[0].message if missing else "the inputs are alike at the lines of the spec"
        raise DataError.because("not-exciting", f"{name}: {why}", hint=responses.REMEDY)
    judged = judge_lines(terms, found, counted, excited)
    unlike = responses.inputs_do_not_repeat(judged.differing, periods.period)
    return judged, [*missing, *counted.findings, *unlike]


def _doubted(terms: ResponseTask, judged: Judged) -> Judged:
    """Return the comparison with spikes, drifts, and, without spikes, a nonlinearity by the silent lines."""
    units, counted, found = terms.header.units, judged.counted, judged.response
    data, periods, repeats, model = counted.data, counted.periods, counted.repeats, terms.experiment.model
    if spikes := period_spikes(data.y, periods, repeats=repeats):
        where = [places(units, data, one.samples) for one in spikes]
        spiked = responses.spiked_periods(units, spikes, where)
        return replace(judged, scattered=tuple(spiked))
    # The noise of the data near frequency zero; noise of the spec may go on rising below the lowest line.
    lowest = int(np.argmin(judged.frequencies))
    noise = judged.noise[lowest]
    if not terms.tabulated:
        known = NoiseSpectrum.of(model).at(periods.period, np.array([0]))[0]
        noise = np.maximum(noise, noise / judged.lines.noise[lowest] * known)
    drift = period_drift(data.y, data.time, periods, noise, repeats=repeats)
    if drift is not None:
        data = replace(data, y=data.y - drift.curve)
        counted = replace(counted, data=data)
        without = counted.response(found.harmonics)
        if without is not None:
            scatter = np.abs(found.deviation**2 - without.deviation**2)
            moved = judged.lines.ratios(np.sqrt(np.abs(found.G - without.G) ** 2 + scatter))
            w = judged.frequencies / units.frequency
            drifting = responses.drifting_periods(units, drift, moved, w, lined=data.lined)
            found, judged = without, replace(judged, scattered=tuple(drifting))
            judged = replace(judged, moved=moved) if drifting else judged
    judged = replace(judged, silent=silent_of(terms, counted))
    if "odd" not in judged.silent:
        return judged
    # The change of the response by a nonlinearity, by power at silent lines and by cubes.
    odd = terms.grid.odd
    error = response_error(found, periods.period, counted.kept, judged.silent["odd"], odd)
    even, uneven = (model.plant_at(terms.grid.at(lines)) for lines in (found.harmonics, odd))
    cube = cubes(found, data.u, data.y, periods, odd, (even, uneven), _noise(terms, odd), repeats=repeats)

    def moved_by(outputs: Array) -> Array:
        return judged.lines.ratios(cube.error * outputs[:, None])

    bent = responses.distorted(judged.silent, judged.lines.ratios(error), cube, moved_by)
    return replace(judged, distorted=bent)


def judge_lines(
    terms: ResponseTask, found: PeriodicResponse, counted: Counted, excited: NDArray[np.bool_]
) -> Judged:
    """Return the deviations of the data against r_adm at the measured G, at the `excited` lines (L,).

    Few periods estimate the noise of a line poorly: its ratio to that of the spec is averaged over lines.
    """
    if np.any(found.noise <= 0.0):
        message = "the periods do not differ at all, so that their noise is not known"
        hint = "give records of a real plant, not of one period that was repeated"
        raise DataError.because("noise-free-data", message, hint)
    lines, size = terms.lines.where(excited).at(found.G), len(found.harmonics)
    expected = found.deviation * np.sqrt(lines.noise / found.noise)[:, :, None]
    window = min(max(-(-_FREEDOM // found.freedom), 1), size)
    means = np.lib.stride_tricks.sliding_window_view(found.noise / lines.noise, window, axis=0).mean(axis=-1)
    # Means over neighbours, at the ends over the nearest ones.
    excess = means[np.clip(np.arange(size) - window // 2, 0, size - window)]
    smooth = expected * np.sqrt(excess)[:, :, None]
    freedom = 2 * found.freedom * window
    rare = 0.5 * (1.0 - _SURE) / (max(size // window, 1) * found.noise.shape[1])
    low, high = np.sqrt(freedom / scipy.special.chdtri(freedom, [rare, 1.0 - rare])).tolist()
    # If r_adm is a share of |G|, its uncertainty is that of |G|.
    far = -float(scipy.special.ndtri(0.25 * (1.0 - _SURE) / smooth.size)) * np.sqrt(0.5)
    away = far * smooth
    at_least = lines.at(np.maximum(np.abs(found.G) - away, 1e-9 * away))
    at_most = lines.at(np.abs(found.G) + away)
    # |G| may be less by `far` deviations, and the noise is estimated anew, from these data and from others.
    anew = 1.0 + scipy.special.ndtri(_SURE) / np.sqrt(freedom)
    needed = np.max(lines.ratios(smooth)) * (high + far * (lines.share or 0.0)) * anew
    return Judged(
        counted=counted,
        response=found,
        lines=lines,
        expected=expected,
        found=smooth,
        least=low * at_most.ratios(smooth),
        largest=high * at_least.ratios(smooth),
        differing=differing(counted.data.u, counted.periods, repeats=counted.repeats),
        times=float(needed) ** 2,
        noise=lines.noise * excess,
        moved=np.zeros(size),
    )


def silent_of(terms: ResponseTask, counted: Counted) -> dict[str, SilentLines]:
    """Return the outputs at lines of the design that are not excited, by kind: odd and even."""
    transforms = counted.periods.transforms(counted.data.y, counted.repeats)
    silent = {"odd": terms.grid.odd, "even": terms.grid.even}
    found = {kind: silent_lines(transforms[:, :, at], _noise(terms, at)) for kind, at in silent.items()}
    return {kind: lines for kind, lines in found.items() if lines is not None}


def _noise(terms: ResponseTask, harmonics: NDArray[np.int_]) -> Array:
    """Return the noise (n, p) at harmonics (n,) between the lines, linear in both logarithms."""
    w, lines = np.log(terms.grid.at(harmonics)), np.log(terms.grid.frequencies)
    return np.exp(np.stack([np.interp(w, lines, np.log(one)) for one in terms.lines.noise.T], axis=1))
