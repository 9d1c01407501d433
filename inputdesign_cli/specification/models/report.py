"""`report:`, what the figures show."""

from __future__ import annotations

from typing import Annotated

from pydantic import BeforeValidator, Field

from inputdesign_cli.specification.models.annotations import Wording
from inputdesign_cli.specification.models.fields import Name, Several
from inputdesign_cli.specification.models.path_diagnostic import fail
from inputdesign_cli.specification.models.section import Section


def _pair(value: object) -> object:
    if isinstance(value, list | tuple) and (len(value) != 2 or value[0] == value[1]):
        raise fail(
            "wrong-shape",
            "{key} must hold two different parameters, which span the plane of the ellipse",
            'write a pair, such as ["b1", "f1"] or ["b1[1,1]", "a1[1]"] (names with brackets in quotes)',
        )
    return value


Pair = Annotated[tuple[Name, Name], BeforeValidator(_pair), Wording("a list of two parameter names")]


class Report(Section):
    """What the figures show."""

    ellipses: Several[Pair] | None = Field(
        default=None,
        description="Pairs of parameters whose confidence ellipses are drawn (default with several channels: "
        "the most correlated ones; with one: none).",
    )
