"""`limits:`, bounds on the experiment."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from inputdesign_cli.specification.models import fields
from inputdesign_cli.specification.models.section import (
    PathDiagnostic,
    Section,
    Shorthand,
    optional,
    pick,
    tag,
)
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.models.transfer import ContinuousTransfer, DiscreteTransfer, transfer_kind
from inputdesign_cli.specification.yaml.plain import Plain

_LONGEST = SIZES["signal.samples"].most
_NUMBERS = ({"type": "number", "exclusiveMinimum": 0}, {"type": "array"})


class PowerLimit(Section, some_of=(("max", "min"),)):
    """Bounds on a power: of the sum over the channels, or with a list of each channel."""

    max: fields.PerChannel[fields.Cap] | None = optional("Largest power; a number or one per channel.")
    min: fields.PerChannel[fields.NonNegative] | None = optional("Smallest power, likewise.")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that the lower bound is below the upper one."""
        if self.max is not None and self.min is not None and np.shape(self.max) == np.shape(self.min):
            yield from _ordered(bool(np.any(np.array(self.min) > np.array(self.max))))


class TableFile(Section, family="curve", phrase="table"):
    """A curve over frequency from a file."""

    kind: ClassVar[Literal["table"]] = "table"

    table: fields.FileName = Field(description="CSV file with frequency and value.")


def _kind(value: dict[str, Plain]) -> str:
    return TableFile.phrase if "table" in value else transfer_kind(value)


_PICK = pick(_kind, plain="number")
Curve = Annotated[
    Annotated[fields.NonNegative, tag("number")] | TableFile | DiscreteTransfer | ContinuousTransfer, _PICK
]
UpperCurve = Annotated[
    Annotated[fields.Cap, tag("number")] | TableFile | DiscreteTransfer | ContinuousTransfer, _PICK
]
"""A level, a tabulated curve, or |numerator/denominator|^2."""


class SpectrumLimit(Section, some_of=(("max", "min"),)):
    """Bounds on the spectrum of the excitation at every frequency."""

    max: UpperCurve | None = optional("Largest density: a number, {table: file}, or a filter W for |W|^2.")
    min: Curve | None = optional("Smallest density, in the same forms.")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that the lower bound is below the upper one."""
        if isinstance(self.max, float) and isinstance(self.min, float):
            yield from _ordered(self.max < self.min)


Power = Annotated[PowerLimit, Shorthand("max", *_NUMBERS)]


class AmplitudeLimit(Section, some_of=(("input", "output"),)):
    """Bounds on single samples, about the operating point and without noise."""

    input: fields.PerChannel[fields.Cap] | None = optional("Largest |u|; a number or one per input.")
    output: fields.PerChannel[fields.Cap] | None = optional(
        "Largest |y| of the simulated output; a number or one per output."
    )


class MovesLimit(Section, one_of=(("count", "per_hour"),)):
    """The largest number of changes of the inputs, in all or an hour."""

    count: Annotated[fields.Count, SIZES["signal.samples"]] | None = optional("In the whole record.")
    per_hour: fields.Positive | None = optional("An hour.")


class Limits(Section):
    """Bounds on the experiment; all are optional."""

    input_power: Power | None = optional("Power of u that r causes: number, list, {min, max}.")
    output_power: Power | None = optional("Power of y that r causes: number, list, {min, max}.")
    excitation_power: Power | None = optional("Power of r: number, list, {min, max}.")
    samples: fields.Count | None = optional("Largest number of samples.")
    duration: fields.Positive | None = optional("In place of samples: the longest experiment, in time_unit.")
    amplitude: Annotated[AmplitudeLimit, Shorthand("input", *_NUMBERS)] | None = optional(
        "Largest |u|: a number or one per input; or {input, output}."
    )
    rate: fields.PerChannel[fields.Cap] | None = optional(
        "Largest change of u from one sample to the next; a number or one per input."
    )
    moves: (
        Annotated[MovesLimit, Shorthand("count", {"type": "integer", "minimum": 1, "maximum": _LONGEST})]
        | None
    ) = optional("Largest number of changes of the inputs in the record: a number, or {per_hour}.")
    energy: fields.Cap | None = optional("Power summed over the samples (trace R).")
    band: fields.Band | None = optional("The excitation vanishes outside these frequencies.")
    spectrum: Annotated[SpectrumLimit, Shorthand("max", {"type": "number", "exclusiveMinimum": 0})] | None = (
        optional("Bounds on the density at every frequency: a number, or {max, min}.")
    )

    @property
    def bounds_power(self) -> bool:
        """Return whether some limit bounds the power of the excitation: the best experiment exists."""
        powers = (self.input_power, self.output_power, self.excitation_power, self.spectrum)
        return bool(self.stated("amplitude", "energy")) or any(
            p is not None and p.max is not None for p in powers
        )


def _ordered(crossed: bool) -> Iterator[PathDiagnostic]:
    if crossed:
        yield PathDiagnostic("conflicting-keys", "{key} is larger than max", "exchange the two", ("min",))
