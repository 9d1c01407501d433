"""Controllers that are designed on estimates make the true loop unstable."""

from __future__ import annotations

from collections.abc import Mapping

from inputdesign_cli.finding import Finding, FindingKind, Severity

UNSTABLE = FindingKind(
    "unstable-runs",
    Severity.DOUBT,
    "controllers of some simulated runs make the loop unstable",
    "Each run designs a controller on its estimate. With some of them the true loop is unstable, so that the "
    "loss is infinite. Means and deviations are taken over the other runs.",
    "Take more samples or more power, or ask for a slower loop.",
)


def unstable_runs(unstable: Mapping[str, int], runs: int) -> list[Finding]:
    """Return a finding for each input with unstable runs."""
    return [
        UNSTABLE.found(
            f"with the input {name}, {count} of {runs} simulated controllers make the true loop unstable. "
            "Their losses are infinite, and the means are taken over the other runs",
            where=name,
            unstable=count,
            runs=runs,
        )
        for name, count in unstable.items()
        if count
    ]
