"""The record as it is applied: its table, other files of it, and what it adds to the figures."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import error_bound
from inputdesign_cli.assemble.curves import frequency_header
from inputdesign_cli.assemble.signal_settings import build_bounds, build_recipe, sampling_rate
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome import BoundCurves, SignalCurves, SpectrumCurves, Table
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import Record, record_information
from inputdesign_cli.spec import Spec


def applied(spec: Spec, samples: Array) -> Array:
    """(n,): the values to be applied, the operating point included."""
    return samples + operating_point(spec)


def operating_point(spec: Spec) -> float:
    """The offset, or the value of the converter next to it."""
    quantiser = build_recipe(spec).quantiser
    if quantiser is not None:
        return quantiser.operating_point
    offset = spec.signal.offset
    return float(offset[0] if isinstance(offset, tuple) else offset or 0.0)


def signal_curves(spec: Spec, record: Record) -> tuple[Table, SignalCurves]:
    """signal.csv, with time stamps in the unit of the spec, and its plot with the limits on u.

    A record that was given is left as it is; others are shifted to the operating point.
    """
    time = spec.sample_time * np.arange(record.samples.size, dtype=np.float64)
    channel = "r1" if spec.closed_loop else "u1"
    given = record.method == "given"
    values = {channel: record.samples if given else applied(spec, record.samples)}
    most = build_bounds(spec, []).amplitude
    limits = {}
    if most is not None and not spec.closed_loop and not given:
        limits[channel] = (operating_point(spec) - most, operating_point(spec) + most)
    return Table({f"time_{spec.time_unit}": time, **values}), SignalCurves(time, values, limits)


def with_periodogram(
    table: Table, curves: SpectrumCurves, spec: Spec, samples: Array
) -> tuple[Table, SpectrumCurves]:
    """The spectrum with the smoothed periodogram of the record over it; lines are left as they are."""
    if curves.density is None:
        return table, curves
    periodogram = np.abs(np.fft.rfft(samples)) ** 2 / samples.size
    reach = int(samples.size**0.4 / 4)
    window = np.ones(2 * reach + 1) / (2 * reach + 1)
    smooth = np.convolve(np.pad(periodogram, reach, mode="reflect"), window, mode="valid")
    w = 2 * np.pi * np.arange(periodogram.size) / samples.size / spec.sample_time
    record = np.interp(table.columns[frequency_header(spec)], w, smooth)
    shown = np.interp(curves.frequency, w, smooth)
    return Table({**table.columns, "phi_record": record}), replace(curves, record=shown)


def with_record(
    curves: BoundCurves, spec: Spec, experiment: Experiment, alpha: float, samples: Array
) -> BoundCurves:
    """The model error with that of the record itself."""
    try:
        information = record_information(experiment, samples)
        r_u = error_bound(experiment, information, alpha, curves.frequency * spec.sample_time)
    except np.linalg.LinAlgError:  # the record does not excite every parameter
        return curves
    return replace(curves, r_u_record=r_u)


def other_files(spec: Spec, record: Record) -> dict[str, bytes]:
    """signal.mat (time, u1 or r1, sample_time) and signal.wav (32-bit float, full scale 1 is `scale`)."""
    wanted = spec.signal.also or ()
    if not wanted:
        return {}
    import scipy.io
    import scipy.io.wavfile

    table, _ = signal_curves(spec, record)
    files: dict[str, bytes] = {}
    if "mat" in wanted:
        buffer = io.BytesIO()
        content: dict[str, Any] = {name: values[:, None] for name, values in table.columns.items()}
        scipy.io.savemat(buffer, content | {"sample_time": spec.sample_time})
        # The first 116 bytes are a text with the date, which would make equal runs differ.
        files["signal.mat"] = b"MATLAB 5.0 MAT-file".ljust(116) + buffer.getvalue()[116:]
    if "wav" in wanted:
        buffer = io.BytesIO()
        rate = round(sampling_rate(spec))
        values = applied(spec, record.samples) / wav_scale(spec, record.samples)
        scipy.io.wavfile.write(buffer, rate, values.astype(np.float32))
        files["signal.wav"] = buffer.getvalue()
    return files


def wav_scale(spec: Spec, samples: Array) -> float:
    """What full scale stands for in signal.wav: the range of the converter, or the largest value."""
    stated = spec.signal.quantisation
    return float(np.abs(applied(spec, samples)).max()) if stated is None else stated.range
