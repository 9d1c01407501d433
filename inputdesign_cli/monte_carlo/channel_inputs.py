"""Spec and design -> the excitations of a study with several channels."""

from __future__ import annotations

import numpy as np

from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.monte_carlo.channel_excitations import (
    ChannelExcitation,
    Drawn,
    Flat,
    InPhase,
    Multisine,
    Recorded,
)
from inputdesign_cli.runs.results import Results
from inputdesign_cli.signal import SignalGenerator, SignalSettings
from inputdesign_cli.signal.settings import Method
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.realisation import Simulation
from inputdesign_cli.specification.models.spectrum import GivenMultisine, GivenSpectrum
from inputdesign_cli.spectrum import TabulatedChannels
from inputdesign_cli.tasks.build.channel_given import (
    given_lines,
    given_sinusoids,
    line_vectors,
    read_channel_excitation,
)
from inputdesign_cli.tasks.build.channel_given import spectral as spectral_excitation
from inputdesign_cli.tasks.build.channels import record_step
from inputdesign_cli.tasks.build.signal_settings import deviations

# Inputs to compare with have a flat spectrum; white noise is Gaussian.
_METHODS: dict[str, Method] = {"white": "filtered_noise", "prbs": "prbs", "binary": "binary"}


def study_excitations(
    spec: Spec,
    study: Simulation,
    experiment: ChannelExperiment,
    outcome: Results,
    drawer: SignalGenerator | None,
) -> list[ChannelExcitation]:
    """The design, what `compare` names at equal power, and white noise of the power that it would need.

    Args:
        experiment: the nominal one.
        drawer: draws other records of the designed spectrum, see `designed_channels`.

    Raises:
        SpecError: `nothing-to-simulate`; `not-supported` for an input to compare with.
    """
    result, step = outcome.result, record_step(spec)
    table = outcome.tables.get("signal")
    if table is None:
        raise spec.complain(
            "nothing-to-simulate",
            "there is no record of the excitation, so that there is no experiment to simulate",
            hint="ask for more accuracy or a longer signal, or give an excitation under spectrum.given",
            key="accuracy",
        )
    design = Recorded("design", deviations(spec, table), step)
    power = float(np.sum(result["power"]["excitation"]))
    renewed = None
    if study.excitation == "new":
        renewed = (
            _redrawn(spec, experiment, design) if drawer is None else Drawn("design", drawer, power, step)
        )
    listed: list[ChannelExcitation] = [renewed or design]
    samples = len(design.record)
    listed += [_flat(spec, experiment, name, name, power, samples) for name in study.compare]
    needed = result.get("baseline", {}).get("white", {}).get("power", {}).get("excitation")
    if needed and result.get("objective", {}).get("kind") == "least_cost" and "white" in study.compare:
        suffices = float(np.sum(needed))
        listed.append(_flat(spec, experiment, "white_that_suffices", "white", suffices, samples))
    return listed


def _redrawn(spec: Spec, experiment: ChannelExperiment, record: Recorded) -> ChannelExcitation | None:
    """What realises a given spectrum anew; None for a given signal."""
    assert isinstance(spec.spectrum, GivenSpectrum)
    given = spec.spectrum.given
    if isinstance(given, GivenMultisine):
        frequencies, amplitudes = given_sinusoids(spec, given)
        return InPhase("design", frequencies * record.step, amplitudes, record.step)
    excitation = read_channel_excitation(spec, experiment)
    found = given_lines(spec, excitation, len(record.record))
    return None if found is None else Multisine("design", found, line_vectors(spec), record.step)


def _flat(
    spec: Spec, experiment: ChannelExperiment, name: str, kind: str, power: float, samples: int
) -> ChannelExcitation:
    """A flat spectrum of this total power, even over the channels and over the band of the excitation.

    Noise and signals of two levels fill all of discrete time; on a band the sinusoids of a flat spectrum do.

    Raises:
        SpecError: `not-supported` for signals of two levels on a band.
    """
    powers = np.full(experiment.inputs, power / experiment.inputs)
    everywhere = spec.plant.sampled and experiment.band == (0.0, np.pi)
    if kind in _METHODS and everywhere:
        return Flat(name, powers, SignalSettings(_METHODS[kind]))
    if kind not in ("white", "multisine"):
        raise spec.complain(
            "not-supported",
            f"a {kind} signal has power at all frequencies of discrete time, the excitation only on a band",
            hint="compare with multisine or white",
            key="simulation.compare",
        )
    basis = TabulatedChannels.white(powers, experiment.band)
    lines = given_lines(spec, spectral_excitation("white", basis, np.ones(1), experiment), samples)
    assert lines is not None
    return Multisine(name, lines, line_vectors(spec), record_step(spec))
