"""Spec -> the simulation of its experiment on the true system, nominal except for `simulation`."""

from __future__ import annotations

from dataclasses import replace

from inputdesign_cli.errors import SpecError, bad_spec
from inputdesign_cli.information import Experiment
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.model_error import unstated_errors
from inputdesign_cli.questions.building.system import build_cost, build_loop, build_model, held_plant
from inputdesign_cli.questions.common.simulation import Simulation
from inputdesign_cli.specification import Simulation as SimulationSection, Spec
from inputdesign_cli.specification.models.experiment import Noise


def build_simulation(spec: Spec, nominal: Experiment) -> Simulation:
    """Return the study of `simulate` without its excitation, for the nominal experiment with its prior.

    Raises `SpecError`: a loop that is unstable with the true plant.
    """
    study = spec.simulation or SimulationSection()
    return Simulation(
        units=build_units(spec),
        nominal=nominal,
        truth=_true_system(spec, nominal),
        relative_noise=None if study.noise is None else study.noise.relative_std,
        runs=study.runs,
        seed=study.seed,
        renewed=study.excitation == "new",
        compare=study.compare,
        cost=build_cost(spec),
        entries=unstated_errors(spec, nominal),
    )


def _true_system(spec: Spec, nominal: Experiment) -> Experiment | None:
    """Return the experiment on the system of `simulation`, or None; `SpecError` if its loop is unstable."""
    study = spec.simulation
    if study is None or (study.plant is None and study.noise is None):
        return None
    plant, noise = study.plant or spec.plant, spec.noise
    if study.noise is not None:
        stated = study.noise
        noise = Noise.model_construct(
            C=stated.C, D=stated.D, drift=stated.drift, known=stated.known, variance=stated.variance or 1.0
        )
    if plant.kind == "continuous" and spec.plant.kind == "polynomial":
        plant = held_plant(plant, spec.sample_time)
    model = build_model(spec.model_copy(update={"plant": plant, "noise": noise}))
    controller = spec.experiment.controller
    try:
        loop = None if controller is None else build_loop(spec, model, controller)
    except SpecError as error:
        found = error.diagnostics[0]
        message = f"with the true plant {found.message}"
        hint = "give a true plant that the controller stabilises as well"
        raise bad_spec(found.code, message, hint=hint, key="simulation.plant") from error
    return replace(nominal, model=model, loop=loop)
