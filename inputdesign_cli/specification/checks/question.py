"""Check that a question is complete and without contradiction, and that its lists fit; run all checks.

Each check is a function of the spec that yields diagnostics with absolute paths.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator

from inputdesign_cli.specification.checks import plant
from inputdesign_cli.specification.models.fields import depth
from inputdesign_cli.specification.models.section import PathDiagnostic
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.wording import show
from inputdesign_cli.specification.yaml.places import Path, parse_key

ROUNDING = 1e-4
"""3.1416 is meant as pi."""
_LONGEST_DELAY = 1000

# Every key that takes a list with one entry per input or output.
_PER_CHANNEL = {
    "input": (
        *("cost.input_power", "cost.excitation_power", "limits.rate", "limits.amplitude.input"),
        *("limits.input_power.max", "limits.input_power.min"),
        *("limits.excitation_power.max", "limits.excitation_power.min"),
        *("signal.amplitudes", "signal.offset", "signal.quantisation.range"),
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
_BANDS = (
    ("limits", "band"),
    ("accuracy", "model_error", "band"),
    ("accuracy", "loop", "band"),
    ("accuracy", "weighted_variance", "band"),
    ("accuracy", "frequency_response", "band"),
    ("spectrum", "band"),
)


def channels(spec: Spec) -> Iterator[PathDiagnostic]:
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


def named_channels(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that names and units belong to channels that the plant has."""
    sizes = ("u", spec.plant.inputs), ("y", spec.plant.outputs)
    there = [f"{letter}{i + 1}" for letter, count in sizes for i in range(count)]
    for name in spec.channels or ():
        if name not in there:
            message = f"the plant has no channel {name}"
            hint = f"it has {', '.join(there)}"
            yield PathDiagnostic("unknown-name", message, hint, ("channels", name), at_key=True)


def delays(spec: Spec) -> Iterator[PathDiagnostic]:
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


def bands(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that bands end at pi/sample_time."""
    for path in _BANDS:
        band = spec.at(*path)
        if isinstance(band, tuple) and band[1] > spec.nyquist * (1 + ROUNDING):
            yield _beyond(spec, band[1], path)


def frequencies(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that given frequencies lie below pi/sample_time and within limits.band."""
    path = ("spectrum", "frequencies") if spec.given is None else ("spectrum", "given", "frequencies")
    listed = spec.at(*path)
    if not isinstance(listed, tuple):
        return
    if listed[-1] > spec.nyquist * (1 + ROUNDING):
        at = next(i for i, w in enumerate(listed) if w > spec.nyquist * (1 + ROUNDING))
        yield _beyond(spec, listed[at], (*path, at))
    low, high = spec.limits.band or (0.0, math.inf)
    for i, w in enumerate(listed):
        if not low * (1 - ROUNDING) <= w <= high * (1 + ROUNDING):
            message = f"{{key}} is {show(w)}, outside limits.band [{show(low)}, {show(high)}]"
            hint = "remove the frequency or widen the band"
            yield PathDiagnostic("bad-band", message, hint, (*path, i))
            return


def _beyond(spec: Spec, frequency: float, path: Path) -> PathDiagnostic:
    unit, most = f"rad/{spec.time_unit}", show(spec.nyquist)
    message = f"{{key}} reaches {show(frequency)}, beyond the Nyquist frequency {most} {unit}"
    hint = f"frequencies are in {unit} and end at pi/sample_time"
    return PathDiagnostic("beyond-nyquist", message, hint, path)


def something_asked(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that a design has a requirement or a criterion; an analysis of a given excitation needs none."""
    accuracy = spec.accuracy
    if spec.designs and not accuracy.requirements and not accuracy.goals:
        message = "nothing is asked of the model: accuracy holds neither a requirement nor a criterion"
        hint = (
            "write accuracy: {model_error: {relative: 0.01}}, accuracy: {criterion: D} for the best within "
            "limits, or give the excitation under spectrum.given"
        )
        yield PathDiagnostic("nothing-asked", message, hint, ("accuracy",))
    if "scale" in accuracy.model_fields_set and accuracy.criterion is None:
        message = "{key} is the scale of a criterion, and there is none"
        hint = "add criterion: D (or A, E, T), or remove scale"
        yield PathDiagnostic("unsuitable-key", message, hint, ("accuracy", "scale"))


def goals_agree(spec: Spec) -> Iterator[PathDiagnostic]:
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


def limits_present(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that some limit bounds the power; otherwise the best experiment would not exist."""
    asked = (*spec.accuracy.goals, *spec.accuracy.requirements)
    if not spec.designs or spec.limits.bounds_power:
        return
    keys = "limits.input_power, limits.output_power, limits.excitation_power or limits.amplitude"
    path = ["objective"]
    if spec.goal == "shortest_experiment":
        message = "the shortest experiment needs a limit on power: otherwise one strong sample would do"
    elif spec.goal == "best_accuracy" and asked:
        message = f"accuracy.{asked[0]} is to be the best that limits allow, but nothing limits its power"
        path = ["accuracy", asked[0]]
        keys = "limits.energy" if spec.plant.kind == "regression" else keys
    else:
        return
    where = ["limits"] if "limits" in spec.model_fields_set else path
    yield PathDiagnostic("needs-limits", message, f"add {keys}", tuple(where))


def lengths_agree(spec: Spec) -> Iterator[PathDiagnostic]:
    """Check that the experiment is not longer than its limit."""
    most = spec.limits.samples
    if most is not None and spec.goal != "shortest_experiment" and spec.experiment.samples > most:
        samples = spec.experiment.samples
        message = f"{{key}} is {samples}, more than limits.samples ({most})"
        hint = "shorten the experiment or raise the limit"
        yield PathDiagnostic("conflicting-keys", message, hint, ("experiment", "samples"))


Check = Callable[[Spec], Iterator[PathDiagnostic]]

# The keys that each check reads. It is skipped if one could not be read: its answer would mislead.
CHECKS: tuple[tuple[Check, tuple[str, ...]], ...] = (
    (lambda spec: plant.check_stable(spec, spec.plant, "plant"), ("plant", "experiment.controller")),
    (plant.controllers_fit, ("plant", "experiment.controller", "accuracy.model_error.sensitivity")),
    (lambda spec: plant.check_noise(spec, spec.noise, "noise"), ("plant", "noise")),
    (plant.names_differ, ("plant.parameters", "noise")),
    (plant.true_system_fits, ("plant", "simulation.plant", "experiment.controller")),
    (plant.true_noise_fits, ("plant", "simulation.noise")),
    (plant.spectrum_fits, ("plant", "spectrum.type")),
    (plant.regression_fits, ("plant", "accuracy.mean_squared_error")),
    (plant.weights_fit, ("plant.sample", "plant.continuous", "limits.spectrum")),
    (plant.control_fits, ("plant", "accuracy.closed_loop_error")),
    (channels, ("plant",)),
    (named_channels, ("plant", "channels")),
    (delays, ("plant", "sample_time", "experiment.samples")),
    (bands, ("plant.sample", "sample_time", "plant.continuous")),
    (frequencies, ("plant.sample", "sample_time", "limits.band")),
    (something_asked, ("accuracy", "spectrum.given", "objective")),
    (goals_agree, ("accuracy", "spectrum.given", "objective")),
    (limits_present, ("accuracy", "limits", "objective", "spectrum.given", "plant")),
    (plant.sensitivity_has_loop, ("experiment.controller", "accuracy.model_error.sensitivity")),
    (lengths_agree, ("experiment.samples", "limits.samples", "objective")),
)

# These checks do not matter if a model is only to be estimated.
OF_DESIGNS = (something_asked, limits_present)


def related(path: Path, broken: Iterable[Path]) -> bool:
    """Return whether the path is one of the broken ones, contains one, or lies inside one."""
    return any(path[: len(b)] == b or b[: len(path)] == path for b in broken)


def run_checks(spec: Spec, broken: set[Path], *, design: bool) -> list[PathDiagnostic]:
    """Return the diagnostics of all checks whose keys are not `broken`; of designs only with `design`."""
    return [
        found
        for check, reads in CHECKS
        if (design or check not in OF_DESIGNS) and not any(related(parse_key(key), broken) for key in reads)
        for found in check(spec)
    ]
