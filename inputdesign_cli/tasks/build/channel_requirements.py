"""Spec -> what is required of every entry of G: its model error and its weighted variance over frequency."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from inputdesign_cli.accuracy import (
    Absolute,
    AdmissibleError,
    ContinuousWeight,
    EllipsoidEntryError,
    EntryError,
    EntryVariance,
    LoopSensitivity,
    NormError,
    RelativeEntry,
    RelativeNorm,
    Weighted,
    active_entries,
)
from inputdesign_cli.accuracy.model_error import check_positive
from inputdesign_cli.information import ChannelExperiment
from inputdesign_cli.plant import ChannelModel, Rational
from inputdesign_cli.plant.polynomial import Array
from inputdesign_cli.specification import Spec
from inputdesign_cli.specification.models.transfer import ContinuousTransfer, DiscreteTransfer
from inputdesign_cli.tasks.build.bound_table import read_bound
from inputdesign_cli.tasks.build.channels import frequency_unit, stable_loop
from inputdesign_cli.tasks.build.experiment import rational, weight
from inputdesign_cli.tasks.build.model_error import model_error_alpha, no_feedback
from inputdesign_cli.tasks.build.tables import has_column

_ERROR = "accuracy.model_error"


def build_entry_errors(
    spec: Spec, experiment: Any
) -> tuple[EntryError | EllipsoidEntryError | NormError, ...]:
    """`accuracy.model_error` for every entry of G, or of its norm; empty when it is not asked for.

    Raises:
        SpecError: `not-supported` forms, `admissible-not-positive`.
        DataError: the table cannot be used.
    """
    error = spec.accuracy.model_error
    if error is None:
        return ()
    band = required_band(spec, experiment, error.band)
    weighted = None if error.weight is None else any_weight(spec, error.weight, f"{_ERROR}.weight")
    alpha = model_error_alpha(spec, experiment)
    if error.norm == "frobenius" or error.sensitivity is not None:
        return (_of_the_norm(spec, experiment, alpha, band, weighted),)
    errors: list[EntryError | EllipsoidEntryError] = []
    for i, j in active_entries(experiment.model, band[1]):
        admissible = _admissible(spec, experiment, band, i, j)
        if weighted is not None:
            admissible = Weighted(admissible, weighted)
        errors.append(
            EntryError(experiment, admissible, alpha, band, output=i, input=j)
            if error.region == "first_order"
            else _over_ellipsoid(spec, experiment, admissible, alpha, band, i, j)
        )
        _check_positive(spec, admissible, errors[-1].grid)
    return tuple(errors)


def unstated_errors(spec: Spec, experiment: Any) -> tuple[EntryError, ...]:
    """What has r_u of every entry where no bound on it is stated."""
    band, alpha = required_band(spec, experiment, None), model_error_alpha(spec, experiment)
    return tuple(
        EntryError(experiment, Absolute(1.0), alpha, band, output=i, input=j)
        for i, j in active_entries(experiment.model, band[1])
    )


def _over_ellipsoid(
    spec: Spec,
    experiment: Any,
    admissible: AdmissibleError,
    alpha: float,
    band: tuple[float, float],
    i: int,
    j: int,
) -> EllipsoidEntryError:
    error = spec.accuracy.model_error
    assert error is not None
    if not experiment.model.is_fraction(i, j):
        raise spec.complain(
            "not-supported",
            f"region: ellipsoid needs entries that are fractions linear in the parameters; [{i + 1},{j + 1}] "
            "is not: it has both A and F, or is sampled from s",
            hint="use region: first_order for this structure",
            key=f"{_ERROR}.region",
        )
    against: Literal["relative", "absolute"] = "absolute" if error.relative is None else "relative"
    return EllipsoidEntryError(experiment, admissible, alpha, against, band, output=i, input=j)


def _of_the_norm(
    spec: Spec,
    experiment: Any,
    alpha: float,
    band: tuple[float, float],
    weighted: Rational | ContinuousWeight | None,
) -> NormError:
    """The requirement on the Frobenius norm of the error.

    Raises:
        SpecError: `not-supported`, `no-feedback`, `admissible-not-positive`; an unstable loop to be kept.
        DataError: the table cannot be used.
    """
    error = spec.accuracy.model_error
    assert error is not None
    if error.region != "first_order":
        raise spec.complain(
            "not-supported",
            "region: ellipsoid is for the entries of G one by one, not for the norm of the error",
            hint="use region: first_order, or norm: entry with relative, absolute or table",
            key=f"{_ERROR}.region",
        )
    admissible: AdmissibleError
    if error.relative is not None:
        admissible = RelativeNorm(experiment.model, error.relative)
    elif error.absolute is not None:
        admissible = Absolute(error.absolute)
    elif error.table is not None:
        admissible = read_bound(spec, error.table, band, unit=frequency_unit(spec))
    else:
        admissible = _sensitivity(spec, experiment.model)
    if weighted is not None:
        admissible = Weighted(admissible, weighted)
    requirement = NormError(experiment, admissible, alpha, band)
    _check_positive(spec, admissible, requirement.grid)
    return requirement


def _check_positive(spec: Spec, admissible: AdmissibleError, grid: Array) -> None:
    check_positive(admissible, grid, unit=frequency_unit(spec), named=f"rad/{spec.time_unit}")


def _sensitivity(spec: Spec, model: ChannelModel) -> LoopSensitivity:
    assert spec.accuracy.model_error is not None
    asked, key = spec.accuracy.model_error.sensitivity, f"{_ERROR}.sensitivity"
    assert asked is not None
    given = asked.controller or spec.experiment.controller
    assert given is not None  # the spec has been checked
    loop = stable_loop(model, given)
    if not np.any(loop.controller.numerator):
        raise no_feedback(spec, key)
    weight = asked.weight
    peak = Rational.build([1.0 if asked.max_db is None else 10 ** (-asked.max_db / 20)])
    return LoopSensitivity(loop, peak if weight is None else rational(weight))


def _admissible(
    spec: Spec, experiment: ChannelExperiment, band: tuple[float, float], i: int, j: int
) -> AdmissibleError:
    """r_adm of one entry; of a table its column r_adm_21, or r_adm for all entries alike."""
    error = spec.accuracy.model_error
    assert error is not None
    if error.relative is not None:
        return RelativeEntry(experiment.model, error.relative, i, j)
    if error.absolute is not None:
        return Absolute(error.absolute)
    assert error.table is not None
    own = f"r_adm_{i + 1}{j + 1}"
    several = has_column(spec.resolve_path(error.table), "r_adm_", key=f"{_ERROR}.table")
    unit = frequency_unit(spec)
    return read_bound(spec, error.table, band, unit=unit, column=own if several else "r_adm")


def any_weight(
    spec: Spec, transfer: DiscreteTransfer | ContinuousTransfer, key: str
) -> Rational | ContinuousWeight:
    """A weight in the time of the plant.

    Raises:
        SpecError: `not-sampled` for a weight in s of a sampled plant that does not say how it is sampled;
            `unsuitable-key` for one in q^-1 of a plant in continuous time.
    """
    if spec.plant.sampled:
        return weight(spec, transfer, key)
    if not isinstance(transfer, ContinuousTransfer):
        raise spec.complain(
            "unsuitable-key",
            f"{key} is in q^-1, but the plant is in continuous time",
            hint="write continuous: {numerator: [..], denominator: [..]} in s",
            key=key,
        )
    ratio = transfer.continuous
    return ContinuousWeight(np.array(ratio.numerator), np.array(ratio.denominator_polynomial))


def build_entry_variances(spec: Spec, experiment: Any) -> list[EntryVariance]:
    """`accuracy.weighted_variance` for every entry of G, in raw coordinates; empty when not asked for.

    Raises:
        SpecError: `not-sampled` for a weight in s of a sampled plant that does not say how it is sampled.
    """
    stated, key = spec.accuracy.weighted_variance, "accuracy.weighted_variance.weight"
    if stated is None:
        return []
    W: Any = Rational.build([1.0]) if stated.weight is None else any_weight(spec, stated.weight, key)
    band = required_band(spec, experiment, stated.band)
    return [
        EntryVariance(experiment, W, stated.max, band, stated.relative, output=i, input=j)
        for i, j in active_entries(experiment.model, band[1])
    ]


def required_band(
    spec: Spec, experiment: ChannelExperiment, stated: tuple[float, float] | None
) -> tuple[float, float]:
    """The band of a requirement: as stated, or all frequencies, in continuous time those that are excited."""
    if stated is not None:
        lo, hi = (edge * frequency_unit(spec) for edge in stated)
        return lo, float(min(hi, np.pi)) if spec.plant.sampled else hi
    return (0.0, float(np.pi)) if spec.plant.sampled else experiment.band
