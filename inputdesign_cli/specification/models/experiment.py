"""`noise:`, `channels:`, `experiment:`, `campaign:`, `cost:`: how data are collected, and at what price."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, Field, Strict

from inputdesign_cli.specification.models import fields
from inputdesign_cli.specification.models.loop import Controller
from inputdesign_cli.specification.models.section import (
    PathDiagnostic,
    Section,
    Shorthand,
    Wording,
    by_tag,
    fail,
    optional,
    tag,
)
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.models.wording import count

# This factor moves roots on the unit circle inside, whatever the rounding of decimals.
_INSIDE = 1.0 - 1e-7

InformationSource = fields.FileOr[fields.SemidefiniteMatrix]

Values = Annotated[
    Mapping[str, fields.Number],
    Field(min_length=1),
    Wording("a mapping", "write parameter names and values: {b1: 3.6, f1: -0.7}"),
]
PriorParameters = Annotated[
    Annotated[Values, tag("values")] | Annotated[fields.Names, tag("names")],
    by_tag(lambda value: "values" if isinstance(value, Mapping) else "names"),
]


class NoiseShape(Section):
    """The filter C(q)/D(q) that colours the noise; one polynomial, or one per output."""

    C: fields.StablePerOutput = Field(default=(1.0,), description="Monic, stable numerator in q^-1.")
    D: fields.MonicPerOutput = Field(
        default=(1.0,), description="Monic denominator in q^-1, stable, or at its limit where known."
    )
    drift: fields.PerChannel[fields.Flag] = Field(
        default=False,
        description="Whether the noise integrates as well; one for all outputs, or a list. Beside "
        "standard_deviation it adds a random walk that moves by a fifth of that in a sample.",
    )
    variance: fields.Variance | None = optional("Variance of e, or its covariance matrix.")
    standard_deviation: fields.PerChannel[fields.Deviation] | None = optional(
        "In place of variance, C and D: of the noise itself; a number or one per output."
    )
    correlation_time: fields.PerChannel[fields.CorrelationTime] | None = optional(
        "Beside standard_deviation: the time in which the correlation falls to 37 % (default: white)."
    )
    known: fields.Names | None = optional("Names of coefficients of C and D that are not estimated.")

    def covariance(self, outputs: int) -> np.ndarray:
        """Return the covariance (outputs, outputs) of e; a number is a multiple of I, no variance is I."""
        if isinstance(self.variance, tuple):
            return np.array(self.variance, dtype=float)
        return (self.variance or 1.0) * np.eye(outputs)

    @property
    def coefficients(self) -> tuple[str, ...]:
        """Return the names of the coefficients of C and D."""
        return tuple(name for letter in "CD" for names in self._named(letter) for name in names)

    def _named(self, letter: str) -> list[tuple[str, ...]]:
        """Return the names of the coefficients of each polynomial C, or D."""
        return [
            tuple(f"{letter.lower()}{k}{f'[{at[0] + 1}]' if at else ''}" for k in range(1, len(polynomial)))
            for at, polynomial in fields.with_paths(self.C if letter == "C" else self.D)
        ]

    @property
    def held(self) -> tuple[bool, ...]:
        """Return for each D whether all its coefficients are known."""
        return tuple(bool(names) and set(names) <= set(self.known or ()) for names in self._named("D"))

    @property
    def drifts(self) -> tuple[bool, ...]:
        """Return whether the noise integrates: one value for all outputs, or one per output."""
        return self.drift if isinstance(self.drift, tuple) else (self.drift,)

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that D is stable where it is estimated, and does not grow where it is known."""
        for (place, polynomial), held in zip(fields.with_paths(self.D), self.held, strict=True):
            shrunk = tuple(c * _INSIDE**k for k, c in enumerate(polynomial)) if held else polynomial
            if found := fields.check_delay_stable(shrunk):
                instead = "; write drift: true, or list all its coefficients in noise.known"
                yield replace(found, path=("D", *place), hint=found.hint + ("" if held else instead))


class Noise(NoiseShape):
    """C(q)/D(q) e(t) with white e."""

    variance: fields.Variance = Field(
        description="Variance of e, or its covariance matrix; or standard_deviation of the noise instead."
    )


class SimulationNoise(NoiseShape, one_of=(("variance", "relative_std"),)):
    """The noise of a simulation: its variance, or its size relative to the outputs."""

    relative_std: fields.Positive | None = optional(
        "Standard deviation as a share of the smallest output rms."
    )


class Prior(Section):
    """Information from before the experiment; with values of the parameters it enters estimates as well."""

    information: InformationSource = Field(
        description="Information matrix (inverse covariance), or a file: data (.csv), or a model (.yaml)."
    )
    parameters: PriorParameters | None = optional(
        "Names of the rows (default: of the model), or names and values: {b1: 3.6, f1: -0.7}."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that every row of a matrix has a name; a file names its parameters itself."""
        if isinstance(self.information, tuple):
            yield from check_names(self.names, len(self.information), "information")
        elif self.parameters is not None:
            message = f"{{key}} stands beside the file {self.information}, which has no rows to be named"
            hint = "remove it, or write the matrix under information in numbers"
            yield PathDiagnostic("conflicting-keys", message, hint, ("parameters",), at_key=True)

    @property
    def names(self) -> tuple[str, ...] | None:
        """Return the names of the parameters, row by row, if they are stated."""
        return None if self.parameters is None else tuple(self.parameters)

    @property
    def values(self) -> Mapping[str, float] | None:
        """Return the values of the parameters by name, if they are stated."""
        return self.parameters if isinstance(self.parameters, Mapping) else None

    @property
    def names_a_model(self) -> bool:
        """Return whether the information comes from a model file."""
        return isinstance(self.information, str) and self.information.endswith((".yaml", ".yml"))


class Estimated(Section):
    """The estimate of plant and noise by identify, with its covariance; it changes no design."""

    parameters: Values = Field(description="The parameters and their values.")
    covariance: fields.CovarianceMatrix = Field(description="Their covariance, in the same order.")

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that every row of the matrix has a name."""
        yield from check_names(tuple(self.parameters), len(self.covariance), "covariance")


class Experiment(Section):
    """How the data will be collected."""

    samples: fields.Count = Field(default=1, description="Number of samples; of 1, criteria are per sample.")
    duration: fields.Positive | None = optional(
        "In place of samples: its length in time_unit.", examples=[3600]
    )
    controller: Controller | None = optional(
        "C of u = r - C y, in q^-1, as pid or in s; of several channels: loops, or rows of columns."
    )
    prior: Prior | None = optional("Information already at hand.")


class Cost(Section):
    """Weights of the powers that the design pays for; a number, or one per channel."""

    input_power: fields.PerChannel[fields.NonNegative] = Field(
        default=0.0, description="Weight of the power of u that r causes."
    )
    output_power: fields.PerChannel[fields.NonNegative] = Field(
        default=0.0, description="Weight of the power of y that r causes."
    )
    excitation_power: fields.PerChannel[fields.NonNegative] = Field(
        default=0.0, description="Weight of the power of r itself."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that some power has a price."""
        if not any(np.any(w) for w in (self.input_power, self.output_power, self.excitation_power)):
            message = "all weights of {key} are zero: every experiment would be free"
            yield PathDiagnostic("no-cost", message, "write input_power: 1")


def check_names(names: tuple[str, ...] | None, size: int, matrix_key: str) -> Iterator[PathDiagnostic]:
    """Check that parameter names are distinct, and that there is one for each row of the matrix."""
    if names is None:
        return
    for repeated in sorted({n for n in names if names.count(n) > 1})[:1]:
        yield PathDiagnostic("wrong-shape", f"{{key}} names {repeated} more than once", path=("parameters",))
    if len(names) != size:
        message = f"{{key}} holds {count(len(names), 'name')}, but {matrix_key} is {size} x {size}"
        hint = "write one name per row, in the order of the rows"
        yield PathDiagnostic("wrong-shape", message, hint, ("parameters",))


def is_label(text: str) -> bool:
    """Return whether a text may stand in the header of a table."""
    return bool(text.strip()) and len(text) <= 40 and not any(c in '",;\t\r\n' for c in text)


def _one_line(text: str) -> str:
    """Return a text if it may stand in the header of a table; refuse it otherwise."""
    if not is_label(text):
        message = "{key} must be one line of at most 40 characters without commas and quotes"
        raise fail("bad-name", message, "shorten it: it stands in headers of tables")
    return text


Label = Annotated[
    str, Strict(), Field(pattern=r"\S"), AfterValidator(_one_line), Wording("a text", 'quote it: "%"')
]


class Channel(Section):
    """One input or output."""

    name: Label | None = optional("What it is called.", examples=["valve"])
    unit: Label | None = optional("The unit of its samples.", examples=["%"])


Channels = Mapping[str, Channel]


Samples = Annotated[fields.Count, SIZES["signal.samples"]]


class Pilot(Section):
    """The first part, while little is known of the plant."""

    samples: Samples = Field(description="Its length.")
    power: fields.Positive | None = optional(
        "Power of white noise in place of the first plan, for a plant of which next to nothing is known."
    )


class Campaign(Section, not_both=(("stages", "block"), ("stages", "pilot"))):
    """An experiment in parts, planned anew after each of them until the data say stop."""

    block: Samples | None = optional("Samples of each part (default: a tenth of the experiment).")
    stages: Annotated[fields.Several[Samples], SIZES["campaign.stages"]] | None = optional(
        "In place of block: the samples of the parts, one by one."
    )
    pilot: (
        Annotated[Pilot, Shorthand("samples", {"type": "integer", "minimum": 1, "maximum": 1_000_000})] | None
    ) = optional("The first part: its samples, or {samples, power} for white noise (default: a block).")
    max_samples: Samples | None = optional("The longest experiment (default: three times its samples).")
    power_cap: fields.Positive | None = optional(
        "Largest cost of a sample, relative to the first plan (default: 10)."
    )
    last: Literal["robust", "nominal"] = Field(
        default="robust",
        description="Whether the last plan is for all plants that the data allow, or for the estimate.",
    )
    stop: Literal["data", "never"] = Field(
        default="data", description="data: once they meet the accuracy; never: at experiment.samples."
    )
