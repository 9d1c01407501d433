"""Whether a record of such settings can exist at all."""

from __future__ import annotations

from inputdesign_cli.questions.building.signal_settings import (
    build_bounds,
    build_signal_settings,
    per_channel,
    sampling_rate,
)
from inputdesign_cli.questions.common.record import least_period
from inputdesign_cli.signal import Quantiser, SignalSettings, blocks_of
from inputdesign_cli.signal.settings import FROM_LEVELS
from inputdesign_cli.specification import Spec

_STEPS_ROUNDING = 1e-12


def check_signal(spec: Spec) -> None:
    """Whether such a record can exist at all.

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
    if settings.ramp and settings.method in FROM_LEVELS:
        raise spec.complain(
            "unsuitable-key",
            f"ramp does not go with type: {settings.method}, whose values are of a few levels",
            hint="remove it, or use filtered_noise or multisine",
            key="signal.ramp",
        )
    if 2 * settings.ramp > samples and fixed:
        raise spec.complain(
            "out-of-range",
            f"ramp is {settings.ramp}, but the signal has {samples} samples to fade in and out",
            hint=f"write at most {samples // 2}",
            key="signal.ramp",
        )
    if settings.method == "slewed" and (spec.closed_loop or spec.limits.rate is None):
        raise spec.complain(
            "unsuitable-key",
            "type: slewed is a signal of ramps between two levels, at the speed of limits.rate, which "
            + ("in a loop does not limit what is applied" if spec.closed_loop else "is not stated"),
            hint=("" if spec.closed_loop else "state limits.rate, or ")
            + "use type: binary, which switches at once",
            key="signal.type",
        )
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
    """Several inputs are shifted against each other by parts of one sequence."""
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
