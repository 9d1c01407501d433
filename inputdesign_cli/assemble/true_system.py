"""Spec -> the true system of a simulation, in the loop and for the length of the nominal experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.assemble.channels import build_channel_model
from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import ChannelExperiment, Experiment
from inputdesign_cli.plant import ChannelLoop, Loop
from inputdesign_cli.spec import Spec
from inputdesign_cli.spec.experiment import Noise
from inputdesign_cli.spec.plant import PolynomialPlant


def true_experiment(spec: Spec, nominal: Experiment, result: Mapping[str, Any]) -> Experiment:
    """`nominal` with the plant and the noise of `simulation`, where they are given.

    Args:
        result: of the design; noise of a relative size refers to its output power.

    Raises:
        SpecError: another kind of plant, or a loop that is unstable with the true plant.
    """
    study = spec.simulation
    if study is None or (study.plant is None and study.noise is None):
        return nominal
    model = nominal.model
    if study.plant is not None:
        plant = study.plant
        if not isinstance(plant, PolynomialPlant) or plant.inputs > 1 or plant.outputs > 1:
            raise spec.complain(
                "not-supported",
                "this version simulates polynomial plants with one input and one output only",
                hint="give simulation.plant as polynomials A, B, F in q^-1",
                key="simulation.plant",
            )
        model = replace(
            model,
            A=np.array(plant.A_per_output[0]),
            B=np.array(plant.B_matrix[0][0]),
            F=np.array(plant.F_matrix[0][0]),
        )
    if study.noise is not None:
        model = replace(
            model,
            C=np.array(study.noise.C_per_output(1)[0]),
            D=np.array(study.noise.D_per_output(1)[0]),
            variance=_variance(spec, result),
        )
    loop = Loop(model, nominal.loop.controller)
    _check_stability(spec, loop)
    return replace(nominal, loop=loop, factor=None)


def true_channel_experiment(
    spec: Spec, nominal: ChannelExperiment, result: Mapping[str, Any]
) -> ChannelExperiment:
    """The same with several channels; noise of a relative size refers to the weakest output.

    Raises:
        SpecError: `not-supported` for a true plant in s of a nominal one in q^-1, or the other way round;
            a loop that is unstable with the true plant.
    """
    study = spec.simulation
    if study is None or (study.plant is None and study.noise is None):
        return nominal
    changes: dict[str, Any] = {}
    if study.plant is not None:
        if type(study.plant) is not type(spec.plant):
            raise spec.complain(
                "not-supported",
                "the true system and the plant are of different kinds: one in s, one in q^-1",
                hint="describe the true system as the plant is described",
                key="simulation.plant",
            )
        changes["plant"] = study.plant
    if study.noise is not None:
        noise = study.noise
        variance: Any = noise.variance
        if noise.relative_std is not None:
            variance = noise.relative_std**2 * float(np.min(result["power"]["output"]))
        changes["noise"] = Noise.model_construct(C=noise.C, D=noise.D, variance=variance)
    model, loop = build_channel_model(spec.model_copy(update=changes)), nominal.loop
    if loop is not None:
        loop = replace(loop, model=model)
        _check_stability(spec, loop)
    return replace(nominal, model=model, loop=loop, factor=None)


def _check_stability(spec: Spec, loop: Loop | ChannelLoop) -> None:
    try:
        loop.check_stability()
    except SpecError as error:
        found = error.complaints[0]
        raise spec.complain(
            found.code,
            f"with the true plant {found.message}",
            hint="give a true plant that the controller stabilises as well",
            key="simulation.plant",
        ) from error


def _variance(spec: Spec, result: Mapping[str, Any]) -> float:
    assert spec.simulation is not None
    assert spec.simulation.noise is not None
    noise = spec.simulation.noise
    if noise.variance is not None:
        return float(np.atleast_2d(np.asarray(noise.variance, dtype=float))[0, 0])
    assert noise.relative_std is not None
    return float(noise.relative_std**2 * np.sum(result["power"]["output"]))
