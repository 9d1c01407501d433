"""Spec -> how its experiment is tried on the true system."""

from __future__ import annotations

from inputdesign_cli.information import Experiment
from inputdesign_cli.specification import Simulation as SimulationSection, Spec
from inputdesign_cli.tasks.build.header import build_units
from inputdesign_cli.tasks.build.model_error import model_error_alpha, unstated_errors
from inputdesign_cli.tasks.build.system import build_cost
from inputdesign_cli.tasks.build.true_system import build_true_system
from inputdesign_cli.tasks.simulation import Simulation


def build_simulation(spec: Spec, nominal: Experiment) -> Simulation:
    """What `simulate` needs besides the design or the given excitation.

    Args:
        nominal: the experiment on the design model, in raw parameters, prior information included.

    Raises:
        SpecError: a loop that is unstable with the true plant.
    """
    study = spec.simulation or SimulationSection()
    return Simulation(
        units=build_units(spec),
        nominal=nominal,
        truth=build_true_system(spec),
        runs=study.runs,
        seed=study.seed,
        renewed=study.excitation == "new",
        compare=study.compare,
        cost=build_cost(spec),
        entries=unstated_errors(spec, nominal),
        alpha=model_error_alpha(spec, nominal.model),
    )
