"""Check that lists have one entry per channel, and that frequencies lie below the Nyquist frequency."""

from __future__ import annotations

import math
from collections.abc import Iterator

from inputdesign_cli.specification.models.fields import depth
from inputdesign_cli.specification.models.section import PathDiagnostic
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.wording import show
from inputdesign_cli.specification.yaml.places import Path, parse_key

ROUNDING = 1e-4
"""3.1416 is meant as pi."""
_LONGEST_DELAY = 1000

# Every key that takes a list with one entry per input or output.
_PER_CHANNEL = {
    "input": (
        *("cost.input_power", "cost.excitation_power", "limits.rate", "limits.amplitude.input"),
        *("limits.input_power.max", "limits.input_power.min"),
        *("limits.excitation_power.max", "limits.excitation_power.min"),
        *("signal.amplitudes", "signal.offset", "signal.quantisation.range", "spectrum.given.power"),
    ),
    "output": (
        *("cost.output_power", "limits.amplitude.output"),
        *("limits.output_power.max", "limits.output_power.min"),
        "accuracy.closed_loop_error.reference.variance",
    ),
}
_BANDS = (
    ("limits", "band"),
    ("accuracy", "model_error", "band"),
    ("accuracy", "loop", "band"),
    ("accuracy", "weighted_variance", "band"),
    ("accuracy", "frequency_response", "band"),
    ("spectrum", "band"),
)


def channels(spec: Spec) -> Iterator[PathDiagnostic]:
    """A list per channel is as long as there are inputs or outputs."""
    if spec.plant.kind == "regression":
        return
    for noun, size in (("input", spec.plant.inputs), ("output", spec.plant.outputs)):
        for key in _PER_CHANNEL[noun]:
            value = spec.at(*key.split("."))
            if isinstance(value, tuple) and len(value) != size:
                yield _wrong_size(key, value, noun, size)
    if (
        spec.given is not None
        and spec.given.type == "multisine"
        and len(spec.given.rows) != spec.plant.inputs
    ):
        yield _wrong_size("spectrum.given.amplitudes", spec.given.rows, "input", spec.plant.inputs)


def named_channels(spec: Spec) -> Iterator[PathDiagnostic]:
    """Names and units belong to channels that the plant has."""
    sizes = ("u", spec.plant.inputs), ("y", spec.plant.outputs)
    there = [f"{letter}{i + 1}" for letter, count in sizes for i in range(count)]
    for name in spec.channels or ():
        if name not in there:
            message = f"the plant has no channel {name}"
            hint = f"it has {', '.join(there)}"
            yield PathDiagnostic("unknown-name", message, hint, ("channels", name), at_key=True)


def _wrong_size(key: str, value: tuple, noun: str, size: int) -> PathDiagnostic:
    entries = "entry" if len(value) == 1 else "entries"
    message = f"{{key}} has {len(value)} {entries}; the plant's number of {noun}s is {size}"
    hint = f"write one entry per {noun}" + ("" if depth(value) > 1 else ", or a number")
    return PathDiagnostic("wrong-shape", message, hint, parse_key(key))


def delays(spec: Spec) -> Iterator[PathDiagnostic]:
    """Dead times end within the record, and are not too many samples."""
    plant = spec.plant
    path: Path
    if plant.kind == "state_space":
        longest, path = plant.state_space.delay, ("plant", "state_space", "delay")
    elif plant.kind == "continuous":
        longest = max(max(row) for row in plant.continuous.delays)
        path = ("plant", "continuous", "dead_time" if plant.continuous.kind == "process" else "delay")
    else:
        return
    whole = spec.experiment.samples * spec.sample_time
    if "samples" in spec.experiment.model_fields_set and longest >= whole:
        message = f"{{key}} is {show(longest)} {spec.time_unit}, and the experiment lasts {show(whole)}"
        yield PathDiagnostic(
            "delay-beyond-record", message, "take more samples, or look at the time_unit", path
        )
    elif plant.sampled and longest > _LONGEST_DELAY * spec.sample_time:
        message = f"{{key}} is more than {_LONGEST_DELAY} samples: {show(longest)} {spec.time_unit}"
        yield PathDiagnostic("too-large", message, "sample more slowly", path)


def bands(spec: Spec) -> Iterator[PathDiagnostic]:
    """Bands end at pi/sample_time."""
    for path in _BANDS:
        band = spec.at(*path)
        if isinstance(band, tuple) and band[1] > spec.nyquist * (1 + ROUNDING):
            yield _beyond(spec, band[1], path)


def frequencies(spec: Spec) -> Iterator[PathDiagnostic]:
    """Given frequencies lie below pi/sample_time and within limits.band."""
    path = ("spectrum", "frequencies") if spec.given is None else ("spectrum", "given", "frequencies")
    listed = spec.at(*path)
    if not isinstance(listed, tuple):
        return
    if listed[-1] > spec.nyquist * (1 + ROUNDING):
        at = next(i for i, w in enumerate(listed) if w > spec.nyquist * (1 + ROUNDING))
        yield _beyond(spec, listed[at], (*path, at))
    low, high = spec.limits.band or (0.0, math.inf)
    for i, w in enumerate(listed):
        if not low * (1 - ROUNDING) <= w <= high * (1 + ROUNDING):
            message = f"{{key}} is {show(w)}, outside limits.band [{show(low)}, {show(high)}]"
            hint = "remove the frequency or widen the band"
            yield PathDiagnostic("bad-band", message, hint, (*path, i))
            return


def _beyond(spec: Spec, frequency: float, path: Path) -> PathDiagnostic:
    unit, most = f"rad/{spec.time_unit}", show(spec.nyquist)
    message = f"{{key}} reaches {show(frequency)}, beyond the Nyquist frequency {most} {unit}"
    hint = f"frequencies are in {unit} and end at pi/sample_time"
    return PathDiagnostic("beyond-nyquist", message, hint, path)
