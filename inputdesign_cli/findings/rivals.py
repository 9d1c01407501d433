"""Other minima explain the data nearly as well as the estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import DOUBT, NOTE, UNDECIDED, Finding, FindingKind, finding
from inputdesign_cli.outcome.design import Rival as Entry
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model

if TYPE_CHECKING:
    from inputdesign_cli.identification import Estimate, Rival

# Parameters that are named: the few that differ most.
_MOST_NAMES = 4


@dataclass(frozen=True)
class Apart:
    """A rival whose G differs from that of the estimate by `ratio` times a `measure`, most at `w`."""

    rival: Rival
    ratio: float
    w: float
    measure: str


def rival_entries(estimate: Estimate, found: Sequence[Rival]) -> tuple[Entry, ...]:
    """Return `identification.rivals` and `identification.ruled_out` of `result.json`."""
    return tuple(
        Entry(dict(zip(estimate.names, one.theta.tolist(), strict=True)), one.excess) for one in found
    )


def foreseen_entries(units: Units, estimate: Estimate, found: Sequence[Apart]) -> tuple[Entry, ...]:
    """Return `foreseen.rivals` of `result.json`."""
    entries = rival_entries(estimate, [one.rival for one in found])
    return tuple(
        replace(entry, ratio=one.ratio, measure=one.measure, frequency=one.w / units.frequency)
        for entry, one in zip(entries, found, strict=True)
    )


def beyond(
    model: Model, estimate: Estimate, errors: Sequence[OnModelError], information: Array | None = None
) -> list[Apart]:
    """Return the rivals whose G differs from that of the estimate by more than the admissible error.

    Args:
        information: (k, k); if given, by more than its error bound r_u instead.
    """
    found, measure = [], "the admissible error" if information is None else "r_u"
    for rival in estimate.search.rivals:
        ratio, frequency, other = 0.0, 0.0, model.at(rival.theta)
        for error in errors:
            w = error.grid
            apart = np.linalg.norm(error.concerned(other.plant_at(w) - model.plant_at(w)), axis=1)
            size = error.admissible.at(w) if information is None else error.error_bound(information, w)
            with np.errstate(divide="ignore", invalid="ignore"):
                ratios = np.where(apart > 0.0, apart / size, 0.0)
            at = int(np.argmax(ratios))
            ratio, frequency = max((ratio, frequency), (float(ratios[at]), float(w[at])))
        if ratio > 1.0:
            found.append(Apart(rival, ratio, frequency, measure))
    return found


def most_apart(estimate: Estimate, rival: Rival) -> list[int]:
    """Return the parameters to name, in their order: the few that differ by the most of their deviations."""
    deviations = np.sqrt(np.diag(estimate.covariance))
    most = np.argsort(-np.abs(rival.theta - estimate.theta) / deviations)[:_MOST_NAMES]
    return sorted(most.tolist())


@finding(UNDECIDED, "other-minimum", "Excite more frequencies, or fix known parameters with `plant.known`.")
def other_minima(
    kind: FindingKind,
    units: Units,
    model: Model,
    estimate: Estimate,
    errors: Sequence[OnModelError],
    unstated: Sequence[OnModelError],
    information: Array,
) -> list[Finding]:
    """Other parameters explain the data nearly as well. Another minimum of the likelihood has another G.

    Args:
        errors: the requirements on the model error.
        unstated: errors of G with r_u, which count if nothing is required.
        information: (k, k) in their coordinates.
    """
    doubtful = beyond(model, estimate, errors or unstated, information)
    decides = beyond(model, estimate, errors) if errors else doubtful
    undecided = {id(one.rival) for one in decides}
    return [
        kind.found(
            _said(units, estimate, one.rival, one),
            severity=severity,
            ratio=one.ratio,
            measure=one.measure,
            excess=one.rival.excess,
        )
        for severity, some in (
            (UNDECIDED, decides),
            (DOUBT, [one for one in doubtful if id(one.rival) not in undecided]),
        )
        for one in some
    ]


@finding(NOTE, "minimum-ruled-out", "Check whether `uncertainty` is right.")
def ruled_out(kind: FindingKind, estimate: Estimate, found: Sequence[Rival]) -> list[Finding]:
    """The uncertainty excludes another minimum. Its parameters explain the data nearly as well."""
    if not found:
        return []
    first = min(found, key=lambda one: one.excess)
    fact, minima = _said(None, estimate, first), len(found)
    return [kind.found(fact, where="uncertainty", excess=first.excess, minima=minima)]


@finding(DOUBT, "other-minimum-foreseen", "Excite more frequencies, or fix the dead time with `plant.known`.")
def foreseen_rivals(
    kind: FindingKind, units: Units, estimate: Estimate, found: Sequence[Apart], remedy: str
) -> list[Finding]:
    """Other parameters would explain a record of the design nearly as well. Estimates may end there."""
    if not found:
        return []
    nearest, minima = min(found, key=lambda one: one.rival.excess), len(found)
    fact, excess = _said(units, estimate, nearest.rival, nearest), nearest.rival.excess
    remedy = f"{remedy[:1].upper()}{remedy[1:]}."
    return [kind.found(fact, remedy=remedy, excess=excess, ratio=nearest.ratio, minima=minima)]


@finding(NOTE, "other-minima-not-looked-at", "Allow more time, or try `idesign simulate`.")
def not_foreseen(kind: FindingKind, reason: str) -> Finding:
    """Other minima were not searched for. A plant with dead times may have some, whole periods away."""
    return kind.found(reason)


def _said(units: Units | None, estimate: Estimate, rival: Rival, apart: Apart | None = None) -> str:
    """Return the parameters of another minimum, how likely it is, and how far its G is away."""
    values = ", ".join(f"{estimate.names[i]} = {rival.theta[i]:.4g}" for i in most_apart(estimate, rival))
    fact = f"{values}, -2 log likelihood {rival.excess:+.3g}"
    if units is not None and apart is not None:
        fact += f", G {apart.ratio:.3g} times {apart.measure} away about {units.named(apart.w)}"
    return fact
