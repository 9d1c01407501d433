"""Spec -> the question that a design answers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from inputdesign_cli.accuracy import EllipsoidError, ModelError
from inputdesign_cli.design.convex.designs import Question
from inputdesign_cli.design.convex.problem import Goal
from inputdesign_cli.information import Experiment, PowerKind
from inputdesign_cli.specification import Spec
from inputdesign_cli.spectrum import FirBasis
from inputdesign_cli.tasks.build.experiment import build_cost, build_experiment
from inputdesign_cli.tasks.build.limits import build_density_limits, build_power_limits
from inputdesign_cli.tasks.build.model_error import build_model_error, model_error_alpha
from inputdesign_cli.tasks.build.requirements import build_criterion, build_requirements
from inputdesign_cli.tasks.build.signal_checks import check_signal
from inputdesign_cli.tasks.build.spectra import band_of_lines, build_basis
from inputdesign_cli.tasks.result.ellipses import check_pairs


@dataclass(frozen=True)
class Task:
    """A spec in the words of the mathematics.

    `experiment` is of the length that the spec states (in `question` it has one sample where the
    length is sought). `alpha` sizes the confidence region of r_u; `model_error` is the requirement on it,
    if there is one.
    """

    question: Question
    experiment: Experiment
    cost: dict[PowerKind, float]
    alpha: float
    model_error: ModelError | EllipsoidError | None


def build_task(spec: Spec) -> Task:
    """Everything that can be wrong with the spec comes to light here, before anything is computed.

    Raises:
        SpecError, DataError: see the builders of the parts.
    """
    check_supported(spec)
    check_signal(spec)
    experiment = build_experiment(spec)
    error = build_model_error(spec, experiment) if spec.accuracy.model_error is not None else None
    requirements = build_requirements(spec, experiment, error)
    criterion = build_criterion(spec, experiment)
    cost = build_cost(spec)
    goal: Goal = "cost"
    if spec.goal == "best_accuracy":
        goal = "factor"
    elif spec.goal == "shortest_experiment":
        goal = "samples"
    experiment.whitened(1.0)  # says which parameters cannot be told apart
    check_pairs(spec, experiment.model.names)
    question = Question(
        experiment=replace(experiment, samples=1) if goal == "samples" else experiment,
        basis=build_basis(spec, experiment),
        goal=goal,
        requirements=requirements if criterion is None else [criterion],
        side=[] if criterion is None else requirements,
        cost=cost if goal == "cost" else {},
        limits=build_power_limits(spec),
        densities=build_density_limits(spec, experiment),
        band=band_of_lines(spec),
    )
    return Task(
        question=question,
        experiment=experiment,
        cost=cost,
        alpha=model_error_alpha(spec, experiment),
        model_error=error,
    )


def build_analysis(spec: Spec) -> Task:
    """The question of a given excitation: its requirements, if any, are checked, not met.

    Raises:
        SpecError: `nothing-given` when `spectrum.given` is missing; see the builders of the parts.
    """
    if spec.designs:
        raise spec.complain(
            "nothing-given",
            "there is no excitation to analyse",
            hint="give one, spectrum: {given: {type: white, power: 1}}, or design one: idesign solve SPEC",
            key="spectrum",
        )
    check_supported(spec)
    check_signal(spec)
    experiment = build_experiment(spec)
    error = build_model_error(spec, experiment) if spec.accuracy.model_error is not None else None
    requirements = build_requirements(spec, experiment, error)
    experiment.whitened(1.0)  # says which parameters cannot be told apart
    check_pairs(spec, experiment.model.names)
    question = Question(experiment, FirBasis(0), "cost", requirements)
    return Task(question, experiment, build_cost(spec), model_error_alpha(spec, experiment), error)


def check_supported(spec: Spec) -> None:
    """Say plainly what this version does not design yet, rather than ignore it.

    Raises:
        SpecError: `not-supported`.
    """

    def refuse(key: str, what: str, hint: str) -> Exception:
        return spec.complain("not-supported", f"this version does not {what}", hint=hint, key=key)

    for name in ("closed_loop_error", "mean_squared_error"):
        if getattr(spec.accuracy, name) is not None:
            raise refuse(f"accuracy.{name}", f"handle {name}", "state the accuracy as model_error")
    if spec.limits.energy is not None:
        raise refuse("limits.energy", "enforce limits.energy here", "limit input_power, its mean a sample")
    if spec.solver.method == "alternating":
        raise refuse("solver.method", "use the alternating method here", "use exchange or lmi")
    if spec.signal.order is not None:
        raise refuse("signal.order", "fit rational filters here", "remove it: noise comes from a long filter")
    if spec.solver.method == "lmi":
        _check_grid_method(spec)


def _check_grid_method(spec: Spec) -> None:
    """The papers' own program is for one requirement, a bound on the model error to first order."""
    plain = (
        spec.goal == "least_cost"
        and spec.accuracy.requirements == ("model_error",)
        and spec.accuracy.model_error is not None
        and spec.accuracy.model_error.region == "first_order"
        and getattr(spec.spectrum, "type", "fir") in ("fir", "white")
        and all(
            getattr(spec.limits, name) is None
            for name in type(spec.limits).model_fields
            if name not in ("amplitude", "rate")  # they bind the signal, not the spectrum
        )
    )
    if not plain:
        raise spec.complain(
            "not-supported",
            "solver.method lmi is the papers' program: the least cost of a FIR spectrum for model_error "
            "alone, without limits",
            hint="use method: exchange, which does the rest, at every frequency",
            key="solver.method",
        )


def lines_of_the_grid(spec: Spec, requirement: ModelError) -> np.ndarray:
    """The logarithmic frequency grid of solver.method lmi, in rad/sample."""
    lo, hi = requirement.band
    return np.geomspace(max(lo, 1e-3 * hi), hi, spec.solver.grid)
