"""Spec -> the requirement on the model error over frequency, entry by entry or of the norm of G."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import scipy

from inputdesign_cli import accuracy
from inputdesign_cli.accuracy.calibration import Calibration
from inputdesign_cli.accuracy.model_error import OnModelError, check_positive
from inputdesign_cli.accuracy.requirement import OverFrequency
from inputdesign_cli.errors import SpecError
from inputdesign_cli.information import Experiment
from inputdesign_cli.outcome.shares import rounded_down, rounded_up
from inputdesign_cli.plant import Model, Rational
from inputdesign_cli.questions.building.controllers import loop_controller
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.system import build_loop
from inputdesign_cli.questions.building.tables import bad_table, check_rows, has_column, read_frequency_table
from inputdesign_cli.questions.building.weights import build_weight, check_finite, on_the_limit, rational
from inputdesign_cli.questions.common.confidence import Confidence, SimulatedEstimates
from inputdesign_cli.specification import ModelError as StatedError, Spec
from inputdesign_cli.specification.models.accuracy import DEFAULT_CONFIDENCE

_KEY = "accuracy.model_error"
_LOOP = "accuracy.loop"
_GROWS = 5.0  # growth of the error over a decade towards a pole that makes it unbounded


def confidence_factor(probability: float, parameters: int) -> float:
    """Return alpha with Pr(chi-squared with this many degrees of freedom <= alpha^2) = probability."""
    return float(np.sqrt(2.0 * scipy.special.gammaincinv(parameters / 2.0, probability)))


def model_error_alpha(spec: Spec, model: Model) -> float:
    """Return alpha as stated, or from the confidence and the number of parameters of G."""
    error = spec.accuracy.error
    if error is not None and error.alpha is not None:
        return error.alpha
    probability = (error.probability if error is not None else None) or DEFAULT_CONFIDENCE
    return confidence_factor(probability, int(np.sum(model.in_plant)))


def build_confidence(spec: Spec, nominal: Experiment) -> Confidence:
    """Return the chi-squared alpha of r_u, and its calibration for `confidence: {exact: ..}`."""
    alpha, error = model_error_alpha(spec, nominal.model), spec.accuracy.error
    stated = None if error is None else error.calibrated
    if stated is None or stated.exact is None:
        return Confidence(alpha, alpha)
    simulator = SimulatedEstimates(nominal, stated.runs, build_units(spec).step) if stated.runs else None
    return Confidence(alpha, alpha, Calibration(stated.exact, stated.draws), simulator=simulator)


def required_band(
    spec: Spec, experiment: Experiment, stated: tuple[float, float] | None
) -> tuple[float, float]:
    """Return the band of a requirement: stated, or all (in continuous time: all excited) frequencies."""
    if not spec.plant.sampled:
        return stated or experiment.band
    lo, hi = spec.clip_band(stated)
    return lo * spec.sample_time, min(hi * spec.sample_time, float(np.pi))


def build_model_errors(
    spec: Spec, experiment: Experiment, nominal: Model | None = None
) -> list[OnModelError]:
    """Return the bounds on the model error, stated or of a loop: one for each entry of G, or of the norm.

    On a scenario, r_adm may follow from the `nominal` plant. Raises `SpecError`: the form is not
    supported, or r_adm is not positive somewhere in the band. Or `DataError`: the table cannot be used.
    """
    error = spec.accuracy.error
    if error is None:
        return []
    band = required_band(spec, experiment, error.band)
    if error.norm == "frobenius" or error.sensitivity is not None:
        places: list[accuracy.Entry | None] = [(0, 0) if build_units(spec).single else None]
    else:
        places = list(accuracy.active_entries(experiment.model, band[1]))
    return [_on_entry(spec, error, experiment, band, entry, nominal) for entry in places]


def unstated_errors(spec: Spec, experiment: Experiment) -> list[accuracy.ModelError]:
    """Return model errors of every entry, to evaluate r_u without a stated bound; r_adm has no meaning."""
    band, alpha = required_band(spec, experiment, None), model_error_alpha(spec, experiment.model)
    return [
        accuracy.ModelError(
            experiment=experiment, band=band, entry=entry, admissible=accuracy.Absolute(1.0), alpha=alpha
        )
        for entry in accuracy.active_entries(experiment.model, band[1])
    ]


def _on_entry(
    spec: Spec,
    error: StatedError,
    experiment: Experiment,
    band: tuple[float, float],
    entry: accuracy.Entry | None,
    nominal: Model | None,
) -> OnModelError:
    units, model = build_units(spec), experiment.model
    scenario = None if nominal is None else spec.uncertainty
    # A scenario has its own r_adm, with a lower bound if stated, or r_adm of the nominal plant.
    fixed = scenario is not None and scenario.r_adm == "fixed"
    admissible = _admissible(spec, error, nominal if fixed and nominal is not None else model, band, entry)
    if scenario is not None and nominal is not None and not fixed and scenario.floor > 0.0:
        admissible = accuracy.Floored(
            admissible, _admissible(spec, error, nominal, band, entry), scenario.floor
        )
    if error.weight is not None:
        key = f"{_KEY}.weight"
        weight = build_weight(spec, error.weight, key)
        check_finite(spec, weight, band, "admissible-not-positive", key)
        void = on_the_limit(weight.zero_points, band)
        if error.region == "ellipsoid" and void is not None:  # ellipsoids are compared with r_adm
            message = f"{key} vanishes at {units.named(void)}, where region: ellipsoid has nothing to bound"
            hint = "leave that frequency out of the band, or use region: first_order"
            raise spec.complain("not-supported", message, hint=hint, key=key)
        admissible = accuracy.Weighted(admissible, weight)
    bound: Callable[..., OnModelError] = accuracy.ModelError
    if error.region == "ellipsoid":
        message = hint = ""
        if entry is None:
            message = "region: ellipsoid is for the entries of G one by one, not for the norm of the error"
            hint = "use region: first_order, or norm: entry with relative, absolute or table"
        elif np.any(model.bends(*entry)):
            named = units.entry(*entry) or "G"
            message = f"region: ellipsoid needs a fraction that is linear in the parameters; {named} is not"
            hint = (
                "use region: first_order for this structure (A and F, sampled from s, an estimated dead time)"
            )
        if message:
            raise spec.complain("not-supported", message, hint=hint, key=f"{_KEY}.region")
        bound = partial(accuracy.EllipsoidError, against="absolute" if error.relative is None else "relative")
    alpha = model_error_alpha(spec, model)
    made = bound(experiment=experiment, band=band, entry=entry, admissible=admissible, alpha=alpha)
    if nominal is None:
        check_bounded(spec, made, _KEY if spec.accuracy.loop is None else _LOOP)
    # In all other cases r_adm is positive, since r_adm of the nominal plant is.
    if scenario is None or (not fixed and scenario.floor == 0.0):
        try:
            check_positive(admissible, made.grid, unit=units.frequency, named=units.per_time)
        except SpecError as missed:
            raise _too_much(spec, admissible, made) or missed from missed
    return made


def _too_much(spec: Spec, admissible: accuracy.AdmissibleError, made: OnModelError) -> SpecError | None:
    """Return the error for a margin that the loop does not have with the nominal plant."""
    stated = spec.accuracy.loop
    if stated is None or not isinstance(admissible, accuracy.Sensitivity):
        return None
    peak = float(np.max(admissible.nominal(made.grid)))
    message = f"|S| of the nominal loop reaches {peak:.4g}, and the margin asks for {stated.peak:.4g} at most"
    less = f"{stated.allowing(peak)} (the nearer, the longer), for example {stated.allowing(1.2 * peak)}"
    slower = "lower its gain" if stated.tuning is None else "tune more slowly (simc with a larger tau_c)"
    hint = f"{slower}, or ask for less of a margin than {less}"
    if stated.max_sensitivity_db is None:
        hint += (
            "; gain and phase margins are kept by a bound on |S|, which asks for more than the margin alone"
        )
    return spec.complain("admissible-not-positive", message, hint=hint, key=_LOOP)


def check_bounded(spec: Spec, requirement: OverFrequency, key: str) -> None:
    """Raise `SpecError` (`unbounded-error`) if no information is enough for the requirement.

    Near a pole of G on the unit circle, an error of the pole makes an error of G that grows faster than G.
    """
    lo, hi = requirement.band
    units = build_units(spec)
    for at in requirement.poles_on_the_circle.tolist():
        side = 1.0 if at + 1e-5 * hi <= hi else -1.0
        far, close = np.abs(requirement.rows(at + side * np.array([1e-5, 1e-6]) * hi)).max(axis=(1, 2))
        # A weight may hide the pole.
        if not np.isfinite(close) or close > _GROWS * far:
            cause = f"G has a pole on the unit circle, at {units.named(at)}, that is estimated"
            message = f"{cause}: no experiment bounds the error there"
            # The larger part of the band on one side of the pole.
            margin, right = 1e-2 * (hi - lo), hi - at >= at - lo
            low, high = (at + margin, hi) if right else (lo, at - margin)
            rest = f"{rounded_up(low / units.frequency, 4)}, {rounded_down(high / units.frequency, 4)}"
            hint = f"leave that frequency out: {key}.band: [{rest}]"
            raise spec.complain("unbounded-error", message, hint=hint, key=key)


def _admissible(
    spec: Spec, error: StatedError, model: Model, band: tuple[float, float], entry: accuracy.Entry | None
) -> accuracy.AdmissibleError:
    """Return r_adm; a table has a column r_adm_21 for each entry, or r_adm for all."""
    if error.relative is not None:
        return accuracy.Relative(model, error.relative, entry)
    if error.absolute is not None:
        return accuracy.Absolute(error.absolute)
    if error.table is not None:
        units, column = build_units(spec), "r_adm"
        path = spec.resolve_path(error.table)
        if entry is not None and not units.single and has_column(path, "r_adm_", key=f"{_KEY}.table"):
            column += units.suffix(*entry)
        return positive_table(spec, error.table, band, column, f"{_KEY}.table")
    return _sensitivity(spec, error, model, band)


def positive_table(spec: Spec, name: str, band: tuple[float, float], column: str, key: str) -> accuracy.Table:
    """Return one column of a file, positive over the whole `band` of the section that has `key`.

    Raises `DataError`: the file cannot be read, or lacks the column somewhere in the band (`bad-table`).
    """
    units = build_units(spec)
    columns = read_frequency_table(spec, name, [column], key)
    frequency, value = columns["frequency"], columns[column]
    hint = "leave frequencies that do not matter out, and restrict band"
    check_rows(spec, name, column, value, value <= 0, "it must be positive", hint, key)
    if frequency[0] > band[0] * (1 + 1e-9) or frequency[-1] < band[1] * (1 - 1e-9):
        ends = np.array([frequency[0], frequency[-1], *band]) / units.frequency
        covered, asked = (f"{low:g} to {high:g} {units.per_time}" for low, high in ends.reshape(2, 2))
        message = f"it covers {covered}, but the band is {asked}"
        hint = f"extend the table, or restrict {key.rpartition('.')[0]}.band"
        raise bad_table(spec, name, message, hint, key)
    return accuracy.Table(frequency, value)


def _sensitivity(
    spec: Spec, error: StatedError, model: Model, band: tuple[float, float]
) -> accuracy.Sensitivity:
    asked, kept = error.sensitivity, spec.accuracy.loop
    if kept is not None:
        given = loop_controller(spec, kept, model)
    else:
        given = None if asked is None else asked.controller or spec.experiment.controller
    assert asked is not None
    assert given is not None
    loop = build_loop(spec, model, given)
    if asked.weight is not None:
        weight = rational(asked.weight)
        check_finite(spec, weight, band, "admissible-not-positive", f"{_KEY}.sensitivity")
        return accuracy.Sensitivity(loop, weight)
    peak = 1.0 if asked.max_db is None else 10 ** (-asked.max_db / 20)
    settings: dict[str, float] = {}
    if given.kind == "pid":
        settings = {k: v for k, v in given.pid.model_dump(include={"Kp", "Ti", "Td"}).items() if v}
    return accuracy.Sensitivity(loop, Rational.build([peak]), None if kept is None else settings)
