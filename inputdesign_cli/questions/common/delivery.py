"""Results that all kinds of questions deliver: their growth, their last check, and their simulation.

Results are reread before they are written, and evaluated by other means.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.limits import PowerLimit
from inputdesign_cli.errors import InaccurateError
from inputdesign_cli.finding import Finding
from inputdesign_cli.monte_carlo.excitations import Excitation
from inputdesign_cli.outcome import Objective, Outcome, Simulation
from inputdesign_cli.outcome.curves import Curves
from inputdesign_cli.outcome.results import Results, Table
from inputdesign_cli.outcome.simulation import Searched
from inputdesign_cli.outcome.units import Header

KINDS = {"cost": "least_cost", "factor": "accuracy_factor", "samples": "shortest_experiment"}
"""The kind of objective in the outcome, by the goal of a design."""
# A gap up to this many tolerances is almost optimal.
ALMOST = 100.0
_ROUNDING = 1e-6


APART = 1e-6
"""Two ways to the same number may differ by this share of it."""


@dataclass(frozen=True)
class Delivered:
    """Holds a design or an analysis to be tried: a record (n, r), None if no excitation is needed.

    `renewed` realises the spectrum anew in each run. `of_length` draws `bound` and `ellipses` for another
    number of samples. `rivals` searches a number of records for other minima, from several starts.
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
    """Return the results with a Monte Carlo study; `begun` is `perf_counter` at its start."""
    seconds = {**(results.outcome.timing_s or {}), "simulation": time.perf_counter() - begun}
    outcome = replace(results.outcome, simulation=study, timing_s=seconds)
    return adding(results, outcome, findings, tables, curves)


def proof_status(gap: float, tolerance: float) -> str:
    """Return the status of a proved relative gap: whether it is as small as asked."""
    if gap <= tolerance * (1.0 + _ROUNDING):
        return "optimal"
    return "almost_optimal" if gap <= ALMOST * tolerance else "gap_open"


def check_claims(wrong: Iterable[str], remedy: str) -> None:
    """Raise `InaccurateError` (`internal-disagreement`) with the first sentence on a claim that is wrong."""
    for claim in wrong:
        hint = f"{remedy}; if the spec is plain, please report it: the spec is enough to see the same"
        raise InaccurateError.because("internal-disagreement", claim, hint, "accuracy")


def of_bounds(claimed: Objective, apart: float = APART, size: float = 0.0) -> Iterator[str]:
    """Yield a sentence if the value lies beyond a proved bound by the share `apart` of it, or of `size`."""
    value, largest = claimed.value, claimed.upper_bound is not None
    for name, bound in (
        ("upper_bound", claimed.upper_bound),
        ("lower_bound", claimed.lower_bound),
        ("any_spectrum_bound", claimed.any_spectrum_bound),
    ):
        beyond = 0.0 if bound is None else value - bound
        if not (beyond if largest else -beyond) <= max(apart, APART) * max(abs(value), size):
            yield f"the value {value:.10g} lies beyond {name} ({bound:.10g})"


def of_cost(found: float, claimed: float) -> Iterator[str]:
    """Yield a sentence unless the excitation costs as much as is claimed."""
    if not abs(found - claimed) <= APART * abs(found):
        yield f"the spectrum costs {found:.10g}, not {claimed:.10g}"


def of_limit(limit: PowerLimit, power: float) -> Iterator[str]:
    """Yield a sentence if the power is beyond its limit."""
    excess = power - limit.bound if limit.upper else limit.bound - power
    if not excess <= APART * limit.bound:
        yield f"{limit.key} is {limit.bound:.6g}, but the spectrum has {power:.10g}"
