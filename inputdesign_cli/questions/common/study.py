"""Parts of a run that all kinds of questions share: its times, and the study of its experiment."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import replace

from inputdesign_cli.finding import Finding
from inputdesign_cli.outcome import Simulation
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.results import Results, Table


def timing(started: float, solved: float) -> dict[str, float]:
    """Return the seconds that the design and, until now, its signal took; times by `perf_counter`."""
    return {"design": solved - started, "signal": time.perf_counter() - solved}


def with_study(
    results: Results,
    study: Simulation,
    begun: float,
    *,
    tables: Mapping[str, Table] | None = None,
    curves: Mapping[str, Curves] | None = None,
    findings: Iterable[Finding] = (),
) -> Results:
    """Return the results of a design with a Monte Carlo study of it.

    Args:
        begun: when the study began, by `perf_counter`.
        tables, curves: of the study; they replace the ones of the same stem.
    """
    seconds = {**(results.outcome.timing_s or {}), "simulation": time.perf_counter() - begun}
    return replace(
        results,
        outcome=replace(results.outcome, simulation=study, timing_s=seconds).saying(findings),
        tables={**results.tables, **(tables or {})},
        curves={**results.curves, **(curves or {})},
    )
