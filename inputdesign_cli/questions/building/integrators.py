"""Spec -> where the excitation of a plant that integrates may have power, so that what it tells is finite."""

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

# Poles so near to zero are poles there; those of gradients are of no higher order.
_AT_ZERO, _HIGHEST = 1e-7, 8
# On half the distance to the next pole so many points leave the sums exact to rounding.
_POINTS = 128
_NONE = slice(20, 60)
_ABOVE, _ROUNDING = 30.0, 1e-10
# Of the band, what is left out where nothing else says it.
_MARGIN = 0.01


def on_finite_information(spec: Spec, experiment: Experiment) -> Experiment:
    """The experiment, its band without frequency zero where only lines beside it are excited.

    Next to a pole at z = 1 that is not in a loop the gradient of the prediction grows without end, and so
    does what any power there tells.

    Raises:
        SpecError: `infinite-information`.
    """
    source = experiment.model if experiment.loop is None else experiment.loop
    if not experiment.model.continuous:
        endless = _growing(experiment, source.noise_gradient)
        if endless:
            fed_back = "" if experiment.loop is None else " and fed back"
            first = endless.split(", ")[0]
            part = "plant" if _moves_plant(experiment, first) else "noise"
            another = (
                "in q^-1 it may be free as a root of A, where the noise passes through it as well"
                if part == "plant"
                else "or say noise: {drift: true}, and leave that root out of D"
            )
            hint = f"list it in {part}.known: [{first}]; {another}"
            if any(spec.noise.drifts) and not all(spec.noise.drifts):
                hint = (
                    "the inputs wander with the drift that they counteract: let every output drift (noise: "
                    "{drift: true})"
                )
            raise spec.complain(
                "infinite-information",
                f"the noise alone, which is integrated{fed_back}, tells without end of {endless}",
                hint=hint,
                key=part,
            )
    lo, hi = experiment.band
    grown = "" if lo > 0.0 else _growing(experiment, experiment.excitation_gradient)
    if not grown and not (lo == 0.0 and _wanders(experiment)):
        return experiment
    lowest = _lowest_line(spec, hi)
    if lowest is not None and lowest > 0.0:
        return replace(experiment, band=(0.5 * lowest, hi))
    unit = build_units(spec).frequency
    loop = ", under a controller" if experiment.loop is None else ", under a controller that integrates"
    # A FIR spectrum has power everywhere.
    fir = spec.plant.sampled and (spec.spectrum is None or spec.spectrum.type == "fir")
    other = "spectrum: {type: free} with " if fir else ""
    raise spec.complain(
        "infinite-information" if grown else "infinite-output",
        f"the plant integrates: power at frequency zero tells without end of {grown}, so that no design with "
        "power there has a value"
        if grown
        else "the plant integrates: power at frequency zero makes the outputs wander without end, so that "
        "they have no power",
        hint=f"leave it out, spectrum: {{type: multisine, lines: 100}} or {other}limits: {{band: "
        f"[{_MARGIN * hi / unit:.3g}, {hi / unit:.6g}]}}; or make the experiment in closed loop{loop}",
        key="spectrum" if spec.spectrum is not None else "plant",
    )


def _wanders(experiment: Experiment) -> bool:
    """Whether outputs grow without end towards zero, where what they tell may not: where noise drifts."""
    model = experiment.model
    if experiment.loop is not None or model.continuous:
        return False
    return bool(np.any(_grows(experiment, lambda w: model.plant_at(w)[:, None])))


def _moves_plant(experiment: Experiment, name: str) -> bool:
    """Whether G depends on a parameter: those of the noise alone leave it as it is."""
    model = experiment.model
    gradient = model.plant_gradient([0.3 * experiment.band[1]])
    return bool(np.any(gradient[:, model.names.index(name)]))


def _growing(experiment: Experiment, gradient: Callable[[ArrayLike], ComplexArray]) -> str:
    """The names of the parameters of which a gradient (n, k, ..) grows without end towards zero."""
    grows = _grows(experiment, gradient)
    return ", ".join(name for name, one in zip(experiment.model.names, grows, strict=True) if one)


def _grows(experiment: Experiment, response: Callable[[ArrayLike], ComplexArray]) -> NDArray[np.bool_]:
    """(k,): which parts of a response (n, k, ..) grow without end towards zero.

    Its principal part there tells, however small: Cauchy's integrals over a circle in the plane of
    frequencies that holds no other pole. On the axis a weak pole would be seen from very near only.
    """
    source = experiment.model if experiment.loop is None else experiment.loop
    distance = np.abs(source.singularities)
    nearest = float(np.min(distance[distance > _AT_ZERO], initial=experiment.band[1]))
    # Far off the axis late signals differ too much in size.
    radius = min(0.5 * nearest, 1.0 / max(source.memory, 1.0))
    turn = np.exp(2j * np.pi * (np.arange(_POINTS) + 0.5) / _POINTS)
    around = response(radius * turn)
    powers: Array = np.abs(np.fft.ifft(around, axis=0)).max(axis=(2, 3))
    # Poles of such high order there are none: what stands there is rounding, as in all others.
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
