"""`signal:` and the limits on single samples -> the requirements on the record, and whether it can exist."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.questions.building.demand import check_record, longest_record
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.system import build_cost, build_model, excitation_band, record_step
from inputdesign_cli.questions.common.record import RecordRequest, least_period
from inputdesign_cli.signal.kinds import kind_of
from inputdesign_cli.signal.limits import Bounds
from inputdesign_cli.signal.multisine import blocks_of
from inputdesign_cli.signal.settings import Phases, Quantiser, SignalSettings
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.units import SECONDS

# Number of candidate records, shared by the inputs, and the fewest: with more inputs records differ less.
_CANDIDATES, _FEWEST = 20, 4
_PATIENCE = 4  # at most this many times the candidates are tried if noise fits badly by chance
# Number of candidates with optimised phases: each takes 0.05 s or more, and their quality hardly differs.
_OPTIMISED = 4
# Number of candidates whose switching times are searched: each takes seconds.
_SEARCHED = 2
# For `hold: auto`: values per slowest time constant, and the fewest values in a record.
_VALUES, _FEWEST_VALUES = 10.0, 50


def build_record_request(spec: Spec, parameters: int) -> RecordRequest:
    """Return the requirements of the spec on its record, for a model with a number of parameters.

    Raises `SpecError`: `needs-band`, `too-large`, `beyond-nyquist`.
    """
    check_record(spec, parameters)
    step, limits, signal = record_step(spec), spec.limits, spec.signal
    lo, hi = excitation_band(spec)
    stated = {
        "limits.amplitude": limits.amplitude,
        "limits.rate": limits.rate,
        "limits.moves": limits.moves,
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
        others=()
        if limits.moves is not None
        else tuple(build_signal_settings(spec, method) for method in _methods(spec)[1:]),
        limit_keys=tuple(key for key, value in stated.items() if value is not None),
        operating_points=None if signal.offset is None else operating_points(spec),
        also=(*(signal.also or ()), *(signal.export or ())),
        full_scale=None if signal.quantisation is None else float(np.max(signal.quantisation.range)),
        sampling_rate=sampling_rate(spec),
    )


def build_signal_settings(spec: Spec, method: str | None = None) -> SignalSettings:
    """Return the settings of the signal of a type; what is not stated follows from other keys."""
    signal, inputs = spec.signal, spec.plant.inputs
    method = method or _methods(spec)[0]
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
        hold=chosen_hold(spec),
        tolerance=signal.tolerance,
        seconds=signal.seconds,
        ramp=signal.ramp or 0,
        returns=bool(signal.at("return")),
        bits=signal.bits,
        level=per_channel(signal.amplitudes, inputs),
        candidates=signal.candidates or candidates,
        most_candidates=signal.candidates or most,
        seed=signal.seed or 0,
    )


def chosen_hold(spec: Spec) -> int:
    """Return the samples for which values are held: as stated, or about a tenth of the slowest time constant.

    A chosen hold divides the length of the record, and gives it at least 50 values (or is 1).
    """
    stated = spec.signal.hold
    if stated is None or isinstance(stated, int):
        return stated or 1
    # The noise may decay slowly; only the memory of the plant counts.
    white = {"noise": {"variance": 1.0}}
    radius, samples = build_model(spec.revised(white)).radius, spec.signal_samples
    slowest = -1.0 / np.log(radius) if 0.0 < radius < 1.0 else np.inf if radius >= 1.0 else 0.0
    most = int(np.clip(slowest / _VALUES, 1, max(samples // _FEWEST_VALUES, 1)))
    return max(hold for hold in range(1, most + 1) if samples % hold == 0)


def stated_peaks(spec: Spec) -> tuple[Array | None, Array | None]:
    """Return the largest |u| (r,) and |y| (p,), counted from the offset; None without a limit."""
    amplitude = spec.limits.amplitude
    if amplitude is None:
        return None, None
    return per_channel(amplitude.input, spec.plant.inputs), per_channel(amplitude.output, spec.plant.outputs)


def stated_moves(spec: Spec) -> Array | None:
    """Return the largest rms value (r,) of moves within the limit on single moves; None without a limit.

    It is infinite if the limit on |u| is tighter: moves between -a and a are 2 a at most.
    """
    rate, (peak, _) = per_channel(spec.limits.rate, spec.plant.inputs), stated_peaks(spec)
    if rate is None:
        return None
    tighter = np.ones(rate.size, dtype=bool) if peak is None else rate < 2.0 * peak
    return np.where(tighter, rate / np.sqrt(chosen_hold(spec)), np.inf)


def build_bounds(spec: Spec) -> Bounds:
    """Return the bounds on single samples; an offset between two values of a converter lowers the peak."""
    amplitude, output = stated_peaks(spec)
    if amplitude is not None:
        amplitude = amplitude - np.abs(_offsets(spec) - operating_points(spec))
    rate = per_channel(spec.limits.rate, spec.plant.inputs)
    moves, hour = spec.limits.moves, None
    if moves is not None and moves.per_hour is not None:
        hour = 3600.0 / (spec.sample_time * SECONDS[spec.time_unit])
    most = None if moves is None else moves.count or moves.per_hour
    return Bounds(amplitude, rate, output, quantisers=_quantisers(spec), moves=most, moves_in=hour)


def _offsets(spec: Spec) -> Array:
    return np.broadcast_to(np.asarray(spec.signal.offset or 0.0, dtype=float), spec.plant.inputs)


def _quantisers(spec: Spec) -> tuple[Quantiser, ...]:
    """Return the converter of each input; all have the same number of bits."""
    stated = spec.signal.quantisation
    if stated is None:
        return ()
    each = np.broadcast(stated.range, _offsets(spec))
    return tuple(Quantiser(stated.bits, float(span), float(offset)) for span, offset in each)


def operating_points(spec: Spec) -> Array:
    """Return the offset (r,) of each input, or the nearest value of its converter."""
    quantisers = _quantisers(spec)
    return np.array([one.operating_point for one in quantisers]) if quantisers else _offsets(spec)


def sampling_rate(spec: Spec) -> float:
    """Return the number of samples per second."""
    return 1.0 / (spec.sample_time * SECONDS[spec.time_unit])


def _methods(spec: Spec) -> tuple[str, ...]:
    """Return the type of signal, as stated or as other keys imply, and then others that may serve too.

    The usual type is filtered noise for one input and output in q^-1, or else multisine. There are no others
    if the spec states how the signal is made.
    """
    signal, plant, spectrum = spec.signal, spec.plant, spec.spectrum
    single = plant.kind == "polynomial" and plant.inputs == plant.outputs == 1
    banded = spectrum is not None and spectrum.type == "polynomial" and not spec.closed_loop
    noise = single and not banded and spec.accuracy.frequency_response is None
    usual = "filtered_noise" if noise else "multisine"
    implied = "prbs" if signal.bits is not None else usual
    if made := signal.stated("phases", "lines"):
        implied = "multisine"
    method = signal.type or implied
    if made or signal.bits is not None:
        return (method,)
    others = [usual, "multisine"]
    if plant.sampled and not signal.ramp:
        moves, (peak, _) = stated_moves(spec), stated_peaks(spec)
        # Limits on moves may prevent an input from switching between its levels at once.
        slow = moves is not None and peak is not None and bool(np.isfinite(moves).any())
        others.append("slewed" if slow and not spec.closed_loop else "binary")
    return tuple(dict.fromkeys([method, *others]))


def per_channel(value: float | tuple[float, ...] | None, channels: int) -> Array | None:
    """Return a value (channels,) for each channel; a single number holds for all, None for none."""
    return None if value is None else np.broadcast_to(np.asarray(value, dtype=float), channels)


_STEPS_ROUNDING = 1e-12
_LEAST_WINDOWS = 4  # least `solver.windows` for a bound over all records


def check_signal(spec: Spec) -> None:
    """Refuse settings that no record can have: of length, of the kind of signal, and of single samples.

    Raises `SpecError`: `conflicting-keys`, `unsuitable-key`, `out-of-range`, `coarse-converter`, `not-
    supported`, `no-sample-rate`.
    """
    settings = build_signal_settings(spec)
    if spec.goal != "shortest_experiment" or spec.signal.samples is not None:
        _check_length(spec, settings)
    _check_kind(spec, settings)
    _check_moves(spec, settings)
    _check_levels(spec)


def _check_length(spec: Spec, settings: SignalSettings) -> None:
    """Refuse samples, periods, holds, ramps and harmonics that do not fit each other."""
    samples, block, ramp = spec.signal_samples, settings.block, settings.ramp
    least, period = least_period(spec.plant.inputs), samples // block
    if samples % block or (block > 1 and period < least):
        message = f"the values of a period are {period}, and must be {least} or more"
        hint = "ask for more samples, fewer periods or a shorter hold"
        if samples % block:
            usable = (samples - samples % block, max(block * (period + 1), least * block))
            nearest = " or ".join(str(n) for n in usable if n >= least * block)
            message = f"{samples} samples are no multiple of {block}: periods times samples of a hold"
            hint = f"write signal.samples: {nearest}, or another number of periods or a shorter hold"
        key = "signal.periods" if settings.periods > 1 else "signal.hold"
        raise spec.complain("conflicting-keys", message, hint=hint, key=key)
    if 2 * ramp > samples:
        message = f"ramp is {ramp}, but the signal has {samples} samples to fade in and out"
        raise spec.complain("out-of-range", message, hint=f"write at most {samples // 2}", key="signal.ramp")
    if isinstance(settings.lines, tuple):
        values = settings.period(samples) // blocks_of(settings.vectors, spec.plant.inputs)
        top, last = values // 2, settings.lines[-1]
        if last > top:
            message = f"lines reaches harmonic {last}; a period of {values} values has harmonics 0 to {top}"
            raise spec.complain("out-of-range", message, hint="make the period longer", key="signal.lines")


def _check_kind(spec: Spec, settings: SignalSettings) -> None:
    """Refuse settings and files that do not go with the type of the signal."""
    method, bits, inputs = settings.method, settings.bits, spec.plant.inputs
    kind = kind_of(method)
    if settings.ramp and kind.of_levels:
        message = f"ramp does not go with type: {method}, whose values are of a few levels"
        raise spec.complain("unsuitable-key", message, hint="remove it, or use multisine", key="signal.ramp")
    if kind.slewed and (spec.closed_loop or spec.limits.rate is None):
        message = "type: slewed ramps between two levels at the speed of limits.rate, in open loop"
        hint = "state limits.rate in open loop, or use type: binary, which switches at once"
        raise spec.complain("unsuitable-key", message, hint=hint, key="signal.type")
    if not kind.several and inputs > 1:
        message = f"type: {method} is a signal of one input, and the plant has {inputs}"
        raise spec.complain("not-supported", message, hint="use type: multisine", key="signal.type")
    if method == "prbs" and bits is not None and 2**bits - 1 < least_period(inputs):
        # Several inputs apply shifted parts of the sequence.
        message = f"a register of {bits} bits repeats after {2**bits - 1} values, too few for {inputs} inputs"
        raise spec.complain("out-of-range", message, hint="take more bits", key="signal.bits")
    rate, most = sampling_rate(spec), (2**32 - 1) // (4 * inputs)  # bytes a second, in its head
    whole = 1 <= round(rate) <= most and abs(rate - round(rate)) <= 1e-9 * rate
    if "wav" in (spec.signal.also or ()) and not whole:
        message = f"a WAV file needs a whole number of samples a second up to {most}, and has {rate:.6g}"
        raise spec.complain("no-sample-rate", message, hint="use mat, or signal.csv", key="signal.also")


def _check_moves(spec: Spec, settings: SignalSettings) -> None:
    """Refuse a limit on the number of moves where no search keeps it: it needs the bound over all records."""
    most, least = build_bounds(spec).most_moves(spec.signal_samples), 2 if settings.returns else 1
    if most is None:
        return
    if most < least:
        message = f"limits.moves allows {most} moves in {spec.signal_samples} samples, and {least} are needed"
        hint = "allow more, or make the record longer"
        raise spec.complain("out-of-range", message, hint=hint, key="limits.moves")
    kind, peak = kind_of(settings.method), stated_peaks(spec)[0]
    searched = kind.few_levels and not kind.flat and settings.periods == 1 and settings.level is None
    known = peak is not None and not spec.closed_loop and spec.goal != "shortest_experiment"
    asked = spec.solver.any_spectrum and spec.solver.windows >= _LEAST_WINDOWS
    whole = spec.signal_samples == spec.experiment.samples
    if not (searched and known and asked and whole and "output" not in build_cost(spec)):
        message = "limits.moves is kept by the search for the best record, which does not go with this spec"
        hint = "use signal.type: binary of one period, limits.amplitude, an open loop and a stated length"
        raise spec.complain("not-supported", message, hint=hint, key="limits.moves")


def _check_levels(spec: Spec) -> None:
    """Refuse a level, limits and a converter that do not fit; in a loop, limits are not of the signal."""
    bounds, inputs = build_bounds(spec), spec.plant.inputs
    unlimited = np.full(inputs, np.inf)
    most, rate = (
        unlimited if bound is None or spec.closed_loop else bound for bound in (bounds.amplitude, bounds.rate)
    )
    for channel, level in enumerate(np.broadcast_to(spec.signal.amplitudes or 0.0, inputs)):
        if level > max(most[channel], 0.0):
            of = f" of input {channel + 1}" if inputs > 1 else ""
            hint = "lower it, or remove it: the tool finds the level that the accuracy needs"
            message = f"amplitudes is {level:g}, above limits.amplitude {most[channel]:g}{of}"
            raise spec.complain("conflicting-keys", message, hint=hint, key="signal.amplitudes")
    for channel, quantiser in enumerate(bounds.quantisers):
        step, span = quantiser.step, quantiser.span
        if quantiser.reach() < step:
            message = f"the offset {quantiser.offset:g} leaves no room in [{-span:g}, {span - step:g}]"
            hint = "move the offset, or widen quantisation.range"
            raise spec.complain("coarse-converter", message, hint=hint, key="signal.offset")
        for key, bound in (("limits.amplitude", most[channel]), ("limits.rate", rate[channel])):
            if bound * (1 + _STEPS_ROUNDING) < step:
                message = f"{key} is {bound:g}, less than one step {step:g} of the converter"
                hint = "take a converter of more bits or of a smaller range, or raise the limit"
                raise spec.complain("coarse-converter", message, hint=hint, key=key)
