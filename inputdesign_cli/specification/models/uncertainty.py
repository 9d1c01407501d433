"""`uncertainty:`, how well the plant of the spec is known, for a robust design."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from inputdesign_cli.specification.models import fields
from inputdesign_cli.specification.models.experiment import InformationSource, Values, check_names
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
from inputdesign_cli.specification.models.wording import show

SOURCES = ("covariance", "information", "intervals")
_OF_DRAWS = ("risk", "discard", "seed", "stable_within", "worst_case")


def _rising(ends: tuple[float, float]) -> tuple[float, float]:
    if ends[0] > ends[1]:
        message = f"{{key}} falls from {show(ends[0])} to {show(ends[1])}"
        raise fail("bad-interval", message, "write [least, largest]")
    return ends


Intervals = Annotated[
    Mapping[
        str, Annotated[tuple[fields.Number, fields.Number], AfterValidator(_rising), Wording("two numbers")]
    ],
    Field(min_length=1),
    Wording("a mapping", "write parameter names and intervals: {K: [1.5, 2.7]}"),
]
Scenarios = Annotated[
    Annotated[fields.Count, SIZES["uncertainty.scenarios"], tag("number")]
    | Annotated[fields.Several[Values], SIZES["uncertainty.scenarios"], tag("list")],
    by_tag(lambda value: "list" if isinstance(value, list | tuple) else "number"),
]


class Uncertainty(Section, not_both=(SOURCES,)):
    """How well the plant is known, and how the design takes this into account."""

    covariance: fields.FileOr[fields.CovarianceMatrix] | None = optional(
        "Covariance of the parameters: a matrix, or a model that identify wrote (.yaml)."
    )
    information: InformationSource | None = optional(
        "Its inverse: a matrix, or a file: data (.csv) of an earlier excitation, or a model (.yaml)."
    )
    intervals: Intervals | None = optional("Parameters drawn evenly: {K: [1.5, 2.7]}; others are known.")
    parameters: fields.Names | None = optional("Names that order the rows (default: of the model).")
    scenarios: Scenarios | None = optional(
        "How many plants are drawn (default: 100, or by risk), or the plants: [{b1: 3.2}, {b1: 4.0}]."
    )
    risk: fields.Fraction | None = optional(
        "Share of plants that may be left out, with confidence 0.999: as many are drawn as it takes."
    )
    discard: Annotated[fields.NonNegative, Field(lt=0.5)] = Field(
        default=0.0, description="Share of the drawn plants that the design may leave out, the dearest."
    )
    worst_case: fields.Fraction | None = optional(
        "Confidence of the region in which plants that miss the accuracy are searched and added."
    )
    seed: fields.Index = Field(default=1, description="Seed of the draws.")
    stable_within: Annotated[fields.NonNegative, Field(gt=0, le=1)] | None = optional(
        "Plants, or loops, with poles beyond this radius are not drawn (default: about 0.998)."
    )
    r_adm: Literal["own", "fixed"] = Field(
        default="own", description="The admissible error of every plant: its own, or the nominal one."
    )
    floor: Annotated[fields.NonNegative, Field(lt=1)] = Field(
        default=0.1, description="Least admissible error of a plant, as a share of that of the nominal plant."
    )
    cost: Literal["nominal", "mean", "worst"] | None = optional(
        "The powers that are paid for: nominal, mean (default in closed loop) or worst."
    )
    fresh: Annotated[fields.Index, SIZES["uncertainty.fresh"]] = Field(
        default=3000, description="Plants drawn afresh that the finished design is tried on."
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """Check that the uncertainty is stated once, with names for the rows of a matrix."""
        listed = isinstance(self.scenarios, tuple)
        if listed:
            for extra in (key for key in (*SOURCES, *_OF_DRAWS) if key in self.model_fields_set):
                message = "{key} is for plants that are drawn, and these are listed one by one"
                yield PathDiagnostic("conflicting-keys", message, f"remove {extra}", (extra,), at_key=True)
        else:
            yield from self.at_most_one("scenarios", "risk")
        if not listed and not self.stated(*SOURCES):
            hint = "add one of them, or list the plants: scenarios: [{b1: 3.2}, {b1: 4.0}]"
            keys = (*SOURCES, "scenarios")
            yield PathDiagnostic("missing-key", "{key} does not say how the plant may vary", hint, keys=keys)
        for other in self.stated("worst_case", "risk") if self.discard else ():
            message = f"{{key}} leaves plants out, which does not go with {other}"
            hint = "remove one of the two, or state scenarios: 200: fresh plants show how many are missed"
            yield PathDiagnostic("conflicting-keys", message, hint, ("discard",))
        for key, matrix in (("covariance", self.covariance), ("information", self.information)):
            if isinstance(matrix, tuple):
                yield from check_names(self.parameters, len(matrix), key)
