"""A given model does not describe other data: its simulation explains nothing of them, or too little."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.explore.fits import Fits
from inputdesign_cli.finding import DOUBT, Finding, FindingKind, finding
from inputdesign_cli.findings.explored_logs import HALF, LEAST_FIT
from inputdesign_cli.findings.places import Record
from inputdesign_cli.identification import cross_correlations
from inputdesign_cli.identification.checks import signal_name
from inputdesign_cli.outcome.shares import chance

# Probability that past inputs explain the residuals of a model by chance alone.
_SURELY = 1e-6


def other_plants(found: Fits, data: Record) -> list[Finding]:
    """Return the reasons why a model does not describe these data, output by output.

    A poor fit alone is no fault of the model, since the noise may be strong. It is one if past inputs explain
    the rest.
    """
    doubts = list[Finding]()
    for i, fit in enumerate(found.simulation):
        output = signal_name("y", i, len(found.simulation))
        if not np.isfinite(fit):
            doubts += _unsimulated(output)
        elif fit < LEAST_FIT:
            doubts += _unexplained(output, fit)
        elif fit < HALF:
            doubts += _contradicted(output, fit, found, data, i)
    return doubts


@finding(DOUBT, "model-not-simulated", "Check the model, or judge it with its loop: `idesign assess`.")
def _unsimulated(kind: FindingKind, output: str) -> list[Finding]:
    """The model has no simulation of an output. Its plant is unstable."""
    return [kind.found(f"{output}. Its plant is unstable", where=output)]


@finding(
    DOUBT,
    "model-explains-nothing",
    "See whether the model is of this plant, and gain, delay, units and columns agree.",
)
def _unexplained(kind: FindingKind, output: str, fit: float) -> list[Finding]:
    """The simulation explains next to nothing of an output. A level alone explains as much."""
    fact = f"{fit:.1f} % of {output}, and less than {LEAST_FIT:g} % is nothing"
    return [kind.found(fact, where=output, fit_percent=fit)]


@finding(
    DOUBT, "model-of-other-plant", "See whether the model is of this plant, and at this operating point."
)
def _contradicted(
    kind: FindingKind, output: str, fit: float, found: Fits, data: Record, i: int
) -> list[Finding]:
    """Past inputs explain what the simulation of an output does not. The model is of another plant."""
    test = cross_correlations(found.errors[:, i : i + 1], data.u, lengths=data.lengths)
    p = test.probability
    fact = f"it explains {fit:.1f} % of {output} only (probability {chance(p)} by chance)"
    return kind.when(not p >= _SURELY, fact, where=output, fit_percent=fit, probability=p)
