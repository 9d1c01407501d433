"""The record as it is applied: its table, other files of it, and what it adds to the figures."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.accuracy import error_bound
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import BoundCurves, SignalCurves, SpectrumCurves, Table
from inputdesign_cli.signal import record_information
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.spectrum import GivenSignal, GivenSpectrum
from inputdesign_cli.tasks.build.signal_settings import (
    build_channel_bounds,
    operating_points,
    sampling_rate,
)
from inputdesign_cli.tasks.result.curves import frequency_header


def applied(spec: Spec, samples: Array, *, given: bool = False) -> Array:
    """(n, r): the values of the samples (n,) or (n, r) to be applied, shifted to the operating points.

    A record that was `given` is left as it is.
    """
    values = samples.reshape(len(samples), -1)
    return values if given else values + operating_points(spec)


def deviations(spec: Spec, table: Table) -> Array:
    """(n, r): the samples of signal.csv from their operating points; a record that was given as it is."""
    letter = "r" if spec.closed_loop else "u"
    names = [f"{letter}{a + 1}" for a in range(spec.plant.inputs)]
    values = np.stack([np.asarray(table.columns[name]) for name in names], axis=1)
    given = isinstance(spec.spectrum, GivenSpectrum) and isinstance(spec.spectrum.given, GivenSignal)
    return values if given else values - operating_points(spec)


def signal_curves(spec: Spec, samples: Array, *, given: bool = False) -> tuple[Table, SignalCurves]:
    """signal.csv, with time stamps in the unit of the spec, and its plot with the limits on u."""
    time = spec.sample_time * np.arange(len(samples), dtype=np.float64)
    shown = applied(spec, samples, given=given)
    letter = "r" if spec.closed_loop else "u"
    channels = {f"{letter}{a + 1}": shown[:, a] for a in range(shown.shape[1])}
    most = build_channel_bounds(spec, []).amplitude
    limits = {}
    if most is not None and not spec.closed_loop and not given:
        around = operating_points(spec)
        limits = {f"u{a + 1}": (around[a] - most[a], around[a] + most[a]) for a in range(most.size)}
    return Table({f"time_{spec.time_unit}": time, **channels}), SignalCurves(time, channels, limits)


def with_periodogram(
    table: Table, curves: SpectrumCurves, spec: Spec, samples: Array
) -> tuple[Table, SpectrumCurves]:
    """The spectrum with the smoothed periodogram of the record over it; lines are left as they are."""
    if curves.density is None:
        return table, curves
    w, smooth = smoothed_periodogram(samples, spec.sample_time)
    record = np.interp(table.columns[frequency_header(spec)], w, smooth)
    shown = np.interp(curves.frequency, w, smooth)
    return Table({**table.columns, "phi_record": record}), replace(curves, record=shown)


def smoothed_periodogram(samples: Array, step: float) -> tuple[Array, Array]:
    """Frequencies in rad per unit of the `step`, and the smoothed periodogram there of samples (n,)."""
    periodogram = np.abs(np.fft.rfft(samples)) ** 2 / samples.size
    reach = int(samples.size**0.4 / 4)
    window = np.ones(2 * reach + 1) / (2 * reach + 1)
    smooth = np.convolve(np.pad(periodogram, reach, mode="reflect"), window, mode="valid")
    return 2 * np.pi * np.arange(periodogram.size) / samples.size / step, smooth


def with_record(
    curves: BoundCurves, spec: Spec, experiment: Experiment, alpha: float, samples: Array
) -> BoundCurves:
    """The model error with that of the record itself."""
    (panel,) = curves.panels
    try:
        information = record_information(experiment, samples)
        r_u = error_bound(experiment, information, alpha, panel.frequency * spec.sample_time)
    except np.linalg.LinAlgError:  # the record does not excite every parameter
        return curves
    return BoundCurves((replace(panel, r_u_record=r_u),))


def other_files(spec: Spec, samples: Array, *, given: bool = False) -> dict[str, bytes]:
    """signal.mat (time, u1, .. or r1, sample_time) and signal.wav (32-bit float, 1 being `wav_scale`)."""
    wanted = spec.signal.also or ()
    if not wanted:
        return {}
    import scipy.io
    import scipy.io.wavfile

    table, _ = signal_curves(spec, samples, given=given)
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
        values = applied(spec, samples, given=given) / wav_scale(spec, samples, given=given)
        scipy.io.wavfile.write(buffer, rate, values.astype(np.float32))
        files["signal.wav"] = buffer.getvalue()
    return files


def wav_scale(spec: Spec, samples: Array, *, given: bool = False) -> float:
    """What full scale stands for in signal.wav, in all channels: the largest range or the largest value."""
    stated = spec.signal.quantisation
    if stated is not None and not given:
        return float(np.max(stated.range))
    return float(np.abs(applied(spec, samples, given=given)).max())
