"""`channels:` what inputs and outputs are called, and their units."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from pydantic import AfterValidator, Field, Strict

from inputdesign_cli.specification.models.annotations import Wording
from inputdesign_cli.specification.models.path_diagnostic import fail
from inputdesign_cli.specification.models.section import Section

_LONGEST = 40


def _one_line(text: str) -> str:
    """A text that may stand in the header of a table."""
    if any(c in '",;\t\r\n' for c in text) or len(text) > _LONGEST:
        message = f"{{key}} must be one line of at most {_LONGEST} characters without commas and quotes"
        raise fail("bad-name", message, "shorten it: it stands in headers of tables")
    return text


Label = Annotated[
    str, Strict(), Field(pattern=r"\S"), AfterValidator(_one_line), Wording("a text", 'quote it: "%"')
]


class Channel(Section):
    """One input or output."""

    name: Label | None = Field(default=None, description="What it is called.", examples=["valve"])
    unit: Label | None = Field(default=None, description="The unit of its samples.", examples=["%"])


Channels = Mapping[str, Channel]
