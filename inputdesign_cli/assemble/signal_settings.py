"""`signal:` and the limits on single samples -> recipe and bounds of the record."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.assemble.channels import has_channels
from inputdesign_cli.design.limits import PowerLimit
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.signal import Bounds, ChannelBounds, Quantiser, Recipe
from inputdesign_cli.signal.recipe import LEVELLED, Method, Phases
from inputdesign_cli.spec import Spec

_CANDIDATES = 20
_PATIENCE = 4  # times as many at most, where noise happens to fit badly
# Optimised phases take a twentieth of a second or more each, and hardly differ in quality.
_OPTIMISED_CANDIDATES = 4
_STEPS_ROUNDING = 1e-12
SHORTEST_BLOCK = 8  # values
_SECONDS = {"us": 1e-6, "ms": 1e-3, "s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}


def build_recipe(spec: Spec) -> Recipe:
    """What is to be drawn; kinds and phases that the spec leaves open follow from the rest."""
    signal = spec.signal
    method = _method(spec)
    limited = spec.limits.amplitude is not None or spec.limits.rate is not None
    phases: Phases = signal.phases or ("optimised" if limited and method == "multisine" else "random")
    optimised = method == "multisine" and phases == "optimised"
    candidates = signal.candidates or (_OPTIMISED_CANDIDATES if optimised else _CANDIDATES)
    patient = signal.candidates is None and method == "filtered_noise"
    return Recipe(
        method=method,
        phases=phases,
        lines=signal.lines,  # type: ignore[arg-type]
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


def check_signal(spec: Spec) -> None:
    """Whether such a record can exist at all.

    Raises:
        SpecError: `conflicting-keys` when the samples are no whole number of periods of held values, or
            the level exceeds the limit on the amplitude; `unsuitable-key` for a ramp of a signal of few
            levels; `coarse-converter` when a limit is below the converter's step;
            `no-sample-rate` for a WAV file of a sampling rate that is not a whole number of hertz.
    """
    recipe = build_recipe(spec)
    samples = spec.signal_samples
    fixed = spec.goal != "shortest_experiment" or spec.signal.samples is not None
    if fixed and samples % recipe.block:
        below = samples - samples % recipe.block
        nearest = " or ".join(str(n) for n in (below, below + recipe.block) if n)
        key = "signal.periods" if recipe.periods > 1 else "signal.hold"
        raise spec.complain(
            "conflicting-keys",
            f"{samples} samples do not make "
            + (f"{recipe.periods} equal periods" if recipe.periods > 1 else "a whole number")
            + (f" of values held for {recipe.hold} samples" if recipe.hold > 1 else ""),
            hint=f"write signal.samples: {nearest}, or another number of periods",
            key=key,
        )
    least, period = _least_period(spec), samples // recipe.block
    if fixed and recipe.block > 1 and period < least:
        raise spec.complain(
            "conflicting-keys",
            f"one period has {period} {'value' if period == 1 else 'values'}, and needs at least {least}",
            hint="ask for more samples, fewer periods or a shorter hold",
            key="signal.periods" if recipe.periods > 1 else "signal.hold",
        )
    if recipe.ramp and recipe.method in LEVELLED:
        raise spec.complain(
            "unsuitable-key",
            f"ramp does not go with type: {recipe.method}, whose values are of a few levels",
            hint="remove it, or use filtered_noise or multisine",
            key="signal.ramp",
        )
    if 2 * recipe.ramp > samples and fixed:
        raise spec.complain(
            "out-of-range",
            f"ramp is {recipe.ramp}, but the signal has {samples} samples to fade in and out",
            hint=f"write at most {samples // 2}",
            key="signal.ramp",
        )
    _check_harmonics(spec, recipe, samples if fixed else None)
    _check_register(spec, recipe)
    _check_files(spec)
    bounds = build_channel_bounds(spec, [])
    for channel, quantiser in enumerate(build_quantisers(spec)):
        amplitude = None if bounds.amplitude is None else float(bounds.amplitude[channel])
        rate = None if bounds.rate is None else float(bounds.rate[channel])
        _check_level(spec, channel, amplitude)
        if quantiser is not None:
            _check_converter(spec, quantiser, amplitude, rate)


def _check_harmonics(spec: Spec, recipe: Recipe, samples: int | None) -> None:
    if samples is None or not isinstance(recipe.lines, tuple):
        return
    blocks = spec.plant.inputs if spec.signal.phases != "random" else 1
    block = recipe.period(samples) // blocks
    top = block // 2
    if recipe.lines[-1] > top:
        raise spec.complain(
            "out-of-range",
            f"lines reaches harmonic {recipe.lines[-1]}, but a period of {block} values has "
            f"harmonics 0 to {top}",
            hint="remove the higher ones, or make the period longer",
            key="signal.lines",
        )


def _least_period(spec: Spec) -> int:
    """Values that a period must have: two, and eight in every block of a record of several inputs."""
    return SHORTEST_BLOCK * spec.plant.inputs if has_channels(spec) else 2


def _check_register(spec: Spec, recipe: Recipe) -> None:
    """Several inputs are shifted against each other by parts of one sequence."""
    if recipe.method == "prbs" and recipe.bits is not None and 2**recipe.bits - 1 < _least_period(spec):
        raise spec.complain(
            "out-of-range",
            f"a register of {recipe.bits} bits repeats after {2**recipe.bits - 1} values, too few for "
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
    if quantiser.room() < step:
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


def sampling_rate(spec: Spec) -> float:
    """Samples a second."""
    return 1.0 / (spec.sample_time * _SECONDS[spec.time_unit])


def _check_files(spec: Spec) -> None:
    """Whether the files that `signal.also` names can hold the record."""
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
