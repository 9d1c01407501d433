"""The estimate is far from the plant of the spec, on which the design rested."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy
from numpy.typing import NDArray

from inputdesign_cli.accuracy import OnModelError
from inputdesign_cli.arrays import Array
from inputdesign_cli.finding import NOTE, Finding, doubt, note
from inputdesign_cli.identification import Estimate
from inputdesign_cli.levels import level
from inputdesign_cli.outcome import Nominal
from inputdesign_cli.outcome.units import Units
from inputdesign_cli.plant import Model

# If G differs by more than this share of the larger one, and this multiple of r_u, the plant is another.
_ANOTHER, _BEYOND_ERROR = 0.5, 2.0
# The probability that a normal variable is farther than five standard deviations from its mean.
_FIVE_DEVIATIONS = 5.733e-7
_AWAY, _LISTED = 4.0, 4  # least standard deviations of a listed parameter; the most listed
_LOWEST = 1e-6  # share of the band below which a frequency is not named
_SOME = np.array([0.013, 0.37, 1.9])  # frequencies at which two plants are compared

ANOTHER = doubt(
    "another-plant",
    "The estimate contradicts the plant of the spec. The two G differ by more than half of the larger one "
    "and by more than their uncertainty.",
    "Check signs and units of the record. If they are right, put the estimate into the spec.",
)
FAR = doubt(
    "far-from-the-spec",
    "The estimate lies far from the plant of the spec. The parameters of G together differ by more than "
    "five standard deviations, a stated uncertainty included. The plant, the units or the values of "
    "the spec may be wrong; without an uncertainty its values count as exact, and this is a note.",
    "The verdict holds for the estimate: r_u and r_adm are at its parameters. Put it into the spec.",
)
OUTSIDE = note(
    "outside-uncertainty",
    "The estimate lies outside the uncertainty of the spec. The design was made for the plants within it.",
    "The verdict holds for the estimate. Before another design, state an uncertainty that holds it.",
)


@dataclass(frozen=True)
class Distance:
    """The distance of an estimate from the plant of the spec.

    Attributes:
        listed: the parameters that are farthest, with their values and deviations.
        share, place: largest difference of G, relative to the larger one, and where; zero without r_u of G.
        exact: whether the spec states no uncertainty.
        outside: the parameters beyond the uncertainty of the spec, with their values.
    """

    nominal: Nominal
    listed: tuple[str, ...]
    share: float
    place: str
    exact: bool = False
    outside: tuple[str, ...] = ()


def from_nominal(
    units: Units,
    nominal: Model,
    estimated: Model,
    estimate: Estimate,
    errors: Sequence[OnModelError],
    information: Array,
    *,
    asked: bool = False,
    nominal_covariance: Array | None = None,
) -> Distance:
    """Return how far an estimate lies from the plant of the spec.

    Args:
        nominal, estimated: models of one structure.
        errors: the model errors with r_u and a band, entry by entry.
        information: (k, k) in their coordinates, the inverse covariance of the difference of the two.
        asked: whether they have an r_adm, below which a difference of G does not matter.
        nominal_covariance: (k, k), covariance of the plant of the spec; None if it counts as exact.
    """
    of_plant = np.flatnonzero(estimated.in_plant)
    order = _nearest_order(nominal, estimate.theta, of_plant.tolist())
    values = nominal.theta[order]
    away = (values - estimate.theta)[of_plant]
    # Other minima explain the data nearly as well: the nearest of them counts.
    others = [(one.excess, (values - one.theta)[of_plant]) for one in estimate.search.rivals]
    covariance = estimate.covariance
    if nominal_covariance is not None:
        covariance = covariance + nominal_covariance[np.ix_(order, order)]
    scale = np.sqrt(np.diag(covariance))[of_plant]
    correlation = covariance[np.ix_(of_plant, of_plant)] / np.outer(scale, scale)
    statistic = min(
        excess + float((x / scale) @ np.linalg.lstsq(correlation, x / scale, rcond=None)[0])
        for excess, x in [(0.0, away), *others]
    )
    apart = [one for error in errors for one in _apart(units, nominal, estimated, error, information, asked)]
    share, place, _ = max(apart, default=(0.0, "", False))
    deviations = np.abs(away) / scale
    listed = tuple(
        f"{estimate.names[of_plant[k]]} is {estimate.theta[of_plant[k]]:.4g}, not "
        f"{values[of_plant[k]]:.4g} ({deviations[k]:.3g} standard deviations)"
        for k in np.argsort(-deviations)[:_LISTED]
        if deviations[k] > _AWAY
    )
    found = Nominal(
        deviations=float(np.sqrt(statistic)),
        statistic=statistic,
        degrees_of_freedom=of_plant.size,
        probability=float(scipy.special.chdtrc(of_plant.size, statistic)),
        worst_difference=share if apart else None,
        opposite_sign=any(opposite for *_, opposite in apart) if apart else None,
    )
    exact = nominal_covariance is None or not np.any(nominal_covariance)
    return Distance(found, listed, share, place, exact)


def _nearest_order(nominal: Model, theta: Array, of_plant: Sequence[int]) -> NDArray[np.int_]:
    """Return the order (k,) of the parameters of the spec's plant that is nearest to an estimate.

    Two lags may be exchanged without a change of G.
    """
    order, values = np.arange(theta.size), np.asarray(nominal.theta)
    with np.errstate(all="ignore"):  # an exchange may make an invalid plant
        G = nominal.plant_at(_SOME)
        for a, b in combinations(of_plant, 2):
            other = order.copy()
            other[[a, b]] = order[[b, a]]
            nearer = np.sum(np.abs(values[other] - theta)) < np.sum(np.abs(values[order] - theta))
            if nearer and np.allclose(nominal.at(values[other]).plant_at(_SOME), G, rtol=1e-9, atol=0.0):
                order = other
    return order


def far_from_nominal(distance: Distance) -> list[Finding]:
    """Return a finding where the two are different plants, or parameters lie far apart or outside."""
    found, another = distance.nominal, distance.share > _ANOTHER
    if found.probability > (level("far from nominal") if another else _FIVE_DEVIATIONS):
        fact = f"{', '.join(distance.outside)}, by more than chance"
        return OUTSIDE.when(distance.outside, fact, where="uncertainty")
    kind = ANOTHER if another else FAR
    sign = ", with the opposite sign at low frequency" if found.opposite_sign else ""
    exact = "its values count as exact, " * distance.exact
    apart = f"{exact}{found.deviations:.3g} standard deviations apart{sign}"
    if distance.share:
        apart += f"; {distance.place} differs by {100 * distance.share:.0f} % of the larger one"
    fact = "; ".join((apart, *distance.listed))
    weight = NOTE if distance.exact and not another else None
    far, chance = found.deviations, found.probability
    return [kind.found(fact, where="plant", severity=weight, deviations=far, probability=chance)]


def _apart(
    units: Units, nominal: Model, estimated: Model, error: OnModelError, information: Array, asked: bool
) -> list[tuple[float, str, bool]]:
    """Return by which share, and where, entries of G differ beyond r_u and r_adm, and whether in sign."""
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
        # Beside an integrator the grid comes as near to zero as it can: the number says nothing.
        place = "the lowest frequencies" if w[at] < _LOWEST * w[-1] else units.named(float(w[at]))
        place = f"G{units.entry(i, j)} at {place}"
        found.append((float(share[at]), place, opposite))
    return found
