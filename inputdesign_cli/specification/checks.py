"""Check conditions across the sections of a spec: its parts fit the plant, and the question is complete.

Each check is a function of the spec that yields diagnostics with absolute paths.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import cast

from inputdesign_cli.specification.models.experiment import NoiseShape
from inputdesign_cli.specification.models.fields import check_no_growth, depth, size_of
from inputdesign_cli.specification.models.loop import Controller
from inputdesign_cli.specification.models.plant import Plant
from inputdesign_cli.specification.models.section import PathDiagnostic
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.transfer import check_each, check_per_output
from inputdesign_cli.specification.models.wording import count, show
from inputdesign_cli.specification.yaml.places import Path, parse_key

_Found = Iterator[PathDiagnostic]
_SAMPLED = "add sample: zoh to the plant"
_LONGEST_DELAY = 1000  # samples
_ROUNDING = 1e-4  # 3.1416 is meant as pi
_WEIGHTS = (
    *("accuracy.model_error.weight", "accuracy.weighted_variance.weight"),
    *("limits.spectrum.max", "limits.spectrum.min"),
)
_BANDED = ("model_error", "loop", "weighted_variance", "frequency_response")
_BANDS = (("limits", "band"), *(("accuracy", key, "band") for key in _BANDED), ("spectrum", "band"))
_SENSITIVITY, _LOOP = ("accuracy", "model_error", "sensitivity"), ("accuracy", "loop")
# Every key that takes a list with one entry per input or output.
_PER_CHANNEL = {
    "input": (
        *("cost.input_power", "cost.excitation_power", "limits.rate", "limits.amplitude.input"),
        *("limits.input_power.max", "limits.input_power.min"),
        *("limits.excitation_power.max", "limits.excitation_power.min"),
        *("signal.amplitudes", "signal.least_move", "signal.offset", "signal.quantisation.range"),
        *("spectrum.given.power", "spectrum.given.amplitudes"),
    ),
    "output": (
        *("cost.output_power", "limits.amplitude.output"),
        *("noise.standard_deviation", "noise.correlation_time"),
        *("simulation.noise.standard_deviation", "simulation.noise.correlation_time"),
        *("limits.output_power.max", "limits.output_power.min"),
        "accuracy.closed_loop_error.reference.variance",
    ),
}


def plant_is_stable(spec: Spec) -> _Found:
    """Check that A of the plant is stable, integrators aside, unless a controller acts on it."""
    yield from _stable(spec, spec.plant, "plant")


def _stable(spec: Spec, plant: Plant, *path: str) -> _Found:
    if spec.closed_loop or plant.kind != "polynomial":
        return
    for found in check_each(plant.A, check_no_growth, *path, "A"):
        unstable = found.code == "unstable-polynomial"
        needs = "an unstable plant needs a loop: add experiment.controller, or " if unstable else ""
        yield replace(found, hint=needs + found.hint)


def noise_fits(spec: Spec) -> _Found:
    """Check that the noise, and that of a simulation, fit the outputs and the time of the plant."""
    yield from _noise(spec, spec.noise, "noise")
    if spec.simulation is not None and spec.simulation.noise is not None:
        yield from _noise(spec, spec.simulation.noise, "simulation", "noise")


def _noise(spec: Spec, noise: NoiseShape, *path: str) -> _Found:
    if noise.standard_deviation is not None:
        return  # `fading_noise` made the filter for this plant; `channels` checks the lists
    outputs = spec.plant.outputs
    has = f"but the plant has {count(outputs, 'output')}"
    white = "the noise of a regression is white" if spec.plant.kind == "regression" else ""
    kind = white or ("" if spec.plant.sampled else "the plant is not sampled")
    for key, value in (("C", noise.C), ("D", noise.D), ("drift", ())):
        if kind and key in noise.model_fields_set:
            message = f"{{key}} is {'a polynomial' if value else 'a root'} in q^-1, but {kind}"
            hint = f"remove {key}" if white else f"{_SAMPLED}, or remove {key}"
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


def names_differ(spec: Spec) -> _Found:
    """Check that no parameter of the plant has the name of a coefficient of the noise."""
    if spec.plant.kind == "regression":
        return
    for name in spec.plant.parameters or ():
        if name in spec.noise.coefficients:
            message = f"{name} is the name of a coefficient of the noise as well"
            hint = f"choose another name for the parameter: {name}_plant"
            yield PathDiagnostic("bad-name", message, hint, ("plant", "parameters", name), at_key=True)


def spectrum_fits(spec: Spec) -> _Found:
    """Check that moments belong to a regression, and a FIR spectrum to discrete time."""
    spectrum, regression = spec.spectrum, spec.plant.kind == "regression"
    if spectrum is None or spectrum.type == "given":
        return
    if regression != (spectrum.type == "moments"):
        message, hint = "moments are for a regression", "write spectrum: {type: fir, order: 20}"
        if regression:
            message, hint = "a regression is designed by its moments", "write spectrum: {type: moments}"
        yield PathDiagnostic("regression-mismatch", message, hint, ("spectrum", "type"))
    elif spectrum.type == "fir" and not spec.plant.sampled:
        message = "a fir spectrum is in discrete time, but the plant is not sampled"
        hint = f"{_SAMPLED}, or choose type: polynomial"
        yield PathDiagnostic("unsuitable-key", message, hint, ("spectrum", "type"))


def weights_fit(spec: Spec) -> _Found:
    """Check that no filter is in q^-1 if the plant is not sampled."""
    for path in map(parse_key, () if spec.plant.sampled else _WEIGHTS):
        if spec.at(*map(str, path), "kind") == "discrete":
            message = "{key} is in q^-1, but the plant is not sampled"
            hint = f"{_SAMPLED}, or write {{continuous: {{numerator: [..], denominator: [..]}}}} in s"
            yield PathDiagnostic("unsuitable-key", message, hint, path)


def true_system_fits(spec: Spec) -> _Found:
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
        message = f"{{key}} has {_channels(true)}, the plant {_channels(plant)}"
        hint = "the true system may be of another order, but has the same signals"
        yield PathDiagnostic("wrong-shape", message, hint, path)
    yield from _stable(spec, true, *path)


def _channels(plant: Plant) -> str:
    return f"{count(plant.inputs, 'input')} and {count(plant.outputs, 'output')}"


def regression_fits(spec: Spec) -> _Found:
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


def controllers_fit(spec: Spec) -> _Found:
    """Check that controllers are in discrete time, with a row per plant input and a column per output."""
    for path in (("experiment", "controller"), (*_SENSITIVITY, "controller"), (*_LOOP, "controller")):
        controller = cast(Controller | None, spec.at(*path))
        if controller is not None and spec.plant.kind != "regression":
            yield from _controller(spec.plant, controller, *path)
    if spec.closed_loop and spec.plant.kind == "regression":
        message, path = "{key} does not go with a regression", ("experiment", "controller")
        yield PathDiagnostic("unsuitable-key", message, "remove the controller", path)


def sensitivity_has_loop(spec: Spec) -> _Found:
    """Check that a bound on a sensitivity comes with a control loop."""
    tuned = spec.at(*_LOOP, "tuning") is not None
    for path, where in ((_SENSITIVITY, "there"), (_LOOP, "or tuning: {simc: {}} there")):
        stated, own = spec.at(*path), spec.at(*path, "controller")
        if stated is not None and own is None and not spec.closed_loop and not (path == _LOOP and tuned):
            message = "{key} needs a control loop, but there is no controller"
            hint = f"add experiment.controller, or a controller {where} for the loop to be kept"
            yield PathDiagnostic("needs-controller", message, hint, path)


def _controller(plant: Plant, controller: Controller, *path: str) -> _Found:
    if not plant.sampled:
        message = "{key} works in discrete time, but the plant is not sampled"
        yield PathDiagnostic("unsuitable-key", message, _SAMPLED, path)
    channels = (plant.inputs, plant.outputs)
    has = f"but the plant has {_channels(plant)}"
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


def control_fits(spec: Spec) -> _Found:
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


def channels(spec: Spec) -> _Found:
    """Check that a list per channel is as long as there are inputs or outputs."""
    if spec.plant.kind == "regression":
        return
    given = spec.given.rows if spec.given is not None and spec.given.type == "multisine" else None
    for noun, size in (("input", spec.plant.inputs), ("output", spec.plant.outputs)):
        for key in _PER_CHANNEL[noun]:
            value = given if key == "spectrum.given.amplitudes" else spec.at(*key.split("."))
            if isinstance(value, tuple) and len(value) != size:
                entries = "entry" if len(value) == 1 else "entries"
                message = f"{{key}} has {len(value)} {entries}; the plant's number of {noun}s is {size}"
                hint = f"write one entry per {noun}" + ("" if depth(value) > 1 else ", or a number")
                yield PathDiagnostic("wrong-shape", message, hint, parse_key(key))


def named_channels(spec: Spec) -> _Found:
    """Check that names and units belong to channels that the plant has."""
    sizes = ("u", spec.plant.inputs), ("y", spec.plant.outputs)
    there = [f"{letter}{i + 1}" for letter, count in sizes for i in range(count)]
    for name in spec.channels or ():
        if name not in there:
            message = f"the plant has no channel {name}"
            hint = f"it has {', '.join(there)}"
            yield PathDiagnostic("unknown-name", message, hint, ("channels", name), at_key=True)


def delays(spec: Spec) -> _Found:
    """Check that dead times end within the record and are not too many samples."""
    plant = spec.plant
    path: Path
    if plant.kind == "state_space":
        longest, path = plant.state_space.delay, ("plant", "state_space", "delay")
    elif plant.kind == "continuous":
        longest = max(max(row) for row in plant.continuous.delays)
        path = ("plant", "continuous", "dead_time" if plant.continuous.kind == "process" else "delay")
    else:
        return
    whole = spec.experiment.samples * spec.sample_time
    if "samples" in spec.experiment.model_fields_set and longest >= whole:
        message = f"{{key}} is {show(longest)} {spec.time_unit}, and the experiment lasts {show(whole)}"
        hint = "take more samples, or look at the time_unit"
        yield PathDiagnostic("delay-beyond-record", message, hint, path)
    elif plant.sampled and longest > _LONGEST_DELAY * spec.sample_time:
        message = f"{{key}} is more than {_LONGEST_DELAY} samples: {show(longest)} {spec.time_unit}"
        yield PathDiagnostic("too-large", message, "sample more slowly", path)


def bands(spec: Spec) -> _Found:
    """Check that bands end at pi/sample_time."""
    for path in _BANDS:
        band = spec.at(*path)
        if isinstance(band, tuple) and band[1] > spec.nyquist * (1 + _ROUNDING):
            yield _beyond(spec, band[1], path)


def frequencies(spec: Spec) -> _Found:
    """Check that given frequencies lie below pi/sample_time and within limits.band."""
    path = ("spectrum", "frequencies") if spec.given is None else ("spectrum", "given", "frequencies")
    listed = spec.at(*path)
    if not isinstance(listed, tuple):
        return
    if listed[-1] > spec.nyquist * (1 + _ROUNDING):
        at = next(i for i, w in enumerate(listed) if w > spec.nyquist * (1 + _ROUNDING))
        yield _beyond(spec, listed[at], (*path, at))
    low, high = spec.limits.band or (0.0, math.inf)
    for i, w in enumerate(listed):
        if not low * (1 - _ROUNDING) <= w <= high * (1 + _ROUNDING):
            message = f"{{key}} is {show(w)}, outside limits.band [{show(low)}, {show(high)}]"
            hint = "remove the frequency or widen the band"
            yield PathDiagnostic("bad-band", message, hint, (*path, i))
            return


def _beyond(spec: Spec, frequency: float, path: Path) -> PathDiagnostic:
    unit, most = f"rad/{spec.time_unit}", show(spec.nyquist)
    message = f"{{key}} reaches {show(frequency)}, beyond the Nyquist frequency {most} {unit}"
    hint = f"frequencies are in {unit} and end at pi/sample_time"
    return PathDiagnostic("beyond-nyquist", message, hint, path)


def something_asked(spec: Spec) -> _Found:
    """Check that a design has a requirement or a criterion; an analysis of a given excitation needs none."""
    accuracy = spec.accuracy
    if spec.designs and not accuracy.requirements and not accuracy.goals:
        message = "nothing is asked of the model: accuracy holds neither a requirement nor a criterion"
        hint = (
            "write accuracy: {model_error: {relative: 0.01}}, accuracy: {criterion: D} for the best within "
            "limits, or give the excitation under spectrum.given"
        )
        if spec.plant.kind == "regression":
            weights = f"estimated: {[1] * spec.plant.regression.estimated}, neglected_norm: 1.0"
            message = "nothing is asked of the regression"
            hint = f"write accuracy: {{mean_squared_error: {{target: 1.0, {weights}}}}}"
        yield PathDiagnostic("nothing-asked", message, hint, ("accuracy",))
    if "scale" in accuracy.model_fields_set and accuracy.criterion is None:
        message = "{key} is the scale of a criterion, and there is none"
        hint = "add criterion: D (or A, E, T), or remove scale"
        yield PathDiagnostic("unsuitable-key", message, hint, ("accuracy", "scale"))


def goals_agree(spec: Spec) -> _Found:
    """Check that there is at most one goal, and that the keys of the objective are complete."""
    accuracy, objective = spec.accuracy, spec.objective
    for extra in accuracy.goals[1:]:
        message = f"{{key}} and accuracy.{accuracy.goals[0]} both ask for the best experiment"
        where = ("accuracy", extra)
        yield PathDiagnostic("conflicting-keys", message, "keep one of the two", where, at_key=True)
    if not spec.designs or not (accuracy.requirements or accuracy.goals):
        return
    message = hint = ""
    if objective in ("least_cost", "shortest_experiment") and accuracy.goals:
        message = f"{objective} meets requirements, but accuracy asks for the best {accuracy.goals[0]}"
        hint = f"write objective: best_accuracy, or a requirement in place of {accuracy.goals[0]}"
    elif objective == "best_accuracy" and not accuracy.goals and accuracy.mean_squared_error is not None:
        message = "best_accuracy asks for the least mean-squared error, but a target for it is given"
        hint = "remove the target of mean_squared_error, or write objective: least_cost"
    if message:
        yield PathDiagnostic("contradictory-objective", message, hint, ("objective",))


def limits_present(spec: Spec) -> _Found:
    """Check that some limit bounds the power; otherwise the best experiment would not exist."""
    asked = (*spec.accuracy.goals, *spec.accuracy.requirements)
    if not spec.designs or spec.limits.bounds_power:
        return
    keys = "limits.input_power, limits.output_power, limits.excitation_power or limits.amplitude"
    path = ["objective"]
    if spec.goal == "shortest_experiment" and spec.plant.kind != "regression":  # refused for a regression
        message = "the shortest experiment needs a limit on power: otherwise one strong sample would do"
    elif spec.goal == "best_accuracy" and asked:
        message = f"accuracy.{asked[0]} is to be the best that limits allow, but nothing limits its power"
        path = ["accuracy", asked[0]]
        keys = "limits.energy" if spec.plant.kind == "regression" else keys
    else:
        return
    where = ["limits"] if "limits" in spec.model_fields_set else path
    yield PathDiagnostic("needs-limits", message, f"add {keys}", tuple(where))


def lengths_agree(spec: Spec) -> _Found:
    """Check that the experiment is not longer than its limit."""
    most = spec.limits.samples
    if most is not None and spec.goal != "shortest_experiment" and spec.experiment.samples > most:
        samples = spec.experiment.samples
        message = f"{{key}} is {samples}, more than limits.samples ({most})"
        hint = "shorten the experiment or raise the limit"
        yield PathDiagnostic("conflicting-keys", message, hint, ("experiment", "samples"))


# Checks by the keys that they rest on. If one of these could not be read, they would mislead and are skipped.
CHECKS: dict[tuple[str, ...], tuple[Callable[[Spec], _Found], ...]] = {
    ("plant", "sample_time", "experiment.controller"): (
        *(plant_is_stable, controllers_fit, noise_fits, names_differ, true_system_fits, spectrum_fits),
        *(regression_fits, weights_fit, control_fits, channels, named_channels, delays, bands, frequencies),
        sensitivity_has_loop,
    ),
    ("accuracy", "spectrum.given", "objective", "limits"): (something_asked, goals_agree, limits_present),
    ("experiment", "limits", "objective"): (lengths_agree,),
}

# Checks that are left out if a model is only to be estimated.
OF_DESIGNS = (something_asked, limits_present)


def related(path: Path, broken: Iterable[Path]) -> bool:
    """Return whether the path is one of the broken ones, contains one, or lies inside one."""
    return any(path[: len(b)] == b or b[: len(path)] == path for b in broken)


def run_checks(spec: Spec, broken: set[Path], *, design: bool) -> list[PathDiagnostic]:
    """Return the diagnostics of all checks whose keys are not `broken`; `OF_DESIGNS` only with `design`."""
    return [
        found
        for keys, checks in CHECKS.items()
        if not (broken and any(related(parse_key(key), broken) for key in keys))
        for check in checks
        if design or check not in OF_DESIGNS
        for found in check(spec)
    ]
