"""`signal:` and the limits on single samples -> recipe and bounds of the record."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import Bounds, ChannelBounds, Quantiser, SignalSettings
from inputdesign_cli.signal.settings import Method, Phases
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.channels import has_channels

_CANDIDATES = 20
_PATIENCE = 4  # times as many at most, where noise happens to fit badly
# Optimised phases take a twentieth of a second or more each, and hardly differ in quality.
_OPTIMISED_CANDIDATES = 4
_SECONDS = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}


def build_signal_settings(spec: Spec) -> SignalSettings:
    """What is to be drawn; kinds and phases that the spec leaves open follow from the rest."""
    signal = spec.signal
    method = _method(spec)
    limited = spec.limits.amplitude is not None or spec.limits.rate is not None
    phases: Phases = signal.phases or ("optimised" if limited and method == "multisine" else "random")
    optimised = method == "multisine" and phases == "optimised"
    candidates = signal.candidates or (_OPTIMISED_CANDIDATES if optimised else _CANDIDATES)
    patient = signal.candidates is None and method == "filtered_noise"
    return SignalSettings(
        method=method,
        phases=phases,
        lines=signal.lines,
        periods=signal.periods or 1,
        hold=signal.hold or 1,
        ramp=signal.ramp or 0,
        bits=signal.bits,
        level=None if signal.amplitudes is None else _level(spec, signal.amplitudes),
        quantiser=None if spec.plant.inputs > 1 else build_quantisers(spec)[0],
        candidates=candidates,
        most_candidates=_PATIENCE * candidates if patient else candidates,
        seed=signal.seed or 0,
    )


def _level(spec: Spec, amplitudes: float | tuple[float, ...]) -> float | Array:
    return _one(amplitudes) if spec.plant.inputs == 1 else per_channel(amplitudes, spec.plant.inputs)


def build_quantisers(spec: Spec) -> list[Quantiser | None]:
    """The converter of each input; all have the same number of bits."""
    stated, inputs = spec.signal.quantisation, spec.plant.inputs
    if stated is None:
        return [None] * inputs
    spans = per_channel(stated.range, inputs)
    offsets = per_channel(spec.signal.offset or 0.0, inputs)
    return [
        Quantiser(stated.bits, float(span), float(offset))
        for span, offset in zip(spans, offsets, strict=True)
    ]


def build_bounds(spec: Spec, power_limits: list[PowerLimit]) -> Bounds:
    """What the record may not exceed."""
    amplitude = spec.limits.amplitude
    return Bounds(
        amplitude=None if amplitude is None or amplitude.input is None else _one(amplitude.input),
        rate=None if spec.limits.rate is None else _one(spec.limits.rate),
        output=None if amplitude is None or amplitude.output is None else _one(amplitude.output),
        powers=tuple((limit.kind, limit.bound) for limit in power_limits if limit.upper),
    )


def build_channel_bounds(spec: Spec, power_limits: list[PowerLimit]) -> ChannelBounds:
    """What a record of several inputs may not exceed, channel by channel."""
    amplitude, rate = spec.limits.amplitude, spec.limits.rate
    inputs, outputs = spec.plant.inputs, spec.plant.outputs
    most = (None, None) if amplitude is None else (amplitude.input, amplitude.output)
    return ChannelBounds(
        amplitude=None if most[0] is None else per_channel(most[0], inputs),
        rate=None if rate is None else per_channel(rate, inputs),
        output=None if most[1] is None else per_channel(most[1], outputs),
        powers=tuple((limit.kind, limit.channel, limit.bound) for limit in power_limits if limit.upper),
    )


def operating_points(spec: Spec) -> Array:
    """(r,): the offset of each input, or the value of its converter next to it."""
    offsets = per_channel(spec.signal.offset or 0.0, spec.plant.inputs)
    pairs = zip(build_quantisers(spec), offsets, strict=True)
    return np.array([float(offset) if q is None else q.operating_point for q, offset in pairs])


def sampling_rate(spec: Spec) -> float:
    """Samples a second."""
    return 1.0 / (spec.sample_time * _SECONDS[spec.time_unit])


def _method(spec: Spec) -> Method:
    signal = spec.signal
    if signal.type is not None:
        return signal.type
    if signal.phases is not None or signal.lines is not None:
        return "multisine"
    if signal.bits is not None:
        return "prbs"
    return "multisine" if has_channels(spec) else "filtered_noise"


def per_channel(value: float | tuple[float, ...], channels: int) -> Array:
    """(channels,): a number holds for every channel."""
    return np.broadcast_to(np.asarray(value, dtype=float), channels)


def _one(value: float | tuple[float, ...]) -> float:
    """The entry for the only channel."""
    return value[0] if isinstance(value, tuple) else value
