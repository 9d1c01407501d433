"""Spec -> the requirement on the model error over frequency."""

from __future__ import annotations

from typing import Literal

import numpy as np
import scipy.special

from inputdesign_cli.accuracy import (
    Absolute,
    AdmissibleError,
    EllipsoidError,
    ModelError,
    Relative,
    Sensitivity,
    Weighted,
)
from inputdesign_cli.accuracy.model_error import check_positive
from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import ChannelExperiment, Experiment
from inputdesign_cli.plant import Loop, Rational
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.accuracy import DEFAULT_CONFIDENCE
from inputdesign_cli.specification.models.controller import ControllerMatrix
from inputdesign_cli.tasks.build.bound_table import read_bound
from inputdesign_cli.tasks.build.experiment import rational, weight

_KEY = "accuracy.model_error"


def confidence_factor(probability: float, parameters: int) -> float:
    """alpha with Pr(chi-squared with this many degrees of freedom <= alpha^2) = probability."""
    return float(np.sqrt(2.0 * scipy.special.gammaincinv(parameters / 2.0, probability)))


def build_model_error(spec: Spec, experiment: Experiment) -> ModelError | EllipsoidError:
    """`accuracy.model_error` in raw coordinates; `dataclasses.replace` moves it to others.

    Raises:
        SpecError: the form is not supported, or r_adm is not positive somewhere in the band.
        DataError: the table cannot be used.
    """
    error = spec.accuracy.model_error
    if error is None:
        raise ValueError("the spec states no model_error")
    band = sampled_band(spec, error.band)
    admissible = _admissible(spec, experiment, band)
    if error.weight is not None:
        admissible = Weighted(admissible, weight(spec, error.weight, f"{_KEY}.weight"))
    alpha = model_error_alpha(spec, experiment)
    requirement: ModelError | EllipsoidError
    if error.region == "first_order":
        requirement = ModelError(experiment, admissible, alpha, band)
    else:
        model = experiment.model
        if len(model.A) > 1 and len(model.F) > 1:
            raise spec.complain(
                "not-supported",
                "region: ellipsoid needs a denominator that is linear in the parameters, A or F but not both",
                hint="use region: first_order for this structure",
                key=f"{_KEY}.region",
            )
        against: Literal["relative", "absolute"] = "absolute" if error.relative is None else "relative"
        requirement = EllipsoidError(experiment, admissible, alpha, against, band)
    check_positive(admissible, requirement.grid, unit=spec.sample_time, named=f"rad/{spec.time_unit}")
    return requirement


def no_feedback(spec: Spec, key: str) -> SpecError:
    """The diagnostic about a sensitivity without a controller."""
    return spec.complain(
        "no-feedback",
        "the controller is zero: no model error can harm the sensitivity",
        hint="give the controller of the loop to be kept",
        key=key,
    )


def model_error_alpha(spec: Spec, experiment: Experiment | ChannelExperiment) -> float:
    """alpha as given, or from the confidence and the number of parameters of G."""
    error = spec.accuracy.model_error
    if error is not None and error.alpha is not None:
        return error.alpha
    probability = (error.probability if error is not None else None) or DEFAULT_CONFIDENCE
    return confidence_factor(probability, int(np.sum(experiment.model.in_plant)))


def sampled_band(spec: Spec, band: tuple[float, float] | None) -> tuple[float, float]:
    """A band of the spec in rad/sample."""
    lo, hi = spec.clip_band(band)
    return lo * spec.sample_time, min(hi * spec.sample_time, float(np.pi))


def _admissible(spec: Spec, experiment: Experiment, band: tuple[float, float]) -> AdmissibleError:
    error = spec.accuracy.model_error
    assert error is not None
    model = experiment.model
    if error.relative is not None:
        return Relative(model, error.relative)
    if error.absolute is not None:
        return Absolute(error.absolute)
    if error.table is not None:
        return read_bound(spec, error.table, band, unit=spec.sample_time)
    sensitivity = error.sensitivity
    assert sensitivity is not None
    given = sensitivity.controller or spec.experiment.controller
    assert not isinstance(given, ControllerMatrix)  # the spec has been checked
    assert given is not None
    controller = rational(given)
    Loop(model, controller).check_stability()
    if not np.any(controller.numerator):
        raise no_feedback(spec, f"{_KEY}.sensitivity")
    if sensitivity.max_db is not None:
        return Sensitivity(model, controller, Rational.build([10 ** (-sensitivity.max_db / 20)]))
    weight = sensitivity.weight
    assert weight is not None
    return Sensitivity(model, controller, rational(weight))
