"""Measure the frequency response without a model, and whether it meets what the spec asks."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.frequency_responses import (
    REMEDY,
    UNLIKE,
    inputs_do_not_repeat,
    periods_between_gaps,
    samples_before_periods,
    unexcited_lines,
)
from inputdesign_cli.findings.periods import Distorted, distorted, drifting_periods, spiked_periods
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
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.noise_spectrum import NoiseSpectrum
from inputdesign_cli.questions.assessment.outcome import response_of_data
from inputdesign_cli.questions.frequency_response.measured import Judged, Measured, measured_results
from inputdesign_cli.questions.frequency_response.terms import ResponseTerms
from inputdesign_cli.records import Preparation, Record, read_data

# Degrees of freedom (of complex numbers) over which the noise is averaged along the lines.
_FREEDOM = 60
_SURE = 0.95


@dataclass(frozen=True)
class Counted:
    """Data that count, how they repeat, the number of records of equal length, and what is left out."""

    data: Record
    periods: Periods
    repeats: int
    findings: tuple[Finding, ...] = ()

    @property
    def kept(self) -> int:
        """Periods of one phase that count, in all records."""
        return self.repeats * self.periods.kept(self.data.lengths[0])

    def response(self, harmonics: NDArray[np.int_]) -> PeriodicResponse | None:
        """Return the response at harmonics (L,); None if the inputs are alike there."""
        data = self.data
        return periodic_response(data.u, data.y, self.periods, harmonics, repeats=self.repeats)


def whole_periods(stated: Periods, data: Record, name: str, step: float) -> Counted:
    """Return the data that count.

    Records of equal length are not changed. Of pieces between gaps, and of records of several lengths, the
    periods that lie in one piece are taken. All have the same phase, counted from the begin of each file:
    the one with the most periods.

    Args:
        name: of the file that messages name.
        step: the sample time, in the unit of the times of the data.

    Raises:
        DataError: `bad-period`, `too-few-samples`.
    """
    lengths, length = set(data.lengths), data.lengths[0]
    whole = stated.blocks * stated.period
    if len(lengths) == 1 and len(data.files) == len(data.lengths):
        if stated.blocks == 1 or length % whole == 0:
            _check(stated.kept(length), stated.kept(length) * len(data.lengths), stated, name)
            return Counted(data, stated, len(data.lengths), tuple(samples_before_periods(length, stated)))
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
    period, places = stated.period, _places(data, step)
    transient = stated.skip * period
    follow = np.ones(len(places), dtype=bool)
    follow[np.cumsum(data.lengths)[:-1]] = False
    gaps = np.cumsum(~follow)
    last = np.arange(len(places)) + period - 1
    begins = np.flatnonzero((last < len(places)) & (places >= transient))
    begins = begins[gaps[last[begins]] == gaps[begins]]
    taken: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
    if begins.size:
        phase = int(np.argmax(np.bincount(places[begins] % period)))
        taken = begins[places[begins] % period == phase]
    _check(taken.size, taken.size, stated, name)
    samples = (taken[:, None] + np.arange(period)).ravel()
    kept = data.at(samples, (len(samples),))
    left_out = periods_between_gaps(len(data.lengths), taken.size, period)
    return Counted(kept, replace(stated, skip=0), 1, (left_out,))


def _places(data: Record, step: float) -> NDArray[np.int64]:
    """Return the number (N,) of samples between the begin of a file and each of its samples."""
    files = np.split(data.time, np.cumsum([count for _, count in data.files])[:-1])
    return np.concatenate([np.round((part - part[0]) / step) for part in files]).astype(np.int64)


def _check(each: int, together: int, stated: Periods, name: str) -> None:
    """Check that enough periods count, in a block and in all records.

    Raises:
        DataError: `too-few-samples`.
    """
    if each < 1 or together < 2:
        raise DataError.because(
            "too-few-samples",
            f"{name} has {max(each, 0)} whole periods of {stated.period} samples after {stated.skip} that "
            "are transient: the noise is estimated from the scatter of two or more",
            hint="record more periods, or give several records",
        )


@dataclass(frozen=True)
class Measurement:
    """How a frequency response is measured: at the lines of `terms`, or without them where data excite.

    Attributes:
        model: the nominal plant, which the response is drawn beside.
        operating_point: by channel, the values of the spec that signals vary about.
    """

    header: Header
    model: Model
    terms: ResponseTerms | None
    operating_point: Mapping[str, float]


def measure(
    question: Measurement, paths: Sequence[Path], preparation: Preparation, *, assess: bool = False
) -> Results:
    """Return the response with its confidence; with lines of a spec also how it compares with what is asked.

    Raises:
        DataError: a file cannot be used, or does not repeat as the spec says.
    """
    started = time.perf_counter()
    units, terms, name = question.header.units, question.terms, paths[0].name
    known = {**question.operating_point, **preparation.operating_point}
    data = read_data(paths, units, replace(preparation, operating_point=known))
    if terms is None:
        found = _without_lines(question, data, name)
    else:
        counted = whole_periods(terms.periods, data, name, units.sample_time)
        found = _at_lines(question, terms, counted, name, assess=assess)
    by_reference = data.r is not None and terms is None
    shown = response_of_data(units, question.model, found.response, by_reference=by_reference)
    return measured_results(question.header, found, shown, time.perf_counter() - started, assess=assess)


def _without_lines(question: Measurement, data: Record, name: str) -> Measured:
    """Return the response where the data excite it."""
    delays = partial(response_delays, question.model, step=question.header.units.step)
    found = frequency_response(data.u, data.y, data.r, lengths=data.lengths, delays=delays)
    if found is None:
        raise DataError.because(
            "too-few-samples",
            f"{name} excites no frequency enough for a response without a model",
            hint="record longer, or excite more frequencies",
        )
    return Measured(data, found)


def _at_lines(
    question: Measurement, terms: ResponseTerms, counted: Counted, name: str, *, assess: bool
) -> Measured:
    """Return the response at the lines of the spec that the data excite."""
    data, periods = counted.data, counted.periods
    excited = excited_lines(data.u, periods, terms.grid.excited, repeats=counted.repeats)
    missing = unexcited_lines(question.header.units, terms.grid.frequencies, excited)
    found = counted.response(terms.grid.excited[excited])
    if found is None or (assess and missing):
        why = missing[0].message if missing else "the inputs are alike at the lines of the spec"
        raise DataError.because("not-exciting", f"{name}: {why}", hint=REMEDY)
    judged = judge_lines(terms, found, counted, excited)
    seen = [*missing, *counted.findings, *inputs_do_not_repeat(judged.differing, periods.period)]
    # Periods of outputs differ if the inputs do not repeat.
    if judged.differing <= UNLIKE:
        judged = _doubted(question, terms, found, counted, judged)
    return Measured(data, of_periods(found, periods.period), judged, tuple(seen))


def _doubted(
    question: Measurement, terms: ResponseTerms, found: PeriodicResponse, counted: Counted, judged: Judged
) -> Judged:
    """Return the comparison with spikes, drifts, and a nonlinearity by the silent lines without drifts.

    Spikes are in every line, so that silent lines show nothing then.
    """
    units, data, periods, repeats = question.header.units, counted.data, counted.periods, counted.repeats
    spikes = period_spikes(data.y, periods, repeats=repeats)
    if spikes:
        where = [places(units, data, one.samples) for one in spikes]
        spiked = list(spiked_periods(units, spikes, where, len(data.y), counted.kept))
        return replace(judged, scattered=tuple(spiked))
    noise = _noise_at_rest(question.model, terms, judged)
    drift = period_drift(data.y, data.time, periods, noise, repeats=repeats)
    if drift is not None:
        counted = replace(counted, data=replace(data, y=data.y - drift.curve))
        without = counted.response(found.harmonics)
        if without is not None:
            scatter = np.abs(found.deviation**2 - without.deviation**2)
            moved = judged.lines.ratios(np.sqrt(np.abs(found.G - without.G) ** 2 + scatter))
            w = judged.grid.frequencies / units.frequency
            drifting = drifting_periods(units, drift, moved, w, lined=data.lined)
            found, judged = without, replace(judged, scattered=tuple(drifting))
            judged = replace(judged, moved=moved) if drifting else judged
    silent = silent_of(terms, counted)
    bent = _distorted(question.model, terms, found, counted, judged, silent) if "odd" in silent else None
    return replace(judged, silent=silent, distorted=bent)


def _noise_at_rest(model: Model, terms: ResponseTerms, judged: Judged) -> Array:
    """Return the spectrum (p,) of the noise of the data near frequency zero, by the one at their lowest line.

    Noise of the spec may go on rising below that line.
    """
    lowest = int(np.argmin(judged.grid.frequencies))
    there = judged.noise[lowest]
    if terms.tabulated:
        return there
    known = NoiseSpectrum.of(model).at(judged.periods.period, np.array([0]))[0]
    return np.maximum(there, there / judged.lines.noise[lowest] * known)


def judge_lines(
    terms: ResponseTerms, found: PeriodicResponse, counted: Counted, excited: NDArray[np.bool_]
) -> Judged:
    """Return the deviations of the data against r_adm at the measured G, with noise averaged along the lines.

    The scatter of a few periods gives the noise of one line badly. Its ratio to the noise of the spec is
    therefore averaged over neighbouring lines.

    Args:
        excited: (L,) lines of the spec that were found.
    """
    if np.any(found.noise <= 0.0):
        raise DataError.because(
            "noise-free-data",
            "the periods do not differ at all, so that their noise is not known",
            hint="give records of a real plant, not of one period that was repeated",
        )
    periods, repeats = counted.periods, counted.repeats
    lines = terms.lines.where(excited).at(found.G)
    expected = found.deviation * np.sqrt(lines.noise / found.noise)[:, :, None]
    window = min(max(-(-_FREEDOM // found.freedom), 1), len(found.harmonics))
    excess = _averaged(found.noise / lines.noise, window)
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


def _averaged(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """Return means (L, p) over `window` neighbours, at the ends over the nearest ones."""
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    first = np.clip(np.arange(len(values)) - window // 2, 0, len(values) - window)
    return np.asarray((sums[first + window] - sums[first]) / window)


def silent_of(terms: ResponseTerms, counted: Counted) -> dict[str, SilentLines]:
    """Return what the outputs have at lines of the design that are not excited, odd and even."""
    found = {}
    for kind, harmonics in (("odd", terms.grid.odd), ("even", terms.grid.even)):
        parts = np.split(counted.data.y, counted.repeats)
        records = [counted.periods.transforms(one)[:, :, harmonics] for one in parts]
        shape = _between(terms.grid.at(harmonics), terms.grid.frequencies, terms.lines.noise)
        lines = silent_lines(np.concatenate(records, axis=1), shape)
        if lines is not None:
            found[kind] = lines
    return found


def _distorted(
    model: Model,
    terms: ResponseTerms,
    found: PeriodicResponse,
    counted: Counted,
    judged: Judged,
    silent: Mapping[str, SilentLines],
) -> Distorted | None:
    """Return the change of the response by a nonlinearity, by power at silent lines and by cubes."""
    odd, periods, data = terms.grid.odd, counted.periods, counted.data
    error = response_error(found, periods.period, counted.kept, silent["odd"], odd)
    nominal = (model.plant_at(terms.grid.at(found.harmonics)), model.plant_at(terms.grid.at(odd)))
    shape = _between(terms.grid.at(odd), terms.grid.frequencies, terms.lines.noise)
    cube = cubes(found, data.u, data.y, periods, odd, nominal, shape, repeats=counted.repeats)
    return distorted(
        silent,
        judged.lines.ratios(error),
        cube,
        lambda outputs: judged.lines.ratios(cube.error * outputs[:, None]),
    )


def _between(w: Array, lines: Array, values: Array) -> Array:
    """Return values (L, p) at lines (L,) between them, at w (n,), linear in both logarithms."""
    logs = [np.interp(np.log(w), np.log(lines), np.log(column)) for column in values.T]
    return np.exp(np.stack(logs, axis=1))
