"""The record as it is applied: what `result.json` says of it, its table, other files of it."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence

import numpy as np

from inputdesign_cli.accuracy import Requirement, criterion_of
from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.outcome.curves import SignalCurves
from inputdesign_cli.outcome.results import Json, Table
from inputdesign_cli.outcome.signal_files import WRITERS
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.predicted import predicted_output
from inputdesign_cli.questions.common.record import Delivery, RecordRequest
from inputdesign_cli.signal import Bounds, DesignedSpectrum, Lines, Record

_LAGS = 50
_LOST = 1e-6  # of the largest sample


def signal_entry(
    request: RecordRequest,
    units: Units,
    experiment: Experiment,
    record: Record,
    requirements: Sequence[Requirement] = (),
    *,
    designed: Array | None = None,
    spectrum: DesignedSpectrum | None = None,
) -> dict[str, Json]:
    """What `result.json` says of a record: powers and peaks by channel, and what it achieves.

    Of a criterion that is its value for an experiment of its own length that goes on as the record does, so
    that it compares with that of the design, and its share of that; of other requirements their worst ratio.

    Args:
        designed: information matrix (k, k) of the design.
        spectrum: of the design, for the error of that of the record.
    """
    samples = record.samples
    plant = FiniteRecord(experiment, len(samples), units.step)
    entry: dict[str, Json] = {"type": record.method}
    if record.method == "multisine":
        entry["phases"] = request.settings.phases
    entry |= {"samples": len(samples), "sample_time": units.sample_time} | _sizes(plant, samples)
    criterion = criterion_of(requirements)
    if criterion is not None:
        level = criterion.level(plant.information_of_experiment(samples))
        entry["criterion"] = criterion.value(level)
        if designed is not None:
            entry["efficiency"] = level / criterion.level(designed)
    elif requirements and np.isfinite(record.worst_ratio):
        entry["worst_ratio"] = record.worst_ratio
    if record.method != "given":
        entry["extra_power"] = record.extra_power
    if spectrum is not None:
        entry["spectrum_error"] = _spectrum_error(spectrum.lines(len(samples)), samples)
    limits = _limits(request, units, record)
    if limits:
        entry["limits"] = {name: list(pair) for name, pair in limits.items()}
    reached = _of_limits(request.bounds, entry)
    if reached:
        entry["of_limits"] = reached
    if record.factor_residual is not None:
        entry["spectral_factor_residual"] = record.factor_residual
    delivery = request.delivery
    if delivery.operating_points is not None and record.method != "given":
        entry["operating_point"] = delivery.operating_points.tolist()
    if "wav" in delivery.also:
        entry["wav_full_scale"] = _full_scale(delivery, record)
    return entry


def signal_curves(
    request: RecordRequest, units: Units, experiment: Experiment, record: Record
) -> tuple[dict[str, Table], SignalCurves]:
    """signal.csv and predicted_output.csv by file stem, with time stamps in the unit of the spec; their plot.

    Raises:
        SpecError: see `applied`.
    """
    columns = applied_columns(request, units, record)
    time, *signals = columns.values()
    predicted, panels = predicted_output(units, experiment, record.samples, request.bounds.output)
    points = request.delivery.operating_points
    curves = SignalCurves(
        time,
        dict(zip(units.excitations, signals, strict=True)),
        _limits(request, units, record),
        {name: units.label(name) for name in units.excitations},
        panels,
        held=units.sampled,
        moves=_moves(request, units, record),
        levels=points is not None and bool(np.any(points)),
    )
    return {"signal": Table(columns), "predicted_output": predicted}, curves


def applied_columns(request: RecordRequest, units: Units, record: Record) -> dict[str, Array]:
    """The columns of signal.csv. Raises `SpecError` as `applied` does."""
    time = units.sample_time * np.arange(len(record.samples), dtype=np.float64)
    values = applied(request.delivery, record).T
    return {units.time_header: time, **dict(zip(map(units.header, units.excitations), values, strict=True))}


def _limits(request: RecordRequest, units: Units, record: Record) -> dict[str, tuple[float, float]]:
    """Between which values each channel of the record is to stay, where that signal is limited."""
    most, around = request.bounds.amplitude, request.delivery.operating_points
    if most is None or units.closed_loop or record.method == "given":
        return {}
    middle = np.zeros(most.size) if around is None else around
    pairs = zip((middle - most).tolist(), (middle + most).tolist(), strict=True)
    return dict(zip(units.excitations, pairs, strict=True))


def _moves(request: RecordRequest, units: Units, record: Record) -> dict[str, tuple[float, float]]:
    """The largest move of each channel from rest and its limit, where the record is the input."""
    most = request.bounds.rate
    if most is None or units.closed_loop:
        return {}
    pairs = zip(_largest_moves(record.samples).tolist(), most.tolist(), strict=True)
    return dict(zip(units.excitations, pairs, strict=True))


def _largest_moves(u: Array) -> Array:
    """(r,): of inputs (n, r) that start from rest."""
    return np.abs(np.diff(u, axis=0, prepend=0.0)).max(axis=0)


def _of_limits(bounds: Bounds, sizes: Mapping[str, Json]) -> dict[str, float]:
    """The largest share over the channels of each limit on single samples that the record takes."""
    stated = (
        ("amplitude.input", bounds.amplitude, "input_peak"),
        ("amplitude.output", bounds.output, "output_peak"),
        ("rate", bounds.rate, "input_move"),
    )
    return {key: float(np.max(sizes[name] / most)) for key, most, name in stated if most is not None}


def applied(delivery: Delivery, record: Record) -> Array:
    """(n, r): the samples shifted to the operating points; a record that was given is left as it is.

    Raises:
        SpecError: `out-of-range` when so much is added that the samples lose their digits.
    """
    points = delivery.operating_points
    if points is None or record.method == "given":
        return record.samples
    if np.any(np.spacing(np.abs(points)) > _LOST * np.abs(record.samples).max(axis=0)):
        raise bad_spec(
            "out-of-range",
            "the operating point is so far off that the samples added to it lose their digits",
            hint="move the zero of the scale, or lower signal.offset",
            key="signal.offset",
        )
    return record.samples + points


def other_files(request: RecordRequest, units: Units, record: Record) -> dict[str, bytes]:
    """signal.mat, .npz and .h (time, u1 or r1, .., sample_time); signal.wav (32-bit float up to 1)."""
    delivery, files = request.delivery, {}
    for ending, made in WRITERS.items():
        if ending in delivery.also:
            files[f"signal.{ending}"] = made(applied_columns(request, units, record), units.sample_time)
    if "wav" in delivery.also:
        import scipy.io.wavfile

        buffer = io.BytesIO()
        values = applied(delivery, record) / _full_scale(delivery, record)
        scipy.io.wavfile.write(buffer, round(delivery.sampling_rate), values.astype(np.float32))
        files["signal.wav"] = buffer.getvalue()
    return files


def _full_scale(delivery: Delivery, record: Record) -> float:
    """What full scale stands for in signal.wav, in all channels: the largest range or the largest value."""
    if delivery.full_scale is not None and record.method != "given":
        return delivery.full_scale
    return float(np.abs(applied(delivery, record)).max())


def _sizes(plant: FiniteRecord, samples: Array) -> dict[str, list[float]]:
    """Powers and peaks by channel of a record (n, r)."""
    y, u = plant.signals("output", samples), plant.signals("input", samples)
    peak, rms = np.abs(samples).max(axis=0), np.sqrt(np.mean(samples**2, axis=0))
    return {
        "power": (rms**2).tolist(),
        "peak": peak.tolist(),
        "crest_factor": (peak / np.maximum(rms, 1e-300)).tolist(),
        "input_power": np.mean(u**2, axis=0).tolist(),
        "output_power": np.mean(y**2, axis=0).tolist(),
        "input_peak": np.abs(u).max(axis=0).tolist(),
        "input_move": _largest_moves(u).tolist(),
        "output_peak": np.abs(y).max(axis=0).tolist(),
    }


def _spectrum_error(lines: Lines, samples: Array) -> float:
    """The largest error of the record's correlations, lags 0 to 50, against those of the design.

    Those of inputs i and j are relative to the roots of their powers; the total power does not count.
    """
    n = len(samples)
    lags = np.arange(min(_LAGS, n // 4) + 1)
    turn = np.exp(1j * np.outer(lags, lines.frequencies))
    wanted = np.einsum("tn,nab->tab", turn, lines.powers).real
    found = np.array([samples[lag:].T @ samples[: n - lag] / (n - lag) for lag in lags])
    found *= np.trace(wanted[0]) / np.trace(found[0])
    size = np.sqrt(np.maximum(np.diag(wanted[0]), 0.0))
    scale = np.where(size > 0.0, size, np.inf)
    return float(np.abs((found - wanted) / np.outer(scale, scale)).max())
