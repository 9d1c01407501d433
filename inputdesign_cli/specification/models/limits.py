"""`limits:`, what the experiment may not exceed."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Discriminator, Field, model_validator

from inputdesign_cli.specification.models.fields import (
    Band,
    Cap,
    Count,
    FileName,
    NonNegative,
    PositivePerChannel,
    WeightPerChannel,
)
from inputdesign_cli.specification.models.findings import Finding, Findings
from inputdesign_cli.specification.models.section import TAG, Section, Shorthand, tag
from inputdesign_cli.specification.models.transfer import ContinuousTransfer, DiscreteTransfer

_NUMBERS = ({"type": "number", "exclusiveMinimum": 0}, {"type": "array"})


class PowerLimit(Section):
    """Bounds on a power: of the sum over the channels, or with a list of each channel."""

    max: PositivePerChannel | None = Field(
        default=None, description="Largest power; a number or one per channel."
    )
    min: WeightPerChannel | None = Field(
        default=None, description="Smallest power; a number or one per channel."
    )

    @model_validator(mode="after")
    def _some(self) -> PowerLimit:
        findings = Findings()
        check_range(findings, self)
        if isinstance(self.max, float | tuple) and isinstance(self.min, float | tuple):
            pairs = list(zip(_listed(self.min), _listed(self.max), strict=False))
            if isinstance(self.max, tuple) == isinstance(self.min, tuple) and any(a > b for a, b in pairs):
                findings.add("conflicting-keys", "{key} is larger than max", "exchange the two", "min")
        findings.stop()
        return self


class TableFile(Section, family="curve", phrase="table"):
    """A curve over frequency from a file."""

    table: FileName = Field(description="CSV file with frequency and value.")


def _curve(value: Any) -> str:
    if isinstance(value, dict):
        return "table" if "table" in value else "continuous" if "continuous" in value else "ratio"
    return "number"


def _pick(value: Any) -> str:
    if isinstance(value, TableFile | DiscreteTransfer | ContinuousTransfer):
        kinds = {TableFile: "table", DiscreteTransfer: "ratio", ContinuousTransfer: "continuous"}
        return TAG + kinds[type(value)]
    return TAG + _curve(value)


Curve = Annotated[
    Annotated[NonNegative, tag("number")]
    | Annotated[TableFile, tag("table")]
    | Annotated[DiscreteTransfer, tag("ratio")]
    | Annotated[ContinuousTransfer, tag("continuous")],
    Discriminator(_pick),
]
"""A level, a tabulated curve, or |numerator/denominator|^2."""


class SpectrumLimit(Section):
    """Bounds on the spectrum of the excitation at every frequency."""

    max: Curve | None = Field(
        default=None, description="Largest density: a number, {table: file}, or a filter W for |W|^2."
    )
    min: Curve | None = Field(default=None, description="Smallest density, in the same forms.")

    @model_validator(mode="after")
    def _some(self) -> SpectrumLimit:
        findings = Findings()
        check_range(findings, self)
        if self.max == 0.0:
            findings.add(
                "out-of-range",
                "{key} must be greater than 0, not 0",
                "to have no limit, remove the key",
                "max",
            )
        if isinstance(self.max, float) and isinstance(self.min, float) and 0 < self.max < self.min:
            findings.add("conflicting-keys", "{key} is larger than max", "exchange the two", "min")
        findings.stop()
        return self


Power = Annotated[PowerLimit, Shorthand("max", *_NUMBERS)]


class AmplitudeLimit(Section):
    """Bounds on single samples of what the excitation causes, noise and operating point not counted."""

    input: PositivePerChannel | None = Field(
        default=None, description="Largest |u|; a number or one per input."
    )
    output: PositivePerChannel | None = Field(
        default=None, description="Largest |y| of the simulated output; a number or one per output."
    )

    @model_validator(mode="after")
    def _some(self) -> AmplitudeLimit:
        findings = Findings()
        if self.input is None and self.output is None:
            hint = "write a number, or {input: 1, output: 2}"
            finding = Finding("missing-key", "{key} needs input or output", hint, keys=("input", "output"))
            findings.append(finding)
        findings.stop()
        return self


class Limits(Section):
    """What the experiment may not exceed; all are optional."""

    input_power: Power | None = Field(
        default=None, description="Power of u that r causes: number, list, {min, max}."
    )
    output_power: Power | None = Field(
        default=None, description="Power of y that r causes: number, list, {min, max}."
    )
    excitation_power: Power | None = Field(default=None, description="Power of r: number, list, {min, max}.")
    samples: Count | None = Field(default=None, description="Largest number of samples.")
    amplitude: Annotated[AmplitudeLimit, Shorthand("input", *_NUMBERS)] | None = Field(
        default=None, description="Largest |u|: a number or one per input; or {input, output}."
    )
    rate: PositivePerChannel | None = Field(
        default=None,
        description="Largest change of u from one sample to the next; a number or one per input.",
    )
    energy: Cap | None = Field(default=None, description="Power summed over the samples (trace R).")
    band: Band | None = Field(default=None, description="The excitation vanishes outside these frequencies.")
    spectrum: Annotated[SpectrumLimit, Shorthand("max", {"type": "number", "exclusiveMinimum": 0})] | None = (
        Field(default=None, description="Bounds on the density at every frequency: a number, or {max, min}.")
    )

    @property
    def bounds_power(self) -> bool:
        """Whether some limit bounds the power of the excitation, so that the best experiment exists."""
        powers = (self.input_power, self.output_power, self.excitation_power, self.spectrum)
        return self.energy is not None or any(p is not None and p.max is not None for p in powers)


def check_range(findings: Findings, limit: PowerLimit | SpectrumLimit) -> None:
    """At least one of max and min is given."""
    if limit.max is None and limit.min is None:
        hint = "write a number, or {max: 1}"
        findings.append(Finding("missing-key", "{key} needs max or min", hint, keys=("max", "min")))


def _listed(value: float | tuple[float, ...]) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)
