"""Spec -> whether a design has a best value.

It has no best value if some excitation informs about the parameters and is neither paid for nor limited.
A combination of the inputs may be free, or a frequency: at a pole of the plant on the unit circle, a loop
leaves the input no power, while the power of the output informs about the pole.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from inputdesign_cli.arrays import Array
from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.design.convex.limits import weights_of
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant import graded_grid, local_maxima
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.common.infeasible import Reach
from inputdesign_cli.specification import Spec
from inputdesign_cli.spectrum import matrices

PricedPower = tuple[PowerKind, int | None, float]


# Shares of the band at which directions are priced: frequencies at which controllers hardly have zeros.
_PLACES = np.array([0.137, 0.293, 0.461, 0.618, 0.787, 0.911])
_SINGULAR = 1e-12
# A price this many decades below the typical one may be a zero between the points of a grid.
_ZERO = 6.0
# Distances to a free frequency at which the information is computed, in units of the next pole's distance.
_DISTANCES = np.geomspace(1e-2, 1e-4, 9)
# Least growth of the information at unit price over one step (its square law gives 3.2), and steps compared.
_GROWS, _EARLIER = 2.5, 4
# Lines and poles nearer to a frequency than this share of the band are on it.
_ON = 1e-6
# The share of the band that is left out at a free end, so that the bound exists.
_MARGIN = 1e-6
_OUTCOMES = {
    "cost": "with power ever nearer to it the accuracy costs as little as you like",
    "factor": "with power ever nearer to it the accuracy grows without end",
    "samples": "with power ever nearer to it the experiment is as short as you like",
}


def check_every_direction_counts(spec: Spec, question: Question) -> None:
    """Refuse a design in which some combination of the inputs may have any power.

    Powers of fewer outputs than inputs do not count every combination, and neither do weights of zero.
    Raises `SpecError`: `no-cost` or `needs-limits`.
    """
    priced = priced_powers(question)
    if priced is None:
        return
    lo, hi = question.experiment.band
    density = price_density(question.experiment, priced, lo + (hi - lo) * _PLACES)
    size = np.sqrt(np.einsum("naa->na", density).real)
    unit = np.where(size > 0.0, size, 1.0)
    correlation = density / (unit[:, :, None] * unit[:, None, :])
    if np.linalg.eigvalsh(correlation)[:, 0].max() > _SINGULAR:
        return
    silent = np.flatnonzero(np.all(size == 0.0, axis=0))
    which = f"the power of input {silent[0] + 1}" if silent.size else "a combination of the inputs"
    if spec.goal == "least_cost":
        hint = "give input_power a weight for every input, however small"
        raise spec.complain("no-cost", f"{which} costs nothing", hint=hint, key="cost")
    hint = "add limits.input_power, or limits.excitation_power in closed loop"
    raise spec.complain("needs-limits", f"nothing limits {which}", hint=hint, key="limits")


def check_reach(spec: Spec, question: Question) -> Reach:
    """Return whether every spectrum has a bound, and whether it is attained.

    Raises `SpecError` (`no-cost`, `needs-limits`): the family has no best spectrum.
    """
    found = free_information(question)
    if found is None:
        return Reach()
    frequencies, unbounded, reached = found
    (lo, hi), goal, family = question.experiment.band, question.goal, question.basis
    section, code, add = "limits", "needs-limits", "add"
    keys = dict.fromkeys(limit.key for limit in question.limits if limit.upper)
    uncounted = f"is not limited by {', '.join(keys)}"
    if goal == "cost":
        section, code, add = "cost", "no-cost", "give a weight, however small, to"
        uncounted = "costs nothing"
    places = " and ".join(map(build_units(spec).named, frequencies))
    free = f"excitation at {places} informs about the parameters and {uncounted}"
    others = f"{section}.excitation_power"
    if spec.experiment.controller is None:
        others = f"{section}.input_power"
    elif "output" not in {kind for kind, _, _ in priced_powers(question) or []}:
        others = f"{section}.output_power or {others}"  # at a pole in the loop only outputs have power
    off, avoid = 2.0 * _MARGIN * hi, "leave it out by limits.band"
    # Lines are kept off an end of the band; they close in on a frequency inside it from both sides.
    inside = goal == "factor" and any(lo + off <= w <= hi - off for w in frequencies)
    approached = "the best is approached with power ever nearer to it"
    outcome = _OUTCOMES[goal] if unbounded else approached
    if reached and (unbounded or inside or (goal == "factor" and not family.free)):
        hint = f"{add} {others}; or {avoid if family.free else 'choose other lines'}"
        message = f"{free}: {outcome}, and no spectrum is the best"
        raise spec.complain(code, message, hint=hint, key=section)
    if unbounded or inside:
        return Reach(bounded=False, note=f"{free}, so that {outcome}; with {others} there is one")
    below, above = (_MARGIN * hi * any(abs(w - end) < off for w in frequencies) for end in (lo, hi))
    note = f"{free}: {approached}, which no record can follow; add {others}, or {avoid}"
    return Reach(attained=False, band=(lo + below, hi - above), note=note if family.free else None)


def free_information(question: Question) -> tuple[tuple[float, ...], bool, bool] | None:
    """Return the frequencies of the band at which the information per unit of price has no bound.

    The first flag says that power ever nearer to them meets all requirements at no price, or that the
    criterion has no bound; otherwise the best value is only approached. The second says that the family can
    have power there. None without such frequencies, and for robust designs: poles of other plants differ.
    """
    priced = priced_powers(question)
    if priced is None or question.others:
        return None
    experiment = question.experiment.whitened(1.0)
    grid = graded_grid(
        np.concatenate([experiment.singularities, experiment.model.singularities]), *experiment.band
    )
    typical = float(np.median(np.linalg.eigvalsh(price_density(experiment, priced, grid))[:, -1]))

    def cheapness(w: Array) -> Array:
        least = np.linalg.eigvalsh(price_density(experiment, priced, w))[:, 0]
        return np.asarray(-np.log10(np.maximum(least / typical, np.finfo(float).tiny)))

    cheap = local_maxima(cheapness, grid, cheapness(grid), above=_ZERO)[0].tolist()
    found = [(w, gain) for w in cheap if (gain := _gain(experiment, priced, w))]
    if not found:
        return None
    places = tuple(w for w, _ in found)
    before, after = (sum(gain[n] for _, gain in found) for n in (0, 1))
    requirements = [make(experiment) for make in question.requirements]

    def level(information: Array) -> float:
        return 2.0 * float(np.log(max(one.worst(information).ratio for one in requirements)))

    gained = level(np.eye(experiment.size) + before) - level(np.eye(experiment.size) + after)
    # The determinant of all k parameters gains the k-th part of the gain of one direction.
    grown = float(np.log(np.trace(after) / np.trace(before)))
    basis, reached = question.basis, question.basis.free
    if not reached and not basis.has_density:
        away = np.abs(basis.lines(basis.even)[0][:, None] - np.array(places))
        reached = bool(np.any(away <= _ON * experiment.band[1]))
    return places, gained > 0.5 * grown / experiment.size, reached


def priced_powers(question: Question) -> list[PricedPower] | None:
    """Return the powers that are paid for, or have an upper limit, each with its weight.

    None if the density of the excitation itself is limited.
    """
    if question.goal == "cost":
        return weights_of(question.cost)
    if any(density.upper for density in question.densities):
        return None
    return [(limit.kind, limit.channel, 1.0 / limit.bound) for limit in question.limits if limit.upper]


def price_density(experiment: Experiment, priced: list[PricedPower], w: Array) -> NDArray:
    """Return the price (n, r, r) of a unit of excitation at frequencies (n,)."""
    parts = [
        weight * matrices(experiment.power_density(kind, w, channel)) for kind, channel, weight in priced
    ]
    return np.asarray(np.sum(parts, axis=0))


def _gain(experiment: Experiment, priced: list[PricedPower], place: float) -> tuple[Array, Array] | None:
    """Return the information (k, k) at unit price near a frequency and nearer; None if it does not grow."""
    hi = experiment.band[1]
    distance = np.abs(experiment.singularities - place)
    scale = float(np.min(distance[distance > _ON * hi], initial=0.1 * hi))
    w = place + scale * _DISTANCES * (1.0 if place + scale * _DISTANCES[0] <= hi else -1.0)
    values, vectors = np.linalg.eigh(price_density(experiment, priced, w))
    roots = vectors / np.sqrt(np.maximum(values, np.finfo(float).tiny))[:, None, :]
    rows = np.einsum("nkpr,nrs->nkps", experiment.excitation_gradient(w), roots)
    flat = rows.reshape(*rows.shape[:2], -1)
    information = np.asarray((flat @ flat.conj().swapaxes(1, 2)).real)
    sizes = np.trace(information, axis1=1, axis2=2)
    if not sizes[-1] > _GROWS * sizes[-2]:
        return None
    return information[-1 - _EARLIER], information[-1]
