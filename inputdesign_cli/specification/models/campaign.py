"""`campaign:`, an experiment in parts: after each of them the rest is planned anew, with all data so far."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from inputdesign_cli.specification.models.fields import Count, Positive, Several
from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.section import Section, Shorthand
from inputdesign_cli.specification.models.sizes import SIZES

Samples = Annotated[Count, SIZES["signal.samples"]]


class Pilot(Section):
    """The first part, while little is known of the plant."""

    samples: Samples = Field(description="Its length.")
    power: Positive | None = Field(
        default=None,
        description="Power of white noise in place of the first plan, for a plant of which next to nothing "
        "is known.",
    )


class Campaign(Section):
    """An experiment in parts, planned anew after each of them until the data say stop."""

    block: Samples | None = Field(
        default=None, description="Samples of each part (default: a tenth of the experiment)."
    )
    stages: Annotated[Several[Samples], SIZES["campaign.stages"]] | None = Field(
        default=None, description="In place of block: the samples of the parts, one by one."
    )
    pilot: (
        Annotated[Pilot, Shorthand("samples", {"type": "integer", "minimum": 1, "maximum": 1_000_000})] | None
    ) = Field(
        default=None,
        description="The first part: its samples, or {samples, power} for white noise (default: a block, at "
        "most a tenth of the experiment).",
    )
    max_samples: Samples | None = Field(
        default=None,
        description="Where the experiment ends at the latest (default: three times its samples).",
    )
    power_cap: Positive | None = Field(
        default=None,
        description="Largest cost of a sample, relative to the first plan; a plan beyond it is made longer, "
        "a part weaker (default: 10).",
    )
    last: Literal["robust", "nominal"] = Field(
        default="robust",
        description="robust: a plan that ends with its first part is made for all plants that the data leave "
        "open (default); nominal: for the estimate alone.",
    )
    stop: Literal["data", "never"] = Field(
        default="data",
        description="data: as soon as the data meet the accuracy (default); never: at experiment.samples.",
    )

    def check(self) -> Iterator[PathDiagnostic]:
        """The parts are stated once."""
        yield from self.at_most_one("stages", "block")
        yield from self.at_most_one("stages", "pilot")
