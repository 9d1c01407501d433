"""Does everything fit the kind of plant: the loop, the noise, the true system, the spectrum."""

from __future__ import annotations

from collections.abc import Iterator

from inputdesign_cli.specification.models.controller import ControllerMatrix
from inputdesign_cli.specification.models.experiment import Noise, SimulationNoise
from inputdesign_cli.specification.models.path_diagnostic import PathDiagnostic
from inputdesign_cli.specification.models.plant import Plant
from inputdesign_cli.specification.models.polynomials import check_delay_stable
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.transfer import DiscreteTransfer
from inputdesign_cli.specification.models.values import depth
from inputdesign_cli.specification.wording import count
from inputdesign_cli.specification.yaml.places import Path


def stable_unless_controlled(spec: Spec) -> Iterator[PathDiagnostic]:
    """A is stable in open loop; under a controller the loop must be, which the mathematics checks."""
    yield from _stable_A(spec, spec.plant, ("plant",))


def _stable_A(spec: Spec, plant: Plant, path: Path) -> Iterator[PathDiagnostic]:  # noqa: N802 (the paper's symbol)
    if spec.closed_loop or plant.kind != "polynomial":
        return
    polynomials = plant.A_per_output if depth(plant.A) == 2 else plant.A_per_output[:1]
    for i, polynomial in enumerate(polynomials):
        finding = check_delay_stable(polynomial)
        if finding is None:
            continue
        hint = finding.hint
        if finding.code == "unstable-polynomial":
            hint = "an unstable plant needs a loop: add experiment.controller, or " + hint
        where = (*path, "A", i) if depth(plant.A) == 2 else (*path, "A")
        yield PathDiagnostic(finding.code, finding.message, hint, where)


def controller_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """A controller works in discrete time and has a row an input and a column an output of the plant."""
    if spec.experiment.controller is not None:
        yield from _controller(spec, spec.experiment.controller, ("experiment", "controller"))


def kept_loop_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """So has the controller of a sensitivity that is to be kept."""
    error = spec.accuracy.model_error
    if error is None or error.sensitivity is None or spec.plant.kind == "regression":
        return
    if error.sensitivity.controller is not None:
        where = ("accuracy", "model_error", "sensitivity", "controller")
        yield from _controller(spec, error.sensitivity.controller, where)


def _controller(
    spec: Spec, controller: DiscreteTransfer | ControllerMatrix, path: Path
) -> Iterator[PathDiagnostic]:
    plant = spec.plant
    if plant.kind == "regression":
        yield PathDiagnostic(
            "unsuitable-key", "{key} does not go with a regression", "remove the controller", path
        )
    elif not plant.sampled:
        yield PathDiagnostic(
            "unsuitable-key",
            "{key} works in discrete time, but the plant is not sampled",
            "add sample: zoh to the plant",
            path,
        )
    if plant.kind == "regression":
        return
    channels = (plant.inputs, plant.outputs)
    if controller.kind == "discrete":
        if channels != (1, 1):
            yield PathDiagnostic(
                "wrong-shape",
                f"{{key}} is a single transfer function, but the plant has {count(plant.inputs, 'input')} "
                f"and {count(plant.outputs, 'output')}",
                "write numerator as rows (inputs) of columns (outputs) of coefficients, and "
                "denominator likewise or as one for all entries",
                path,
            )
        return
    shape = (len(controller.numerator), len(controller.numerator[0]))
    if channels == (1, 1):
        yield PathDiagnostic(
            "wrong-shape",
            "{key} is a matrix, but the plant has one input and one output",
            "write numerator: [..] and denominator: [..]",
            (*path, "numerator"),
        )
    elif shape != channels:
        yield PathDiagnostic(
            "wrong-shape",
            f"{{key}} is {shape[0]} x {shape[1]}, but the plant has {count(plant.inputs, 'input')} and "
            f"{count(plant.outputs, 'output')}",
            "write a row for each input u and in it a column for each output y",
            (*path, "numerator"),
        )


def noise_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """The noise has as many channels as the plant has outputs."""
    yield from _noise(spec, spec.noise, ("noise",))


def true_noise_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """So has the noise of the simulation."""
    if spec.simulation is not None and spec.simulation.noise is not None:
        yield from _noise(spec, spec.simulation.noise, ("simulation", "noise"))


def _noise(spec: Spec, noise: Noise | SimulationNoise, path: Path) -> Iterator[PathDiagnostic]:
    outputs = spec.plant.outputs
    kind = ""
    if spec.plant.kind == "regression":
        kind = "the noise of a regression is white"
    elif not spec.plant.sampled:
        kind = "the plant is not sampled"
    for key, value in (("C", noise.C), ("D", noise.D)):
        if kind and key in noise.model_fields_set:
            yield PathDiagnostic(
                "unsuitable-key",
                f"{{key}} is a polynomial in q^-1, but {kind}",
                f"remove {key}",
                (*path, key),
            )
        elif depth(value) == 2 and len(value) != outputs:
            yield PathDiagnostic(
                "wrong-shape",
                f"{{key}} holds {len(value)} polynomials, but the plant has {count(outputs, 'output')}",
                "write one polynomial for all outputs, or a list with one per output",
                (*path, key),
            )
    variance = noise.variance
    if isinstance(variance, tuple) and len(variance) != outputs:
        yield PathDiagnostic(
            "wrong-shape",
            f"{{key}} is {len(variance)} x {len(variance)}, but the plant has {count(outputs, 'output')}",
            f"write a number, or a matrix with {count(outputs, 'row')}",
            (*path, "variance"),
        )


def true_system_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """The true system has the channels of the nominal one, and is described in the same time."""
    true = spec.simulation.plant if spec.simulation is not None else None
    if true is None:
        return
    path, plant = ("simulation", "plant"), spec.plant
    if plant.kind == "regression":
        size = plant.inputs
        if true.kind != "parameters":
            yield PathDiagnostic(
                "regression-mismatch",
                "{key} of a regression is a list of its true parameters",
                f"write {{parameters: [..]}} with {count(size, 'number')}",
                path,
            )
        elif len(true.parameters) != size:
            yield PathDiagnostic(
                "wrong-shape",
                f"{{key}} holds {count(len(true.parameters), 'number')}, but the regression has "
                f"{count(size, 'parameter')}",
                "write the estimated parameters, then the neglected ones",
                (*path, "parameters"),
            )
        return
    if true.kind == "parameters" or true.kind == "regression":
        yield PathDiagnostic(
            "regression-mismatch",
            "{key} describes a regression, but the plant is not one",
            "describe the true system as the plant is described",
            path,
        )
        return
    if true.sampled != plant.sampled:
        yield PathDiagnostic(
            "wrong-shape",
            "{key} is in discrete time, but the plant is not sampled"
            if true.sampled
            else "{key} is not sampled, but the plant is in discrete time",
            "describe the true system in s as well" if true.sampled else "add sample: zoh to it",
            path,
        )
    if (true.inputs, true.outputs) != (plant.inputs, plant.outputs):
        yield PathDiagnostic(
            "wrong-shape",
            f"{{key}} has {count(true.inputs, 'input')} and {count(true.outputs, 'output')}, "
            f"the plant {count(plant.inputs, 'input')} and {count(plant.outputs, 'output')}",
            "the true system may be of another order, but has the same signals",
            path,
        )
    yield from _stable_A(spec, true, path)


def spectrum_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """Moments are for regressions, a FIR spectrum for discrete time."""
    spectrum = spec.spectrum
    regression = spec.plant.kind == "regression"
    if spectrum is None or spectrum.type == "given":
        return
    if (spectrum.type == "moments") != regression:
        yield PathDiagnostic(
            "regression-mismatch",
            "a regression is designed by its moments" if regression else "moments are for a regression",
            "write spectrum: {type: moments}" if regression else "write spectrum: {type: fir, order: 20}",
            ("spectrum", "type"),
        )
    elif spectrum.type == "fir" and not spec.plant.sampled:
        yield PathDiagnostic(
            "unsuitable-key",
            "a fir spectrum is in discrete time, but the plant is not sampled",
            "add sample: zoh to the plant, or choose type: polynomial",
            ("spectrum", "type"),
        )


def regression_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """A regression is designed for mean-squared error, and that error is one of regressions."""
    error, plant = spec.accuracy.mean_squared_error, spec.plant
    path = ("accuracy", "mean_squared_error")
    if plant.kind != "regression":
        if error is not None:
            yield PathDiagnostic(
                "regression-mismatch",
                "{key} is for a linear regression, but the plant is not one",
                "write plant: {regression: {estimated: 1, neglected: 1}}, or ask for a model_error",
                path,
            )
        return
    for key in (*spec.accuracy.requirements, *spec.accuracy.goals):
        if key != "mean_squared_error":
            yield PathDiagnostic(
                "regression-mismatch",
                "{key} does not go with a regression",
                "ask for accuracy.mean_squared_error",
                ("accuracy", key),
            )
    if error is None:
        return
    for name, given, size in (
        ("estimated", error.estimated, plant.regression.estimated),
        ("neglected", error.neglected, plant.regression.neglected),
    ):
        if given is not None and len(given) != size:
            yield PathDiagnostic(
                "wrong-shape",
                f"{{key}} holds {count(len(given), 'weight')}, but {size} regressors are {name}",
                "write one weight per regressor; plant.regression says how many there are",
                (*path, name),
            )


def control_fits(spec: Spec) -> Iterator[PathDiagnostic]:
    """The controller inverts the plant, so that plant and desired loop are square and of one size."""
    error, plant = spec.accuracy.closed_loop_error, spec.plant
    if error is None or plant.kind == "regression":
        return
    if plant.inputs != plant.outputs:
        yield PathDiagnostic(
            "not-square",
            f"{{key}} designs a controller that inverts the plant, but the plant has "
            f"{count(plant.outputs, 'output')} and {count(plant.inputs, 'input')}",
            "choose as many inputs as outputs",
            ("accuracy", "closed_loop_error", "control"),
        )
        return
    target = error.control.model_reference
    if target is None or target.kind == "discrete" or target.kind == "continuous":
        return
    rows = target.numerator if target.kind == "discrete_matrix" else target.continuous.numerator
    if (len(rows), len(rows[0])) != (plant.outputs, plant.outputs):
        step = ("continuous",) if target.kind == "continuous_matrix" else ()
        yield PathDiagnostic(
            "not-square",
            f"{{key}} is {len(rows)} x {len(rows[0])}: the loop from reference to output is square, "
            f"{plant.outputs} x {plant.outputs}",
            "write one transfer function t for t I, or a square matrix",
            ("accuracy", "closed_loop_error", "control", "model_reference", *step, "numerator"),
        )


def weights_fit(spec: Spec) -> Iterator[PathDiagnostic]:
    """A filter in q^-1 has no meaning for a plant that is not sampled."""
    if spec.plant.sampled:
        return
    accuracy = spec.accuracy
    for name, given in (
        ("model_error", accuracy.model_error),
        ("weighted_variance", accuracy.weighted_variance),
    ):
        if given is not None and given.weight is not None and given.weight.kind == "discrete":
            yield PathDiagnostic(
                "unsuitable-key",
                "{key} is in q^-1, but the plant is not sampled",
                "write {continuous: {numerator: [..], denominator: [..]}} in s",
                ("accuracy", name, "weight"),
            )
