"""What is asked is met as far as the rows of a table describe a given spectrum."""

from __future__ import annotations

from inputdesign_cli.finding import Finding, FindingKind, Severity

MET_WITHIN_TABLE = FindingKind(
    "met-within-table",
    Severity.NOTE,
    "what is asked is met as far as the table describes the spectrum",
    "A table gives a spectrum by its rows, and straight lines between them. The error of that decides "
    "whether what is asked is met.",
    "Give the table more rows.",
)


def met_within_table(error: float) -> Finding:
    """Return the finding that the error of a table, of the worst ratio, decides."""
    return MET_WITHIN_TABLE.found(
        f"what is asked is met to within {error:.1g}: so far the table describes the spectrum, linear "
        "between its rows",
        where="spectrum.given",
        error=error,
    )
