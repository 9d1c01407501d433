"""What is said of other minima that explain the data nearly as well as the estimate."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.identification import Estimate, Rival
from inputdesign_cli.plant import Model
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.runs.results import Json
from inputdesign_cli.runs.units import Units

# Parameters that are told, those that differ most.
_MOST_NAMES = 4


def rival_entries(estimate: Estimate) -> list[dict[str, Json]]:
    """`identification.rivals` of `result.json`."""
    return [
        {"theta": dict(zip(estimate.names, one.theta.tolist(), strict=True)), "excess": one.excess}
        for one in estimate.rivals
    ]


def beyond_errors(
    units: Units, model: Model, estimate: Estimate, errors: Sequence[OnModelError], information: Array
) -> list[str]:
    """The rivals whose G is outside of the error bound r_u of the estimate."""
    return _told(units, model, estimate, errors, lambda error, w: error.error_bound(information, w), "r_u")


def beyond_admissible(
    units: Units, model: Model, estimate: Estimate, errors: Sequence[OnModelError]
) -> list[str]:
    """The rivals whose G is further from that of the estimate than is admitted."""
    return _told(
        units, model, estimate, errors, lambda error, w: error.admissible.at(w), "the admissible error"
    )


def _told(
    units: Units,
    model: Model,
    estimate: Estimate,
    errors: Sequence[OnModelError],
    size: Callable[[OnModelError, Array], Array],
    name: str,
) -> list[str]:
    found = []
    for rival in estimate.rivals:
        other = model.at(rival.theta)
        ratio, w = max((_furthest(model, other, error, size) for error in errors), default=(0.0, 0.0))
        if ratio > 1.0:
            found.append(
                f"other parameters explain the data nearly as well ({_parameters(estimate, rival)}; -2 log "
                f"likelihood is {rival.excess:.3g} higher), and their G differs by {ratio:.3g} times {name} "
                f"about {units.named(w)}: excite more frequencies, or hold what is known (plant.known)"
            )
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
    deviations = np.sqrt(np.diag(estimate.covariance))
    most = np.argsort(-np.abs(rival.theta - estimate.theta) / deviations)[:_MOST_NAMES]
    return ", ".join(f"{estimate.names[i]} = {rival.theta[i]:.4g}" for i in sorted(most))
