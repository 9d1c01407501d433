"""Refuse designs that take too much memory or time, or have unlimited information or no effects.

The sizes of single keys stand in `specification.models.sizes`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import Model, noise_gradients
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models import spectrum
from inputdesign_cli.specification.models.sizes import most
from inputdesign_cli.spectrum import Basis

_MOST_BYTES = 4 * 2**30
_NODES = 2000  # nodes of an integral if poles are well damped
_COPIES = 4  # copies of a record's gradient while its information matrix is formed
# A round takes _STEPS steps of the solver. Each factors the matrices of _CUTS cuts, and sums the products of
# all pairs of entries of the information matrix for _UNKNOWNS unknowns.
_CUTS, _STEPS, _ROUNDS, _UNKNOWNS = 50, 15, 15, 250
_CRITERION, _FACTORINGS = 4, 60  # inequalities of a criterion, and k^3 operations of each inequality
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
    silent = ~np.any(slope, axis=(0, 2, 3)) & ~np.any(noise_gradients([model], w), axis=(0, 1, 3, 4))
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


# Poles nearer to zero than this are at zero; the highest order of a pole of a gradient.
_AT_ZERO, _HIGHEST = 1e-7, 8
# Points on a circle at half the distance to the next pole, with which the sums are exact to rounding.
_POINTS = 128
_TAIL = slice(20, 60)
_ABOVE, _ROUNDING = 30.0, 1e-10
# The share of the band that a hint proposes to leave out.
_MARGIN = 0.01


def on_finite_information(spec: Spec, experiment: Experiment) -> Experiment:
    """Return the experiment with finite information: if need be, its band starts below the lowest line.

    Near a pole at z = 1 outside a loop, gradient and information of any power have no bound. Raises
    `SpecError`: `infinite-information`, `infinite-output`.
    """
    model, loop, (lo, hi) = experiment.model, experiment.loop, experiment.band
    if not model.continuous and (unbounded := _growing(experiment, experiment.disturbance_gradient)):
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
    # On a larger circle, terms with dead times differ too much in size.
    radius = min(0.5 * nearest, 1.0 / max(source.memory, 1.0))
    turn = np.exp(2j * np.pi * (np.arange(_POINTS) + 0.5) / _POINTS)
    around = response(radius * turn)
    powers: Array = np.abs(np.fft.ifft(around, axis=0)).max(axis=(2, 3))
    # No pole has an order this high: these coefficients are rounding errors, as large as in the others.
    rounding = np.maximum(_ABOVE * powers[_TAIL].max(axis=0), _ROUNDING * np.abs(around).max(axis=(0, 2, 3)))
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
