"""Do lists have one entry per channel, and do frequencies lie where there are frequencies."""

from __future__ import annotations

import math
from collections.abc import Iterator

from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.plant import RegressionPlant
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.spectrum import (
    GivenMultisine,
    GivenSpectrum,
    GivenWhite,
    MultisineSpectrum,
    PolynomialSpectrum,
)
from inputdesign_cli.specification.models.values import depth
from inputdesign_cli.specification.wording import show
from inputdesign_cli.specification.yaml.places import Path

ROUNDING = 1e-4
"""3.1416 is meant as pi."""


def channels(spec: Spec) -> Iterator[PathDiagnostic]:
    """A list per channel is as long as there are inputs or outputs."""
    inputs, outputs = spec.plant.inputs, spec.plant.outputs
    if isinstance(spec.plant, RegressionPlant):
        return
    cost, limits, signal = spec.cost, spec.limits, spec.signal
    sized: list[tuple[object, Path, int, str]] = [
        (cost.input_power, ("cost", "input_power"), inputs, "inputs"),
        (cost.output_power, ("cost", "output_power"), outputs, "outputs"),
        (cost.excitation_power, ("cost", "excitation_power"), inputs, "inputs"),
        (limits.rate, ("limits", "rate"), inputs, "inputs"),
        (signal.amplitudes, ("signal", "amplitudes"), inputs, "inputs"),
        (signal.offset, ("signal", "offset"), inputs, "inputs"),
    ]
    if signal.quantisation is not None:
        sized.append((signal.quantisation.range, ("signal", "quantisation", "range"), inputs, "inputs"))
    if limits.amplitude is not None:
        sized.append((limits.amplitude.input, ("limits", "amplitude", "input"), inputs, "inputs"))
        sized.append((limits.amplitude.output, ("limits", "amplitude", "output"), outputs, "outputs"))
    for key, size, noun in (
        ("input_power", inputs, "inputs"),
        ("output_power", outputs, "outputs"),
        ("excitation_power", inputs, "inputs"),
    ):
        limit = getattr(limits, key)
        if limit is not None:
            sized.append((limit.max, ("limits", key, "max"), size, noun))
            sized.append((limit.min, ("limits", key, "min"), size, noun))
    if isinstance(spec.spectrum, GivenSpectrum):
        given = spec.spectrum.given
        if isinstance(given, GivenWhite):
            sized.append((given.power, ("spectrum", "given", "power"), inputs, "inputs"))
        if isinstance(given, GivenMultisine) and (depth(given.amplitudes) == 2 or inputs > 1):
            rows = given.amplitudes if depth(given.amplitudes) == 2 else (given.amplitudes,)
            sized.append((rows, ("spectrum", "given", "amplitudes"), inputs, "inputs"))
    error = spec.accuracy.closed_loop_error
    if error is not None:
        where = ("accuracy", "closed_loop_error", "reference", "variance")
        sized.append((error.reference.variance, where, outputs, "outputs"))
    for value, path, size, noun in sized:
        if isinstance(value, tuple) and len(value) != size:
            yield PathDiagnostic(
                "wrong-shape",
                f"{{key}} has {len(value)} {'entry' if len(value) == 1 else 'entries'}; "
                f"the plant's number of {noun} is {size}",
                f"write one entry per {noun[:-1]}" + ("" if depth(value) > 1 else ", or a number"),
                path,
            )


def bands(spec: Spec) -> Iterator[PathDiagnostic]:
    """Bands end at pi/sample_time."""
    accuracy = spec.accuracy
    found: list[tuple[tuple[float, float] | None, Path]] = [(spec.limits.band, ("limits", "band"))]
    if accuracy.model_error is not None:
        found.append((accuracy.model_error.band, ("accuracy", "model_error", "band")))
    if accuracy.weighted_variance is not None:
        found.append((accuracy.weighted_variance.band, ("accuracy", "weighted_variance", "band")))
    if isinstance(spec.spectrum, PolynomialSpectrum):
        found.append((spec.spectrum.band, ("spectrum", "band")))
    for band, path in found:
        if band is not None and band[1] > spec.nyquist * (1 + ROUNDING):
            yield _beyond(spec, band[1], path)


def frequencies(spec: Spec) -> Iterator[PathDiagnostic]:
    """Given frequencies lie below pi/sample_time and within limits.band."""
    listed: tuple[float, ...] | None = None
    path: Path = ("spectrum", "frequencies")
    if isinstance(spec.spectrum, MultisineSpectrum):
        listed = spec.spectrum.frequencies
    elif isinstance(spec.spectrum, GivenSpectrum) and isinstance(spec.spectrum.given, GivenMultisine):
        listed, path = spec.spectrum.given.frequencies, ("spectrum", "given", "frequencies")
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
