"""Other minima explain the data nearly as well as the estimate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import Finding, Severity, doubt, note, unsure
from inputdesign_cli.identification import Estimate, Rival
from inputdesign_cli.outcome.design import Rival as Entry
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model

# Parameters that are named: the few that differ most.
_MOST_NAMES = 4

OTHER_MINIMUM = unsure(
    "other-minimum",
    "Other parameters explain the data nearly as well. The likelihood has another minimum of nearly the "
    "same depth. Its G differs by more than the error bound or the admissible error.",
    "Excite more frequencies, or fix known parameters with `plant.known`.",
)
RULED_OUT = note(
    "minimum-ruled-out",
    "The uncertainty excludes another minimum. Its parameters explain the data nearly as well, but lie far "
    "outside the region of `uncertainty` for the plant.",
    "Check whether `uncertainty` is right.",
)
FORESEEN = doubt(
    "other-minimum-foreseen",
    "A record of the design may have other minima. The likelihood of a simulated record has another minimum "
    "of nearly the same depth, with another G. Estimates may end there, and `assess` would then be "
    "undecided.",
    "Excite more frequencies, or fix a known dead time with `plant.known`.",
)
NOT_FORESEEN = note(
    "other-minima-not-looked-at",
    "Other minima were not searched for. A plant with dead times may have some, whole periods away.",
    "Allow more time, or try `idesign simulate`.",
)


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
    """Return the rivals whose G is further from that of the estimate than is admitted.

    Args:
        information: (k, k); with it, further than the error bound r_u.
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


def other_minima(
    units: Units,
    model: Model,
    estimate: Estimate,
    errors: Sequence[OnModelError],
    unstated: Sequence[OnModelError],
    information: Array,
) -> list[Finding]:
    """Return a finding for each rival with another G: it is undecided where more than admitted depends on it.

    Args:
        errors: what is asked of the model error.
        unstated: what has r_u of G where nothing is asked.
        information: (k, k) in their coordinates.
    """
    doubtful = beyond(model, estimate, errors or unstated, information)
    decides = beyond(model, estimate, errors) if errors else doubtful
    undecided = {id(one.rival) for one in decides}
    return [
        OTHER_MINIMUM.found(
            f"other parameters explain the data nearly as well ({_parameters(estimate, one.rival)}; -2 log "
            f"likelihood is {one.rival.excess:.3g} higher), and their G differs by {_far(units, one)}: "
            "excite more frequencies, or hold what is known (plant.known)",
            severity=Severity.UNDECIDED if id(one.rival) in undecided else Severity.DOUBT,
            ratio=one.ratio,
            measure=one.measure,
            excess=one.rival.excess,
        )
        for one in [*decides, *(one for one in doubtful if id(one.rival) not in undecided)]
    ]


def ruled_out(estimate: Estimate, found: Sequence[Rival]) -> list[Finding]:
    """Return a finding on minima that what the spec knows of the plant rules out."""
    if not found:
        return []
    first = min(found, key=lambda one: one.excess)
    message = (
        f"{_parameters(estimate, first)}{_more(found)} would explain the data nearly as well "
        f"({_higher(first)}), but is far outside the uncertainty of the plant, and does not count"
    )
    return [RULED_OUT.found(message, where="uncertainty", excess=first.excess, minima=len(found))]


def foreseen_rivals(units: Units, estimate: Estimate, found: Sequence[Apart], remedy: str) -> list[Finding]:
    """Return a finding on rivals that a record of the design would leave."""
    if not found:
        return []
    nearest = min(found, key=lambda one: one.rival.excess)
    message = (
        "other parameters would explain this kind of record nearly as well: in a simulated one also "
        f"{_parameters(estimate, nearest.rival)}{_more(found)}, of which {_higher(nearest.rival)} and G "
        f"differs by {_far(units, nearest)}. Estimates may end there, whatever r_u says, and assess would "
        f"call such a record undecided: {remedy}"
    )
    return [FORESEEN.found(message, excess=nearest.rival.excess, ratio=nearest.ratio, minima=len(found))]


def not_foreseen(reason: str) -> Finding:
    """Return the finding that other minima were not looked for, and why."""
    return NOT_FORESEEN.found(
        f"{reason}: whether other dead times would explain the record nearly as well was not examined"
    )


def _higher(one: Rival) -> str:
    return f"-2 log likelihood is {abs(one.excess):.3g} {'higher' if one.excess >= 0.0 else 'lower'}"


def _more(found: Sequence[object]) -> str:
    return f" (and {len(found) - 1} more)" if len(found) > 1 else ""


def _far(units: Units, one: Apart) -> str:
    return f"{one.ratio:.3g} times {one.measure} about {units.named(one.w)}"


def _parameters(estimate: Estimate, rival: Rival) -> str:
    return ", ".join(f"{estimate.names[i]} = {rival.theta[i]:.4g}" for i in most_apart(estimate, rival))
