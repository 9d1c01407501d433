"""The record as it is applied: its entry of the outcome, its tables, the outputs it causes, its files."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.accuracy import Requirement, criterion_of
from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import bad_spec
from inputdesign_cli.information import Experiment, FiniteRecord
from inputdesign_cli.outcome import Signal
from inputdesign_cli.outcome.curves import PredictedPanel, SignalCurves
from inputdesign_cli.outcome.design import Moves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.text_formats import WRITERS
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.questions.common.delivery import adding
from inputdesign_cli.questions.common.record import RecordRequest
from inputdesign_cli.signal.lines import DesignedSpectrum, Lines
from inputdesign_cli.signal.selection import Record

_LAGS = 50
_LOST = 1e-6  # largest rounding, as a share of the largest sample
# Noise is stationary if its deviation grows by less than this share in the second half of the record.
_SETTLED = 0.02


def signal_of(
    request: RecordRequest,
    experiment: Experiment,
    record: Record,
    requirements: Sequence[Requirement] = (),
    *,
    designed: Array | None = None,
    spectrum: DesignedSpectrum | None = None,
) -> Signal:
    """Return the entry of the outcome for a record: powers and peaks by channel, and its accuracy.

    The value of a criterion is for an experiment of the design's length that goes on as the record does.
    Other requirements have their worst ratio.
    """
    units, samples, made = request.units, record.samples, record.method != "given"
    held = request.settings.hold > 1
    plant = FiniteRecord(experiment, len(samples), units.step)
    criterion, value, efficiency = criterion_of(requirements), None, None
    ratio = record.worst_ratio if requirements and np.isfinite(record.worst_ratio) else None
    if criterion is not None:
        level = criterion.level(plant.information_of_experiment(samples))
        value = criterion.value(level)
        efficiency = None if designed is None else level / criterion.level(designed)
    y, u = plant.signals("output", samples), plant.signals("input", samples)
    points = request.operating_points
    return replace(
        plain_signal(samples),
        type=record.method,
        sample_time=units.sample_time,
        input_power=_channels(np.mean(u**2, axis=0)),
        output_power=_channels(np.mean(y**2, axis=0)),
        input_peak=_channels(np.abs(u).max(axis=0)),
        input_move=_channels(_largest_moves(u)),
        output_peak=_channels(np.abs(y).max(axis=0)),
        criterion=value,
        efficiency=efficiency,
        worst_ratio=ratio if criterion is None else None,
        extra_power=record.extra_power if made else None,
        spectrum_error=None if spectrum is None else _spectrum_error(spectrum.lines(len(samples)), samples),
        limits=_limits(request, record) or None,
        of_limits=request.bounds.shares(u, y) or None,
        spectral_factor_residual=record.factor_residual,
        operating_point=None if points is None else _channels(points),
        wav_full_scale=_full_scale(request, record) if "wav" in request.also else None,
        # Moves that are held, or few, may be made by an operator.
        moves=_moves(samples, units.sample_time) if made and (held or request.bounds.moves) else None,
        details={
            **({"phases": request.settings.phases} if record.method == "multisine" else {}),
            **({"hold": request.settings.hold} if made and held else {}),
        },
    )


def _moves(samples: Array, sample_time: float) -> Moves:
    """Return the changes of all inputs of a record (n, r) from rest, and the shortest time between two."""
    changes = np.diff(samples, axis=0, prepend=0.0)
    at = [np.append(np.flatnonzero(column), len(samples)) for column in changes.T]
    shortest = min((int(np.diff(one).min()) for one in at if one.size > 1), default=len(samples))
    largest = _channels(np.abs(changes).max(axis=0))
    return Moves(int(np.count_nonzero(changes)), largest, shortest * sample_time)


def _channels(values: Array) -> tuple[float, ...]:
    return tuple(values.tolist())


def with_record(
    results: Results, request: RecordRequest, experiment: Experiment, record: Record, signal: Signal
) -> Results:
    """Return the results with a record: signal.csv, predicted_output.csv, their plot, and other files."""
    units = request.units
    time = units.sample_time * np.arange(len(record.samples), dtype=np.float64)
    signals = list(applied(request, record).T)
    columns = {
        units.time_header: time,
        **dict(zip(map(units.header, units.excitations), signals, strict=True)),
    }
    around, panels = request.operating_points, _predicted(request, experiment, record)
    predicted = {units.time_header: time}
    for panel in sorted(panels, key=lambda panel: panel.applied):  # outputs stand first in the table
        name = panel.name
        predicted |= {units.header(name): panel.values, f"{name}_noise_deviation": panel.deviation}
    moves, rate = {}, request.bounds.rate
    if rate is not None and not units.closed_loop:  # the largest move from rest, and its limit
        pairs = zip(_largest_moves(record.samples).tolist(), rate.tolist(), strict=True)
        moves = dict(zip(units.excitations, pairs, strict=True))
    curves = SignalCurves(
        time,
        dict(zip(units.excitations, signals, strict=True)),
        {} if units.closed_loop else _limits(request, record),
        {name: units.label(name) for name in units.excitations},
        tuple(panels),
        held=units.sampled,
        moves=moves,
        levels=around is not None and bool(np.any(around)),
    )
    tables = {"signal": Table(columns), "predicted_output": Table(predicted)}
    if "step_table" in request.also:  # the first value, and each that differs from the one before
        moved = np.any(np.diff(record.samples, axis=0, prepend=np.nan) != 0.0, axis=1)
        tables["steps"] = Table({name: values[moved] for name, values in columns.items()})
    # signal.mat, .npz and .h (time, u1 or r1, .., sample_time), and signal.wav (32-bit float up to 1).
    endings = [ending for ending in WRITERS if ending in request.also]
    files = {f"signal.{ending}": WRITERS[ending](columns, units.sample_time) for ending in endings}
    if "wav" in request.also:
        import scipy.io.wavfile

        buffer = io.BytesIO()
        values = applied(request, record) / _full_scale(request, record)
        scipy.io.wavfile.write(buffer, round(request.sampling_rate), values.astype(np.float32))
        files["signal.wav"] = buffer.getvalue()
    results = replace(results, files=files)
    return adding(results, replace(results.outcome, signal=signal), (), tables, {"signal": curves})


def _predicted(request: RecordRequest, experiment: Experiment, record: Record) -> list[PredictedPanel]:
    """Return what the record causes at the outputs, and before them at the inputs where there is a loop."""
    units, n, most, panels = request.units, len(record.samples), request.bounds.output, []
    y, u = (FiniteRecord(experiment, n, units.step).signals(at, record.samples) for at in ("output", "input"))
    of_y, of_u = noise_deviation(experiment, n, units.step)
    if units.closed_loop:
        around, limits = request.operating_points, _limits(request, record)
        u = u if around is None else u + around
        for i, values in enumerate(u.T):
            name = f"u{i + 1}"
            kept, label = limits.get(name), units.label(name)
            panels.append(PredictedPanel(name, values, of_u[:, i], kept, label, applied=True))
    for i, values in enumerate(y.T):
        name, kept = f"y{i + 1}", None if most is None else (-float(most[i]), float(most[i]))
        panels.append(PredictedPanel(name, values, of_y[:, i], kept, units.label(name)))
    return panels


def noise_deviation(experiment: Experiment, samples: int, step: float) -> tuple[Array, Array]:
    """Return standard deviations of the noise at outputs (n, p) and, in a loop, at inputs (n, r).

    Their squares are sums of squared responses to an impulse of e. Noise that settles within the record is
    stationary from its start; drifting noise grows from zero.
    """
    model, p = experiment.model, experiment.model.outputs
    e = np.zeros((p, samples, p))
    e[:, 0] = np.linalg.cholesky(model.covariance).T
    rest = np.zeros((p, samples, model.inputs))
    loop = experiment.loop
    y, u = (model.simulate(rest, e, step)[1], rest) if loop is None else loop.signals(rest, e)
    return _grown(y), _grown(u)


def _grown(caused: Array) -> Array:
    """Return standard deviations (n, channels) from responses (sources, n, channels) to impulses."""
    grown = np.sqrt(np.cumsum(np.sum(caused**2, axis=0), axis=0))
    still = grown[len(grown) // 2] >= (1.0 - _SETTLED) * grown[-1]
    return np.where(still, grown[-1], grown)


def _limits(request: RecordRequest, record: Record) -> dict[str, tuple[float, float]]:
    """Return the least and largest value of each input, where it is limited."""
    most, around = request.bounds.amplitude, request.operating_points
    if most is None or record.method == "given":
        return {}
    middle = np.zeros(most.size) if around is None else around
    pairs = zip((middle - most).tolist(), (middle + most).tolist(), strict=True)
    return {f"u{i}": pair for i, pair in enumerate(pairs, start=1)}


def _largest_moves(u: Array) -> Array:
    """Return the largest moves (r,) of inputs (n, r) that start from rest."""
    return np.abs(np.diff(u, axis=0, prepend=0.0)).max(axis=0)


def applied(request: RecordRequest, record: Record) -> Array:
    """Return samples (n, r) about the operating points; raise `out-of-range` where they lose their digits."""
    points = request.operating_points
    if points is None:
        return record.samples
    if np.any(np.spacing(np.abs(points)) > _LOST * np.abs(record.samples).max(axis=0)):
        message = "the operating point is so far off that the samples added to it lose their digits"
        hint = "move the zero of the scale, or lower signal.offset"
        raise bad_spec("out-of-range", message, hint=hint, key="signal.offset")
    return record.samples + points


def _full_scale(request: RecordRequest, record: Record) -> float:
    """Return the value at full scale in signal.wav, of all channels: the largest range or value."""
    if request.full_scale is not None:
        return request.full_scale
    return float(np.abs(applied(request, record)).max())


def _spectrum_error(lines: Lines, samples: Array) -> float:
    """Return the largest error of the record's correlations, lags 0 to 50, against the design.

    Correlations of inputs i and j are relative to the roots of their powers; the total power does not count.
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


def plain_signal(u: Array) -> Signal:
    """Return length, mean squares, peaks and crest factors by channel; the crest of a zero channel is 1."""
    power = np.mean(u * u, axis=0)
    peak = np.abs(u).max(axis=0)
    crest = np.divide(peak, np.sqrt(power), out=np.ones_like(peak), where=power > 0.0)
    return Signal(len(u), power=_channels(power), peak=_channels(peak), crest_factor=_channels(crest))


def signal_results(units: Units, u: Array) -> tuple[Table, SignalCurves]:
    """Return signal.csv and its plot."""
    time = units.sample_time * np.arange(len(u), dtype=np.float64)
    channels = {f"u{i + 1}": samples for i, samples in enumerate(u.T)}
    return Table({units.time_header: time, **channels}), SignalCurves(time, channels)
