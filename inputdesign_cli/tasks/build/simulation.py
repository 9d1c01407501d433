"""Spec -> how its experiment is tried on the true system."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.monte_carlo.excitations import Excitation, InPhase, Multisine
from inputdesign_cli.signal.density_lines import density_lines
from inputdesign_cli.specification import Simulation as SimulationSection
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.spectrum import GivenMultisine, GivenSignal, GivenSpectrum
from inputdesign_cli.spectrum import TabulatedChannels
from inputdesign_cli.tasks.build.channel_given import given_sinusoids, read_channel_excitation
from inputdesign_cli.tasks.build.channel_requirements import build_entry_errors, unstated_errors
from inputdesign_cli.tasks.build.channel_task import channel_cost, with_prior
from inputdesign_cli.tasks.build.channels import channel_experiment
from inputdesign_cli.tasks.build.header import build_units
from inputdesign_cli.tasks.build.model_error import model_error_alpha
from inputdesign_cli.tasks.build.true_system import build_true_system
from inputdesign_cli.tasks.channel_record import channel_phases
from inputdesign_cli.tasks.simulation import FlatInputs, Simulation


def build_simulation(spec: Spec) -> Simulation:
    """What `simulate` needs besides the design or the given excitation.

    Raises:
        SpecError, DataError: see the builders of the parts; a loop that is unstable with the true plant.
    """
    study, units = spec.simulation or SimulationSection(), build_units(spec)
    nominal = with_prior(spec, channel_experiment(spec))
    return Simulation(
        units=units,
        nominal=nominal,
        truth=build_true_system(spec),
        runs=study.runs,
        seed=study.seed,
        renewed=study.excitation == "new",
        given=lambda samples: _given(spec, nominal, samples),
        compare=study.compare,
        flat=FlatInputs(
            inputs=nominal.inputs,
            band=nominal.band,
            everywhere=units.sampled and nominal.band == (0.0, np.pi),
            step=units.step,
            phases=channel_phases(spec),
        ),
        cost=channel_cost(spec),
        errors=build_entry_errors(spec, nominal),
        entries=unstated_errors(spec, nominal),
        alpha=model_error_alpha(spec, nominal),
    )


def _given(spec: Spec, experiment: ChannelExperiment, samples: int) -> Excitation | None:
    """What realises a given spectrum anew; None where there is none, or it is a record."""
    spectrum, phases, step = spec.spectrum, channel_phases(spec), build_units(spec).step
    if not isinstance(spectrum, GivenSpectrum) or isinstance(spectrum.given, GivenSignal):
        return None
    if isinstance(spectrum.given, GivenMultisine):
        frequencies, amplitudes = given_sinusoids(spec, spectrum.given)
        return InPhase("design", frequencies * step, amplitudes, step)
    excitation = read_channel_excitation(spec, experiment)
    assert isinstance(excitation.basis, TabulatedChannels)
    powers = np.array(excitation.power["excitation"])
    lines = density_lines(excitation.basis, powers, samples, step, phases)
    return None if lines is None else Multisine("design", lines, phases, step)
