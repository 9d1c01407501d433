"""`report:`, what the figures show."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from pydantic import Field, PlainValidator, WithJsonSchema

from inputdesign_cli.specification.models.findings import fail
from inputdesign_cli.specification.models.section import Section
from inputdesign_cli.specification.models.values import name, several


def _pair(value: Any) -> tuple[str, ...]:
    names = several(value, partial(name, what="a parameter name"), "two parameter names")
    if len(names) != 2 or names[0] == names[1]:
        raise fail(
            "wrong-shape",
            "{key} must hold two different parameters, which span the plane of the ellipse",
            'write a pair, such as ["b1", "f1"] or ["b1[1,1]", "a1[1]"] (names with brackets in quotes)',
        )
    return names


Pairs = Annotated[
    tuple[tuple[str, str], ...],
    PlainValidator(partial(several, item=_pair, what="pairs of parameter names")),
    WithJsonSchema(
        {
            "type": "array",
            "minItems": 1,
            "items": {"type": "array", "items": {"type": "string"}, "minItems": 2, "maxItems": 2},
        }
    ),
]


class Report(Section):
    """What the figures show."""

    ellipses: Pairs | None = Field(
        default=None,
        description="Pairs of parameters whose confidence ellipses are drawn (default with several channels: "
        "the most correlated ones; with one: none).",
    )
