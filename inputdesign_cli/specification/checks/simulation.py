"""Do the true system and the true noise of a simulation fit the nominal ones."""

from __future__ import annotations

from collections.abc import Iterator

from inputdesign_cli.specification.checks.plant import check_noise, check_stable
from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.wording import count


def true_noise_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """The noise of the simulation has as many channels as the plant has outputs."""
    if spec.simulation is not None and spec.simulation.noise is not None:
        yield from check_noise(spec, spec.simulation.noise, "simulation", "noise")


def true_system_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """The true system has the channels of the nominal one, and is described in the same time."""
    true = spec.simulation.plant if spec.simulation is not None else None
    path, plant = ("simulation", "plant"), spec.plant
    if true is None:
        return
    if plant.kind == "regression":
        if true.kind != "parameters":
            message = "{key} of a regression is a list of its true parameters"
            hint = f"write {{parameters: [..]}} with {count(plant.inputs, 'number')}"
            yield PathDiagnostic("regression-mismatch", message, hint, path)
        elif len(true.parameters) != plant.inputs:
            holds, has = count(len(true.parameters), "number"), count(plant.inputs, "parameter")
            message = f"{{key}} holds {holds}, but the regression has {has}"
            hint = "write the estimated parameters, then the neglected ones"
            yield PathDiagnostic("wrong-shape", message, hint, (*path, "parameters"))
        return
    if true.kind == "parameters" or true.kind == "regression":
        message = "{key} describes a regression, but the plant is not one"
        hint = "describe the true system as the plant is described"
        yield PathDiagnostic("regression-mismatch", message, hint, path)
        return
    if true.sampled and not plant.sampled:
        message = "{key} is in discrete time, but the plant is not sampled"
        yield PathDiagnostic("wrong-shape", message, "describe the true system in s as well", path)
    if plant.sampled and not true.sampled:
        message = "{key} is not sampled, but the plant is in discrete time"
        yield PathDiagnostic("wrong-shape", message, "add sample: zoh to it", path)
    if (true.inputs, true.outputs) != (plant.inputs, plant.outputs):
        message = (
            f"{{key}} has {count(true.inputs, 'input')} and {count(true.outputs, 'output')}, "
            f"the plant {count(plant.inputs, 'input')} and {count(plant.outputs, 'output')}"
        )
        hint = "the true system may be of another order, but has the same signals"
        yield PathDiagnostic("wrong-shape", message, hint, path)
    yield from check_stable(spec, true, *path)
