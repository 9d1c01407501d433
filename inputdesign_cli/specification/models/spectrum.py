"""`spectrum:`, the family in which the input spectrum is designed, or a given excitation."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal, cast

from pydantic import Field

from inputdesign_cli.specification.models import fields
from inputdesign_cli.specification.models.section import (
    PathDiagnostic,
    Section,
    Wording,
    by_tag,
    optional,
    pick,
    tag,
)
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.models.wording import count
from inputdesign_cli.specification.yaml.plain import Plain


def _type(value: dict[str, Plain]) -> str:
    return f"type: {value.get('type')}"


class WhiteSpectrum(Section, family="spectrum", phrase="type: white"):
    """A flat spectrum; only its level is designed."""

    type: Literal["white"] = Field(description="A flat spectrum.")


class FirSpectrum(Section, family="spectrum", phrase="type: fir"):
    """The spectrum of filtered white noise: autocovariances c_0..c_m."""

    type: Literal["fir"] = Field(description="A trigonometric polynomial.")
    order: Annotated[fields.Index, SIZES["spectrum.order of fir"]] = Field(
        default=20, description="m: the last designed autocovariance (default 20)."
    )


class MultisineSpectrum(
    Section, family="spectrum", phrase="type: multisine", one_of=(("lines", "frequencies"),)
):
    """Lines, either evenly spaced or at given frequencies."""

    type: Literal["multisine"] = Field(description="Sinusoids.")
    lines: Annotated[fields.Count, SIZES["spectrum.lines"]] | None = optional(
        "Number of evenly spaced candidate frequencies."
    )
    frequencies: Annotated[fields.Frequencies, SIZES["spectrum.frequencies"]] | None = optional(
        "The candidate frequencies, increasing."
    )


class FreeSpectrum(Section, family="spectrum", phrase="type: free"):
    """No parametrisation: the best of all spectra."""

    type: Literal["free"] = Field(description="Every spectrum is allowed.")


class PolynomialSpectrum(Section, family="spectrum", phrase="type: polynomial"):
    """A spectrum whose factor is a polynomial in frequency over a band."""

    type: Literal["polynomial"] = Field(description="A polynomial in frequency.")
    basis: Literal["legendre", "chebyshev", "monomial"] = Field(
        default="chebyshev", description="Basis of the polynomial (default chebyshev)."
    )
    order: Annotated[fields.Index, SIZES["spectrum.order of polynomial"]] = Field(
        description="Degree of the polynomial factor."
    )
    band: fields.Band = Field(description="The band [low, high] outside of which the spectrum vanishes.")
    coefficients: Literal["real", "complex"] = Field(default="real", description="Kind of coefficients.")
    factor_columns: Annotated[fields.Count, SIZES["spectrum.factor_columns"]] | None = optional(
        "Columns of the spectral factor: the rank of the spectrum (default: full)."
    )


class PointwiseSpectrum(Section, family="spectrum", phrase="type: pointwise"):
    """A spectrum designed frequency by frequency."""

    type: Literal["pointwise"] = Field(description="Frequency by frequency.")
    grid: Annotated[fields.Count, SIZES["spectrum.grid"]] = Field(
        default=512, description="Number of frequencies (default 512)."
    )


class MomentsSpectrum(Section, family="spectrum", phrase="type: moments"):
    """The second moments of the regressors of a regression."""

    type: Literal["moments"] = Field(description="The matrix of second moments of the regressors.")
    structure: Literal["free", "toeplitz"] = Field(
        default="free", description="free: independent regressors; toeplitz: delayed copies of one input."
    )


class GivenWhite(Section, family="given", phrase="type: white"):
    """White noise of a given power."""

    type: Literal["white"] = Field(description="White noise.")
    power: fields.PerChannel[fields.Positive] = Field(description="Its power; a number or one per channel.")


Amplitudes = Annotated[
    Annotated[fields.Several[fields.Number], Wording("a list of amplitudes, one per frequency"), tag("1")]
    | Annotated[fields.Several[fields.Several[fields.Number]], tag("2")],
    by_tag(lambda value: str(fields.depth(value))),
    Wording("a list of amplitudes, one per frequency, or one such list per input"),
]


class GivenMultisine(Section, family="given", phrase="type: multisine"):
    """A sum of sinusoids."""

    type: Literal["multisine"] = Field(description="A sum of sinusoids.")
    frequencies: Annotated[fields.Frequencies, SIZES["spectrum.given.frequencies"]] = Field(
        description="Their frequencies, increasing."
    )
    amplitudes: Amplitudes = Field(description="An amplitude per frequency, or one list per input.")

    @property
    def rows(self) -> tuple[tuple[float, ...], ...]:
        """Return the amplitudes of each input; with several inputs a single list holds for all of them."""
        listed = self.amplitudes if fields.depth(self.amplitudes) == 2 else (self.amplitudes,)
        return cast(tuple[tuple[float, ...], ...], listed)

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that every frequency has an amplitude."""
        wrong = next((row for row in self.rows if len(row) != len(self.frequencies)), None)
        if wrong is not None:
            held, lists = count(len(wrong), "amplitude"), fields.depth(self.amplitudes) == 2
            message = f"{{key}} holds {held}, and the number of frequencies is {len(self.frequencies)}"
            hint = f"write one {'list per input, with one ' if lists else ''}amplitude per frequency"
            yield PathDiagnostic("wrong-shape", message, hint, ("amplitudes",))


class GivenTable(Section, family="given", phrase="type: table"):
    """A spectrum read from a file."""

    type: Literal["table"] = Field(description="A tabulated spectrum.")
    file: fields.FileName = Field(description="CSV file with frequency and spectrum.")


class GivenSignal(Section, family="given", phrase="signal"):
    """A recorded or planned signal."""

    type: ClassVar[Literal["signal"]] = "signal"

    signal: fields.FileName = Field(description="CSV file with the samples of the signal.")


Given = Annotated[
    GivenWhite | GivenMultisine | GivenTable | GivenSignal,
    pick(lambda v: "signal" if "signal" in v else _type(v)),
    Wording("a mapping of keys", "write {type: white, power: 1} or {signal: u.csv}"),
]
"""An excitation that is not designed."""


class GivenSpectrum(Section, family="spectrum", phrase="given"):
    """The excitation is fixed; nothing is designed."""

    type: ClassVar[Literal["given"]] = "given"

    given: Given = Field(description="The excitation: white, multisine, a tabulated spectrum, or a signal.")


Spectrum = Annotated[
    WhiteSpectrum
    | FirSpectrum
    | MultisineSpectrum
    | FreeSpectrum
    | PolynomialSpectrum
    | PointwiseSpectrum
    | MomentsSpectrum
    | GivenSpectrum,
    pick(lambda v: "given" if "given" in v else _type(v)),
    Wording("a mapping of keys", "write {type: fir, order: 20}"),
]
"""A parametrisation to design in, or a given excitation."""
