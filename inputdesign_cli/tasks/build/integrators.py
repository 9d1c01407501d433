"""Spec -> where the excitation of a plant that integrates may have power, so that what it tells is finite."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.information import Experiment
from inputdesign_cli.plant.polynomial import Array, ComplexArray
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.spectrum import (
    GivenMultisine,
    GivenSignal,
    GivenSpectrum,
    MultisineSpectrum,
)
from inputdesign_cli.tasks.build.header import build_units

_FAR, _CLOSE = 1e-3, 1e-4
_GROWS = 5.0
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
            known = f"list it in plant.known: [{endless.split(', ')[0]}]"
            hint = (
                f"{known}; in q^-1 it may be free as a root of A, where the noise passes through it as well"
            )
            if any(spec.noise.drifts) and not all(spec.noise.drifts):
                hint = "let the controller integrate where outputs drift, or let every output drift"
            raise spec.complain(
                "infinite-information",
                f"the noise alone, which is integrated and fed back, tells without end of {endless}",
                hint=hint,
                key="plant",
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
    """Whether outputs grow without end towards zero, where what they tell does not: where noise drifts."""
    if experiment.loop is not None or experiment.model.continuous:
        return False
    size = np.abs(experiment.model.plant_at(_beside(experiment))).max(axis=(1, 2))
    return bool(size[1] > _GROWS * size[0])


def _beside(experiment: Experiment) -> Array:
    """Two frequencies near zero."""
    source = experiment.model if experiment.loop is None else experiment.loop
    distance = np.abs(source.singularities)
    scale = float(np.min(distance[distance > 1e-7], initial=experiment.band[1]))
    return scale * np.array([_FAR, _CLOSE])


def _growing(experiment: Experiment, gradient: Callable[[ArrayLike], ComplexArray]) -> str:
    """The names of the parameters of which a gradient (n, k, ..) grows without end towards zero."""
    size: Array = np.abs(gradient(_beside(experiment))).max(axis=(2, 3))
    grows = size[1] > _GROWS * size[0]
    return ", ".join(name for name, one in zip(experiment.model.names, grows, strict=True) if one)


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
