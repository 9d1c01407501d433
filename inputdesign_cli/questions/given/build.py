"""Spec -> the analysis of an excitation that is given: its spectrum, or its samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from inputdesign_cli.arrays import Array
from inputdesign_cli.errors import bad_spec, refuse
from inputdesign_cli.information import Experiment
from inputdesign_cli.monte_carlo.excitations import InPhase
from inputdesign_cli.questions.building.header import build_header, build_units
from inputdesign_cli.questions.building.model_error import build_confidence
from inputdesign_cli.questions.building.requirements import build_criterion, build_requirements
from inputdesign_cli.questions.building.signal_settings import build_record_request, check_signal
from inputdesign_cli.questions.building.spectra import build_power_limits, read_given_spectrum
from inputdesign_cli.questions.building.system import (
    build_cost,
    build_experiment,
    read_excitation_record,
    record_step,
)
from inputdesign_cli.questions.building.uncertainty import build_foresight, build_plants, build_simulation
from inputdesign_cli.questions.building.unhandled import refuse_unhandled
from inputdesign_cli.questions.common.robust import Plants
from inputdesign_cli.questions.given.solve import GivenExcitation, GivenTask
from inputdesign_cli.questions.least_cost.build import check_pairs, check_supported
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models import spectrum as stated_spectrum
from inputdesign_cli.spectrum import LinesBasis, TabulatedSpectrum

_OF_DESIGNS = ("limits.spectrum", "limits.moves", "objective", "campaign")
# Keys of `signal` that apply only to a record that idesign makes.
_MADE = ("type", "periods", "hold", "lines", "amplitudes", "ramp", "bits", "quantisation", "phases")


def build_given(spec: Spec) -> GivenTask:
    """Return the task of a given excitation; `SpecError` (`nothing-given`) where there is none."""
    if spec.spectrum is None or spec.spectrum.type != "given":
        message = "there is no excitation to analyse"
        hint = "give one, spectrum: {given: {type: white, power: 1}}, or design one: idesign solve SPEC"
        raise bad_spec("nothing-given", message, hint=hint, key="spectrum")
    check_supported(spec, "the analysis of a given excitation")
    refuse_unhandled(spec, "the analysis of a given excitation", dict.fromkeys(_OF_DESIGNS, "remove it"))
    # Settings of the signal mean nothing for a record, nor for sinusoids in phase over several inputs.
    kind, settings = spec.spectrum.given.type, spec.signal
    harmless = {"type": settings.type == "multisine", "phases": settings.phases == "random"}
    fixed = kind == "signal" or (kind == "multisine" and spec.plant.inputs > 1)
    for name in settings.stated(*_MADE) if fixed else ():
        if not harmless.get(name):
            what = "apply it to a given excitation whose samples are settled"
            raise refuse(f"signal.{name}", what, "remove it")
    check_signal(spec)
    experiment = build_experiment(spec)
    requirements = build_requirements(spec, experiment)
    experiment.whitened(1.0)  # raises an error that names unidentifiable parameters
    check_pairs(spec, experiment.model.names)
    return GivenTask(
        experiment=experiment,
        excitation=_excitation(spec, spec.spectrum, experiment),
        requirements=requirements,
        criterion=build_criterion(spec, experiment),
        cost=build_cost(spec),
        confidence=build_confidence(spec, experiment),
        limits=build_power_limits(spec),
        plants=_build_plants(spec, experiment),
        header=build_header(spec),
        record=build_record_request(spec, experiment.size),
        ellipses=spec.report.ellipses,
        simulation=build_simulation(spec, experiment),
        foresight=build_foresight(spec, experiment),
    )


def _build_plants(spec: Spec, experiment: Experiment) -> Plants | None:
    """Return the plants of `uncertainty`; raise `not-supported` for keys of the nominal plant alone."""
    stated, limits = spec.uncertainty, spec.limits
    if stated is None:
        return None
    amplitude = limits.amplitude
    depends = spec.closed_loop and limits.bounds_power
    if depends or limits.output_power is not None or (amplitude is not None and amplitude.output is not None):
        key, what = "limits", "look at limits that depend on the plant at several plants"
    elif stated.cost not in (None, "nominal"):
        key, what = "uncertainty.cost", "weigh what a given excitation costs at several plants"
    elif spec.accuracy.criterion is not None or not spec.accuracy.requirements:
        key, what = "uncertainty", "look at several plants without a requirement, or with a criterion"
    else:
        plants = build_plants(spec, experiment, None)
        return None if plants is None else replace(plants, paid="nominal")
    hint = "remove it, or uncertainty; a design holds for all plants: remove spectrum.given"
    raise refuse(key, what, hint)


def _excitation(spec: Spec, stated: stated_spectrum.GivenSpectrum, experiment: Experiment) -> GivenExcitation:
    """Return the excitation that stands under `spectrum.given`.

    A power of white excitation is spread evenly over the channels unless there is one for each. The
    sinusoids of one frequency are in phase over the channels; a negative amplitude is in counterphase.
    """
    r = experiment.inputs
    match stated.given:
        case stated_spectrum.GivenSignal() as given:
            samples = read_excitation_record(spec, given.signal, "spectrum.given.signal")
            return GivenExcitation("signal", experiment, samples=samples, step=record_step(spec))
        case stated_spectrum.GivenWhite(power=power):
            powers = np.array(power if isinstance(power, tuple) else [power / r] * r, dtype=float)
            white = TabulatedSpectrum.white(powers, experiment.band)
            return GivenExcitation("white", experiment, (white, np.ones(1)))
        case stated_spectrum.GivenMultisine() as given:
            frequencies, amplitudes = _sinusoids(spec, given)
            constant = (frequencies <= 0.0) | (spec.plant.sampled & (frequencies >= np.pi))
            size = np.linalg.norm(amplitudes, axis=1)
            lines = LinesBasis(frequencies, amplitudes / size[:, None] + 0j, frequencies, np.ones(r))
            x = np.where(constant, 1.0, 0.5) * size**2
            w = frequencies * record_step(spec)
            in_phase = None if r == 1 else InPhase("design", w, amplitudes, lines, x)
            return GivenExcitation("multisine", experiment, (lines, x), in_phase)
        case stated_spectrum.GivenTable() as given:
            return GivenExcitation("table", experiment, read_given_spectrum(spec, given.file, r))


def _sinusoids(spec: Spec, given: stated_spectrum.GivenMultisine) -> tuple[Array, Array]:
    """Return frequencies (L,) in the unit of the experiment and amplitudes (L, r) that are not zero."""
    frequencies = np.array(given.frequencies) * build_units(spec).frequency
    if spec.plant.sampled:
        frequencies = np.minimum(frequencies, np.pi)
    amplitudes = np.array(given.rows, dtype=float).T
    there = np.any(amplitudes != 0.0, axis=1)
    if not there.any():
        message = "all amplitudes are zero: nothing is excited"
        hint = "give the sinusoids amplitudes"
        raise bad_spec("not-exciting", message, hint=hint, key="spectrum.given.amplitudes")
    return frequencies[there], amplitudes[there]
