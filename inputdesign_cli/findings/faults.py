"""Faults of measurement: spikes, sensors that stand still, shifts of an output, columns of another clock."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import NOTE, REFUTED, Finding, FindingKind, finding, refuted
from inputdesign_cli.findings.outlying_values import visible_step
from inputdesign_cli.findings.places import SHOWN, Record, file_of, of_file, places, rows_of, without_option
from inputdesign_cli.identification import Estimate, LevelShift, chance_of_shifts
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.faults import frozen, shifted, spikes
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import TransferMatrix

# Share of samples above which a frozen sensor biases a model; fit (%) below which spikes do.
_BIASING, _HALF = 0.02, 50.0
# The error that rounding may leave in a level, as a share of the deviation of the output.
_ROUNDED_OFF, _HARMONICS = 0.03, 50
# Moves of inputs up to so many samples before explain spikes, if they leave less than this share of squares.
_BEFORE, _LEFT = 6, 0.25

SPIKES = refuted(
    "spikes",
    "A few samples dominate the residuals. They hold most of the sum of squares of an output. They are "
    "measurement spikes, or events that the model does not describe.",
    "Leave out faulty rows with `--without`, which cuts the record there.",
)
FROZEN = refuted(
    "sensor-stands-still",
    "An output stands still while the input moves. It keeps its value for longer than rounding explains. "
    "The sensor is frozen or saturated, or the logger repeats its last value.",
    "Leave these rows out with `--without`, which cuts the record there.",
)

COARSE = refuted(
    "sensor-too-coarse",
    "The steps of a sensor decide what is measured. The noise is too small beside a step to even rounding "
    "out, so that the error follows the output.",
    "Log with more digits, or let the output move over many more steps.",
)


def faults(units: Units, estimate: Estimate, data: Record) -> list[Finding]:
    """Return a finding for each output and kind of fault, with its rows."""
    found = []
    for one in spikes(estimate.errors):
        if follows_inputs(estimate.errors[list(one.samples), one.output], one.samples, data.u):
            continue
        rows, name = rows_of(data, [(at, at) for at in one.samples]), _named(units, one.output)
        fact = (
            f"{len(one.samples)} of {len(estimate.errors)} samples of {name} hold {100.0 * one.share:.3g} % "
            f"of the squares (at {places(units, data, one.samples)})"
        )
        option = without_option(rows)
        remedy = f"Leave out rows that are faults of measurement: {option}."
        times, at = [float(data.time[at]) for at in one.samples], [row for _, row, _ in rows]
        found.append(
            SPIKES.found(
                fact, where=name, remedy=remedy, share=one.share, times=times, rows=at, option=option
            )
        )
    for output, runs in _still(estimate, data).items():
        rows, name = rows_of(data, runs), _named(units, output)
        still = sum(last - first + 1 for first, last in runs)
        listed = ", ".join(
            f"rows {first} to {last}{of_file(data, at)}"
            for (at, _), (_, first, last) in zip(runs[:SHOWN], rows, strict=False)
        )
        more = ", .." * (len(runs) > SHOWN)
        fact = f"{name} keeps its value for {still} of {len(data.y)} samples ({listed}{more})"
        option = without_option(rows)
        remedy = f"Leave these rows out, which cuts the record there: {option}."
        span = [[first, last] for _, first, last in rows]
        found.append(FROZEN.found(fact, where=name, remedy=remedy, samples=still, rows=span, option=option))
    return [*found, *_coarse(units, estimate, data)]


def _coarse(units: Units, estimate: Estimate, data: Record) -> list[Finding]:
    """Return a finding for each output whose noise does not even out the steps of its sensor."""
    if data.recorded is None:
        return []
    found = []
    for output, simulated in enumerate(estimate.simulation.outputs.T):
        y = data.recorded.values[:, data.u.shape[1] + output]
        step, spread = visible_step(y), float(np.std(y))
        if not step:
            continue
        left = float(np.var(data.y[:, output] - simulated))
        noise = float(np.sqrt(max(left - step**2 / 12.0, 0.0)))
        error = rounding_error(step, noise)
        name = _named(units, output)
        fact = (
            f"{name} in steps of {step:.3g}, and noise of about {noise:.2g}. Levels may be wrong by "
            f"{error:.2g}, {100.0 * error / spread:.2g} % of the deviation of {name}"
        )
        off = error > _ROUNDED_OFF * spread
        found += COARSE.when(off, fact, where=name, step=step, noise=noise, error=error)
    return found


def follows_inputs(errors: Array, samples: Sequence[int], u: Array) -> bool:
    """Return whether moves of inputs u (n, r) explain spikes (m,): the model is wrong, not the sensor."""
    moves, at = np.diff(u, axis=0, prepend=u[:1]), np.array(samples)
    columns = np.column_stack([moves[np.maximum(at - lag, 0)] for lag in range(_BEFORE + 1)])
    left = errors - columns @ np.linalg.lstsq(columns, errors, rcond=None)[0]
    return len(at) >= 2 * columns.shape[1] and float(left @ left) < _LEFT * float(errors @ errors)


def rounding_error(step: float, noise: float) -> float:
    """Return the largest mean error of rounded samples of a level, behind Gaussian noise of that deviation.

    It is a sawtooth of the level with harmonics (d / (pi k)) exp(-2 (pi k s / d)^2), step d and noise s
    ([widrow-kollar-2008]). Their sum bounds it, and so does half a step.
    """
    k = np.arange(1, _HARMONICS + 1)
    harmonics = step / (np.pi * k) * np.exp(-2.0 * (np.pi * k * noise / step) ** 2)
    return float(min(0.5 * step, np.sum(harmonics)))


def biasing(units: Units, estimate: Estimate, data: Record, fitted: Sequence[float]) -> list[Finding]:
    """Return the faults that give the model of an output other dynamics than the plant has.

    Args:
        fitted: (p,), per cent of each output that the simulation explains.
    """
    fits = {_named(units, output): fit for output, fit in enumerate(fitted)}
    matters = {
        COARSE.code: lambda one: True,
        SPIKES.code: lambda one: fits[one.where] < _HALF,
        FROZEN.code: lambda one: one.figures["samples"] >= _BIASING * len(data.y),
    }
    return [one for one in faults(units, estimate, data) if matters[one.code](one)]


@finding(REFUTED, "columns-misaligned", "Shift the column, or correct the controller of the spec.")
def loop_faults(kind: FindingKind, controller: TransferMatrix | None, data: Record) -> list[Finding]:
    """A column was logged at another time. With it shifted, the data follow u = r - C y much better."""
    if controller is None or data.r is None:
        return []
    found = {}
    for one in shifted(controller, data.u, data.y, data.r, data.lengths):
        several = data.u.shape[1] > 1 and one.letter != "y"
        name = f"{one.letter}{one.channel + 1}" if several else one.letter
        count = abs(one.lag)
        fact = (
            f"{name} is {count} sample{'s' * (count > 1)} {'late' if one.lag > 0 else 'early'}. u = r - C y "
            f"leaves {100 * one.left:.3g} % of u unexplained, and {100 * one.then:.2g} % with {name} shifted"
        )
        found[fact] = kind.found(fact, where=name, lag=one.lag, left=one.left, then=one.then)
    return list(found.values())


def _named(units: Units, output: int) -> str:
    return f"y{output + 1}" if units.outputs > 1 else "y"


def _still(estimate: Estimate, data: Record) -> dict[int, list[tuple[int, int]]]:
    """Return the stretches in which outputs stand still while an input moves, by output; see `frozen`."""
    known, simulated = data.recorded, estimate.simulation.outputs
    if known is None:
        return {}
    apart = data.y - simulated
    return frozen(known.held, known.resolution, data.u, estimate.errors, apart, simulated, data.lengths)


@finding(
    REFUTED,
    "level-shift",
    "Leave those rows out with `--without`, or record what changed as a further input.",
)
def shifted_levels(kind: FindingKind, estimate: Estimate, data: Record, time_unit: str) -> list[Finding]:
    """An output shifts without an input. A load or the gain may have changed."""
    if not estimate.tests.shifted or data.recorded is None:
        return []
    every = np.arange(len(data.y))
    what, runs = _described(estimate.tests.shifted, data, data.recorded.rows, every, time_unit)
    option = without_option(runs)
    remedy = f"Leave the shift out: {option}; or record what changed as a further input."
    rows = [[first, last] for _, first, last in runs]
    probability = chance_of_shifts(estimate.tests.shifted)[0]
    return [kind.found(what, remedy=remedy, probability=probability, rows=rows, option=option)]


@finding(NOTE, "shifts-left-out", "Leave the same rows out for identify and assess: `--without ROWS`.")
def left_out(
    kind: FindingKind,
    log: Record,
    shifts: Sequence[LevelShift],
    samples: NDArray[np.int64],
    time_unit: str,
    *,
    short: int,
) -> Finding:
    """Shifts of an output were left out, and each part has its own level. A load may have changed.

    Args:
        samples: positions in the log of the samples by which the shifts are numbered.
        short: how many more samples were left out, since the parts next to the shifts were too short.
    """
    rows = np.arange(len(log.y)) if log.recorded is None else log.recorded.rows
    what, runs = _described(shifts, log, rows, samples, time_unit)
    listed = " and ".join(f"{first} to {last}{f' of {name}' if name else ''}" for name, first, last in runs)
    besides = f", and {short} samples next to them, too few for a segment" if short else ""
    option = without_option(runs)
    fact = f"{what} (a change of load, or of the gain?). Rows {listed}{besides}"
    remedy = f"Leave the same rows out for identify and assess: {option}."
    return kind.found(fact, remedy=remedy, rows=[[first, last] for _, first, last in runs], option=option)


def _described(
    shifts: Sequence[LevelShift],
    record: Record,
    rows: NDArray[np.int64],
    samples: NDArray[np.int64],
    time_unit: str,
) -> tuple[str, list[tuple[str, int, int]]]:
    """Return what shifts when, and the file and rows of each shift."""
    events, runs = [], []
    for shift in sorted(shifts, key=lambda one: one.sample):
        at, first, last = samples[[shift.sample, shift.begins, shift.ends - 1]].tolist()
        output = signal_name("y", shift.output, record.y.shape[1])
        events.append(
            f"{output} {'rises' if shift.rises else 'falls'} about row {rows[at]}{of_file(record, at)} "
            f"({record.time[at]:.6g} {time_unit})"
        )
        runs.append((file_of(record.files, at), int(rows[first]), int(rows[last])))
    probability = chance(chance_of_shifts(shifts)[0])
    return f"{' and '.join(events)}, which no input explains (probability {probability} by chance)", runs
