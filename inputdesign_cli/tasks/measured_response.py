"""Records -> the frequency response without a model, beside what the spec designed, and whether it is met."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.errors import DataError
from inputdesign_cli.identification import frequency_response
from inputdesign_cli.identification.cubes import cubes
from inputdesign_cli.identification.distortion import response_error
from inputdesign_cli.identification.frequency_response import of_periods
from inputdesign_cli.identification.periodic_response import (
    PeriodicResponse,
    Periods,
    differing,
    excited_lines,
    periodic_response,
)
from inputdesign_cli.identification.silent_lines import SilentLines, silent_lines
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Results
from inputdesign_cli.runs.units import Header
from inputdesign_cli.tasks.build.data import Data, read_data
from inputdesign_cli.tasks.build.preparation import Preparation
from inputdesign_cli.tasks.response import ResponseTask
from inputdesign_cli.tasks.result.measured_response import REMEDY, UNLIKE, Judged, measured_results, unexcited
from inputdesign_cli.tasks.result.responses import response_of_data
from inputdesign_cli.tasks.result.silent_lines import Distorted, distorted

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
        found = frequency_response(data.u, data.y, data.r, lengths=data.lengths)
        if found is None:
            raise DataError.because(
                "too-few-samples",
                f"{paths[0].name} excites no frequency enough for a response without a model",
                hint="record longer, or excite more frequencies",
            )
    else:
        periods, repeats = _periods(task, data, paths[0].name)
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
        silent = _silent(task, data, periods, repeats)
        if "odd" in silent:
            judged = replace(
                judged, distorted=_distorted(question.model, task, by_lines, data, judged, silent)
            )
        lacking = [f"{missing}: {REMEDY}"] if missing else []
        data = replace(data, notes=(*data.notes, *lacking, *_seen(data, periods, judged.differing)))
    shown = response_of_data(units, question.model, found, by_reference=data.r is not None and task is None)
    results = measured_results(
        question.header, found, shown, judged, silent, data, time.perf_counter() - started, assess=assess
    )
    return results, judged


def _periods(task: ResponseTask, data: Data, name: str) -> tuple[Periods, int]:
    """How the data repeat, and how many records of equal length there are.

    Raises:
        DataError: `bad-period`.
    """
    stated, lengths = task.periods, set(data.lengths)
    length, whole = data.lengths[0], stated.blocks * stated.period
    fits = len(lengths) == 1 and (stated.blocks == 1 or length % whole == 0)
    if not fits:
        what = " and ".join(str(one) for one in sorted(lengths))
        raise DataError.because(
            "bad-period",
            f"{name} has stretches of {what} samples, and the design has {stated.blocks} blocks of "
            f"whole periods of {stated.period}",
            hint="cut every record to the length of signal.csv (--skip, --range), and close gaps",
        )
    if stated.kept(length) < 1 or stated.kept(length) * len(data.lengths) < 2:
        raise DataError.because(
            "too-few-samples",
            f"{name} has {stated.each(length)} periods of {stated.period} samples, {stated.skip} of them "
            "transient: the scatter of two that count is needed to tell the noise",
            hint="record more periods, or give several records",
        )
    return stated, len(data.lengths)


def _seen(data: Data, periods: Periods, share: float) -> list[str]:
    """What is left out of the records, and whether the inputs repeat at all."""
    told, samples = [], data.lengths[0]
    left = samples - periods.each(samples) * periods.blocks * periods.period
    if left:
        told.append(
            f"the first {left} of {samples} samples are left out: the others are whole periods of "
            f"{periods.period}"
        )
    if share > UNLIKE:
        told.append(
            f"{100.0 * share:.3g} % of the power of the inputs differs from period to period of "
            f"{periods.period} samples: they do not repeat as the spec says; was its signal.csv applied, and "
            "is u recorded as it was?"
        )
    return told


def _judged(
    task: ResponseTask,
    found: PeriodicResponse,
    data: Data,
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
    )


def _averaged(values: NDArray[np.float64], window: int) -> NDArray[np.float64]:
    """(L, p): means over `window` neighbours, at the ends over the nearest so many."""
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])
    first = np.clip(np.arange(len(values)) - window // 2, 0, len(values) - window)
    return np.asarray((sums[first + window] - sums[first]) / window)


def _silent(task: ResponseTask, data: Data, periods: Periods, repeats: int) -> dict[str, SilentLines]:
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
    data: Data,
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
