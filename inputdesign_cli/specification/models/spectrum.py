"""`spectrum:`, the family the input spectrum is designed in, or an excitation that is given."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Discriminator, Field, PlainValidator, WithJsonSchema, model_validator

from inputdesign_cli.specification.models.experiment import exactly_one
from inputdesign_cli.specification.models.fields import (
    Band,
    Count,
    FileName,
    Frequencies,
    Index,
    PositivePerChannel,
)
from inputdesign_cli.specification.models.findings import Findings, fail
from inputdesign_cli.specification.models.section import Section, needs_mapping, picker, tag
from inputdesign_cli.specification.models.values import PolynomialList, depth, number, several
from inputdesign_cli.specification.near_words import unknown_word


class WhiteSpectrum(Section, family="spectrum", phrase="type: white"):
    """A flat spectrum; only its level is designed."""

    type: Literal["white"] = Field(description="A flat spectrum.")


class FirSpectrum(Section, family="spectrum", phrase="type: fir"):
    """The spectrum of filtered white noise: autocovariances c_0..c_m."""

    type: Literal["fir"] = Field(description="A trigonometric polynomial.")
    order: Index = Field(default=20, description="m: the last designed autocovariance (default 20).")


class MultisineSpectrum(Section, family="spectrum", phrase="type: multisine"):
    """Lines, either evenly spaced or at given frequencies."""

    type: Literal["multisine"] = Field(description="Sinusoids.")
    lines: Count | None = Field(default=None, description="Number of evenly spaced candidate frequencies.")
    frequencies: Frequencies | None = Field(
        default=None, description="The candidate frequencies, increasing."
    )

    @model_validator(mode="after")
    def _one(self) -> MultisineSpectrum:
        findings = Findings()
        exactly_one(findings, self, "lines", "frequencies")
        findings.stop()
        return self


class FreeSpectrum(Section, family="spectrum", phrase="type: free"):
    """No parametrisation: the best of all spectra."""

    type: Literal["free"] = Field(description="Every spectrum is allowed.")


class PolynomialSpectrum(Section, family="spectrum", phrase="type: polynomial"):
    """A spectrum whose factor is a polynomial in frequency over a band."""

    type: Literal["polynomial"] = Field(description="A polynomial in frequency.")
    basis: Literal["legendre", "chebyshev", "monomial"] = Field(
        default="chebyshev", description="Basis of the polynomial (default chebyshev)."
    )
    order: Index = Field(description="Degree of the polynomial factor.")
    band: Band = Field(description="The band [low, high] outside of which the spectrum vanishes.")
    coefficients: Literal["real", "complex"] = Field(
        default="real", description="Kind of coefficients (default real)."
    )
    factor_columns: Count | None = Field(
        default=None, description="Columns of the spectral factor: the rank of the spectrum (default: full)."
    )


class PointwiseSpectrum(Section, family="spectrum", phrase="type: pointwise"):
    """A spectrum designed frequency by frequency."""

    type: Literal["pointwise"] = Field(description="Frequency by frequency.")
    grid: Count = Field(default=512, description="Number of frequencies (default 512).")


class MomentsSpectrum(Section, family="spectrum", phrase="type: moments"):
    """The second moments of the regressors of a regression."""

    type: Literal["moments"] = Field(description="The matrix of second moments of the regressors.")
    structure: Literal["free", "toeplitz"] = Field(
        default="free", description="free: independent regressors; toeplitz: delayed copies of one input."
    )


class GivenWhite(Section, family="given", phrase="type: white"):
    """White noise of a given power."""

    type: Literal["white"] = Field(description="White noise.")
    power: PositivePerChannel = Field(description="Its power; a number or one per channel.")


def _amplitudes(value: Any) -> Any:
    if depth(value) == 2:
        return several(value, lambda row: several(row, number, "amplitudes"), "lists of amplitudes")
    return several(value, number, "amplitudes, one per frequency")


Amplitudes = Annotated[
    tuple[float, ...] | PolynomialList,
    PlainValidator(_amplitudes),
    WithJsonSchema({"type": "array", "minItems": 1}),
]


class GivenMultisine(Section, family="given", phrase="type: multisine"):
    """A sum of sinusoids."""

    type: Literal["multisine"] = Field(description="A sum of sinusoids.")
    frequencies: Frequencies = Field(description="Their frequencies, increasing.")
    amplitudes: Amplitudes = Field(
        description="An amplitude per frequency; for several inputs one list per input."
    )

    @model_validator(mode="after")
    def _sizes(self) -> GivenMultisine:
        several = depth(self.amplitudes) == 2
        rows = self.amplitudes if several else (self.amplitudes,)
        for row in rows:
            if isinstance(row, tuple) and len(row) != len(self.frequencies):
                raise fail(
                    "wrong-shape",
                    f"{{key}} holds {len(row)} amplitudes for {len(self.frequencies)} frequencies",
                    "write one list per input, with one amplitude per frequency"
                    if several
                    else "write one amplitude per frequency",
                    "amplitudes",
                )
        return self


class GivenTable(Section, family="given", phrase="type: table"):
    """A spectrum read from a file."""

    type: Literal["table"] = Field(description="A tabulated spectrum.")
    file: FileName = Field(description="CSV file with frequency and spectrum.")


class GivenSignal(Section, family="given", phrase="signal"):
    """A recorded or planned signal."""

    signal: FileName = Field(description="CSV file with the samples of the signal.")


def choose(value: Any, words: tuple[str, ...], other: str) -> Any:
    """Refuse a mapping whose `type` is not one of the words, unless it has the key `other`."""
    if not isinstance(value, dict) or other in value:
        return value
    if "type" not in value:
        raise fail(
            "missing-key", "{key} needs a type", f"write type: {words[0]}; the types are {', '.join(words)}"
        )
    kind = value["type"]
    if not isinstance(kind, str) or kind not in words:
        message, hint = unknown_word(kind, words)
        raise fail("unknown-word", message, hint, "type")
    return value


_GIVEN = ("white", "multisine", "table")

Given = Annotated[
    Annotated[GivenWhite, tag("type: white")]
    | Annotated[GivenMultisine, tag("type: multisine")]
    | Annotated[GivenTable, tag("type: table")]
    | Annotated[GivenSignal, tag("signal")],
    Discriminator(picker(lambda v: "signal" if "signal" in v else f"type: {v.get('type')}")),
    BeforeValidator(lambda v: choose(v, _GIVEN, "signal")),
    needs_mapping("{type: white, power: 1} or {signal: u.csv}"),
]
"""An excitation that is not designed."""


class GivenSpectrum(Section, family="spectrum", phrase="given"):
    """The excitation is fixed; nothing is designed."""

    given: Given = Field(description="The excitation: white, multisine, a tabulated spectrum, or a signal.")


Designed = (
    WhiteSpectrum
    | FirSpectrum
    | MultisineSpectrum
    | FreeSpectrum
    | PolynomialSpectrum
    | PointwiseSpectrum
    | MomentsSpectrum
)
_TYPES = tuple(get_args(c.model_fields["type"].annotation)[0] for c in get_args(Designed))

Spectrum = Annotated[
    Annotated[WhiteSpectrum, tag("type: white")]
    | Annotated[FirSpectrum, tag("type: fir")]
    | Annotated[MultisineSpectrum, tag("type: multisine")]
    | Annotated[FreeSpectrum, tag("type: free")]
    | Annotated[PolynomialSpectrum, tag("type: polynomial")]
    | Annotated[PointwiseSpectrum, tag("type: pointwise")]
    | Annotated[MomentsSpectrum, tag("type: moments")]
    | Annotated[GivenSpectrum, tag("given")],
    Discriminator(picker(lambda v: "given" if "given" in v else f"type: {v.get('type')}")),
    BeforeValidator(lambda v: choose(v, _TYPES, "given")),
    needs_mapping("{type: fir, order: 20}"),
]
"""A parametrisation to design in, or a given excitation."""
