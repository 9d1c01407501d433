"""Spec -> requirements on the accuracy of the model and criteria, as makers for any coordinates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Protocol, cast

import numpy as np
from numpy.typing import ArrayLike

from inputdesign_cli.accuracy import Criterion, InformationTarget, WeightedVariance, active_entries
from inputdesign_cli.accuracy.requirement import OverFrequency
from inputdesign_cli.design.convex.demands import RequirementFactory
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import Model
from inputdesign_cli.questions.building import model_error
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.system import embedded
from inputdesign_cli.questions.building.weights import build_weight, check_finite
from inputdesign_cli.questions.common.infeasible import StatedBound
from inputdesign_cli.specification import Spec

_RELATIVE_ZERO = 1e-9


class AddedRequirement(Protocol):
    """Describes a section of `accuracy` that another package adds (`specification.plugins`)."""

    def build(self, spec: Spec, experiment: Experiment) -> list[RequirementFactory]:
        """Return a function for each of its requirements, which makes it in the coordinates of a design."""


def build_requirements(
    spec: Spec, experiment: Experiment, nominal: Model | None = None
) -> list[RequirementFactory]:
    """Return a maker for each requirement of `accuracy`, in the order of its `requirements`.

    Requirements over frequency are made entry by entry of G. On a scenario, `nominal` is the plant of the
    spec. Raises `SpecError`: a name that the model does not have, a matrix of the wrong size, a
    requirement that cannot be met or is not supported. Or `DataError`: a table cannot be used.
    """
    accuracy, found = spec.accuracy, list[RequirementFactory]()
    for key in accuracy.requirements:
        match key:
            case "model_error" | "loop":
                found += [_maker(one) for one in model_error.build_model_errors(spec, experiment, nominal)]
            case "information" if (stated := accuracy.information) is not None:
                found.append(_target(spec, experiment, stated.matrix, stated.parameters, key))
            case "application" if (asked := accuracy.application) is not None:
                # M >= (chi2 gamma / 2) V'', chi2 the quantile for the parameters of the hessian
                chi2 = model_error.confidence_factor(asked.confidence, len(asked.parameters)) ** 2
                hessian = 0.5 * chi2 * asked.gamma * np.array(asked.hessian, dtype=float)
                found.append(_target(spec, experiment, hessian, asked.parameters, key))
            case "standard_deviation":
                for name, most in (accuracy.standard_deviation or {}).items():
                    found.append(_target(spec, experiment, [[1.0 / most**2]], (name,), key, f" of {name}"))
            case "weighted_variance":
                found += _weighted_variances(spec, experiment)
            case "frequency_response":
                pass  # it is measured without this model
            case _:
                found += cast(AddedRequirement, accuracy.at(key)).build(spec, experiment)
    return found


def build_criterion(spec: Spec, experiment: Experiment) -> Callable[[Experiment], Criterion] | None:
    """Return the maker of `accuracy.criterion`; `SpecError` (`zero-parameter`) without a relative error."""
    letter = spec.accuracy.criterion
    if letter is None:
        return None
    scale = np.ones(experiment.size)
    if spec.accuracy.scale == "relative":
        scale = experiment.model.theta
        if np.any(scale == 0.0):
            name = experiment.model.names[int(np.argmax(scale == 0.0))]
            message = f"{name} is zero, so that it has no relative error"
            hint = "use scale: absolute, or drop the parameter from the model"
            raise spec.complain("zero-parameter", message, hint=hint, key="accuracy.scale")

    def make(coordinates: Experiment) -> Criterion:
        factor = np.eye(coordinates.size) if coordinates.factor is None else coordinates.factor
        return Criterion(letter, scale[:, None] * factor)

    return make


def build_asked(
    spec: Spec, experiment: Experiment, nominal: Model | None = None
) -> tuple[list[RequirementFactory], list[RequirementFactory]]:
    """Return the makers of the goal of a design, and of the requirements besides a criterion; or raise."""
    requirements = build_requirements(spec, experiment, nominal)
    criterion = build_criterion(spec, experiment)
    return (requirements, []) if criterion is None else ([criterion], requirements)


def stated_bounds(spec: Spec) -> list[StatedBound]:
    """Return the numbers of `accuracy` that are proportional to a power of the admitted error.

    There are none for a bound over the whole confidence ellipsoid, whose error is not proportional to it.
    """
    accuracy = spec.accuracy
    if accuracy.error is not None and accuracy.error.region == "ellipsoid":
        return []
    rows = [
        ("model_error.relative", "relative", 1),
        ("model_error.absolute", "absolute", 1),
        ("application.gamma", "gamma", -2),
        ("weighted_variance.max", "weighted_variance", 2),
    ]
    stated = [(f"accuracy.{key}", label, accuracy.at(*key.split(".")), power) for key, label, power in rows]
    stated += [
        (f"accuracy.standard_deviation.{name}", f"standard_deviation of {name}", most, 1)
        for name, most in (accuracy.standard_deviation or {}).items()
    ]
    return [
        StatedBound(key, label, value, power=power, fraction=label == "relative")
        for key, label, value, power in stated
        if isinstance(value, float)
    ]


def _maker(requirement: OverFrequency) -> RequirementFactory:
    return lambda experiment: replace(requirement, experiment=experiment)


def _target(
    spec: Spec, raw: Experiment, matrix: ArrayLike, names: Sequence[str] | None, key: str, of: str = ""
) -> RequirementFactory:
    full = embedded(spec, raw.model.names, np.array(matrix, dtype=float), names, f"accuracy.{key}")
    return lambda experiment: InformationTarget(experiment.whiten_matrix(full), key + of)


def _weighted_variances(spec: Spec, experiment: Experiment) -> list[RequirementFactory]:
    """Require `accuracy.weighted_variance` of every entry of G that is present."""
    stated, key = spec.accuracy.weighted_variance, "accuracy.weighted_variance"
    assert stated is not None
    weight = build_weight(spec, stated.weight, f"{key}.weight")
    band = model_error.required_band(spec, experiment, stated.band)
    check_finite(spec, weight, band, "admissible-not-positive", f"{key}.weight")
    bound = partial(WeightedVariance, experiment=experiment, band=band, weight=weight, limit=stated.max)
    entries = active_entries(experiment.model, band[1])
    found = [bound(entry=entry, relative=stated.relative) for entry in entries]
    for variance in found:
        model_error.check_bounded(spec, variance, key)
        if not stated.relative:
            continue
        units, size = build_units(spec), variance.nominal_size(variance.grid)
        if size.min() <= _RELATIVE_ZERO * np.median(size):
            at = units.named(variance.grid[int(np.argmin(size))])
            entry = variance.entry
            named = f"entry {units.entry(*entry)} of G" if entry and not units.single else "G"
            message = f"{named} vanishes at {at}: its relative variance is infinite there"
            hint = "restrict `band` to the frequencies that matter"
            raise spec.complain("admissible-not-positive", message, hint=hint, key=key)
    return [_maker(variance) for variance in found]
