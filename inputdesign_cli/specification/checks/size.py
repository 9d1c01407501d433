"""Do lists have one entry per channel, and do frequencies lie where there are frequencies."""

from __future__ import annotations

import math
from collections.abc import Iterator

from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.values import depth
from inputdesign_cli.specification.wording import show
from inputdesign_cli.specification.yaml.places import Path, parse_key

ROUNDING = 1e-4
"""3.1416 is meant as pi."""


def channels(spec: Spec) -> Iterator[PathDiagnostic]:
    """A list per channel is as long as there are inputs or outputs."""
    if spec.plant.kind == "regression":
        return
    for key, value, noun in _per_channel(spec):
        size = spec.plant.inputs if noun == "input" else spec.plant.outputs
        if isinstance(value, tuple) and len(value) != size:
            yield PathDiagnostic(
                "wrong-shape",
                f"{{key}} has {len(value)} {'entry' if len(value) == 1 else 'entries'}; "
                f"the plant's number of {noun}s is {size}",
                f"write one entry per {noun}" + ("" if depth(value) > 1 else ", or a number"),
                parse_key(key),
            )


def _per_channel(spec: Spec) -> Iterator[tuple[str, object, str]]:
    """Every key that takes a list, its value, and what the list has one entry for."""
    cost, limits, signal = spec.cost, spec.limits, spec.signal
    yield "cost.input_power", cost.input_power, "input"
    yield "cost.output_power", cost.output_power, "output"
    yield "cost.excitation_power", cost.excitation_power, "input"
    yield "limits.rate", limits.rate, "input"
    yield "signal.amplitudes", signal.amplitudes, "input"
    yield "signal.offset", signal.offset, "input"
    if signal.quantisation is not None:
        yield "signal.quantisation.range", signal.quantisation.range, "input"
    if limits.amplitude is not None:
        yield "limits.amplitude.input", limits.amplitude.input, "input"
        yield "limits.amplitude.output", limits.amplitude.output, "output"
    for name, power, noun in (
        ("input_power", limits.input_power, "input"),
        ("output_power", limits.output_power, "output"),
        ("excitation_power", limits.excitation_power, "input"),
    ):
        if power is not None:
            yield f"limits.{name}.max", power.max, noun
            yield f"limits.{name}.min", power.min, noun
    if spec.given is not None and spec.given.type == "white":
        yield "spectrum.given.power", spec.given.power, "input"
    if spec.given is not None and spec.given.type == "multisine":
        yield "spectrum.given.amplitudes", spec.given.rows, "input"
    error = spec.accuracy.closed_loop_error
    if error is not None:
        yield "accuracy.closed_loop_error.reference.variance", error.reference.variance, "output"


def bands(spec: Spec) -> Iterator[PathDiagnostic]:
    """Bands end at pi/sample_time."""
    accuracy = spec.accuracy
    found: list[tuple[tuple[float, float] | None, Path]] = [(spec.limits.band, ("limits", "band"))]
    if accuracy.model_error is not None:
        found.append((accuracy.model_error.band, ("accuracy", "model_error", "band")))
    if accuracy.weighted_variance is not None:
        found.append((accuracy.weighted_variance.band, ("accuracy", "weighted_variance", "band")))
    if spec.spectrum is not None and spec.spectrum.type == "polynomial":
        found.append((spec.spectrum.band, ("spectrum", "band")))
    for band, path in found:
        if band is not None and band[1] > spec.nyquist * (1 + ROUNDING):
            yield _beyond(spec, band[1], path)


def frequencies(spec: Spec) -> Iterator[PathDiagnostic]:
    """Given frequencies lie below pi/sample_time and within limits.band."""
    listed: tuple[float, ...] | None = None
    path: Path = ("spectrum", "frequencies")
    if spec.spectrum is not None and spec.spectrum.type == "multisine":
        listed = spec.spectrum.frequencies
    elif spec.given is not None and spec.given.type == "multisine":
        listed, path = spec.given.frequencies, ("spectrum", "given", "frequencies")
    if not listed:
        return
    if listed[-1] > spec.nyquist * (1 + ROUNDING):
        at = next(i for i, w in enumerate(listed) if w > spec.nyquist * (1 + ROUNDING))
        yield _beyond(spec, listed[at], (*path, at))
    low, high = spec.limits.band or (0.0, math.inf)
    for i, w in enumerate(listed):
        if not low * (1 - ROUNDING) <= w <= high * (1 + ROUNDING):
            yield PathDiagnostic(
                "bad-band",
                f"{{key}} is {show(w)}, outside limits.band [{show(low)}, {show(high)}]",
                "remove the frequency or widen the band",
                (*path, i),
            )
            return


def _beyond(spec: Spec, frequency: float, path: Path) -> PathDiagnostic:
    return PathDiagnostic(
        "beyond-nyquist",
        f"{{key}} reaches {show(frequency)}, beyond the Nyquist frequency "
        f"{show(spec.nyquist)} rad/{spec.time_unit}",
        f"frequencies are in rad/{spec.time_unit} and end at pi/sample_time",
        path,
    )
