"""`signal:`, `solver:`, `simulation:` and `report:`: how a spectrum is realised, found, tested and shown."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal, cast

from pydantic import BeforeValidator, Field, JsonValue
from pydantic.fields import FieldInfo

from inputdesign_cli.plugins import names, own
from inputdesign_cli.specification.models import fields
from inputdesign_cli.specification.models.experiment import SimulationNoise
from inputdesign_cli.specification.models.plant import TruePlant
from inputdesign_cli.specification.models.section import (
    PathDiagnostic,
    Section,
    Wording,
    by_tag,
    fail,
    optional,
    tag,
)
from inputdesign_cli.specification.models.sizes import SIZES
from inputdesign_cli.specification.models.wording import unknown_word
from inputdesign_cli.specification.yaml.plain import Plain

Samples = Annotated[fields.Count, SIZES["signal.samples"]]
_GROUP = "idesign.signals"


def _names() -> list[str]:
    return [*own(_GROUP), *sorted(names(_GROUP))]


def _registered(value: object) -> object:
    if value not in (words := _names()):
        raise fail("unknown-word", *unknown_word(value, words))
    return value


SignalType = Annotated[
    str,
    BeforeValidator(_registered),
    Field(json_schema_extra=lambda schema: schema.update(enum=cast(list[JsonValue], _names()))),
]

Hold = Annotated[
    Annotated[Samples, tag("samples")]
    | Annotated[Literal["auto"], Wording("auto", "write auto, or a number of samples"), tag("auto")],
    by_tag(lambda value: "auto" if isinstance(value, str) else "samples"),
]

# Settings that mean something for some types of signal only.
_ONLY_FOR = {
    "phases": ("multisine",),
    "lines": ("multisine", "binary", "slewed", "ternary"),
    "ramp": ("filtered_noise", "multisine", "white", "chirp"),
    "bits": ("prbs",),
    "order": ("filtered_noise",),
}


class Quantisation(Section):
    """The digital-to-analogue converter that applies the signal."""

    bits: fields.RegisterLength = Field(description="The converter has 2^bits values.", examples=[12])
    range: fields.PerChannel[fields.Positive] = Field(
        description="They span [-range, range), offset included; a number or one per input.", examples=[10.0]
    )


class Signal(Section):
    """The time series that realises the spectrum."""

    type: SignalType | None = optional("Kind of signal (default: what suits the spectrum).")
    samples: Samples | None = optional("Length (default: experiment.samples).")
    seed: fields.Index | None = optional("Seed of the random numbers.")
    phases: Literal["random", "schroeder", "optimised"] | None = optional(
        "Phases of a multisine; optimised: for a low crest factor."
    )
    periods: Samples | None = optional("Number of equal periods.")
    hold: Hold | None = optional(
        "Samples for which each value is held; auto: about a tenth of the slowest time constant."
    )
    least_move: fields.PerChannel[fields.Positive] | None = optional(
        "Smallest useful move of an input in the parts of a campaign; a number or one per input."
    )
    tolerance: fields.Fraction = Field(
        default=0.02,
        description="A search for the best record within limits.amplitude ends this near to its bound "
        "(default 0.02).",
    )
    seconds: fields.Positive = Field(
        default=10.0, description="Seconds that the search may take (default 10)."
    )
    lines: Annotated[fields.Harmonics, SIZES["signal.lines"]] | None = optional(
        "Harmonics of a period that are used: their number, odd, or a list."
    )
    amplitudes: fields.PerChannel[fields.Positive] | None = optional(
        "Amplitude (level) to scale to, whatever it buys; a number or one per input."
    )
    offset: fields.PerChannel[fields.Number] | None = optional("Operating point; a number or one per input.")
    ramp: Annotated[fields.Index, SIZES["signal.samples"]] | None = optional(
        "Samples over which the signal fades in and out."
    )
    order: Annotated[fields.Count, SIZES["signal.order"]] | None = optional(
        "States for each input of a rational filter for filtered_noise (default: a long filter)."
    )
    start: Literal["steady", "zero"] | None = optional(
        "Past of a regression's input: its periodic continuation (default), or zero."
    )
    bits: fields.RegisterLength | None = optional("Length of a prbs register (default: no repetition).")
    quantisation: Quantisation | None = optional("The converter: {bits, range}.")
    scale: Literal["target", "design"] | None = optional(
        "The least power with which the record meets the accuracy (default), or that of the design."
    )
    also: tuple[Literal["mat", "npz", "h", "wav"], ...] | None = optional(
        "Other files of the signal beside signal.csv: mat (MATLAB), npz (numpy), h (C), wav."
    )
    export: tuple[Literal["step_table"], ...] | None = optional(
        "Tables for a control system: step_table, the time and the values of each move in steps.csv."
    )
    candidates: Annotated[fields.Count, SIZES["signal.candidates"]] | None = optional(
        "Number of random realisations to choose the best of."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that every setting belongs to the type of signal."""
        for key in self.stated(*_ONLY_FOR):
            types = _ONLY_FOR[key]
            if self.type in own(_GROUP) and self.type not in types:  # kinds of other packages may use any
                message = f"{{key}} does not go with type: {self.type}"
                hint = f"it belongs to type: {types[0]}; remove it, or change the type"
                yield PathDiagnostic("unsuitable-key", message, hint, (key,), at_key=True)


# `return` is a keyword of Python, so that no class body can declare it as an attribute.
_RETURN: Plain = fields.Flag | None
Signal.model_fields["return"] = FieldInfo.from_annotated_attribute(
    _RETURN, optional("Whether the record ends at the operating point.")
)


class Solver(Section):
    """How the optimum is found."""

    method: Literal["exchange", "lmi", "alternating"] = Field(
        default="exchange",
        description="exchange: every frequency, with a proof; lmi: the papers' program, on a grid.",
    )
    tolerance: fields.Tolerance = Field(default=1e-7, description="Relative gap to be proved (default 1e-7).")
    any_spectrum: fields.Flag = Field(default=True, description="Whether to bound what other spectra reach.")
    any_spectrum_tolerance: fields.Tolerance = Field(
        default=1e-4, description="Relative gap of the bound over every spectrum."
    )
    windows: Annotated[fields.Index, SIZES["solver.windows"]] = Field(
        default=12, description="Longest windows of the bound over all records (0: no bound)."
    )
    time_limit: fields.Positive = Field(default=600.0, description="Seconds that a design may take.")
    grid: Annotated[fields.Count, SIZES["solver.grid"]] = Field(
        default=1000, description="Number of frequencies of the lmi method (default 1000)."
    )
    positivity: Literal["kyp", "gram"] = Field(default="gram", description="Positivity in the lmi method.")


class Simulation(Section):
    """The Monte Carlo study on the true system."""

    runs: Annotated[fields.Count, SIZES["simulation.runs"]] = Field(default=100, description="How many runs.")
    seed: fields.Index = Field(default=0, description="Seed of the random numbers (default 0).")
    plant: TruePlant | None = optional("The true system (default: the nominal plant).")
    noise: SimulationNoise | None = optional("The true noise (default: the nominal noise).")
    excitation: Literal["new", "record"] = Field(
        default="new",
        description="new: each run realises the spectrum anew; record: all apply the delivered one.",
    )
    compare: Annotated[
        tuple[Literal["white", "prbs", "multisine", "binary"], ...], SIZES["simulation.compare"]
    ] = Field(default=(), description="Other inputs to compare with, at equal power.")


def _pair(value: object) -> object:
    if isinstance(value, list | tuple) and (len(value) != 2 or value[0] == value[1]):
        message = "{key} must hold two different parameters, which span the plane of the ellipse"
        hint = 'write a pair: ["b1", "f1"], or ["b1[1,1]", "a1[1]"] (names with brackets in quotes)'
        raise fail("wrong-shape", message, hint)
    return value


Pair = Annotated[
    tuple[fields.Name, fields.Name], BeforeValidator(_pair), Wording("a list of two parameter names")
]


class Figures(Section):
    """The form of the figures of a run."""

    width: Literal["column", "page"] = Field(
        default="page",
        description="column: 89 mm with smaller text, as in a paper; page: 178 mm (default page).",
    )
    format: Literal["png", "pdf", "svg"] = Field(default="png", description="Of the files (default png).")


class Report(Section):
    """The contents of the figures."""

    ellipses: Annotated[fields.Several[Pair], SIZES["report.ellipses"]] | None = optional(
        "Pairs of parameters whose ellipses are drawn (default: none, or the most correlated ones)."
    )
