"""The pictures of a campaign are older than its last decision."""

from __future__ import annotations

from collections.abc import Sequence

from inputdesign_cli.finding import Finding, FindingKind, Severity

EARLIER_PICTURES = FindingKind(
    "earlier-pictures",
    Severity.NOTE,
    "pictures show the campaign before its last decision",
    "`idesign next --no-figures` keeps the pictures that are there. They do not show the last record.",
    "Give `idesign next DIR` without `--no-figures`: it draws them anew.",
)


def earlier_pictures(names: Sequence[str]) -> list[Finding]:
    """Return a finding that names pictures of an earlier decision."""
    message = (
        f"{', '.join(names)} show the campaign before this decision, which was made with --no-figures: "
        "`idesign next` without it draws them anew"
    )
    return [EARLIER_PICTURES.found(message, files=list(names))] if names else []
