"""Records -> the frequency response without a model, beside what the spec designed, and whether it is met."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError
from inputdesign_cli.identification import frequency_response, response_delays
from inputdesign_cli.identification.cubes import cubes
from inputdesign_cli.identification.distortion import response_error
from inputdesign_cli.identification.frequency_response import of_periods
from inputdesign_cli.identification.period_drift import period_drift
from inputdesign_cli.identification.periodic_response import (
    PeriodicResponse,
    Periods,
    differing,
    excited_lines,
    periodic_response,
)
from inputdesign_cli.identification.silent_lines import SilentLines, silent_lines
from inputdesign_cli.identification.spikes import period_spikes
from inputdesign_cli.outcome.results import Results
from inputdesign_cli.outcome.units import Header
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.noise_spectrum import NoiseSpectrum
from inputdesign_cli.questions.assessment.responses import response_of_data
from inputdesign_cli.questions.frequency_response.doubts import Doubts, drift_told, spikes_told
from inputdesign_cli.questions.frequency_response.measured import (
    REMEDY,
    UNLIKE,
    Judged,
    measured_results,
    unexcited,
)
from inputdesign_cli.questions.frequency_response.silent_lines import Distorted, distorted
from inputdesign_cli.questions.frequency_response.solve import ResponseTask
from inputdesign_cli.questions.frequency_response.whole_periods import left_out, whole_periods
from inputdesign_cli.records import Preparation, Record, read_data

# Degrees of freedom (of complex numbers) over which the noise is averaged along the lines.
_FREEDOM = 60
_SURE = 0.95


@dataclass(frozen=True)
class Measurement:
    """How a frequency response is measured: by the lines of `task`, or without it by what data excite.

    Attributes:
        model: the nominal plant, which the response is drawn beside.
        operating_point: by channel, what the spec says that signals vary about.
    """

    header: Header
    model: Model
    task: ResponseTask | None
    operating_point: Mapping[str, float]


def measure(
    question: Measurement, paths: Sequence[Path], preparation: Preparation, *, assess: bool = False
) -> tuple[Results, Judged | None]:
    """The response with its confidence; with lines of a spec also how it compares with what is asked.

    Args:
        assess: whether the result is a verdict.

    Raises:
        DataError: a file cannot be used, or does not repeat as the spec says.
    """
    started = time.perf_counter()
    units = question.header.units
    known = {**question.operating_point, **preparation.operating_point}
    data = read_data(paths, units, replace(preparation, operating_point=known))
    task, judged = question.task, None
    silent: dict[str, SilentLines] = {}
    if task is None:
        delays = partial(response_delays, question.model, step=units.step)
        found = frequency_response(data.u, data.y, data.r, lengths=data.lengths, delays=delays)
        if found is None:
            raise DataError.because(
                "too-few-samples",
                f"{paths[0].name} excites no frequency enough for a response without a model",
                hint="record longer, or excite more frequencies",
            )
    else:
        data, periods, repeats = whole_periods(task.periods, data, paths[0].name, units.sample_time)
        excited = excited_lines(data.u, periods, task.grid.excited, repeats=repeats)
        missing = unexcited(question.header, task.grid.frequencies, excited)
        by_lines = periodic_response(data.u, data.y, periods, task.grid.excited[excited], repeats=repeats)
        if by_lines is None or (assess and missing):
            raise DataError.because(
                "not-exciting",
                f"{paths[0].name}: {missing or 'the inputs cannot be told apart at the lines of the spec'}",
                hint=REMEDY,
            )
        found = of_periods(by_lines, periods.period)
        judged = _judged(task, by_lines, data, periods, repeats, excited)
        silent, doubts = _doubted(question, task, by_lines, data, judged, repeats)
        judged = replace(judged, doubts=doubts)
        lacking = [f"{missing}: {REMEDY}"] if missing else []
        told = [*lacking, *left_out(data, periods), *_unlike(judged)]
        data = replace(data, remarks=(*data.remarks, *told))
    shown = response_of_data(units, question.model, found, by_reference=data.r is not None and task is None)
    results = measured_results(
        question.header, found, shown, judged, silent, data, time.perf_counter() - started, assess=assess
    )
    return results, judged


def _unlike(judged: Judged) -> Iterator[str]:
    """Whether the inputs repeat at all."""
    if judged.differing > UNLIKE:
        yield (
            f"{100.0 * judged.differing:.3g} % of the power of the inputs differs from period to period of "
            f"{judged.periods.period} samples: they do not repeat as the spec says; was its signal.csv "
            "applied, and is u recorded as it was?"
        )


def _doubted(
    question: Measurement,
    task: ResponseTask,
    found: PeriodicResponse,
    data: Record,
    judged: Judged,
    repeats: int,
) -> tuple[dict[str, SilentLines], Doubts]:
    """What silent lines have beside a drift, and what besides noise decides on the response.

    Spikes are in every line: beside them silent lines tell nothing. Of inputs that do not repeat, periods of
    outputs differ by what these do.
    """
    if judged.differing > UNLIKE:
        return {}, judged.doubts
    units, periods, doubts = question.header.units, judged.periods, judged.doubts
    kept = repeats * periods.kept(data.lengths[0])
    spiked = spikes_told(units, period_spikes(data.y, periods, repeats=repeats), data, kept)
    if spiked:
        return {}, replace(doubts, spiked=spiked)
    drift = period_drift(
        data.y, data.time, periods, _noise_at_rest(question.model, task, judged), repeats=repeats
    )
    if drift is not None:
        data = replace(data, y=data.y - drift.curve)
        without = periodic_response(data.u, data.y, periods, found.harmonics, repeats=repeats)
        if without is not None:
            scatter = np.abs(found.deviation**2 - without.deviation**2)
            moved = judged.lines.ratios(np.sqrt(np.abs(found.G - without.G) ** 2 + scatter))
            w = judged.grid.frequencies / units.frequency
            drifting, moved = drift_told(units, drift, moved, w, lined=data.lined)
            found, doubts = without, replace(doubts, drifting=drifting, moved=moved)
    silent = _silent(task, data, periods, repeats)
    if "odd" not in silent:
        return silent, doubts
    bent = _distorted(question.model, task, found, data, judged, silent)
    return silent, replace(doubts, distorted=bent)


def _noise_at_rest(model: Model, task: ResponseTask, judged: Judged) -> Array:
    """(p,): the spectrum of the noise towards frequency zero, of the data, by that at their lowest line.

    Noise of the spec may go on rising below that line.
    """
    lowest = int(np.argmin(judged.grid.frequencies))
    there = judged.noise[lowest]
    if task.tabulated:
        return there
    known = NoiseSpectrum.of(model).at(judged.periods.period, np.array([0]))[0]
    return np.maximum(there, there / judged.lines.noise[lowest] * known)


def _judged(
    task: ResponseTask,
    found: PeriodicResponse,
    data: Record,
    periods: Periods,
    repeats: int,
    excited: NDArray[np.bool_],
) -> Judged:
    """The deviations of the data against r_adm at the measured G, with noise averaged along the lines.

    The scatter of a few periods tells the noise of one line badly: what it is over the noise of the spec is
    averaged over neighbouring lines.

    Args:
        excited: (L,) lines of the task that were found.
    """
    if np.any(found.noise <= 0.0):
        raise DataError.because(
            "noise-free-data",
            "the periods do not differ at all, so that they tell nothing of the noise",
            hint="give records of a real plant, not of one period that was repeated",
        )
    lines = task.lines.where(excited).at(found.G)
    counted = repeats * periods.blocks * periods.kept(data.lengths[0]) * periods.period
    expected = found.deviation * np.sqrt(lines.noise / found.noise)[:, :, None]
    window = min(max(-(-_FREEDOM // found.freedom), 1), len(found.harmonics))
    excess = _averaged(found.noise / lines.noise, window)
    smooth = expected * np.sqrt(excess)[:, :, None]
    freedom = 2 * found.freedom * window
    tests = max(len(found.harmonics) // window, 1) * found.noise.shape[1]
    rare = 0.5 * (1.0 - _SURE) / tests
    low, high = (
        float(np.sqrt(freedom / (2.0 * scipy.special.gammaincinv(0.5 * freedom, p))))
        for p in (1.0 - rare, rare)
    )
    # Where r_adm is a share of |G|, it is known as well as |G| is.
    far = -float(scipy.special.ndtri(0.25 * (1.0 - _SURE) / smooth.size)) * np.sqrt(0.5)
    away = far * smooth
    at_least = lines.at(np.maximum(np.abs(found.G) - away, 1e-9 * away))
    at_most = lines.at(np.abs(found.G) + away)
    return Judged(
        grid=replace(task.grid, excited=found.harmonics),
        asked=excited.size,
        differing=differing(data.u, periods, repeats=repeats),
        # Sizes are less by `far` deviations at most, and noise comes out anew, in these data and in those.
        times=float(
            np.max(lines.ratios(smooth))
            * (high + far * (lines.share or 0.0))
            * (1.0 + scipy.special.ndtri(_SURE) / np.sqrt(freedom))
        )
        ** 2,
        periods=periods,
        lines=lines,
        expected=expected,
        found=smooth,
        ratios=lines.ratios(smooth),
        least=low * at_most.ratios(smooth),
        largest=high * at_least.ratios(smooth),
        counted=counted,
        noise=lines.noise * excess,
        doubts=Doubts(np.zeros(len(found.harmonics))),
    )


def _averaged(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """(L, p): means over `window` neighbours, at the ends over the nearest so many."""
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    first = np.clip(np.arange(len(values)) - window // 2, 0, len(values) - window)
    return np.asarray((sums[first + window] - sums[first]) / window)


def _silent(task: ResponseTask, data: Record, periods: Periods, repeats: int) -> dict[str, SilentLines]:
    """What the outputs have at lines of the design that are not excited, odd and even."""
    found = {}
    for kind, harmonics in (("odd", task.grid.odd), ("even", task.grid.even)):
        records = [periods.transforms(one)[:, :, harmonics] for one in np.split(data.y, repeats)]
        shape = _between(task.grid.at(harmonics), task.grid.frequencies, task.lines.noise)
        lines = silent_lines(np.concatenate(records, axis=1), shape)
        if lines is not None:
            found[kind] = lines
    return found


def _distorted(
    model: Model,
    task: ResponseTask,
    found: PeriodicResponse,
    data: Record,
    judged: Judged,
    silent: Mapping[str, SilentLines],
) -> Distorted | None:
    """What a nonlinearity of odd degree changes of the response, by power at silent lines and by cubes."""
    odd, periods, repeats = task.grid.odd, judged.periods, len(data.lengths)
    kept = repeats * periods.kept(data.lengths[0])
    error = response_error(found, periods.period, kept, silent["odd"], odd)
    nominal = tuple(model.plant_at(task.grid.at(lines)) for lines in (found.harmonics, odd))
    shape = _between(task.grid.at(odd), task.grid.frequencies, task.lines.noise)
    cube = cubes(found, data.u, data.y, periods, odd, (nominal[0], nominal[1]), shape, repeats=repeats)
    return distorted(
        silent,
        judged.lines.ratios(error),
        cube,
        lambda outputs: judged.lines.ratios(cube.error * outputs[:, None]),
    )


def _between(w: Array, lines: Array, values: Array) -> Array:
    """(n, p): values (L, p) at lines (L,), at frequencies between, linear in both logarithms."""
    logs = [np.interp(np.log(w), np.log(lines), np.log(column)) for column in values.T]
    return np.exp(np.stack(logs, axis=1))
