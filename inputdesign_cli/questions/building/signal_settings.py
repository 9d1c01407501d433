"""`signal:` and the limits on single samples -> what is asked of the record, and whether it can exist."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.outcome.results import Table
from inputdesign_cli.questions.building.demand import check_record, longest_record
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.system import build_cost, excitation_band, record_step
from inputdesign_cli.questions.common.record import Delivery, RecordRequest, least_period
from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.signal.limits import Bounds
from inputdesign_cli.signal.multisine import blocks_of
from inputdesign_cli.signal.settings import Phases, Quantiser, SignalSettings
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.units import SECONDS

# Shared by the inputs: each adds a period to a record, which then varies less and takes longer.
_CANDIDATES, _FEWEST = 20, 4
_PATIENCE = 4  # times the number of candidates at most, if noise happens to fit badly
# Optimised phases take a twentieth of a second or more each, and hardly differ in quality.
_OPTIMISED = 4
# Signals whose times of switching are searched take seconds.
_SEARCHED = 2


def build_record_request(spec: Spec, parameters: int) -> RecordRequest:
    """Return everything that the spec asks of its record, for a model with a number of parameters.

    Raises:
        SpecError: `needs-band`; `too-large`; `beyond-nyquist` when samples are too far apart for the band.
    """
    check_record(spec, parameters)
    step, limits, signal = record_step(spec), spec.limits, spec.signal
    lo, hi = excitation_band(spec)
    stated = {
        "limits.amplitude": limits.amplitude,
        "limits.rate": limits.rate,
        "signal.quantisation": signal.quantisation,
    }
    return RecordRequest(
        settings=build_signal_settings(spec),
        bounds=build_bounds(spec),
        cost=build_cost(spec) or {"excitation": 1.0},
        units=build_units(spec),
        band=(lo * step, hi * step),
        step=step,
        samples=signal.samples,
        meets=signal.scale != "design",
        most_samples=limits.samples,
        longest=longest_record(parameters, spec.plant.outputs),
        stated_method=signal.type is not None,
        others=tuple(build_signal_settings(spec, method) for method in _other_methods(spec)),
        limit_keys=tuple(key for key, value in stated.items() if value is not None),
        delivery=Delivery(
            operating_points=None if signal.offset is None else operating_points(spec),
            also=signal.also or (),
            full_scale=None if signal.quantisation is None else float(np.max(signal.quantisation.range)),
            sampling_rate=sampling_rate(spec),
        ),
    )


def build_signal_settings(spec: Spec, method: str | None = None) -> SignalSettings:
    """Return the settings of the signal; its type and phases, if not stated, follow from other keys.

    Args:
        method: in place of the type of the spec.
    """
    signal, inputs = spec.signal, spec.plant.inputs
    method = method or _method(spec)
    limited = spec.limits.amplitude is not None or spec.limits.rate is not None
    uniform: Phases = "orthogonal" if inputs > 1 else "random"
    phases: Phases = signal.phases or ("optimised" if limited and method == "multisine" else uniform)
    candidates = max(_CANDIDATES // inputs, _FEWEST)
    if method == "multisine" and phases == "optimised":
        candidates = _OPTIMISED
    elif kind_of(method).slewed:
        candidates = _SEARCHED
    most = _PATIENCE * candidates if method == "filtered_noise" else candidates
    return SignalSettings(
        method=method,
        phases=phases,
        lines=signal.lines,
        periods=signal.periods or 1,
        hold=signal.hold or 1,
        ramp=signal.ramp or 0,
        bits=signal.bits,
        level=None if signal.amplitudes is None else per_channel(signal.amplitudes, inputs),
        candidates=signal.candidates or candidates,
        most_candidates=signal.candidates or most,
        seed=signal.seed or 0,
    )


def stated_peaks(spec: Spec) -> tuple[Array | None, Array | None]:
    """Return the largest |u| (r,) and |y| (p,), counted from the offset; None without a limit."""
    amplitude = spec.limits.amplitude
    if amplitude is None:
        return None, None
    u, y = amplitude.input, amplitude.output
    return (
        None if u is None else per_channel(u, spec.plant.inputs),
        None if y is None else per_channel(y, spec.plant.outputs),
    )


def stated_moves(spec: Spec) -> Array | None:
    """Return the largest rms value (r,) of moves within the limit on single moves; None without a limit.

    It is infinite if the limit on |u| is tighter: moves between -a and a are 2 a at most.
    """
    if spec.limits.rate is None:
        return None
    rate, (peak, _) = per_channel(spec.limits.rate, spec.plant.inputs), stated_peaks(spec)
    tighter = np.ones(rate.size, dtype=bool) if peak is None else rate < 2.0 * peak
    return np.where(tighter, rate / np.sqrt(spec.signal.hold or 1), np.inf)


def build_bounds(spec: Spec) -> Bounds:
    """Return the bounds on single samples of the record, channel by channel.

    Samples count from a value of the converter. If the offset lies between two values, the peak is reduced by
    the difference.
    """
    rate, inputs, quantisers = spec.limits.rate, spec.plant.inputs, _quantisers(spec)
    amplitude, output = stated_peaks(spec)
    if amplitude is not None and quantisers:
        amplitude = amplitude - np.abs(
            per_channel(spec.signal.offset or 0.0, inputs) - operating_points(spec)
        )
    return Bounds(
        amplitude=amplitude,
        rate=None if rate is None else per_channel(rate, inputs),
        output=output,
        quantisers=quantisers,
    )


def _quantisers(spec: Spec) -> tuple[Quantiser, ...]:
    """The converter of each input; all have the same number of bits."""
    stated, inputs = spec.signal.quantisation, spec.plant.inputs
    if stated is None:
        return ()
    spans = per_channel(stated.range, inputs)
    offsets = per_channel(spec.signal.offset or 0.0, inputs)
    return tuple(
        Quantiser(stated.bits, float(span), float(offset))
        for span, offset in zip(spans, offsets, strict=True)
    )


def operating_points(spec: Spec) -> Array:
    """Return the offset (r,) of each input, or the nearest value of its converter."""
    quantisers = _quantisers(spec)
    if quantisers:
        return np.array([quantiser.operating_point for quantiser in quantisers])
    return per_channel(spec.signal.offset or 0.0, spec.plant.inputs)


def deviations(spec: Spec, table: Table) -> Array:
    """Return the samples (n, r) of signal.csv about their operating points; a given record unchanged."""
    columns = build_units(spec).excitations
    values = np.stack([np.asarray(table.columns[name]) for name in columns], axis=1)
    given = spec.given is not None and spec.given.type == "signal"
    return values if given else values - operating_points(spec)


def sampling_rate(spec: Spec) -> float:
    """Return the number of samples per second."""
    return 1.0 / (spec.sample_time * SECONDS[spec.time_unit])


def _method(spec: Spec) -> str:
    """The type of signal: stated, or the one that other keys belong to."""
    signal = spec.signal
    if signal.type is not None:
        return signal.type
    if signal.phases is not None or signal.lines is not None:
        return "multisine"
    if signal.bits is not None:
        return "prbs"
    return _usual_method(spec)


def _usual_method(spec: Spec) -> str:
    """The type if none is stated: filtered noise for one input and output in q^-1, otherwise a multisine."""
    plant, spectrum = spec.plant, spec.spectrum
    if spec.accuracy.frequency_response is not None:
        return "multisine"
    single = plant.kind == "polynomial" and plant.inputs == plant.outputs == 1
    banded = spectrum is not None and spectrum.type == "polynomial" and not spec.closed_loop
    return "filtered_noise" if single and not banded else "multisine"


def _other_methods(spec: Spec) -> tuple[str, ...]:
    """Other types that may serve as well; empty if the spec states how the signal is made."""
    signal = spec.signal
    if signal.phases is not None or signal.lines is not None or signal.bits is not None:
        return ()
    levels: tuple[str, ...] = ("binary",) if spec.plant.sampled and not signal.ramp else ()
    if levels and _ramps_needed(spec):
        levels = ("slewed",)
    others: list[str] = list(dict.fromkeys((_usual_method(spec), "multisine", *levels)))
    return tuple(method for method in others if method != _method(spec))


def _ramps_needed(spec: Spec) -> bool:
    """Whether the limits on moves prevent an input from switching between its levels at once."""
    moves, (peak, _) = stated_moves(spec), stated_peaks(spec)
    return moves is not None and not spec.closed_loop and peak is not None and bool(np.isfinite(moves).any())


def per_channel(value: float | tuple[float, ...], channels: int) -> Array:
    """Return a value (channels,) for each channel; a single number holds for all."""
    return np.broadcast_to(np.asarray(value, dtype=float), channels)


_STEPS_ROUNDING = 1e-12


def check_signal(spec: Spec) -> None:
    """Refuse settings that no record can have.

    Raises:
        SpecError: `conflicting-keys` when the samples are no whole number of periods of held values, or
            the level exceeds the limit on the amplitude; `unsuitable-key` for a ramp of a signal of few
            levels, and for ramps between levels without a limit on moves;
            `coarse-converter` when a limit is below the converter's step;
            `no-sample-rate` for a WAV file of a sampling rate that is not a whole number of hertz.
    """
    settings = build_signal_settings(spec)
    samples = spec.signal_samples
    fixed = spec.goal != "shortest_experiment" or spec.signal.samples is not None
    if fixed and samples % settings.block:
        below = samples - samples % settings.block
        nearest = " or ".join(str(n) for n in (below, below + settings.block) if n)
        key = "signal.periods" if settings.periods > 1 else "signal.hold"
        raise spec.complain(
            "conflicting-keys",
            f"{samples} samples do not make "
            + (f"{settings.periods} equal periods" if settings.periods > 1 else "a whole number")
            + (f" of values held for {settings.hold} samples" if settings.hold > 1 else ""),
            hint=f"write signal.samples: {nearest}, or another number of periods",
            key=key,
        )
    least, period = least_period(spec.plant.inputs), samples // settings.block
    if fixed and settings.block > 1 and period < least:
        raise spec.complain(
            "conflicting-keys",
            f"one period has {period} {'value' if period == 1 else 'values'}, and needs at least {least}",
            hint="ask for more samples, fewer periods or a shorter hold",
            key="signal.periods" if settings.periods > 1 else "signal.hold",
        )
    if 2 * settings.ramp > samples and fixed:
        raise spec.complain(
            "out-of-range",
            f"ramp is {settings.ramp}, but the signal has {samples} samples to fade in and out",
            hint=f"write at most {samples // 2}",
            key="signal.ramp",
        )
    _check_kind(spec, settings)
    _check_harmonics(spec, settings, samples if fixed else None)
    _check_register(spec, settings)
    _check_files(spec)
    bounds = build_bounds(spec)
    for channel in range(spec.plant.inputs):
        amplitude = None if bounds.amplitude is None else float(bounds.amplitude[channel])
        rate = None if bounds.rate is None else float(bounds.rate[channel])
        _check_level(spec, channel, amplitude)
        if bounds.quantisers:
            _check_converter(spec, bounds.quantisers[channel], amplitude, rate)


def _check_kind(spec: Spec, settings: SignalSettings) -> None:
    """Refuse what the kind of signal cannot be."""
    kind = kind_of(settings.method)
    if settings.ramp and kind.of_levels:
        raise spec.complain(
            "unsuitable-key",
            f"ramp does not go with type: {settings.method}, whose values are of a few levels",
            hint="remove it, or use filtered_noise or multisine",
            key="signal.ramp",
        )
    if kind.slewed and (spec.closed_loop or spec.limits.rate is None):
        raise spec.complain(
            "unsuitable-key",
            "type: slewed is a signal of ramps between two levels, at the speed of limits.rate, which "
            + ("in a loop does not limit what is applied" if spec.closed_loop else "is not stated"),
            hint=("" if spec.closed_loop else "state limits.rate, or ")
            + "use type: binary, which switches at once",
            key="signal.type",
        )
    if not kind.several and spec.plant.inputs > 1:
        raise spec.complain(
            "not-supported",
            f"type: {settings.method} is a signal of one input, and the plant has {spec.plant.inputs}",
            hint="use type: multisine",
            key="signal.type",
        )


def _check_harmonics(spec: Spec, settings: SignalSettings, samples: int | None) -> None:
    if samples is None or not isinstance(settings.lines, tuple):
        return
    block = settings.period(samples) // blocks_of(settings.vectors, spec.plant.inputs)
    top = block // 2
    if settings.lines[-1] > top:
        raise spec.complain(
            "out-of-range",
            f"lines reaches harmonic {settings.lines[-1]}, but a period of {block} values has "
            f"harmonics 0 to {top}",
            hint="remove the higher ones, or make the period longer",
            key="signal.lines",
        )


def _check_register(spec: Spec, settings: SignalSettings) -> None:
    """Refuse a sequence too short for several inputs, which apply shifted parts of it."""
    least = least_period(spec.plant.inputs)
    if settings.method == "prbs" and settings.bits is not None and 2**settings.bits - 1 < least:
        raise spec.complain(
            "out-of-range",
            f"a register of {settings.bits} bits repeats after {2**settings.bits - 1} values, too few for "
            f"{spec.plant.inputs} inputs",
            hint="take more bits, or remove the key",
            key="signal.bits",
        )


def _check_level(spec: Spec, channel: int, most: float | None) -> None:
    if spec.signal.amplitudes is None or most is None or spec.closed_loop:
        return
    level = float(per_channel(spec.signal.amplitudes, spec.plant.inputs)[channel])
    if level > most:
        raise spec.complain(
            "conflicting-keys",
            f"amplitudes is {level:g}, above limits.amplitude {most:g}"
            + (f" of input {channel + 1}" if spec.plant.inputs > 1 else ""),
            hint="lower it, or remove it: the tool finds the level that the accuracy needs",
            key="signal.amplitudes",
        )


def _check_converter(spec: Spec, quantiser: Quantiser, amplitude: float | None, rate: float | None) -> None:
    step = quantiser.step
    if quantiser.reach() < step:
        raise spec.complain(
            "coarse-converter",
            f"the offset {quantiser.offset:g} leaves the converter no room: its values reach from "
            f"{-quantiser.span:g} to {quantiser.span - step:g}",
            hint="move the offset, or widen quantisation.range",
            key="signal.offset",
        )
    for key, bound in (("limits.amplitude", amplitude), ("limits.rate", rate)):
        if bound is not None and not spec.closed_loop and bound * (1 + _STEPS_ROUNDING) < step:
            raise spec.complain(
                "coarse-converter",
                f"{key} is {bound:g}, less than one step {step:g} of the converter",
                hint="take a converter of more bits or of a smaller range, or raise the limit",
                key=key,
            )


def _check_files(spec: Spec) -> None:
    """Refuse files of `signal.also` that cannot hold the record."""
    if "wav" not in (spec.signal.also or ()):
        return
    rate = sampling_rate(spec)
    if round(rate) < 1 or abs(rate - round(rate)) > 1e-9 * rate:
        raise spec.complain(
            "no-sample-rate",
            f"a WAV file needs a whole number of samples a second; the sample time gives {rate:.6g}",
            hint="use mat, or signal.csv, which has time stamps",
            key="signal.also",
        )
