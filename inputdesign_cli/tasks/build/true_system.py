"""Spec -> the true system of a simulation, in the loop and for the length of the nominal experiment."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import ChannelExperiment, Experiment
from inputdesign_cli.plant import Loop, hold_entries
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.experiment import Noise
from inputdesign_cli.specification.models.plant import ContinuousPlant, PolynomialPlant
from inputdesign_cli.tasks.build.channels import build_channel_model, stable_loop


def true_experiment(spec: Spec, nominal: Experiment, result: Mapping[str, Any]) -> Experiment:
    """`nominal` with the plant and the noise of `simulation`, where they are given.

    Args:
        result: of the design; noise of a relative size refers to its output power.

    Raises:
        SpecError: a loop that is unstable with the true plant.
    """
    study = spec.simulation
    if study is None or (study.plant is None and study.noise is None):
        return nominal
    model = nominal.model
    if study.plant is not None:
        plant = _polynomials(spec, study.plant)
        assert isinstance(plant, PolynomialPlant)  # the spec has been checked
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
    with _told_of_truth(spec):
        loop.check_stability()
    return replace(nominal, loop=loop, factor=None)


def true_channel_experiment(
    spec: Spec, nominal: ChannelExperiment, result: Mapping[str, Any]
) -> ChannelExperiment:
    """The same with several channels; noise of a relative size refers to the weakest output.

    Raises:
        SpecError: a loop that is unstable with the true plant.
    """
    study = spec.simulation
    if study is None or (study.plant is None and study.noise is None):
        return nominal
    changes: dict[str, Any] = {}
    if study.plant is not None:
        changes["plant"] = study.plant
    if study.noise is not None:
        noise = study.noise
        variance: Any = noise.variance
        if noise.relative_std is not None:
            variance = noise.relative_std**2 * float(np.min(result["power"]["output"]))
        changes["noise"] = Noise.model_construct(C=noise.C, D=noise.D, variance=variance)
    plant, noise = changes.get("plant", spec.plant), changes.get("noise", spec.noise)
    if isinstance(spec.plant, PolynomialPlant) or noise.filters:
        changes["plant"] = _polynomials(spec, plant)
    model, controller = build_channel_model(spec.model_copy(update=changes)), spec.experiment.controller
    loop = None
    if controller is not None:
        with _told_of_truth(spec):
            loop = stable_loop(model, controller)
    return replace(nominal, model=model, loop=loop, factor=None)


def _polynomials(spec: Spec, plant: Any) -> Any:
    """A true plant in s behind a hold as B/F in q^-1: C and D then filter the noise alone."""
    if not isinstance(plant, ContinuousPlant):
        return plant
    matrix = plant.continuous
    held = hold_entries(matrix.numerator_matrix, matrix.denominator_matrix, spec.sample_time)
    above = tuple(tuple(tuple(entry.numerator.tolist()) for entry in row) for row in held)
    below = tuple(tuple(tuple(entry.denominator_polynomial.tolist()) for entry in row) for row in held)
    return PolynomialPlant.model_construct(A=(1.0,), B=above, F=below)


@contextmanager
def _told_of_truth(spec: Spec) -> Iterator[None]:
    """A loop that the nominal plant leaves stable, and the true one does not, is the fault of the latter."""
    try:
        yield
    except SpecError as error:
        found = error.diagnostics[0]
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
