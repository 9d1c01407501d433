"""Read files as records: signals by channel in segments with even steps, and what was done to them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from inputdesign_cli.errors import DataError, Diagnostic, Location, bad_spec
from inputdesign_cli.finding import Finding
from inputdesign_cli.findings.other_systems import samples_repeated
from inputdesign_cli.findings.places import Record as Record, Recorded, is_called
from inputdesign_cli.findings.prepared_records import (
    TIMES_ASSUMED,
    columns_against_spec,
    columns_by_unit,
    name_and_unit,
)
from inputdesign_cli.identification.faults import resolution_of
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.records.columns import roles_of
from inputdesign_cli.records.reading import read_sheet
from inputdesign_cli.records.segments import EVEN, segments_of
from inputdesign_cli.records.sheet import Preparation, Sheet
from inputdesign_cli.records.signals import Signals, is_even, joined_rows, signals_of, typical_step
from inputdesign_cli.specification.models.units import SECONDS

# The sample time of a file may differ by this share from the spec's or a stated one. If resampled, it may be
# longer than a stated one by the second share.
_ALIKE, _LONGER = 0.1, 0.5
# Sample times of several files, or of a file in two places, differ by less than this share by rounding alone.
_ROUND = 1e-3


def read_log(path: Path, preparation: Preparation) -> Record:
    """Read a file without a spec: channels that are named, or else u1, u2, .., y1, y2, .. of the header.

    Raises:
        DataError: the file cannot be read, or does not show its inputs and outputs.
    """
    return _read(path, preparation)


def read_logs(paths: Sequence[Path], preparation: Preparation) -> Record:
    """Read several files of the same channels and sample time, one after the other.

    Raises:
        DataError: see `read_log`; the files differ, or hold the same samples.
    """
    records = [read_log(path, preparation) for path in paths]
    first = records[0]
    for path, one in zip(paths, records, strict=True):
        _check_alike(path, one, paths[0], first)
    joined = _together(paths, records)
    return replace(joined, findings=(*joined.repeated, *joined.findings))


def _check_alike(path: Path, one: Record, first_path: Path, first: Record) -> None:
    """Raise `DataError` (`data-not-uniform`) if a file has other channels or steps than the first."""
    both, line = (one, first), 1
    ours, theirs = (", ".join(sorted(role for role in log.names if role[0] in "uy")) for log in both)
    hint = "name columns that all files have: --columns u1=NAME,y1=NAME"
    if ours == theirs:
        if one.time_unit == first.time_unit and abs(one.step - first.step) <= _ROUND * first.step:
            return
        line = 1 if one.recorded is None else int(one.recorded.rows[:2][-1])
        ours, theirs = (f"a sample every {log.step:.6g} {log.time_unit}" for log in both)
        hint = f"add --sample-time {max(one.step, first.step):.6g} --resample"
        if one.time_unit != first.time_unit:
            hint = "write all times in one unit"
        elif not all("time" in log.names for log in both):
            hint = "give the sample time of all by --sample-time"
    message = f"{path.name} has {ours}, and {first_path.name} has {theirs}"
    place = Location(str(path), line, 1)
    raise DataError.because("data-not-uniform", message, f"explore one file at a time, or {hint}", "", place)


def read_data(paths: Sequence[Path], units: Units, preparation: Preparation) -> Record:
    """Read the channels of a plant: columns u1, u2, .., y1, y2, .. and, if there is one, time.

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
                message = f"the {what} {name}, but the plant has no such channel"
                hint = f"its channels are {', '.join(channels)}: write {option}"
                raise bad_spec("unknown-channel", message, hint=hint)
    return _together(paths, [_read(path, preparation, units) for path in paths])


def _read(path: Path, preparation: Preparation, units: Units | None = None) -> Record:
    """Read one file, for a plant if its units are given."""
    sheet = read_sheet(path, preparation=preparation)
    roles = roles_of(sheet, preparation.columns, units)
    signals = joined_rows(signals_of(sheet, roles, preparation), resample=preparation.resample)
    if units is not None:
        found = [*_against_spec(sheet, roles, preparation, units)]
        signals, step, unit = _in_step(signals, units, preparation), units.sample_time, units.time_unit
    else:
        known = _step_of(signals, preparation.sample_time, resample=preparation.resample)
        if known is None and signals.name:
            if len(signals.time) == 1:
                message = f"one row of {sheet.path.name} is too few"
                raise sheet.error("too-few-samples", message, "record more samples, or keep more rows", 0)
            message = f"the times in column {signals.name} show no sample time"
            hint = "give it: --sample-time 0.5; if that column does not count, add --columns time=none"
            raise sheet.error("data-not-uniform", message, hint, 0)
        step, unit, found = known or 1.0, signals.unit or "s", TIMES_ASSUMED.when(known is None)
    record = _record(signals, step, unit, preparation)
    return replace(record, names=roles, findings=(*record.findings, *found))


def _against_spec(
    sheet: Sheet, roles: Mapping[str, str], preparation: Preparation, units: Units
) -> Iterator[Finding]:
    """Yield findings for columns that the plant lacks, of other units, or taken by their unit alone."""
    yield from columns_against_spec(sheet.names, units.channels, units.inputs, units.outputs, roles)
    taken = {
        channel: name
        for channel, name in roles.items()
        if channel not in ("time", *preparation.columns)
        and not is_called(channel, name.lower())
        and name_and_unit(name)[0].lower() != units.channels.get(channel, ("", ""))[0].lower()
    }
    yield from columns_by_unit(taken)


def _together(paths: Sequence[Path], records: Sequence[Record]) -> Record:
    """Join the records of several files, one after the other."""
    counts = Counter(path.name for path in paths)
    labels = [path.name if counts[path.name] == 1 else str(path) for path in paths]
    recorded = [one.recorded for one in records if one.recorded is not None]
    references = [one.r for one in records if one.r is not None]
    begin = [f"{path.name}: " if len(paths) > 1 else "" for path in paths]
    return replace(
        records[0],
        u=np.concatenate([one.u for one in records]),
        y=np.concatenate([one.y for one in records]),
        r=np.concatenate(references) if len(references) == len(records) else None,
        time=np.concatenate([one.time for one in records]),
        lengths=tuple(length for one in records for length in one.lengths),
        files=tuple((label, len(one.y)) for label, one in zip(labels, records, strict=True)),
        findings=tuple(
            replace(found, message=f"{name}{found.message}")
            for name, one in zip(begin, records, strict=True)
            for found in one.findings
        ),
        means=np.average([one.means for one in records], axis=0, weights=[len(one.u) for one in records]),
        recorded=Recorded(
            np.concatenate([one.values for one in recorded]),
            np.concatenate([one.rows for one in recorded]),
            np.concatenate([one.held for one in recorded]),
            np.max([one.resolution for one in recorded], axis=0),
        ),
        repeated=tuple(samples_repeated(paths, [one.values for one in recorded])),
        lined=any(one.lined for one in records),
        paths=tuple(map(str, paths)),
    )


def _record(signals: Signals, step: float, unit: str, preparation: Preparation) -> Record:
    """Build the record from the signals of one file, whose references follow the inputs."""
    r = sum(name.startswith("u") for name in signals.names)
    segments, done = segments_of(signals, step, unit, preparation)
    times, u, y = (np.concatenate(part) for part in zip(*segments, strict=True))
    lengths = tuple(len(part.y) for part in segments)
    # The signals of the file at the samples of the segments.
    stamped = np.flatnonzero(~np.isnan(signals.time))
    stamps = signals.time[stamped] * (1.0 if signals.name else step)
    at = stamped[np.searchsorted(0.5 * (stamps[1:] + stamps[:-1]), times)]
    logged = signals.y[at]
    held = np.diff(logged, axis=0, prepend=np.nan) == 0.0
    held[np.cumsum([0, *lengths])[:-1]] = False
    values, rows = np.column_stack([signals.u[at, :r], logged]), signals.sheet.lines[at]
    return Record(
        u[:, :r],
        y,
        u[:, r:] if u.shape[1] > r else None,
        times,
        lengths,
        ((signals.sheet.path.name, len(u)),),
        Recorded(values, rows, held, resolution_of(signals.y)),
        step=step,
        time_unit=unit,
        findings=(*signals.findings, *done),
        header=tuple(signals.sheet.header),
        means=np.nanmean(signals.u[:, :r], axis=0),
        lined=any(one.where.startswith("y") and one.figures.get("line") for one in done),
    )


def _step_of(signals: Signals, stated: float | None, *, resample: bool) -> float | None:
    """Return the sample time by the option, the times or the file; None if nothing states it.

    Raises `DataError` (`data-not-uniform`): times advance by something else than the user states.
    """
    apart = typical_step(signals.time) if signals.name else np.nan
    if stated is None:
        return apart if np.isfinite(apart) else signals.sheet.sample_time
    if abs(apart - stated) > _ALIKE * stated and not (resample and apart - stated <= _LONGER * stated):
        message = (
            f"times in column {signals.name} advance by {apart:.6g}, and --sample-time says {stated:.6g}"
        )
        hint = "leave --sample-time out; or mind --time-unit; or, if that column does not count, time=none"
        raise signals.sheet.error("data-not-uniform", message, hint, 0)
    return stated


def _in_step(signals: Signals, units: Units, preparation: Preparation) -> Signals:
    """Return the signals with times in the unit of the spec.

    Raises `DataError`: `data-wrong-unit`; `data-not-uniform`, the sample time differs.
    """
    sheet, stated, scale = signals.sheet, preparation.sample_time, 1.0
    if signals.unit and (signals.name or preparation.time_unit):
        scale = SECONDS[signals.unit] / SECONDS[units.time_unit]
    if scale != 1.0 and not (preparation.time_unit or signals.dated):
        message = f"the times are in {signals.unit}, but the spec counts in {units.time_unit}"
        hint = f"add --time-unit {signals.unit} to convert them, or set time_unit: {signals.unit}"
        place = Location(str(sheet.path), 1, 1, signals.name)
        raise DataError.because("data-wrong-unit", message, hint, "time_unit", place)
    signals = replace(signals, time=signals.time * scale) if signals.name else signals
    stated = stated or (None if signals.name else sheet.sample_time)
    stated = stated and stated * (scale if preparation.time_unit else 1.0)
    step = _step_of(signals, stated, resample=preparation.resample) or units.sample_time
    apart, most = abs(step - units.sample_time), (EVEN if stated else _ALIKE) * units.sample_time
    # Even steps do not jitter: a small difference is another sample time once it adds up to a sample.
    falls_behind = apart > EVEN * units.sample_time and apart * len(signals.time) > units.sample_time
    other = bool(signals.name) and is_even(signals.time) and falls_behind and not preparation.resample
    if apart <= most and not other:
        return signals
    default = " (as it is where none is stated)" if units.sample_time == 1.0 else ""
    said = f"the data are sampled every {step:.6g} {units.time_unit}, but sample_time is "
    message = f"{said}{units.sample_time:g} {units.time_unit}{default}"
    hint = f"if that is right, set sample_time: {step:.6g} and design anew"
    place = Location(str(sheet.path), int(sheet.lines[min(1, len(sheet.lines) - 1)]), 1)
    details = {"data_sample_time": step}
    raise DataError(Diagnostic("data-not-uniform", message, hint, "sample_time", place, details))
