"""Spec -> the parameters to be estimated, and the information about them that `experiment.prior` states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from inputdesign_cli.arrays import Array, Rows
from inputdesign_cli.expressions import Expression
from inputdesign_cli.identification import Earlier
from inputdesign_cli.plant import Listed, Model, Parameter, Parametrisation, Reparametrised, Words
from inputdesign_cli.plant.model import DELAY
from inputdesign_cli.specification import Spec, load_estimate
from inputdesign_cli.specification.models.plant import ContinuousPlant, PolynomialPlant, StateSpacePlant


def delays_of(plant: ContinuousPlant) -> Rows:
    """Return rows of lists of one dead time, empty where none is present; () if no entry has one."""
    terms = plant.terms.delay
    rows = tuple(
        tuple(np.array([value] if terms[i][j].present else []) for j, value in enumerate(row))
        for i, row in enumerate(plant.continuous.delays)
    )
    return rows if any(entry.size for row in rows for entry in row) else ()


def reparametrised(
    spec: Spec, plant: PolynomialPlant | ContinuousPlant | StateSpacePlant, model: Listed
) -> Model:
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


def _of_named(
    spec: Spec, plant: PolynomialPlant | ContinuousPlant | StateSpacePlant, parameters: Sequence[Parameter]
) -> Parametrisation:
    """Return the parametrisation by the named parameters of the plant, then the noise coefficients."""
    named = plant.named_parameters
    noise = [p for p in parameters if p.letter in "cd"]
    # Names of parameters of the plant are in ASCII: these differ from all of them.
    symbols = {p.name: f"\N{GREEK SMALL LETTER EPSILON}{i}" for i, p in enumerate(noise)}
    terms = [Expression(symbols[p.name]) if p.letter in "cd" else _term(plant, p) for p in parameters]
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


def _term(plant: PolynomialPlant | ContinuousPlant | StateSpacePlant, parameter: Parameter) -> Expression:
    """Return a coefficient of the model as an expression in the named parameters of the plant."""
    letter, (i, j) = parameter.letter, parameter.places[0]
    if plant.kind == "state_space":
        return plant.term(letter, i, j)
    if plant.kind == "polynomial":
        return plant.coefficients(letter, i, j)[parameter.power]
    if letter == DELAY:
        return plant.terms.delay[i][j]
    below = plant.terms.denominator[i][j]
    entry = plant.terms.numerator[i][j] if letter == "b" else below
    return entry[-1 - parameter.power] / below[0]


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
    theta = [values.get(name, value) for name, value in zip(nominal.names, nominal.theta, strict=True)]
    return Earlier(np.array(theta, dtype=float), information)


def inverse(covariance: Array) -> Array:
    """Return the inverse (k, k) of a covariance or information matrix; `LinAlgError` if it is singular."""
    scale = np.sqrt(np.diag(covariance))
    if not np.all(scale > 0.0):
        raise np.linalg.LinAlgError
    half = np.linalg.inv(np.linalg.cholesky(covariance / np.outer(scale, scale))) / scale
    return np.asarray(half.T @ half)
