"""Spec -> requirements on the accuracy of the model and criteria, as makers for any coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.accuracy import (
    Criterion,
    EllipsoidError,
    InformationTarget,
    ModelError,
    WeightedVariance,
)
from inputdesign_cli.design.convex.problem import RequirementFactory
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import Rational
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.specification import Spec
from inputdesign_cli.tasks.build.experiment import embedded, weight
from inputdesign_cli.tasks.build.model_error import confidence_factor, sampled_band

_RELATIVE_ZERO = 1e-9


def build_requirements(
    spec: Spec, experiment: Experiment, error: ModelError | EllipsoidError | None
) -> list[RequirementFactory]:
    """One maker for each requirement that `accuracy` states, in the order of the contract.

    Args:
        error: the one on the model error, from `build_model_error`.

    Raises:
        SpecError: a name that the model does not have, a matrix of the wrong size, a requirement that
            cannot be met or is not supported.
        DataError: a table cannot be used.
    """
    makers: list[RequirementFactory] = []
    accuracy = spec.accuracy
    if error is not None:
        makers.append(lambda e: replace(error, experiment=e))
    if accuracy.information is not None:
        target = accuracy.information
        makers.append(
            _target(spec, experiment, target.matrix, target.parameters, "accuracy.information", "information")
        )
    if accuracy.application is not None:
        makers.append(_application(spec, experiment))
    if accuracy.weighted_variance is not None:
        variance = _weighted_variance(spec, experiment)
        makers.append(lambda e: replace(variance, experiment=e))
    for name, deviation in (accuracy.standard_deviation or {}).items():
        key = "accuracy.standard_deviation"
        precision = np.array([[1.0 / deviation**2]])
        makers.append(_target(spec, experiment, precision, (name,), key, f"standard_deviation of {name}"))
    return makers


def build_criterion(spec: Spec, experiment: Experiment) -> RequirementFactory | None:
    """`accuracy.criterion`, of the parameters or of their relative errors.

    Raises:
        SpecError: `zero-parameter` when a relative error of a parameter that is zero is asked for.
    """
    letter = spec.accuracy.criterion
    if letter is None:
        return None
    scale = np.ones(experiment.size)
    if spec.accuracy.scale == "relative":
        scale = experiment.model.theta
        if np.any(scale == 0.0):
            name = experiment.model.names[int(np.argmax(scale == 0.0))]
            raise spec.complain(
                "zero-parameter",
                f"{name} is zero, so that it has no relative error",
                hint="use scale: absolute, or drop the parameter from the model",
                key="accuracy.scale",
            )

    def make(coordinates: Experiment) -> Criterion:
        factor = np.eye(coordinates.size) if coordinates.factor is None else coordinates.factor
        return Criterion(letter, scale[:, None] * factor)

    return make


def _target(
    spec: Spec,
    experiment: Experiment,
    matrix: Sequence[Sequence[float]] | Array,
    names: Sequence[str] | None,
    key: str,
    label: str,
) -> RequirementFactory:
    full = embedded(spec, experiment.model.names, np.array(matrix, dtype=float), names, key)
    return lambda e: InformationTarget(e.whiten_matrix(full), label)


def _application(spec: Spec, experiment: Experiment) -> RequirementFactory:
    """M >= (chi2 gamma / 2) V'', chi2 the quantile for all parameters that the hessian is over."""
    application = spec.accuracy.application
    assert application is not None
    chi2 = confidence_factor(application.confidence, len(application.parameters)) ** 2
    hessian = 0.5 * chi2 * application.gamma * np.array(application.hessian, dtype=float)
    return _target(spec, experiment, hessian, application.parameters, "accuracy.application", "application")


def _weighted_variance(spec: Spec, experiment: Experiment) -> WeightedVariance:
    variance, key = spec.accuracy.weighted_variance, "accuracy.weighted_variance"
    assert variance is not None
    transfer = variance.weight
    W = Rational.build([1.0]) if transfer is None else weight(spec, transfer, f"{key}.weight")
    band = sampled_band(spec, variance.band)
    requirement = WeightedVariance(experiment, W, variance.max, band, variance.relative)
    if variance.relative:
        G = np.abs(experiment.model.plant_at(requirement.grid))
        if G.min() <= _RELATIVE_ZERO * np.median(G):
            at = requirement.grid[int(np.argmin(G))] / spec.sample_time
            raise spec.complain(
                "admissible-not-positive",
                f"G vanishes at {at:.6g} rad/{spec.time_unit}, where its relative variance is infinite",
                hint="restrict `band` to the frequencies that matter",
                key=key,
            )
    return requirement
