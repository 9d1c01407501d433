"""Recorded experiments: u and y from data files, their columns, units and times checked, outliers named."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import DataError, Diagnostic, Location, SpecError, bad_spec
from inputdesign_cli.identification import resolution_of
from inputdesign_cli.outcome.shares import per_cent
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.specification.models.units import SECONDS
from inputdesign_cli.tasks.build.columns import (
    counted_unit,
    other_units,
    reference_columns,
    time_unit_in,
    unused_columns,
    with_headers,
    with_names,
)
from inputdesign_cli.tasks.build.copies import check_different
from inputdesign_cli.tasks.build.far_off import outliers, strange_values
from inputdesign_cli.tasks.build.files import read_sheet
from inputdesign_cli.tasks.build.passed_over import passed_over
from inputdesign_cli.tasks.build.preparation import (
    EVEN,
    MOST_JITTER,
    Preparation,
    Segment,
    jitter,
    limits_of_sensor,
    moves_between,
    resampled,
    trend,
    whole_segments,
)
from inputdesign_cli.tasks.build.signals import Signals, check_stated, signals_of, stated_step
from inputdesign_cli.tasks.build.without import labels
from inputdesign_cli.tasks.build.written_apart import joined_rows

_UNSTATED = " (as it is where none is stated)"


@dataclass(frozen=True)
class Recorded:
    """The outputs as they stand in the files.

    Attributes:
        values: (samples, r + p), of inputs and outputs as they stand in the file.
        rows: (samples,), where each sample stands; the nearest one, where times were evened out.
        held: (samples, p), whether a value is that of the sample before.
        resolution: (p,), the step in which each is recorded.
    """

    values: Array
    rows: NDArray[np.int64]
    held: NDArray[np.bool_]
    resolution: Array

    @classmethod
    def together(cls, parts: Sequence[Recorded]) -> Recorded:
        """Those of several files, one after the other."""
        return cls(
            np.concatenate([part.values for part in parts]),
            np.concatenate([part.rows for part in parts]),
            np.concatenate([part.held for part in parts]),
            np.max([part.resolution for part in parts], axis=0),
        )

    def at(self, samples: NDArray[np.int64]) -> Recorded:
        """Those of some samples."""
        return replace(self, values=self.values[samples], rows=self.rows[samples], held=self.held[samples])


@dataclass(frozen=True)
class Data:
    """u (samples, r) and y (samples, p) of experiments one after the other, and what to know of them.

    Attributes:
        r: (samples, r), the reference of a loop; None where some file does not have it.
        lengths: the samples of each stretch without gaps.
        files: the name of each file and its samples.
        time: (samples,), in the unit of the spec; counted from zero in a file that has none.
        notes: what was done to the record and what was seen in it.
        means: (r,), of the inputs as they were recorded, before anything was taken away; None: not known.
        recorded: of the outputs; None: not known.
        repeated: what is said of files that have samples in common.
        lined: whether lines were taken away from outputs: what of them the plant did not make is estimated
            along, since a line through the output is not that of the drift alone.
    """

    u: Array
    y: Array
    r: Array | None
    time: Array
    lengths: tuple[int, ...]
    files: tuple[tuple[str, int], ...]
    notes: tuple[str, ...]
    means: Array | None = None
    recorded: Recorded | None = None
    repeated: tuple[str, ...] = ()
    lined: bool = False


def read_data(paths: Sequence[Path], units: Units, preparation: Preparation) -> Data:
    """The columns u1, u2, .., y1, y2, .. of all channels of the plant and, if there is one, time.

    The only input may be called u, the only output y.

    Raises:
        SpecError: `unknown-channel`, a channel is named that the plant does not have.
        DataError: a file cannot be read, lacks a column, holds text, or is sampled otherwise than the spec
            says.
    """
    channels = [f"u{i + 1}" for i in range(units.inputs)] + [f"y{i + 1}" for i in range(units.outputs)]
    named = set(preparation.columns) - {"time"} - (set(units.excitations) if units.closed_loop else set())
    for what, option, names in (
        ("operating point names", f"--operating-point {channels[0]}=1.5", preparation.operating_point),
        ("columns name", f"--columns {channels[0]}=2", named),
    ):
        for name in names:
            if name not in channels:
                raise bad_spec(
                    "unknown-channel",
                    f"the {what} {name}, but the plant has no such channel",
                    hint=f"its channels are {', '.join(channels)}: write {option}",
                )
    parts = [_read(path, units, preparation, named=len(paths) > 1) for path in paths]
    recorded = [part.recorded for part in parts if part.recorded is not None]
    references = [part.r for part in parts if part.r is not None]
    return Data(
        np.concatenate([part.u for part in parts]),
        np.concatenate([part.y for part in parts]),
        np.concatenate(references) if len(references) == len(parts) else None,
        np.concatenate([part.time for part in parts]),
        tuple(length for part in parts for length in part.lengths),
        tuple((name, len(part.u)) for name, part in zip(labels(paths), parts, strict=True)),
        tuple(note for part in parts for note in part.notes),
        np.average([part.means for part in parts], axis=0, weights=[len(part.u) for part in parts]),
        Recorded.together(recorded),
        tuple(check_different(paths, [one.values for one in recorded])),
        any(part.lined for part in parts),
    )


def prepared(
    signals: Signals, step: float, time_unit: str, preparation: Preparation
) -> tuple[list[Segment], list[str]]:
    """Segments with even steps, their trends taken away, and what was done and seen.

    Args:
        step: the sample time.
        time_unit: of the times, for messages.

    Raises:
        DataError: `data-not-uniform`, the times jitter too much; `data-not-a-number`, no row is whole.
    """
    sheet, rows, told = signals.sheet, signals.sheet.lines, list(signals.told)
    time = signals.time if signals.name else signals.time * step
    whole = ~np.isnan(np.column_stack([time, signals.u, signals.y])).any(axis=1)
    if not np.any(whole & ~signals.without):
        message = f"no row of {sheet.path.name} has a number in every column that is asked for"
        hint = (
            "inputs, outputs and times of a sample stand in one row: where a logger writes them in turn, "
            "join the rows; or name other columns (--columns)"
        )
        if np.any(whole):
            message, hint = f"--without leaves no row of {sheet.path.name}", "leave fewer rows out"
            raise DataError(sheet.error("data-unreadable", message, hint))
        raise DataError(sheet.error("data-not-a-number", message, hint, 0))
    for name, x in zip(signals.inputs, signals.u.T, strict=True):
        there = ~np.isnan(x) & ~signals.without
        told += outliers(name, x[there], rows[there])
    for name, x in zip(signals.outputs, signals.y.T, strict=True):
        there = ~np.isnan(x) & ~signals.without
        told += strange_values(name, x[there], signals.u[there], rows[there])
        told += limits_of_sensor(name, x[there])
    apart, lines = passed_over(sheet, timed=bool(signals.name))
    segments, cuts = whole_segments(
        time, signals.u, signals.y, step, apart, rows, signals.without, resample=preparation.resample
    )
    told = [*lines, *cuts, *told]
    off = jitter(segments, step)
    if off > EVEN:
        if off > MOST_JITTER and not preparation.resample:
            row = _worst_step(signals.time, step)
            message = (
                f"the steps of time differ from {step:.6g} {time_unit} by up to {per_cent(off)}, and more "
                f"than {100 * MOST_JITTER:g} % is not evened out unasked"
            )
            hint = "add --resample to interpolate all the same, or give the sample time that holds"
            raise DataError(sheet.error("data-not-uniform", message, hint, row))
        moved = sum(moves_between(part, step) for part in segments)
        segments = [resampled(part, step) for part in segments]
        told.insert(
            0,
            f"the steps of time jitter by up to {per_cent(off, 2)} of {step:.6g} {time_unit}: resampled "
            "(outputs by interpolation, inputs at the nearest sample)",
        )
        if moved:
            told.insert(
                1,
                f"inputs move between {moved} of the resampled instants, and are taken as held there: the "
                "estimate is not that of the plant; resample to a step over which they are held, or estimate "
                "at the steps of the file",
            )
    taken = [_detrended(part, signals, preparation) for part in segments]
    return [part for part, _ in taken], [*told, *dict.fromkeys(n for _, notes in taken for n in notes)]


def _detrended(part: Segment, signals: Signals, preparation: Preparation) -> tuple[Segment, list[str]]:
    told, lined = [], False
    found = {}
    for letter, names, values in (("u", signals.inputs, part.u), ("y", signals.outputs, part.y)):
        columns = []
        for name, x in zip(names, values.T, strict=True):
            level = preparation.operating_point.get(name if name[1:] else f"{name}1", 0.0)
            if preparation.detrend == "none":
                columns.append(x - level)
                continue
            away, what, line = trend(x, preparation.detrend)
            lined |= line and letter == "y"
            told.append(f"{what} was taken away from {name}")
            columns.append(x - away)
        found[letter] = np.column_stack(columns)
    return Segment(part.time, found["u"], found["y"], part.held, lined), told


def _worst_step(time: Array, step: float) -> int:
    return int(np.nanargmax(np.abs(np.diff(time) - step))) + 1


def _read(path: Path, units: Units, preparation: Preparation, *, named: bool) -> Data:
    """One file, which the notes name if asked to."""
    sheet = read_sheet(path, key="")
    preparation = with_names(sheet, units, with_headers(sheet, preparation))
    references = reference_columns(units.inputs, sheet, preparation.columns) if units.closed_loop else {}
    signals, joined = joined_rows(
        signals_of(sheet, units.inputs, units.outputs, preparation, references), resample=preparation.resample
    )
    unit = counted_unit(signals.sheet, signals.name, preparation, dated=signals.dated)
    if unit is not None and signals.name:
        signals = replace(signals, time=signals.time * (SECONDS[unit] / SECONDS[units.time_unit]))
    _check_steps(signals, units, preparation)
    segments, told = prepared(signals, units.sample_time, units.time_unit, preparation)
    told += [*joined, *unused_columns(sheet, units, preparation), *other_units(sheet, units, preparation)]
    inputs = np.concatenate([part.u for part in segments])
    return Data(
        inputs[:, : units.inputs],
        np.concatenate([part.y for part in segments]),
        inputs[:, units.inputs :] if references else None,
        np.concatenate([part.time for part in segments]),
        tuple(len(part.y) for part in segments),
        ((path.name, len(inputs)),),
        tuple(f"{path.name}: {note}" if named else note for note in told),
        np.nanmean(signals.u[:, : units.inputs], axis=0),
        recorded_in(signals, units.sample_time, segments, units.inputs),
        lined=any(part.lined for part in segments),
    )


def recorded_in(signals: Signals, step: float, segments: Sequence[Segment], inputs: int) -> Recorded:
    """The outputs of the file, sample by sample of the segments, `step` apart; of u so many are inputs."""
    stamped = np.flatnonzero(~np.isnan(signals.time))
    stamps = signals.time[stamped] * (1.0 if signals.name else step)
    times = np.concatenate([part.time for part in segments])
    nearest = np.searchsorted(0.5 * (stamps[1:] + stamps[:-1]), times)
    held = np.concatenate([part.held for part in segments])
    at = stamped[nearest]
    values = np.column_stack([signals.u[:, :inputs], signals.y])[at]
    return Recorded(values, signals.sheet.lines[at], held, resolution_of(signals.y))


@contextmanager
def blaming_columns(path: Path) -> Iterator[None]:
    """Lays what an estimator says against the signals at the columns of the file that they came from.

    Raises:
        DataError: in place of the estimator's `SpecError`.
    """
    try:
        yield
    except SpecError as error:
        header = read_sheet(path, key="").header

        def placed(diagnostic: Diagnostic) -> Diagnostic:
            named = [name for name in header if name.startswith(diagnostic.key or "u")]
            before = header[: header.index(named[0])] if named else []
            column = 1 + sum(len(name) + 1 for name in before)
            return replace(diagnostic, location=Location(str(path), 1, column, ",".join(header)))

        raise DataError([placed(diagnostic) for diagnostic in error.diagnostics]) from error


def _check_steps(signals: Signals, units: Units, preparation: Preparation) -> None:
    """The file is sampled as the spec says.

    Raises:
        DataError: `data-wrong-unit` or `data-not-uniform`.
    """
    sheet = signals.sheet
    unit = None if signals.dated or preparation.time_unit else time_unit_in(sheet, signals.name)
    if unit is not None and unit != units.time_unit:
        message = f"the times are in {unit}, but the spec counts in {units.time_unit}"
        hint = f"add --time-unit {unit} to convert them, or set time_unit: {unit} (and sample_time in it)"
        place = Location(str(sheet.path), 1, 1, signals.name)
        raise DataError.because("data-wrong-unit", message, hint, "time_unit", place)
    steps = np.diff(signals.time[~np.isnan(signals.time)]) if signals.name else np.zeros(0)
    stated = stated_step(sheet, preparation)
    if steps.size and not preparation.sample_time:
        stated = None
    if stated is not None and preparation.time_unit is not None:
        stated *= SECONDS[preparation.time_unit] / SECONDS[units.time_unit]
    if stated is not None:
        check_stated(signals, stated, resample=preparation.resample)
    typical = stated or (float(np.median(steps)) if steps.size else units.sample_time)
    if abs(typical - units.sample_time) <= (EVEN if stated else MOST_JITTER) * units.sample_time:
        return
    raise DataError(
        Diagnostic(
            "data-not-uniform",
            f"the data are sampled every {typical:.6g} {units.time_unit}, but sample_time is "
            f"{units.sample_time:g} {units.time_unit}{_UNSTATED * (units.sample_time == 1.0)}",
            f"if that is right, set sample_time: {typical:.6g} and design anew",
            "sample_time",
            Location(str(sheet.path), int(sheet.lines[min(1, len(sheet.lines) - 1)]), 1, ""),
            {"data_sample_time": typical},
        )
    )
