"""How far the estimate is from the plant of the spec, on which the design rested."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.identification import Estimate
from inputdesign_cli.outcome.results import Json
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model

# Farther apart than this share of the larger of the two, and than so many r_u, G is that of another plant.
_ANOTHER, _BEYOND_ERROR = 0.5, 2.0
# A statistic that chance exceeds more often than this contradicts nothing.
_CHANCE = 1e-3
# The probability that a normal variable is farther than five standard deviations from its mean.
_FIVE_DEVIATIONS = 5.733e-7
_AWAY = 4.0
_LISTED = 4


@dataclass(frozen=True)
class _Apart:
    """Where an entry of G is farthest from that of the spec, as a share of the larger of the two."""

    share: float
    frequency: float
    entry: str
    opposite: bool


def from_nominal(
    units: Units,
    nominal: Model,
    estimated: Model,
    estimate: Estimate,
    errors: Sequence[OnModelError],
    information: Array,
    *,
    asked: bool = False,
) -> tuple[dict[str, Json], list[str]]:
    """What `assessment.nominal` says, and a note where the two are different plants.

    Args:
        nominal, estimated: of one structure.
        errors: what has r_u and a band, entry by entry; information (k, k) is in their coordinates.
        asked: whether they have an r_adm, below which a difference of G matters to nothing.
    """
    of_plant = np.flatnonzero(estimated.in_plant)
    away = (nominal.theta - estimate.theta)[of_plant]
    scale = np.sqrt(np.diag(estimate.covariance))[of_plant]
    correlation = estimate.covariance[np.ix_(of_plant, of_plant)] / np.outer(scale, scale)
    statistic = float((away / scale) @ np.linalg.lstsq(correlation, away / scale, rcond=None)[0])
    found = [_apart(units, nominal, estimated, error, information, asked) for error in errors]
    worst = max((one for places in found for one in places), key=lambda one: one.share, default=None)
    told: dict[str, Json] = {
        "deviations": float(np.sqrt(statistic)),
        "statistic": statistic,
        "degrees_of_freedom": of_plant.size,
        "probability": float(scipy.special.chdtrc(of_plant.size, statistic)),
    }
    deviations = np.abs(away) / scale
    listed = [
        f"{estimate.names[of_plant[k]]} is {estimate.theta[of_plant[k]]:.4g}, not "
        f"{nominal.theta[of_plant[k]]:.4g} ({deviations[k]:.3g} standard deviations)"
        for k in np.argsort(-deviations)[:_LISTED]
        if deviations[k] > _AWAY
    ]
    if worst is None:
        return told, _far(told, listed)
    told |= {"worst_difference": worst.share, "opposite_sign": any(o.opposite for p in found for o in p)}
    if worst.share <= _ANOTHER:
        return told, _far(told, listed)
    sign = "of the opposite sign at low frequency, and " if told["opposite_sign"] else ""
    apart = (
        f"G{worst.entry} is {sign}up to {100 * worst.share:.0f} % of the larger one apart at "
        f"{worst.frequency:.4g} {units.per_time} (chi-squared {statistic:.4g} with {of_plant.size} "
        "degrees of freedom"
    )
    if told["probability"] > _CHANCE:
        return told, [
            "the estimate is far from the plant of the spec, but so uncertain that it does not contradict "
            f"it: {apart}, probability {told['probability']:.2g}). A longer record would tell"
        ]
    return told, [
        f"the estimate contradicts the plant of the spec: {apart}{'; ' * bool(listed)}{', '.join(listed)}). "
        "The design rested on the plant of the spec; what is admitted here is that of the estimate. Check "
        "signs and units of the record; if they are right, put the estimate into the spec"
    ]


def of_first_part(told: Mapping[str, Json]) -> list[str]:
    """The same note where an experiment in parts begins: a poor first estimate is why it goes in parts."""
    if told["probability"] > _CHANCE:
        return []
    sign = " and G has the opposite sign at low frequency: check the signs of the record"
    return [
        f"the estimate lies {told['deviations']:.3g} standard deviations from the plant of the spec"
        f"{sign if told.get('opposite_sign') else ''}. From now on plans rest on the estimates"
    ]


def _far(told: dict[str, Json], listed: Sequence[str]) -> list[str]:
    """What to say of a plant that is not the one of the spec, but near it."""
    if told["probability"] > _FIVE_DEVIATIONS:
        return []
    return [
        f"the estimate lies {told['deviations']:.3g} standard deviations from the plant of the spec (all "
        f"parameters of G together, chi-squared {told['statistic']:.4g} with {told['degrees_of_freedom']} "
        f"degrees of freedom{'; ' * bool(listed)}{', '.join(listed)}): it is another plant, its units are "
        "others, or the numbers of the spec, on which the design rested, were poor. The verdict holds for "
        "the estimate: r_u and r_adm are those at its parameters"
    ]


def _apart(
    units: Units, nominal: Model, estimated: Model, error: OnModelError, information: Array, asked: bool
) -> list[_Apart]:
    """The entries of G that a model error is about, where they differ by more than r_u and r_adm."""
    w = error.grid
    with np.errstate(divide="ignore", invalid="ignore"):  # the nominal plant may have a pole on the grid
        before, now = nominal.plant_at(w), estimated.plant_at(w)
    beyond = _BEYOND_ERROR * error.error_bound(information, w)
    if asked:
        beyond = np.maximum(beyond, error.admissible.at(w))
    found = []
    for i, j in [error.entry] if error.entry is not None else np.ndindex(units.outputs, units.inputs):
        old, new = before[:, i, j], now[:, i, j]
        apart = np.where(np.isfinite(old), np.abs(new - old), 0.0)
        size = np.maximum(np.maximum(np.abs(new), np.nan_to_num(np.abs(old))), 1e-300)
        share = np.where(apart > beyond, apart / size, 0.0)
        at = int(np.argmax(share))
        opposite = bool(share[0] > 1.0 and (old[0].conj() * new[0]).real < 0.0)
        found.append(_Apart(float(share[at]), float(w[at]) / units.frequency, units.entry(i, j), opposite))
    return found
