"""Spec -> the band of the excitation of a plant that integrates, so that the information is finite."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from inputdesign_cli.arrays import Array, ComplexArray
from inputdesign_cli.information import Experiment
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.spectrum import (
    GivenMultisine,
    GivenSignal,
    GivenSpectrum,
    MultisineSpectrum,
)

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

    Near a pole at z = 1 that is not in a loop, the gradient of the prediction has no bound, and neither has
    the information of any power there. Raises `SpecError`: `infinite-information`.
    """
    source = experiment.model if experiment.loop is None else experiment.loop
    if not experiment.model.continuous:
        unbounded = _growing(experiment, source.noise_gradient)
        if unbounded:
            first = unbounded.split(", ")[0]
            part, other = "noise", "say noise: {drift: true}, and leave that root out of D"
            if experiment.model.in_plant[experiment.model.names.index(first)]:
                part, other = "plant", "in q^-1 let it be a root of A, through which the noise passes, too"
            hint = f"list it in {part}.known: [{first}], or {other}"
            if any(spec.noise.drifts) and not all(spec.noise.drifts):
                hint = "let every output drift (noise: {drift: true}): the inputs wander with each drift"
            through = "integrated" if experiment.loop is None else "integrated and fed back"
            message = f"the noise alone, {through}, gives infinite information about {unbounded}"
            raise spec.complain("infinite-information", message, hint=hint, key=part)
    lo, hi = experiment.band
    grown = "" if lo > 0.0 else _growing(experiment, experiment.excitation_gradient)
    if not grown and not (lo == 0.0 and _wanders(experiment)):
        return experiment
    lowest = _lowest_line(spec, hi)
    if lowest is not None and lowest > 0.0:
        return replace(experiment, band=(0.5 * lowest, hi))
    unit = build_units(spec).frequency
    integrates = "" if experiment.loop is None else " that integrates"
    # A FIR spectrum has power everywhere.
    fir = spec.plant.sampled and (spec.spectrum is None or spec.spectrum.type == "fir")
    other = "spectrum: {type: free} with " if fir else ""
    what = f"gives infinite information about {grown}" if grown else "makes the outputs drift without bound"
    band = f"limits: {{band: [{_MARGIN * hi / unit:.3g}, {hi / unit:.6g}]}}"
    raise spec.complain(
        "infinite-information" if grown else "infinite-output",
        f"the plant integrates: power at frequency zero {what}",
        hint=f"leave it out, spectrum: {{type: multisine, lines: 100}} or {other}{band}; or make the "
        f"experiment in closed loop, under a controller{integrates}",
        key="spectrum" if spec.spectrum is not None else "plant",
    )


def _wanders(experiment: Experiment) -> bool:
    """Whether outputs have no bound at frequency zero, while drifting noise keeps the information finite."""
    model = experiment.model
    if experiment.loop is not None or model.continuous:
        return False
    return bool(np.any(_grows(experiment, lambda w: model.plant_at(w)[:, None])))


def _growing(experiment: Experiment, gradient: Callable[[ArrayLike], ComplexArray]) -> str:
    """The names of the parameters whose gradient (n, k, ..) has a pole at frequency zero."""
    grows = _grows(experiment, gradient)
    return ", ".join(name for name, one in zip(experiment.model.names, grows, strict=True) if one)


def _grows(experiment: Experiment, response: Callable[[ArrayLike], ComplexArray]) -> NDArray[np.bool_]:
    """Which parts (k,) of a response (n, k, ..) have a pole at frequency zero.

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
    """The lowest frequency of an excitation of lines, in the unit of the experiment; None for others."""
    unit = build_units(spec).frequency
    match spec.spectrum:
        case MultisineSpectrum(frequencies=given) if given:
            return given[0] * unit
        case MultisineSpectrum(lines=lines):
            return hi / ((lines or 1) + (not spec.plant.sampled))
        case GivenSpectrum(given=GivenMultisine(frequencies=given)):
            return given[0] * unit
        case GivenSpectrum(given=GivenSignal()):
            return hi / spec.experiment.samples
    return None
