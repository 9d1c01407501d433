"""A model that was found in a log -> a complete spec, commented, and what `identify` makes of it."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from inputdesign_cli.errors import DataError, bad_spec
from inputdesign_cli.explore import Found, output_error_form
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.outcome.model_words import blocks_of
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.assessment.build import build_identification
from inputdesign_cli.questions.assessment.identify import Identification
from inputdesign_cli.questions.building.system import build_model
from inputdesign_cli.records import Record
from inputdesign_cli.specification import Spec, parse_spec

_MOST_SAMPLES = 100_000
_DIGITS = 6
# Before a title, in the quotes of a string.
_DOUBTED = '"On a model that deserves no trust: '


def spec_text(log: Record, found: Found, sources: Sequence[Path]) -> str:
    """Return a spec that `idesign solve` accepts: the model, and the most informative input of that power."""
    power = np.mean((log.u - log.u.mean(axis=0)) ** 2, axis=0)
    low, high = log.u.min(axis=0), log.u.max(axis=0)
    half = 0.5 * (high - low)
    power, half = (np.where(x > 0.0, x, x.max()) for x in (power, half))
    # Six digits of the distance that the input moves: a level far from zero takes more.
    places = [_DIGITS - 1 - int(np.floor(np.log10(x))) for x in half]
    levels, widths = (
        [round(float(x), n) for x, n in zip(values, places, strict=True)]
        for values in (0.5 * (low + high), half)
    )
    blocks = blocks_of(found.model)
    blocks["noise"], drawn = _inside(blocks["noise"], len(log.y))
    structures = ", ".join(
        f"{signal_name('y', i, found.model.outputs)}: {c.orders.family}" for i, c in enumerate(found.taken)
    )
    kind = (
        f"plants in s by their parameters (times in {log.time_unit}), their inputs held between samples"
        if any(c.orders.physical for c in found.taken)
        else "A y = (B/F) u + (C/D) e, polynomials in q^-1"
    )
    names = ", ".join(f"{x} is {' '.join(column.split())}" for x, column in log.names.items() if x != "time")
    limit, amplitude = _numbers([float(f"{x:.6g}") for x in power]), _numbers(widths)
    ranges = " and ".join(f"{a:.6g} to {b:.6g}" for a, b in zip(low, high, strict=True))
    # Power at frequency zero determines the gain of an integrator without end.
    family = "{type: multisine, lines: 100}" if found.integrates else "{type: fir, order: 20}"
    signal = "multisine" if found.integrates else "filtered_noise"
    samples = min(len(log.y), _MOST_SAMPLES)
    source = " ".join(" and ".join(path.name for path in sources).split())
    text = f"""\
# Written by `idesign explore` from {source}.
# `idesign solve FILE` designs what it asks; every entry can be changed here or by --set key=value.
title: {json.dumps(f"The next experiment after {source}")}

sample_time: {log.step!r}          # in time_unit; frequencies are in rad per time_unit
time_unit: {log.time_unit}

# Known from the record: {kind} ({structures}).
# {names}
"""
    for key, block in blocks.items():
        if key == "noise" and drawn:
            text += (
                f"# Roots of {' and '.join(drawn)} on the circle, drawn into it by one in {len(log.y)}:\n"
                "# so many samples tell no more, and noise that never fades would count for any experiment.\n"
            )
        text += "\n".join([f"{key}:", *(f"  {name}: {json.dumps(value)}" for name, value in block.items())])
        text += "\n"
    text += f"""
experiment:
  samples: {samples}              # as long as the record; how long may the next one be?

# What the next experiment is for. D: the most informative one within the limits. To ask for an accuracy at
# the least cost instead, replace these lines by
#   accuracy: {{model_error: {{relative: 0.05, confidence: 0.95}}}}  # add band: [..] if you like
accuracy: {{criterion: D}}
limits:
  input_power: {limit}            # mean square about the mean, as in the record
  # amplitude: {amplitude}         # with it every sample stays within the range of the log, {ranges}

# The family of spectra to search, and the signal to apply: about the middle of the range of the log.
spectrum: {family}
signal: {{type: {signal}, seed: 1, offset: {json.dumps(levels[0] if len(levels) == 1 else levels)}}}
"""
    return text


def warned(text: str, reasons: Sequence[str], *, loop: bool) -> str:
    """A spec that says at its head, and in its title, why its model deserves no trust, and of a loop.

    Args:
        loop: whether inputs seem to answer the outputs.
    """
    told = [f"No model of this record deserves trust, and no design on this one: {one}" for one in reasons]
    if loop:
        told.append(
            "The inputs seem to answer the outputs, as in a loop. Then identify and assess need its "
            "controller, experiment: {controller: {numerator: [..], denominator: [..]}}; solve then designs "
            "in the loop."
        )
    lines = [textwrap.fill(one, 110, initial_indent="# ", subsequent_indent="#   ") for one in told]
    head, title, rest = text.partition("\ntitle: ")
    doubted = f"{title}{_DOUBTED}{rest[1:]}" if reasons else title + rest
    return "\n".join([head, *lines]) + doubted


def _inside(noise: Mapping[str, Any], samples: int) -> tuple[dict[str, Any], list[str]]:
    """Return the block with roots of C and D not too near to the unit circle, and the letters that changed.

    Their modulus is at most 1 - 1 / samples: a record of this length cannot resolve nearer roots. One factor
    scales all roots of a polynomial.
    """
    drawn = dict(noise)
    for letter in {"C", "D"} & noise.keys():
        several = isinstance(noise[letter][0], list)
        rows = noise[letter] if several else [noise[letter]]
        radii = [float(np.abs(np.roots(row)).max(initial=1e-9)) for row in rows]
        shares = [min((1.0 - 1.0 / samples) / radius, 1.0) for radius in radii]
        own = [
            [float(c * share**k) for k, c in enumerate(row)] for row, share in zip(rows, shares, strict=True)
        ]
        drawn[letter] = own if several else own[0]
    return drawn, sorted(letter for letter in noise if drawn[letter] != noise[letter])


def _numbers(values: Sequence[float]) -> str:
    """One number as it is, or a list."""
    listed = ", ".join(f"{x:.10g}" for x in values)
    return listed if len(values) == 1 else f"[{listed}]"


def build_explored(text: str) -> Identification:
    """Return what `identify` runs on, of a spec that was written for a log."""
    return build_identification(parse_spec(text, "spec.yaml"))


@contextmanager
def naming_model(model: Spec) -> Iterator[None]:
    """Let errors of time name the file of the model, which is what counts otherwise than the data."""
    try:
        yield
    except DataError as error:
        place = model.locate("")
        name, named = Path(place.file).name if place else "the model", []
        for one in error.diagnostics:
            step = one.details.get("data_sample_time")
            if step is not None:
                hint = f"if {name} is of data sampled like these, write sample_time: {step:.6g} in it; a "
                hint += "model of another sample time cannot be judged by them"
                one = replace(one, message=f"{one.message} in {name}", hint=hint)
            elif one.code == "data-wrong-unit":
                one = replace(one, message=f"{one.message}: {name} does")
            named.append(one)
        raise DataError(named) from error


def model_to_judge(spec: Spec) -> Model:
    """The model of a spec that is to be judged by data.

    Raises:
        SpecError: it is neither of polynomials nor of transfer functions that are sampled.
    """
    model = build_model(spec)
    try:
        output_error_form(model)
    except TypeError:
        raise bad_spec(
            "not-supported",
            "models in state space, and in s without sample: zoh, cannot be judged by data in this version",
            hint="idesign identify DATA --spec MODEL estimates them anew and shows the fit",
            key="plant",
        ) from None
    return model
