"""Spec -> plant, loop and experiment: parameters to be estimated, what is known of them, and the price."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from inputdesign_cli.arrays import Array, Rows
from inputdesign_cli.design.convex.limits import Goal, Weight
from inputdesign_cli.expressions import Expression
from inputdesign_cli.information import POWER_KINDS, Experiment, FiniteRecord, PowerKind
from inputdesign_cli.plant import (
    Coloured,
    ContinuousModel,
    Listed,
    Loop,
    Matrices,
    Model,
    Parameter,
    Parametrisation,
    PolynomialModel,
    Reparametrised,
    SampledModel,
    StateSpaceModel,
    Words,
    close_loop,
    hold_entries,
)
from inputdesign_cli.plant.model import DELAY
from inputdesign_cli.questions.building.controllers import controller_matrix
from inputdesign_cli.questions.building.demand import check_effects, check_model, on_finite_information
from inputdesign_cli.questions.building.header import build_units
from inputdesign_cli.questions.building.tables import read_frequency_table, read_samples
from inputdesign_cli.specification import Spec, load_estimate
from inputdesign_cli.specification.models import spectrum
from inputdesign_cli.specification.models.experiment import NoiseShape
from inputdesign_cli.specification.models.loop import Controller
from inputdesign_cli.specification.models.named import leading
from inputdesign_cli.specification.models.plant import (
    ContinuousPlant,
    NamedPlant,
    PolynomialPlant,
    StateSpacePlant,
)

if TYPE_CHECKING:
    from inputdesign_cli.identification import Earlier

# A pole this near to the unit circle is on it, but for rounding.
_ROUNDING = 1e-9
GOALS: dict[str, Goal] = {"least_cost": "cost", "best_accuracy": "factor", "shortest_experiment": "samples"}
"""The quantity that a design optimises, by its `objective` in the spec."""


def state_space_model(spec: Spec, plant: StateSpacePlant, covariance: Array) -> StateSpaceModel:
    """Return the state-space model at the nominal parameters.

    Raises `SpecError`: `unstable-polynomial` for an unstable predictor, or an unstable plant without a
    controller; `conflicting-keys` for K together with coloured noise.
    """
    stated = plant.state_space
    shapes = {"D": (plant.outputs, plant.inputs), "K": (len(stated.A), plant.outputs)}
    given = {letter: np.array(stated.at(letter), dtype=float) for letter in stated.stated(*"ABCDK")}
    places = [(letter, *ij) for letter, matrix in given.items() for ij in np.ndindex(matrix.shape)]
    free = [place for place in (*places, (DELAY, 0, 0)) if plant.expression(*place).names]
    zeros = {letter: np.zeros(shape) for letter, shape in shapes.items()}
    step = spec.sample_time if plant.sample is not None else None
    model = StateSpaceModel(Matrices(**zeros | given, delay=stated.delay), tuple(free), covariance, step)
    coloured = any(spec.noise.drifts) or any(len(np.ravel(x)) > 1 for x in (spec.noise.C, spec.noise.D))
    if "K" in given and coloured:
        message = "K says how the noise is coloured, and noise does so, too"
        hint = "remove K, or C, D and drift"
        raise spec.complain("conflicting-keys", message, hint=hint, key="plant.state_space.K")
    away = np.abs(model.predictor_poles[:, None] - model.poles).min(axis=1, initial=np.inf)
    own = model.predictor_poles[away > np.sqrt(_ROUNDING)]  # poles that K has moved
    gained = np.any(np.abs(own) > 1.0 - _ROUNDING)
    for what, poles, wrong, hint in (
        ("predictor", model.predictor_poles, gained, "it needs a gain K with which A - K C is stable"),
        ("plant", model.poles, False, "an unstable plant needs a loop: add experiment.controller"),
    ):
        worst = float(np.max(np.abs(poles), initial=0.0))
        if wrong or (worst > 1.0 + _ROUNDING and not (what == "plant" and spec.closed_loop)):
            message = f"the {what} is unstable: sampled, it has an eigenvalue of radius {worst:.6g}"
            hint = f"check the signs of A; {hint}"
            raise spec.complain("unstable-polynomial", message, hint=hint, key="plant.state_space.A")
    return model


# The share of pi/sample_time at which a proposed band ends.
_WITHIN = 0.95


def build_model(spec: Spec) -> Model:
    """Return the model of `plant` and `noise`.

    Raises `SpecError`: `not-supported` for a regression; the errors of `reparametrised`.
    """
    covariance = np.asarray(spec.noise.covariance(spec.plant.outputs), dtype=float)
    noise = spec.noise
    C, D = per_output(noise.C), per_output(noise.D)
    match spec.plant:
        case PolynomialPlant() as plant:
            one = np.ones(1)
            inside, outside = (
                [one if held is out else d for d, held in zip(D, noise.held, strict=True)]
                for out in (True, False)
            )
            model: Listed = polynomial_model(plant, noise, covariance, inside)
            C, D = (one,), tuple(outside)
        case ContinuousPlant() as plant:
            matrix = plant.continuous
            continuous = ContinuousModel.monic(
                _arrays(matrix.numerator_matrix, -1),
                _arrays(matrix.denominator_matrix, -1),
                covariance,
                common=matrix.common,
                delay=delays_of(plant),
                common_delay=matrix.common_delay,
                degrees=[[len(b) - leading(b) - 1 for b in row] for row in plant.terms.numerator],
            )
            model = SampledModel(continuous, spec.sample_time) if plant.sampled else continuous
        case StateSpacePlant() as plant:
            model = state_space_model(spec, plant, covariance)
        case _:
            message = "a regression has no dynamic model to estimate or to judge"
            hint = "write the plant as polynomials A, B, F in q^-1, or in s under continuous"
            raise spec.complain("not-supported", message, hint=hint, key="plant")
    if any(noise.drifts) or any(len(p) > 1 for p in (*C, *D)):
        model = Coloured(model, C, D, noise.held, noise.drifts)
    return reparametrised(spec, plant, model)


def polynomial_model(
    plant: PolynomialPlant, noise: NoiseShape, covariance: Array, D: Sequence[Array] | None = None
) -> PolynomialModel:
    """Return the model of a plant in q^-1, with white noise of a covariance (p, p), and another D if given.

    A, C and D that are stated once are common to the outputs.
    """
    return PolynomialModel(
        B=_arrays(plant.B_matrix),
        A=per_output(plant.A),
        F=_arrays(plant.F_matrix),
        C=per_output(noise.C),
        D=per_output(noise.D) if D is None else tuple(D),
        covariance=covariance,
        delays=plant.delays,
    )


def held_plant(plant: ContinuousPlant, sample_time: float) -> PolynomialPlant:
    """Return a plant in s behind a hold as B/F in q^-1: C and D then filter the noise alone."""
    matrix = plant.continuous
    rows = (matrix.numerator_matrix, matrix.denominator_matrix)
    held = hold_entries(*rows, sample_time, matrix.delays)
    B, F = (tuple(tuple(tuple(entry.tolist()) for entry in row) for row in rows) for rows in held)
    return PolynomialPlant.model_construct(A=(1.0,), B=B, F=F)


def bare_experiment(spec: Spec, model: Model, loop: Loop | None = None) -> Experiment:
    """Return the experiment in raw coordinates, unchecked and without its prior."""
    return Experiment(model, spec.experiment.samples, excitation_band(spec), loop=loop)


def build_experiment(spec: Spec) -> Experiment:
    """Return the experiment in raw coordinates with its prior, its loop checked for stability and delay.

    Raises `SpecError`: `needs-band`, `too-large`, `without-effect`, `infinite-information`; an unstable or
    algebraic loop; a prior that does not fit. Or `DataError`: the record of a prior cannot be used.
    """
    model, controller = build_model(spec), spec.experiment.controller
    check_model(spec, model)
    loop = None if controller is None else build_loop(spec, model, controller)
    if loop is not None:
        loop.check_delay()
    experiment = bare_experiment(spec, model, loop)
    check_effects(spec, experiment)
    experiment = on_finite_information(spec, experiment)
    if (stated := stated_prior(spec, model.names)) is not None:
        return replace(experiment, prior=stated[0])
    record = prior_record(spec)
    prior = None if record is None else information_in(spec, experiment, record)
    return replace(experiment, prior=prior)


def build_loop(spec: Spec, model: Model, controller: Controller) -> Loop:
    """Return the loop of a sampled model. It raises `SpecError`: the loop is unstable or algebraic."""
    C = controller_matrix(controller, spec.sample_time, (model.inputs, model.outputs))
    loop = close_loop(model, C)
    loop.check_stability()
    return loop


def excitation_band(spec: Spec) -> tuple[float, float]:
    """Return the band of the excitation in rad/sample, or rad per time unit in continuous time.

    Raises `SpecError` (`needs-band`), or `DataError` for the table of a given spectrum.
    """
    band = _stated_band(spec)
    if spec.plant.sampled:
        lo, hi = spec.clip_band(band)
        return lo * spec.sample_time, min(hi * spec.sample_time, np.pi)
    if band is None or not np.isfinite(band[1]):
        message = "in continuous time frequencies have no end: the band of the excitation is missing"
        limit = f"limits: {{band: [0, {0.5 * np.pi / spec.sample_time:.3g}]}}"
        stay = f"to stay in continuous time, {limit}, or a polynomial spectrum with its band"
        hint = f"add sample: zoh to the plant, whose input is then held for each sample_time; or, {stay}"
        key = "spectrum" if spec.spectrum is not None else "limits"
        raise spec.complain("needs-band", message, hint=hint, key=key)
    return band


def _stated_band(spec: Spec) -> tuple[float, float] | None:
    """Return the band of the spectrum or the limits; in continuous time also of a given excitation."""
    match spec.spectrum:
        case spectrum.PolynomialSpectrum(band=band):
            return band
        case spectrum.MultisineSpectrum(frequencies=given) if given and not spec.plant.sampled:
            return _around(given)
        case spectrum.GivenSpectrum(given=stated) if spec.limits.band is None and not spec.plant.sampled:
            match stated:
                case spectrum.GivenSignal():
                    return 0.0, np.pi / spec.sample_time
                case spectrum.GivenMultisine():
                    return _around(stated.frequencies)
                case spectrum.GivenTable(file=name):
                    rows = read_frequency_table(spec, name, [], "spectrum.given.file", least=1)
                    return _around(rows["frequency"].tolist())
    return spec.limits.band


def _around(frequencies: Sequence[float]) -> tuple[float, float] | None:
    lo, hi = frequencies[0], frequencies[-1]
    return None if hi == 0.0 else (lo, hi) if hi > lo else (0.5 * lo, 1.5 * hi)


def build_cost(spec: Spec) -> dict[PowerKind, Weight]:
    """Return the weights of the powers: of the sum over the channels, or one per channel."""
    stated = (spec.cost.input_power, spec.cost.output_power, spec.cost.excitation_power)
    return {kind: w for kind, w in zip(POWER_KINDS, stated, strict=True) if np.any(np.asarray(w) > 0)}


def information_in(spec: Spec, experiment: Experiment, record: Array) -> Array:
    """Return the information (k, k) about the plant in the samples (n, r) of an earlier excitation."""
    earlier = experiment.with_samples(len(record))
    return FiniteRecord(earlier, len(record), record_step(spec)).information(record)


def prior_record(spec: Spec) -> Array | None:
    """Return the earlier samples (n, r) that `experiment.prior` names, or None; `DataError` for bad ones."""
    prior = spec.experiment.prior
    if prior is None or prior.names_a_model or not isinstance(prior.information, str):
        return None
    return read_excitation_record(spec, prior.information, PRIOR)


def read_excitation_record(spec: Spec, name: str, key: str) -> Array:
    """Return the samples (n, r) of an excitation from columns u1, u2, .. (in a loop r1, ..) of a file.

    A single input may have the column u. Samples count from `signal.offset`. Raises `DataError`.
    """
    units = build_units(spec)
    names = [units.excitation] if units.inputs == 1 else list(units.excitations)
    columns = read_samples(spec.resolve_path(name), {one: one for one in names}, key=key, units=units)
    return np.stack([columns[column] for column in names], axis=1) - np.asarray(spec.signal.offset or 0.0)


def record_step(spec: Spec) -> float:
    """Return the time between samples in the unit of the experiment's frequencies: 1, or sample_time.

    Raises `SpecError` (`beyond-nyquist`): samples are too far apart for the band of a continuous design.
    """
    if spec.plant.sampled:
        return 1.0
    _, hi = excitation_band(spec)
    if hi * spec.sample_time > np.pi * (1 + 1e-9):
        apart = f"samples {spec.sample_time:g} {spec.time_unit} apart"
        message = f"{apart} cannot carry the band up to {hi:g} rad/{spec.time_unit}"
        held = "if the input is held between samples, add sample: zoh to the plant and end the band at"
        other = f"otherwise set sample_time to {0.5 * np.pi / hi:.3g} or less (at most {np.pi / hi:.3g})"
        hint = f"{held} {_WITHIN * np.pi / spec.sample_time:.3g}; {other}"
        raise spec.complain("beyond-nyquist", message, hint=hint, key="sample_time")
    return spec.sample_time


def _arrays(rows: Sequence[Sequence[Sequence[float]]], step: int = 1) -> tuple[tuple[Array, ...], ...]:
    return tuple(tuple(np.array(entry, dtype=float)[::step] for entry in row) for row in rows)


def per_output(value: tuple) -> tuple[Array, ...]:
    """Return one polynomial, common to all outputs, or one per output."""
    return tuple(np.array(p, dtype=float) for p in (value if isinstance(value[0], tuple) else (value,)))


def delays_of(plant: ContinuousPlant) -> Rows:
    """Return rows of lists of one dead time, empty where none is present; () if no entry has one."""
    terms = plant.terms.delay
    rows = tuple(
        tuple(np.array([value] if terms[i][j].present else []) for j, value in enumerate(row))
        for i, row in enumerate(plant.continuous.delays)
    )
    return rows if any(entry.size for row in rows for entry in row) else ()


def reparametrised(spec: Spec, plant: NamedPlant, model: Listed) -> Model:
    """Return the model in the named parameters of the spec, without the known ones.

    Raises `SpecError`: `unknown-parameter`, `nothing-to-estimate`, or `unused-parameter`.
    """
    named, known = plant.named_parameters, (*(plant.known or ()), *(spec.noise.known or ()))
    if not named and not known:
        return model
    parameters = model.parameters
    in_noise = [p.name for p in parameters if p.letter in "cd"]
    own = [one.label for one in named] or [p.name for p in parameters if p.letter not in "cd"]
    for key, listed, all_ in (("plant.known", plant.known, own), ("noise.known", spec.noise.known, in_noise)):
        for name in listed or ():
            check_known(spec, all_, name, key)
    words = Words(known={"plant": tuple(plant.known or ()), "noise": tuple(spec.noise.known or ())})
    if not named:
        found = Parametrisation.identity(model.names, model.theta, known)
    else:
        found = _of_named(spec, plant, parameters)
        words = Words(plant.written, {one.label: one.place for one in named}, words.known)
    if not np.any(found.free):
        message = "every parameter of the model is known"
        hint = "take those out of known that the experiment is to find"
        raise spec.complain("nothing-to-estimate", message, hint=hint, key="plant.known")
    return Reparametrised(model, found, words)


def _of_named(spec: Spec, plant: NamedPlant, parameters: Sequence[Parameter]) -> Parametrisation:
    """Return the parametrisation by the named parameters of the plant, then the noise coefficients."""
    named = plant.named_parameters
    noise = [p for p in parameters if p.letter in "cd"]
    # Names of parameters of the plant are in ASCII: these differ from all of them.
    symbols = {p.name: f"\N{GREEK SMALL LETTER EPSILON}{i}" for i, p in enumerate(noise)}
    terms = [
        Expression(symbols[p.name]) if p.letter in "cd" else plant.expression(p.letter, *p.places[0], p.power)
        for p in parameters
    ]
    labels = (*(one.label for one in named), *symbols)
    fixed = [one.label in (plant.known or ()) for one in named]
    fixed += [name in (spec.noise.known or ()) for name in symbols]
    made = Parametrisation(
        labels,
        (*(one.symbol for one in named), *symbols.values()),
        np.array([*(one.value for one in named), *(p.value for p in noise)]),
        np.ones(len(labels), dtype=bool),
        tuple(terms),
    )
    for label, moves in zip(labels, np.any(made.jacobian != 0.0, axis=0), strict=True):
        if not moves:
            message = f"no coefficient that is estimated changes with {label} at the nominal parameters"
            hint = "look for a factor that is zero there, or a leading coefficient that vanishes"
            raise spec.complain("unused-parameter", message, hint=hint, key="plant.parameters")
    return replace(made, free=~np.array(fixed))


def check_known(spec: Spec, known: Sequence[str], name: str, key: str) -> None:
    """Raise `SpecError` (`unknown-parameter`) if the model has no parameter of this name."""
    if name not in known:
        of_plant = spec.plant.known if spec.plant.kind != "regression" else None
        fixed = name in (*(of_plant or ()), *(spec.noise.known or ())) and not key.endswith("known")
        message = f"{name} is known: it is not estimated" if fixed else f'the model has no parameter "{name}"'
        hint = f"its parameters are {', '.join(known)}" if known else "it has none here"
        raise spec.complain("unknown-parameter", message, hint=hint, key=key)


def embedded(spec: Spec, known: Sequence[str], matrix: Array, names: Sequence[str] | None, key: str) -> Array:
    """Return a matrix over some named parameters, or all, as one (k, k) over all `known`.

    Raises `SpecError`: `unknown-parameter` or `wrong-shape`.
    """
    for name in names or ():
        check_known(spec, known, name, key)
    listed = tuple(names or known)
    if len(matrix) != len(listed):
        message = f"the matrix is {len(matrix)} x {len(matrix)}, but there are {len(listed)} parameters"
        hint = f"order its rows as {', '.join(known)}, or name its parameters"
        raise spec.complain("wrong-shape", message, hint=hint, key=key)
    full = np.zeros((len(known), len(known)))
    index = [list(known).index(name) for name in listed]
    full[np.ix_(index, index)] = matrix
    return full


PRIOR = "experiment.prior.information"


def stated_prior(spec: Spec, names: Sequence[str]) -> tuple[Array, Mapping[str, float] | None] | None:
    """Return the stated information (k, k) about all parameters, and their values if stated.

    It may stand in a model file. None for a record, or no prior. Raises `SpecError`: `bad-model-file`, or
    it does not fit the parameters.
    """
    prior = spec.experiment.prior
    if prior is None:
        return None
    if not isinstance(prior.information, str):
        matrix = np.array(prior.information, dtype=float)
        return embedded(spec, names, matrix, prior.names, PRIOR), prior.values
    if not prior.names_a_model:
        return None
    found = load_estimate(spec, prior.information, PRIOR)
    information = inverse(np.array(found.covariance, dtype=float))
    return embedded(spec, names, information, tuple(found.parameters), PRIOR), found.parameters


def build_earlier(spec: Spec, nominal: Model) -> Earlier | None:
    """Return the prior as an estimate, with nominal values of other parameters; None without values."""
    information, values = stated_prior(spec, nominal.names) or (None, None)
    if information is None or values is None:
        return None
    from inputdesign_cli.identification import Earlier

    theta = [values.get(name, value) for name, value in zip(nominal.names, nominal.theta, strict=True)]
    return Earlier(np.array(theta, dtype=float), information)


def inverse(covariance: Array) -> Array:
    """Return the inverse (k, k) of a covariance or information matrix; `LinAlgError` if it is singular."""
    scale = np.sqrt(np.diag(covariance))
    if not np.all(scale > 0.0):
        raise np.linalg.LinAlgError
    half = np.linalg.inv(np.linalg.cholesky(covariance / np.outer(scale, scale))) / scale
    return np.asarray(half.T @ half)
