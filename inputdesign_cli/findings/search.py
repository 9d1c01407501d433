"""The search for an estimate did not settle, or the end of an expression stopped it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, FindingKind, Severity
from inputdesign_cli.identification import Estimate
from inputdesign_cli.plant import Model

# Of a standard deviation: nearer to where an expression ends, an estimate was stopped there.
_ASIDE = 0.001

NOT_SETTLED = FindingKind(
    "search-not-settled",
    Severity.UNDECIDED,
    "the search for the estimate did not settle",
    "The search for the parameters still moved at its last step. The estimate may be far from the minimum.",
    "Lower the orders, which may be too high for these data, or begin nearer to the plant.",
    "unsettled",
)
STOPPED = FindingKind(
    "stopped-at-an-end",
    Severity.UNDECIDED,
    "the search stopped where an expression ends",
    "Beyond the estimate an expression of the spec is not defined. The likeliest parameters may lie there, "
    "and the standard deviation is not to be trusted.",
    "Write the expression so that it is defined wherever the plant may be.",
    "unsettled",
)


def unsettled(model: Model, estimate: Estimate) -> list[Finding]:
    """Return findings on a search that did not settle, or that the end of an expression stopped.

    Args:
        model: the estimate as a model.
    """
    found = []
    search = estimate.search
    if not search.converged:
        begun = "its only start" if search.starts == 1 else f"the best of {search.starts} starts"
        found.append(
            NOT_SETTLED.found(
                f"the search did not settle after {search.steps} steps from {begun}: "
                "the estimate may be far from the minimum; the orders may be too high for these data",
                steps=search.steps,
                starts=search.starts,
            )
        )
    return found + stopped_at_ends(model, estimate)


def stopped_at_ends(model: Model, estimate: Estimate) -> list[Finding]:
    """Return a finding for each parameter that the search left where an expression ends."""
    found = []
    deviations = np.sqrt(np.diag(estimate.covariance))
    for k in np.flatnonzero(~model.dead_times).tolist():
        beside = [model.at(theta).flaw for theta in _beside(model.theta, k, _ASIDE * deviations[k])]
        flaw = next(filter(None, beside), None)
        if flaw is not None:
            found.append(
                STOPPED.found(
                    f"the search stopped at {model.names[k]} = {model.theta[k]:.6g}, beyond which {flaw}: "
                    "the likeliest parameters may lie there, and its deviation is not to be trusted; write "
                    "the expression so that it is defined wherever the plant may be",
                    where=model.names[k],
                    value=float(model.theta[k]),
                )
            )
    return found


def _beside(theta: Array, index: int, step: float) -> Iterator[Array]:
    """Return theta with one parameter a little less, and a little more."""
    for sign in (-1.0, 1.0):
        moved = theta.copy()
        moved[index] += sign * step
        yield moved
