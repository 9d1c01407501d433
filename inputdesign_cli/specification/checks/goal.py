"""Check that the question of a design is complete and without contradiction, and has a finite answer."""

from __future__ import annotations

from collections.abc import Iterator

from inputdesign_cli.specification.models.section import PathDiagnostic
from inputdesign_cli.specification.models.spec import Spec
from inputdesign_cli.specification.models.wording import choices


def something_asked(spec: Spec) -> Iterator[PathDiagnostic]:
    """A design needs a requirement or a criterion; an analysis of a given excitation does not."""
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
    """At most one goal, and an objective that has what it needs."""
    accuracy, objective = spec.accuracy, spec.objective
    for extra in accuracy.goals[1:]:
        message = f"{{key}} and accuracy.{accuracy.goals[0]} both ask for the best experiment"
        where = ("accuracy", extra)
        yield PathDiagnostic("conflicting-keys", message, "keep one of the two", where, at_key=True)
    if not spec.designs or not (accuracy.requirements or accuracy.goals):
        return
    found = ("", "")
    goal = f"accuracy.{accuracy.goals[0]}" if accuracy.goals else ""
    if objective in ("least_cost", "shortest_experiment") and not accuracy.requirements:
        goals = choices(accuracy.goals)
        message = f"{objective} needs a requirement to meet, but accuracy only holds {goals}"
        found = message, "add accuracy.model_error, or write objective: best_accuracy"
    elif objective in ("least_cost", "shortest_experiment") and goal:
        message = f"{objective} leaves nothing to optimise for {goal}"
        found = message, f"remove {goal}, or write objective: best_accuracy"
    elif objective == "best_accuracy" and not goal and accuracy.mean_squared_error is not None:
        message = "best_accuracy asks for the least mean-squared error, but a target for it is given"
        found = message, "remove the target of mean_squared_error, or write objective: least_cost"
    if any(found):
        yield PathDiagnostic("contradictory-objective", *found, ("objective",))


def limits_present(spec: Spec) -> Iterator[PathDiagnostic]:
    """Without a limit on power the best experiment has no end, and the shortest is one sample."""
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
    """The experiment is no longer than it may be."""
    most = spec.limits.samples
    if most is not None and spec.goal != "shortest_experiment" and spec.experiment.samples > most:
        samples = spec.experiment.samples
        message = f"{{key}} is {samples}, more than limits.samples ({most})"
        hint = "shorten the experiment or raise the limit"
        yield PathDiagnostic("conflicting-keys", message, hint, ("experiment", "samples"))
