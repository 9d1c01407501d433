"""Faults of measurement: spikes, sensors that stand still, shifts of an output, columns of another clock."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import NOTE, REFUTED, Finding, FindingKind, finding, refuted
from inputdesign_cli.findings.outlying_values import visible_step
from inputdesign_cli.findings.places import Record, file_of, of_file, places, rows_of, without_option
from inputdesign_cli.identification import Estimate, LevelShift, chance_of_shifts
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.identification.faults import frozen, shifted, spikes
from inputdesign_cli.outcome.shares import chance
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import TransferMatrix

# Share of samples above which a frozen sensor biases a model; fit (%) below which spikes do.
_BIASING, _HALF = 0.02, 50.0
# The bias of a level by rounding that matters, as a share of the output's deviation; harmonics in its bound.
_ROUNDED_OFF, _HARMONICS = 0.03, 50
# Input moves up to _BEFORE samples earlier explain spikes if they leave less than _LEFT of their squares.
_BEFORE, _LEFT = 6, 0.25

SPIKES = refuted(
    "spikes",
    "A few samples dominate the residuals. They hold most of the sum of squares of an output. They are "
    "measurement spikes, or events that the model does not describe.",
    "Leave out faulty rows, which cuts the record there: `--without ROWS`.",
)
FROZEN = refuted(
    "sensor-stands-still",
    "An output stands still while the input moves. It keeps its value for longer than rounding explains. "
    "The sensor is frozen or saturated, or the logger repeats its last value.",
    "Leave these rows out, which cuts the record there: `--without ROWS`.",
)

COARSE = refuted(
    "sensor-too-coarse",
    "The steps of a sensor decide what is measured. The noise is too small beside a step to even rounding "
    "out, so that the error follows the output.",
    "Log with more digits, or let the output move over many more steps.",
)


def faults(units: Units, estimate: Estimate, data: Record) -> list[Finding]:
    """Return a finding for each output and kind of fault, with its rows."""
    found, samples = [], len(estimate.errors)
    for one in spikes(estimate.errors):
        if not follows_inputs(estimate.errors[list(one.samples), one.output], one.samples, data.u):
            name = signal_name("y", one.output, units.outputs)
            share = f"{len(one.samples)} of {samples} samples of {name} hold {100.0 * one.share:.3g} %"
            fact = f"{share} of the squares, at {places(units, data, one.samples)}"
            rows = rows_of(data, [(at, at) for at in one.samples])
            found.append(_on_rows(SPIKES, rows, fact, name, share=one.share))
    for output, runs in _still(estimate, data).items():
        name, still = signal_name("y", output, units.outputs), sum(last - first + 1 for first, last in runs)
        begins = places(units, data, [first for first, _ in runs])
        fact = f"{name} keeps its value for {still} of {samples} samples, from {begins}"
        found.append(_on_rows(FROZEN, rows_of(data, runs), fact, name, samples=still))
    return [*found, *_coarse(units, estimate, data)]


def _on_rows(
    kind: FindingKind, runs: Sequence[tuple[str, int, int]], fact: str, where: str = "", **figures: object
) -> Finding:
    """Return a finding on runs of rows (file, first and last), with the option that leaves them out."""
    option, rows = without_option(runs), [[first, last] for _, first, last in runs]
    remedy = kind.remedy.replace("--without ROWS", option)
    return kind.found(fact, where=where, remedy=remedy, severity=None, rows=rows, option=option, **figures)


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
        name = signal_name("y", output, units.outputs)
        fact = f"{name} in steps of {step:.3g}, and noise of about {noise:.2g}. Levels may be {error:.2g} off"
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
    """Return the largest bias of the mean of rounded samples: a level with Gaussian noise of that deviation.

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
    fits = {signal_name("y", output, units.outputs): fit for output, fit in enumerate(fitted)}
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
        name = signal_name(one.letter, one.channel, 1 if one.letter == "y" else data.u.shape[1])
        count, way = abs(one.lag), "late" if one.lag > 0 else "early"
        fact = (
            f"{name} is {count} sample{'s' * (count > 1)} {way}. u = r - C y leaves {100 * one.left:.3g} % "
            f"of u unexplained, and {100 * one.then:.2g} % with {name} shifted"
        )
        found[name] = kind.found(fact, where=name, lag=one.lag, left=one.left, then=one.then)
    return list(found.values())


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
    "Leave the shift out: `--without ROWS`; or record what changed as a further input.",
)
def shifted_levels(kind: FindingKind, estimate: Estimate, data: Record, time_unit: str) -> list[Finding]:
    """An output shifts without an input. A load or the gain may have changed."""
    if not estimate.tests.shifted or data.recorded is None:
        return []
    return [_shifts(kind, data, estimate.tests.shifted, np.arange(len(data.y)), time_unit)]


@finding(NOTE, "shifts-left-out", "Leave the same rows out for identify and assess: `--without ROWS`.")
def left_out(
    kind: FindingKind, log: Record, shifts: Sequence[LevelShift], samples: NDArray[np.int64], time_unit: str
) -> Finding:
    """Shifts of an output were left out, and each part has its own level. A load may have changed.

    Too short segments next to them are left out as well.

    Args:
        samples: positions in the log of the samples by which the shifts are numbered.
    """
    return _shifts(kind, log, shifts, samples, time_unit)


def _shifts(
    kind: FindingKind,
    record: Record,
    shifts: Sequence[LevelShift],
    samples: NDArray[np.int64],
    time_unit: str,
) -> Finding:
    """Return a finding that says what shifts when, with the rows of each shift."""
    rows = np.arange(len(record.y)) if record.recorded is None else record.recorded.rows
    events, runs = [], []
    for shift in sorted(shifts, key=lambda one: one.sample):
        at, first, last = samples[[shift.sample, shift.begins, shift.ends - 1]].tolist()
        output = signal_name("y", shift.output, record.y.shape[1])
        events.append(
            f"{output} {'rises' if shift.rises else 'falls'} about row {rows[at]}{of_file(record, at)} "
            f"({record.time[at]:.6g} {time_unit})"
        )
        runs.append((file_of(record.files, at), int(rows[first]), int(rows[last])))
    probability = chance_of_shifts(shifts)[0]
    fact = f"{' and '.join(events)}, which no input explains (probability {chance(probability)} by chance)"
    return _on_rows(kind, runs, fact, probability=probability)
