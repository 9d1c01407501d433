"""What all kinds of questions deliver: results that grow, and a study of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding
from inputdesign_cli.monte_carlo.excitations import Excitation
from inputdesign_cli.outcome import Outcome, Simulation
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import Searched
from inputdesign_cli.outcome.units import Header

# A gap up to this many tolerances is almost optimal.
ALMOST = 100.0
_ROUNDING = 1e-6


@dataclass(frozen=True)
class Delivered:
    """What a design or an analysis delivers to be tried.

    Attributes:
        results: what has been computed so far.
        record: (n, r), about its operating point; None if no excitation is needed.
        renewed: realises the spectrum anew in each run; None for a record that was given.
        alpha: of r_u, see the contract.
        of_length: curves `bound` and `ellipses` for another number of samples than the results count.
        rivals: searches a number of records from several starts, if that finds other minima.
    """

    results: Results
    record: Array | None
    renewed: Excitation | None
    alpha: float
    of_length: Callable[[int], Mapping[str, Curves]] = lambda _: {}
    rivals: Callable[[int], Searched | None] | None = None


def results_of(
    header: Header, outcome: Outcome, tables: Mapping[str, Table], curves: Mapping[str, Curves]
) -> Results:
    """Return the results of a question with this header."""
    return Results(outcome, header.resolved_spec, header.units.time_unit, tables, curves)


def adding(
    results: Results,
    outcome: Outcome,
    findings: Iterable[Finding] = (),
    tables: Mapping[str, Table] | None = None,
    curves: Mapping[str, Curves] | None = None,
) -> Results:
    """Return the results with an outcome of more sections, findings, and tables and curves by stem."""
    return replace(
        results,
        outcome=outcome.saying(findings),
        tables={**results.tables, **(tables or {})},
        curves={**results.curves, **(curves or {})},
    )


def timing(started: float, solved: float) -> dict[str, float]:
    """Return the seconds that the design and, until now, its signal took; times by `perf_counter`."""
    return {"design": solved - started, "signal": time.perf_counter() - solved}


def with_study(
    results: Results,
    study: Simulation,
    begun: float,
    findings: Iterable[Finding] = (),
    tables: Mapping[str, Table] | None = None,
    curves: Mapping[str, Curves] | None = None,
) -> Results:
    """Return the results with a Monte Carlo study that began then, by `perf_counter`."""
    seconds = {**(results.outcome.timing_s or {}), "simulation": time.perf_counter() - begun}
    outcome = replace(results.outcome, simulation=study, timing_s=seconds)
    return adding(results, outcome, findings, tables, curves)


def proof_status(gap: float, tolerance: float) -> str:
    """Whether the relative gap that is proved is as small as asked."""
    if gap <= tolerance * (1.0 + _ROUNDING):
        return "optimal"
    return "almost_optimal" if gap <= ALMOST * tolerance else "gap_open"
