"""Check that controllers and desired loops fit the channels of the plant."""

from __future__ import annotations

from collections.abc import Iterator

from inputdesign_cli.specification.checks.plant import SAMPLED
from inputdesign_cli.specification.models.loop import Controller
from inputdesign_cli.specification.models.plant import Plant
from inputdesign_cli.specification.models.section import PathDiagnostic
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.transfer import size_of
from inputdesign_cli.specification.models.wording import count

_SENSITIVITY = ("accuracy", "model_error", "sensitivity")
_LOOP = ("accuracy", "loop")


def controller_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """A controller works in discrete time, with a row per input and a column per output of the plant."""
    controller, path = spec.experiment.controller, ("experiment", "controller")
    if controller is not None and spec.plant.kind == "regression":
        message = "{key} does not go with a regression"
        yield PathDiagnostic("unsuitable-key", message, "remove the controller", path)
    elif controller is not None:
        yield from _controller(spec.plant, controller, *path)


def kept_loop_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """The controller of a loop that is to be kept fits the plant in the same way."""
    error, loop = spec.accuracy.model_error, spec.accuracy.loop
    controller = error.sensitivity.controller if error is not None and error.sensitivity is not None else None
    if controller is not None and spec.plant.kind != "regression":
        yield from _controller(spec.plant, controller, *_SENSITIVITY, "controller")
    if loop is not None and loop.controller is not None and spec.plant.kind != "regression":
        yield from _controller(spec.plant, loop.controller, *_LOOP, "controller")


def sensitivity_has_loop(spec: Spec) -> Iterator[PathDiagnostic]:
    """A bound on a sensitivity needs a loop."""
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
    """The controller inverts the plant, so that plant and desired loop are square and of one size."""
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
