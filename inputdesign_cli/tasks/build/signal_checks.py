"""Whether a record of such settings can exist at all."""

from __future__ import annotations

from inputdesign_cli.signal import Quantiser, SignalSettings
from inputdesign_cli.signal.settings import LEVELLED
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.channels import has_channels
from inputdesign_cli.tasks.build.signal_settings import (
    build_channel_bounds,
    build_quantisers,
    build_signal_settings,
    per_channel,
    sampling_rate,
)

_STEPS_ROUNDING = 1e-12
SHORTEST_BLOCK = 8  # values


def check_signal(spec: Spec) -> None:
    """Whether such a record can exist at all.

    Raises:
        SpecError: `conflicting-keys` when the samples are no whole number of periods of held values, or
            the level exceeds the limit on the amplitude; `unsuitable-key` for a ramp of a signal of few
            levels; `coarse-converter` when a limit is below the converter's step;
            `no-sample-rate` for a WAV file of a sampling rate that is not a whole number of hertz.
    """
    recipe = build_signal_settings(spec)
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


def _check_harmonics(spec: Spec, recipe: SignalSettings, samples: int | None) -> None:
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


def _check_register(spec: Spec, recipe: SignalSettings) -> None:
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
