"""Check that the plant is stable, and that noise, spectrum, weights, loops and true system fit it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import cast

from inputdesign_cli.specification.models.experiment import NoiseShape
from inputdesign_cli.specification.models.fields import check_no_growth
from inputdesign_cli.specification.models.loop import Controller
from inputdesign_cli.specification.models.plant import Plant
from inputdesign_cli.specification.models.section import PathDiagnostic
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.transfer import check_each, check_per_output, size_of
from inputdesign_cli.specification.models.wording import count


def check_stable(spec: Spec, plant: Plant, *path: str) -> Iterator[PathDiagnostic]:
    """Check that A of the plant at `path` is stable, integrators aside, unless a controller acts on it."""
    if spec.closed_loop or plant.kind != "polynomial":
        return
    for found in check_each(plant.A, check_no_growth, *path, "A"):
        unstable = found.code == "unstable-polynomial"
        needs = "an unstable plant needs a loop: add experiment.controller, or " if unstable else ""
        yield replace(found, hint=needs + found.hint)


_WEIGHTS = (
    ("accuracy", "model_error", "weight"),
    ("accuracy", "weighted_variance", "weight"),
    ("limits", "spectrum", "max"),
    ("limits", "spectrum", "min"),
)
SAMPLED = "add sample: zoh to the plant"
"""The hint for keys that a plant in s cannot have unless it is sampled."""


def check_noise(spec: Spec, noise: NoiseShape, *path: str) -> Iterator[PathDiagnostic]:
    """Check that the noise at `path` fits the outputs of the plant and its discrete or continuous time."""
    if noise.standard_deviation is not None:
        return  # the filter was made for this plant, and lists of channels are checked as such
    outputs = spec.plant.outputs
    has = f"but the plant has {count(outputs, 'output')}"
    white = "the noise of a regression is white" if spec.plant.kind == "regression" else ""
    kind = white or ("" if spec.plant.sampled else "the plant is not sampled")
    for key, value in (("C", noise.C), ("D", noise.D), ("drift", ())):
        if kind and key in noise.model_fields_set:
            message = f"{{key}} is {'a polynomial' if value else 'a root'} in q^-1, but {kind}"
            hint = f"remove {key}" if white else f"{SAMPLED}, or remove {key}"
            yield PathDiagnostic("unsuitable-key", message, hint, (*path, key))
        elif value:
            yield from check_per_output(value, outputs, *path, key)
    if len(noise.drifts) not in (1, outputs):
        message = f"{{key}} is a list of {len(noise.drifts)}, {has}"
        yield PathDiagnostic("wrong-shape", message, "write true, or one for each output", (*path, "drift"))
    variance = noise.variance
    if isinstance(variance, tuple) and len(variance) != outputs:
        message = f"{{key}} is {len(variance)} x {len(variance)}, {has}"
        hint = f"write a number, or a matrix with {count(outputs, 'row')}"
        yield PathDiagnostic("wrong-shape", message, hint, (*path, "variance"))


def names_differ(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that no parameter of the plant has the name of a coefficient of the noise."""
    if spec.plant.kind == "regression":
        return
    for name in spec.plant.parameters or ():
        if name in spec.noise.coefficients:
            message = f"{name} is the name of a coefficient of the noise as well"
            hint = f"choose another name for the parameter: {name}_plant"
            yield PathDiagnostic("bad-name", message, hint, ("plant", "parameters", name), at_key=True)


def spectrum_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that moments belong to a regression, and a FIR spectrum to discrete time."""
    spectrum = spec.spectrum
    if spectrum is None or spectrum.type == "given":
        return
    path = ("spectrum", "type")
    if spec.plant.kind == "regression" and spectrum.type != "moments":
        message = "a regression is designed by its moments"
        yield PathDiagnostic("regression-mismatch", message, "write spectrum: {type: moments}", path)
    elif spec.plant.kind != "regression" and spectrum.type == "moments":
        hint = "write spectrum: {type: fir, order: 20}"
        yield PathDiagnostic("regression-mismatch", "moments are for a regression", hint, path)
    elif spectrum.type == "fir" and not spec.plant.sampled:
        message = "a fir spectrum is in discrete time, but the plant is not sampled"
        hint = f"{SAMPLED}, or choose type: polynomial"
        yield PathDiagnostic("unsuitable-key", message, hint, path)


def weights_fit(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that no filter is in q^-1 if the plant is not sampled."""
    if spec.plant.sampled:
        return
    for path in _WEIGHTS:
        if spec.at(*path, "kind") == "discrete":
            message = "{key} is in q^-1, but the plant is not sampled"
            hint = f"{SAMPLED}, or write {{continuous: {{numerator: [..], denominator: [..]}}}} in s"
            yield PathDiagnostic("unsuitable-key", message, hint, path)


def true_noise_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that the noise of the simulation has as many channels as the plant has outputs."""
    if spec.simulation is not None and spec.simulation.noise is not None:
        yield from check_noise(spec, spec.simulation.noise, "simulation", "noise")


def true_system_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that the true system has the channels of the nominal one and is described in the same time."""
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
    if true.sampled != plant.sampled:
        one, other = ("is", "is not") if true.sampled else ("is not", "is")
        hint = f"write sample: zoh in {'both' if true.sampled else 'it, too'}, or in none of the two"
        yield PathDiagnostic("wrong-shape", f"{{key}} {one} sampled, but the plant {other}", hint, path)
    if (true.inputs, true.outputs) != (plant.inputs, plant.outputs):
        message = (
            f"{{key}} has {count(true.inputs, 'input')} and {count(true.outputs, 'output')}, "
            f"the plant {count(plant.inputs, 'input')} and {count(plant.outputs, 'output')}"
        )
        hint = "the true system may be of another order, but has the same signals"
        yield PathDiagnostic("wrong-shape", message, hint, path)
    yield from check_stable(spec, true, *path)


def regression_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that a regression is designed for mean-squared error, and only a regression."""
    error, plant = spec.accuracy.mean_squared_error, spec.plant
    path = ("accuracy", "mean_squared_error")
    if plant.kind != "regression":
        if error is not None:
            message = "{key} is for a linear regression, but the plant is not one"
            hint = "write plant: {regression: {estimated: 1, neglected: 1}}, or ask for a model_error"
            yield PathDiagnostic("regression-mismatch", message, hint, path)
        return
    for key in (*spec.accuracy.requirements, *spec.accuracy.goals):
        if key != "mean_squared_error":
            message, hint = "{key} does not go with a regression", "ask for accuracy.mean_squared_error"
            yield PathDiagnostic("regression-mismatch", message, hint, ("accuracy", key))
    if error is None:
        return
    for name, given, size in (
        ("estimated", error.estimated, plant.regression.estimated),
        ("neglected", error.neglected, plant.regression.neglected),
    ):
        if given is not None and len(given) != size:
            message = f"{{key}} holds {count(len(given), 'weight')}, but {size} regressors are {name}"
            hint = "write one weight per regressor; plant.regression says how many there are"
            yield PathDiagnostic("wrong-shape", message, hint, (*path, name))


_SENSITIVITY = ("accuracy", "model_error", "sensitivity")
_LOOP = ("accuracy", "loop")


def controllers_fit(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that controllers are in discrete time, with a row per plant input and a column per output."""
    for path in (("experiment", "controller"), (*_SENSITIVITY, "controller"), (*_LOOP, "controller")):
        controller = cast(Controller | None, spec.at(*path))
        if controller is not None and spec.plant.kind != "regression":
            yield from _controller(spec.plant, controller, *path)
    if spec.closed_loop and spec.plant.kind == "regression":
        message, path = "{key} does not go with a regression", ("experiment", "controller")
        yield PathDiagnostic("unsuitable-key", message, "remove the controller", path)


def sensitivity_has_loop(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that a bound on a sensitivity comes with a control loop."""
    tuned = spec.at(*_LOOP, "tuning") is not None
    for path, where in ((_SENSITIVITY, "there"), (_LOOP, "or tuning: {simc: {}} there")):
        stated, own = spec.at(*path), spec.at(*path, "controller")
        if stated is not None and own is None and not spec.closed_loop and not (path == _LOOP and tuned):
            message = "{key} needs a control loop, but there is no controller"
            hint = f"add experiment.controller, or a controller {where} for the loop to be kept"
            yield PathDiagnostic("needs-controller", message, hint, path)


def _controller(plant: Plant, controller: Controller, *path: str) -> Iterator[PathDiagnostic]:
    if not plant.sampled:
        message = "{key} works in discrete time, but the plant is not sampled"
        yield PathDiagnostic("unsuitable-key", message, SAMPLED, path)
    channels = (plant.inputs, plant.outputs)
    has = f"but the plant has {count(plant.inputs, 'input')} and {count(plant.outputs, 'output')}"
    if controller.kind == "loops":
        for n, one in enumerate(controller.loops):
            ends = ("input", one.input, plant.inputs), ("output", one.output, plant.outputs)
            for key, place, most in ends:
                if place > most:
                    message = f"{{key}} is {place}, {has}"
                    hint = f"count them from 1 to {most}"
                    yield PathDiagnostic("wrong-shape", message, hint, (*path, "loops", n, key))
    elif controller.kind != "discrete_matrix":
        if channels != (1, 1):
            message = f"{{key}} is a single transfer function, {has}"
            rows = "write loops: [{output: 1, input: 1, controller: {..}}, ..], or numerator as rows (inputs)"
            hint = f"{rows} of columns (outputs) of coefficients, and denominator likewise or one for all"
            yield PathDiagnostic("wrong-shape", message, hint, path)
    elif channels == (1, 1):
        message = "{key} is a matrix, but the plant has one input and one output"
        hint = "write numerator: [..] and denominator: [..]"
        yield PathDiagnostic("wrong-shape", message, hint, (*path, "numerator"))
    elif (shape := size_of(controller.numerator)) != channels:
        message = f"{{key}} is {shape[0]} x {shape[1]}, {has}"
        hint = "write a row for each input u and in it a column for each output y"
        yield PathDiagnostic("wrong-shape", message, hint, (*path, "numerator"))


def control_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that plant and desired loop are square and of one size: the controller inverts the plant."""
    error, plant = spec.accuracy.closed_loop_error, spec.plant
    if error is None or plant.kind == "regression":
        return
    path = ("accuracy", "closed_loop_error", "control")
    if plant.inputs != plant.outputs:
        message = (
            f"{{key}} designs a controller that inverts the plant, but the plant has "
            f"{count(plant.outputs, 'output')} and {count(plant.inputs, 'input')}"
        )
        yield PathDiagnostic("not-square", message, "choose as many inputs as outputs", path)
        return
    target = error.control.model_reference
    if target is None or target.kind == "discrete" or target.kind == "continuous":
        return
    matrix, step = (target, ()) if target.kind == "discrete_matrix" else (target.continuous, ("continuous",))
    rows, columns = size_of(matrix.numerator)
    if (rows, columns) != (plant.outputs, plant.outputs):
        square = f"the loop from reference to output is square, {plant.outputs} x {plant.outputs}"
        message = f"{{key}} is {rows} x {columns}: {square}"
        hint = "write one transfer function t for t I, or a square matrix"
        yield PathDiagnostic("not-square", message, hint, (*path, "model_reference", *step, "numerator"))
