"""Spec -> requirements on the accuracy of the model."""

from __future__ import annotations

import numpy as np
import scipy.special

from inputdesign_cli.accuracy import (
    Absolute,
    AdmissibleError,
    ModelError,
    Relative,
    Sensitivity,
    Table,
    Weighted,
)
from inputdesign_cli.assemble.experiment import rational
from inputdesign_cli.assemble.tables import read_columns
from inputdesign_cli.errors import Complaint, DataError
from inputdesign_cli.information import Experiment
from inputdesign_cli.plant import Loop, Rational
from inputdesign_cli.spec import Spec
from inputdesign_cli.spec.transfer import DiscreteTransfer

_KEY = "accuracy.model_error"


def confidence_factor(probability: float, parameters: int) -> float:
    """alpha with Pr(chi-squared with this many degrees of freedom <= alpha^2) = probability."""
    return float(np.sqrt(2.0 * scipy.special.gammaincinv(parameters / 2.0, probability)))


def build_model_error(spec: Spec, experiment: Experiment) -> ModelError:
    """`accuracy.model_error` in raw coordinates; `dataclasses.replace` moves it to others.

    Raises:
        SpecError: the form is not supported, or r_adm is not positive somewhere in the band.
        DataError: the table cannot be used.
    """
    error = spec.accuracy.model_error
    if error is None:
        raise ValueError("the spec states no model_error")
    if error.region != "first_order":
        raise spec.complain(
            "not-supported",
            "this version bounds the model error to first order",
            hint="write region: first_order, or leave the key out",
            key=f"{_KEY}.region",
        )
    model = experiment.model
    lo, hi = spec.clip_band(error.band)
    band = (lo * spec.sample_time, min(hi * spec.sample_time, np.pi))
    admissible = _admissible(spec, experiment, band)
    if error.weight is not None:
        if not isinstance(error.weight, DiscreteTransfer):
            raise spec.complain(
                "not-supported",
                "this version takes the weight as a sampled transfer function",
                hint="write weight: {numerator: [..], denominator: [..]} in q^-1",
                key=f"{_KEY}.weight",
            )
        admissible = Weighted(admissible, rational(error.weight))
    alpha = error.alpha or confidence_factor(error.probability or 0.95, int(np.sum(model.in_plant)))
    requirement = ModelError(experiment, admissible, alpha, band)
    requirement.check_positive()
    return requirement


def _admissible(spec: Spec, experiment: Experiment, band: tuple[float, float]) -> AdmissibleError:
    error = spec.accuracy.model_error
    assert error is not None
    model = experiment.model
    if error.relative is not None:
        return Relative(model, error.relative)
    if error.absolute is not None:
        return Absolute(error.absolute)
    if error.table is not None:
        return _table(spec, error.table, band)
    sensitivity = error.sensitivity
    assert sensitivity is not None
    given = sensitivity.controller or spec.experiment.controller
    assert given is not None
    controller = rational(given)
    Loop(model, controller).check_stability()
    if not np.any(controller.numerator):
        raise spec.complain(
            "no-feedback",
            "the controller is zero: no model error can harm the sensitivity",
            hint="give the controller of the loop to be kept",
            key=f"{_KEY}.sensitivity",
        )
    if sensitivity.max_db is not None:
        return Sensitivity(model, controller, Rational.build([10 ** (-sensitivity.max_db / 20)]))
    weight = sensitivity.weight
    assert weight is not None
    return Sensitivity(model, controller, rational(weight))


def _table(spec: Spec, name: str, band: tuple[float, float]) -> Table:
    key = f"{_KEY}.table"
    path = spec.resolve_path(name)
    columns = read_columns(path, {"frequency": "frequency", "r_adm": "r_adm"}, key=key)
    frequency, value = columns["frequency"], columns["r_adm"]

    def refuse(message: str, hint: str) -> DataError:
        return DataError(Complaint("bad-table", f"{path.name}: {message}", hint, key, spec.locate(key)))

    if np.any(np.diff(frequency) <= 0) or frequency[0] < 0:
        raise refuse("the frequencies must be nonnegative and increase from row to row", "sort the rows")
    if np.any(value <= 0):
        row = int(np.argmax(value <= 0)) + 2
        raise refuse(
            f"r_adm is {value[row - 2]:g} in row {row}: it must be positive",
            "leave frequencies that do not matter out, and restrict band",
        )
    scaled = frequency * spec.sample_time
    lo, hi = band
    if scaled[0] > lo * (1 + 1e-9) or scaled[-1] < hi * (1 - 1e-9):
        unit = f"rad/{spec.time_unit}"
        raise refuse(
            f"it covers {frequency[0]:g} to {frequency[-1]:g} {unit}, but the band is "
            f"{lo / spec.sample_time:g} to {hi / spec.sample_time:g} {unit}",
            "extend the table, or restrict accuracy.model_error.band",
        )
    return Table(scaled, value)
