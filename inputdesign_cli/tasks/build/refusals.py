"""What a kind of design does not do, said plainly rather than ignored."""

from __future__ import annotations

from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.specification.models.section import Section


def stated(section: Section) -> list[str]:
    """The keys of a section that say something."""
    return [name for name, value in section if value is not None]


def refuse(key: str, who: str, what: str, hint: str) -> SpecError:
    """`not-supported`: `who` does not do `what`."""
    return bad_spec("not-supported", f"{who} does not {what}", hint=hint, key=key)
