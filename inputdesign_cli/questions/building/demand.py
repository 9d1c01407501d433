"""Refuse designs that take too much memory or time, or whose information or effects have no bound or trace.

The sizes of single keys stand in `specification.models.sizes`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.design.convex.demands import Question
from inputdesign_cli.design.convex.limits import weights_of
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.plant import Model, graded_grid, local_maxima
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.common.infeasible import Reach
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models import spectrum
from inputdesign_cli.specification.models.sizes import most
from inputdesign_cli.spectrum import Basis, matrices

_MOST_BYTES = 4 * 2**30
_NODES = 2000  # of an integral, where poles are well damped
_COPIES = 4  # of a record's gradient while its information matrix is formed
# A round takes _STEPS steps of the solver. Each factors the matrices of _CUTS cuts, and sums the products of
# all pairs of entries of the information matrix for _UNKNOWNS unknowns.
_CUTS, _STEPS, _ROUNDS, _UNKNOWNS = 50, 15, 15, 250
_CRITERION, _FACTORINGS = 4, 60
_PER_SECOND = 1e10  # multiplications
_PROBES, _TRACE = 40, 1e-12
_GENEROUS = 10  # hard plants take this many times as long as the first rounds


def check_model(spec: Spec, model: Model) -> None:
    """Refuse models whose gradients do not fit into memory. It raises `SpecError` (`too-large`)."""
    channels = model.outputs * model.inputs
    room = _MOST_BYTES // (16 * _NODES * channels)
    what = f"a model of {len(model.names)} parameters and {channels} entries"
    _check_fits(spec, "plant", what, len(model.names), room, "parameters")


def _check_fits(spec: Spec, key: str, what: str, size: int, room: int, things: str) -> None:
    if size > room:
        message = f"{what} takes more than {_MOST_BYTES / 2**30:.0f} GiB of memory"
        hint = f"at most {room} {things} fit: lower the orders"
        raise spec.complain("too-large", message, hint=hint, key=key)


def check_effects(spec: Spec, experiment: Experiment) -> None:
    """Refuse a parameter that changes G by no more than rounding (`SpecError`, `without-effect`)."""
    model, (lo, hi) = experiment.model, experiment.band
    w = np.union1d(np.linspace(lo, hi, _PROBES + 1)[1:-1], np.geomspace(max(lo, 1e-4 * hi), hi, _PROBES)[:-1])
    G, slope = np.abs(model.plant_at(w)), np.abs(model.plant_gradient(w))
    moved = slope * np.abs(model.theta)[:, None, None]
    small = np.all((moved < _TRACE * G[:, None]) | (slope == 0.0), axis=(0, 2, 3)) & (model.theta != 0.0)
    silent = ~np.any(slope, axis=(0, 2, 3)) & ~np.any(model.noise_gradient(w), axis=(0, 2, 3))
    lost = model.in_plant & (silent | small)
    if not np.any(lost):
        return
    names = ", ".join(name for name, listed in zip(model.names, lost, strict=True) if listed)
    still = np.any(model.in_plant & silent)
    what = "a small change of it does not change G" if still else "G hardly changes with all of its value"
    other = "choose nominal values at which G depends on it" if still else "sample faster (sample_time)"
    message = f"{names}: {what} at any frequency of the experiment, so that no data determine it"
    hint = f"{other}, or write plant.known: [{names}]"
    raise spec.complain("without-effect", message, hint=hint, key="plant")


def check_design(spec: Spec, experiment: Experiment, basis: Basis) -> None:
    """Refuse convex designs that do not fit into memory, or whose first rounds exceed the time limit.

    A program has a matrix inequality for each frequency that binds. Raises `SpecError`: `too-large`.
    """
    size, accuracy = experiment.size, spec.accuracy
    known = f"a spectrum of {basis.size} unknowns for a model of {size} parameters"
    _check_fits(spec, "spectrum", known, basis.size, _MOST_BYTES // (8 * size**2), "unknowns")
    inequalities = len(accuracy.standard_deviation or ()) + (_CRITERION if accuracy.criterion else 0)
    if accuracy.error is not None or accuracy.weighted_variance is not None:
        inequalities += _CUTS

    def seconds(k: int) -> float:
        entries = k * (k + 1) / 2
        step = inequalities * (_FACTORINGS * k**3 + entries**2) + entries**2 * _UNKNOWNS
        return step * _STEPS * _ROUNDS / _PER_SECOND

    limit, takes = spec.solver.time_limit, seconds(size)
    if takes > max(limit, 1.0):  # anything below a second is tried
        fits = max(k for k in range(size) if seconds(k) <= max(limit, 1.0))
        need = f"a design for a model of {size} parameters would take {takes:.0f} seconds or more"
        longer = f"solver.time_limit: {float(f'{_GENEROUS * takes:.2g}'):.0f} or more"
        hint = f"{fits} parameters fit: lower the orders, or write {longer}"
        raise spec.complain("too-large", f"{need}; solver.time_limit is {limit:g}", hint=hint, key="plant")


def check_record(spec: Spec, parameters: int) -> None:
    """Refuse records that are too long, if a signal is asked for; raises `SpecError` (`too-large`)."""
    room = longest_record(parameters, spec.plant.outputs)
    samples = spec.signal_samples
    stated = "signal" in spec.model_fields_set and spec.goal != "shortest_experiment"
    if samples > room and (stated or spec.plant.kind == "regression"):
        key = "signal.samples" if spec.signal.samples else "experiment.samples"
        message = f"the record has {samples} samples, and at most {room} are computed for this model"
        hint = f"write signal.samples: {room} or less; experiment.samples may be as large as you like"
        raise spec.complain("too-large", message, hint=hint, key=key)


def longest_record(parameters: int, outputs: int) -> int:
    """Return the most samples of a record whose gradient fits into memory."""
    return min(_MOST_BYTES // (8 * _COPIES * parameters * outputs), most("signal.samples"))


# Poles nearer to zero are poles at zero; poles of gradients are of no higher order.
_AT_ZERO, _HIGHEST = 1e-7, 8
# With this number of points on half the distance to the next pole, the sums are exact to rounding.
_POINTS = 128
_NONE = slice(20, 60)
_ABOVE, _ROUNDING = 30.0, 1e-10
# The share of the band that a hint proposes to leave out.
_MARGIN = 0.01


def on_finite_information(spec: Spec, experiment: Experiment) -> Experiment:
    """Return the experiment with a finite information matrix: its band starts at the lowest line.

    Near a pole at z = 1 outside a loop, gradient and information of any power have no bound. Raises
    `SpecError`: `infinite-information`, `infinite-output`.
    """
    model, loop, (lo, hi) = experiment.model, experiment.loop, experiment.band
    noise = model.noise_gradient if loop is None else loop.noise_gradient
    if not model.continuous and (unbounded := _growing(experiment, noise)):
        first = unbounded[0]
        part, other = "noise", "say noise: {drift: true}, and leave that root out of D"
        if model.in_plant[model.names.index(first)]:
            part, other = "plant", "in q^-1 let it be a root of A, through which the noise passes, too"
        hint = f"list it in {part}.known: [{first}], or {other}"
        if any(spec.noise.drifts) and not all(spec.noise.drifts):
            hint = "let every output drift (noise: {drift: true}): the inputs wander with each drift"
        through = "integrated" if loop is None else "integrated and fed back"
        message = f"the noise alone, {through}, gives infinite information about {', '.join(unbounded)}"
        raise spec.complain("infinite-information", message, hint=hint, key=part)
    grown = [] if lo > 0.0 else _growing(experiment, experiment.excitation_gradient)
    # Outputs have no bound at frequency zero, while drifting noise keeps the information finite.
    wanders = lo == 0.0 and loop is None and not model.continuous
    if not grown and not (wanders and np.any(_grows(experiment, lambda w: model.plant_at(w)[:, None]))):
        return experiment
    lowest = _lowest_line(spec, hi)
    if lowest is not None and lowest > 0.0:
        return replace(experiment, band=(0.5 * lowest, hi))
    unit = build_units(spec).frequency
    integrates = "" if loop is None else " that integrates"
    # A FIR spectrum has power everywhere.
    fir = spec.plant.sampled and (spec.spectrum is None or spec.spectrum.type == "fir")
    other = "spectrum: {type: free} with " if fir else ""
    code, what = "infinite-output", "makes the outputs drift without bound"
    if grown:
        code, what = "infinite-information", f"gives infinite information about {', '.join(grown)}"
    band = f"limits: {{band: [{_MARGIN * hi / unit:.3g}, {hi / unit:.6g}]}}"
    avoid = f"leave it out, spectrum: {{type: multisine, lines: 100}} or {other}{band}"
    hint = f"{avoid}; or make the experiment in closed loop, under a controller{integrates}"
    key = "spectrum" if spec.spectrum is not None else "plant"
    message = f"the plant integrates: power at frequency zero {what}"
    raise spec.complain(code, message, hint=hint, key=key)


def _growing(experiment: Experiment, gradient: Callable[[ArrayLike], ComplexArray]) -> list[str]:
    """Return the names of the parameters whose gradient (n, k, ..) has a pole at frequency zero."""
    grows = _grows(experiment, gradient)
    return [name for name, one in zip(experiment.model.names, grows, strict=True) if one]


def _grows(experiment: Experiment, response: Callable[[ArrayLike], ComplexArray]) -> NDArray[np.bool_]:
    """Return whether each part (k,) of a response (n, k, ..) has a pole at frequency zero.

    Its principal part follows from Cauchy's integrals over a circle that encloses no other pole. Values on
    the axis would show a weak pole only from very near.
    """
    source = experiment.model if experiment.loop is None else experiment.loop
    distance = np.abs(source.singularities)
    nearest = float(np.min(distance[distance > _AT_ZERO], initial=experiment.band[1]))
    # Far from the axis the sizes of late signals differ too much.
    radius = min(0.5 * nearest, 1.0 / max(source.memory, 1.0))
    turn = np.exp(2j * np.pi * (np.arange(_POINTS) + 0.5) / _POINTS)
    around = response(radius * turn)
    powers: Array = np.abs(np.fft.ifft(around, axis=0)).max(axis=(2, 3))
    # No pole has an order this high: these coefficients are rounding, as large as in all others.
    rounding = np.maximum(_ABOVE * powers[_NONE].max(axis=0), _ROUNDING * np.abs(around).max(axis=(0, 2, 3)))
    return np.asarray(powers[1 : _HIGHEST + 1].max(axis=0) > rounding)


def _lowest_line(spec: Spec, hi: float) -> float | None:
    """Return the lowest frequency of a line spectrum in the experiment's unit; None for other spectra."""
    unit = build_units(spec).frequency
    match spec.spectrum:
        case spectrum.MultisineSpectrum(frequencies=given) if given:
            return given[0] * unit
        case spectrum.MultisineSpectrum(lines=lines):
            return hi / ((lines or 1) + (not spec.plant.sampled))
        case spectrum.GivenSpectrum(given=spectrum.GivenMultisine(frequencies=given)):
            return given[0] * unit
        case spectrum.GivenSpectrum(given=spectrum.GivenSignal()):
            return hi / spec.experiment.samples
    return None


PricedPower = tuple[PowerKind, int | None, float]

# Where the price of directions is looked at, in shares of the band: away from what controllers favour.
_PLACES = np.array([0.137, 0.293, 0.461, 0.618, 0.787, 0.911])
_SINGULAR = 1e-12
# A price this many decades below the typical one may be a zero between the points of a grid.
_ZERO = 6.0
# Distances to a free frequency at which the information is looked at, in units of the next pole's distance.
_DISTANCES = np.geomspace(1e-2, 1e-4, 9)
# The information at unit price grows at least with the inverse square of the distance, from step to step.
_GROWS, _EARLIER = 2.5, 4
# Lines and poles nearer to a frequency than this share of the band are on it.
_ON = 1e-6
# The share of the band that is left out at a free end for the bound.
_OFF = 1e-6
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
    """Return the validity of a bound over every spectrum.

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
    off, avoid = 2.0 * _OFF * hi, "leave it out by limits.band"
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
    below, above = (_OFF * hi * any(abs(w - end) < off for w in frequencies) for end in (lo, hi))
    note = f"{free}: {approached}, which no record can follow; add {others}, or {avoid}"
    return Reach(attained=False, band=(lo + below, hi - above), note=note if family.free else None)


def free_information(question: Question) -> tuple[tuple[float, ...], bool, bool] | None:
    """Return the frequencies of the band at which the information per unit of price has no bound.

    Then whether power ever nearer to them meets all requirements at no price, or the criterion has no bound
    (otherwise the best value is only approached there), and whether spectra of the family can have power
    there. None without one, and for robust designs: the poles of other plants lie elsewhere.
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
    """Return the information (k, k) at unit price near a frequency, then nearer; None if it does not grow."""
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
