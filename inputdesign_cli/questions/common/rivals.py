"""What is said of other minima that explain the data nearly as well as the estimate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.identification import Estimate, Rival
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model

# Parameters that are told, those that differ most.
_MOST_NAMES = 4


@dataclass(frozen=True)
class Apart:
    """A rival whose G differs from that of the estimate by `ratio` times a `measure`, most at `w`."""

    rival: Rival
    ratio: float
    w: float
    measure: str


def rival_entries(estimate: Estimate, found: Sequence[Rival]) -> list[dict[str, Json]]:
    """`identification.rivals` and `identification.ruled_out` of `result.json`."""
    return [_entry(estimate, one) for one in found]


def foreseen_entries(units: Units, estimate: Estimate, found: Sequence[Apart]) -> list[dict[str, Json]]:
    """`foreseen.rivals` of `result.json`."""
    return [
        _entry(estimate, one.rival)
        | {"ratio": one.ratio, "measure": one.measure, "frequency": one.w / units.frequency}
        for one in found
    ]


def beyond_errors(
    model: Model, estimate: Estimate, errors: Sequence[OnModelError], information: Array
) -> list[Apart]:
    """The rivals whose G is outside of the error bound r_u of the estimate."""
    return _beyond(model, estimate, errors, lambda error, w: error.error_bound(information, w), "r_u")


def beyond_admissible(model: Model, estimate: Estimate, errors: Sequence[OnModelError]) -> list[Apart]:
    """The rivals whose G is further from that of the estimate than is admitted."""
    return _beyond(model, estimate, errors, lambda error, w: error.admissible.at(w), "the admissible error")


def most_apart(estimate: Estimate, rival: Rival) -> list[int]:
    """The parameters to name, in their order: the few that differ by the most of their deviations."""
    deviations = np.sqrt(np.diag(estimate.covariance))
    most = np.argsort(-np.abs(rival.theta - estimate.theta) / deviations)[:_MOST_NAMES]
    return sorted(most.tolist())


def rival_notes(units: Units, estimate: Estimate, found: Sequence[Apart]) -> list[str]:
    """What to say of rivals that were found in data."""
    return [
        f"other parameters explain the data nearly as well ({_parameters(estimate, one.rival)}; -2 log "
        f"likelihood is {one.rival.excess:.3g} higher), and their G differs by {_far(units, one)}: excite "
        "more frequencies, or hold what is known (plant.known)"
        for one in found
    ]


def ruled_out_notes(estimate: Estimate, found: Sequence[Rival]) -> list[str]:
    """What to say of minima that what the spec knows of the plant rules out."""
    if not found:
        return []
    first = min(found, key=lambda one: one.excess)
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return [
        f"{_parameters(estimate, first)}{more} would explain the data nearly as well (-2 log likelihood is "
        f"{abs(first.excess):.3g} {_higher(first)}), but is far outside of what uncertainty says of the "
        "plant, and does not count"
    ]


def foreseen_note(units: Units, estimate: Estimate, found: Sequence[Apart], remedy: str) -> str:
    """What to say of rivals that a record of the design would leave."""
    nearest = min(found, key=lambda one: one.rival.excess)
    excess = nearest.rival.excess
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return (
        f"other parameters would explain such a record nearly as well: in a simulated one also "
        f"{_parameters(estimate, nearest.rival)}{more}, of which -2 log likelihood is {abs(excess):.3g} "
        f"{_higher(nearest.rival)} and G differs by {_far(units, nearest)}. Estimates may "
        f"end there, whatever r_u says, and assess would call such a record undecided: {remedy}"
    )


def _higher(one: Rival) -> str:
    return "higher" if one.excess >= 0.0 else "lower"


def _far(units: Units, one: Apart) -> str:
    return f"{one.ratio:.3g} times {one.measure} about {units.named(one.w)}"


def _entry(estimate: Estimate, one: Rival) -> dict[str, Json]:
    return {"theta": dict(zip(estimate.names, one.theta.tolist(), strict=True)), "excess": one.excess}


def _beyond(
    model: Model,
    estimate: Estimate,
    errors: Sequence[OnModelError],
    size: Callable[[OnModelError, Array], Array],
    measure: str,
) -> list[Apart]:
    found = []
    for rival in estimate.rivals:
        other = model.at(rival.theta)
        ratio, w = max((_furthest(model, other, error, size) for error in errors), default=(0.0, 0.0))
        if ratio > 1.0:
            found.append(Apart(rival, ratio, w, measure))
    return found


def _furthest(
    model: Model, other: Model, error: OnModelError, size: Callable[[OnModelError, Array], Array]
) -> tuple[float, float]:
    """The largest difference of G over its `size`, and its frequency."""
    w = error.grid
    apart = np.linalg.norm(error.concerned(other.plant_at(w) - model.plant_at(w)), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(apart > 0.0, apart / size(error, w), 0.0)
    at = int(np.argmax(ratio))
    return float(ratio[at]), float(w[at])


def _parameters(estimate: Estimate, rival: Rival) -> str:
    return ", ".join(f"{estimate.names[i]} = {rival.theta[i]:.4g}" for i in most_apart(estimate, rival))
